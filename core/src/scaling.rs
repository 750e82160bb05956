//! Scales table values to a finger.
//!
//! Main trait: [`Scaling`]. The fitted finger is [`Fitted`], another one [`Scaled`]. Uses math.

use crate::math::{Arithmetic, Scalar};
use crate::rescaling::Scaled;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Fitted {}
    impl<T> Sealed for crate::rescaling::Scaled<T> {}
}

/// Scales table values to a finger: [`Fitted`] leaves them unchanged, [`Scaled`] multiplies them for another finger. Sealed. The
/// choice is made at compile time, so a finger without retuning has no cost.
#[doc(hidden)]
pub trait Scaling<T: Arithmetic>: Copy + sealed::Sealed {
    /// The same with the tissue's stiffness changed.
    type Stiffened: Scaling<T>;
    /// Whether the strength over depth may differ in shape from that of the fitted finger.
    const RESCALED: bool;
    /// Cells of the tables per mm, from that of the fitted finger.
    fn per_mm(&self, cells: T) -> T;
    /// A length within the contact, a depth, or the slide equivalent to a press, mm.
    fn length(&self, mm: T) -> T;
    /// An area, mm².
    fn area(&self, mm2: T) -> T;
    /// A force along the normal, N.
    fn normal(&self, n: T) -> T;
    /// A tangential stiffness, N/mm.
    fn stiffness(&self, n_mm: T) -> T;
    /// The strength, N, from that of the fitted finger and the scaled area.
    fn limit(&self, n: T, area_mm2: T) -> T;
    /// Factor on the slides at which springs slip, from the strength of the fitted finger and the scaled one.
    fn radius(&self, fitted_n: T, scaled_n: T) -> T;
    /// One over a force, 1/N.
    fn per_newton(&self, x: T) -> T;
    /// The same finger with the tissue's stiffness times `factor`; `beta` is the exponent of the friction law.
    fn stiffened(&self, factor: T, beta: T) -> Self::Stiffened
    where
        T: Scalar;
}

/// A scaling that eight contacts can share in vector registers. Sealed.
#[doc(hidden)]
pub trait SimdScaling: Scaling<f32> {
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes: Scaling<crate::lanes::Lanes>;
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes;
}

impl SimdScaling for Fitted {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Fitted;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Fitted {
        Fitted
    }
}

/// The finger that the model was fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fitted;

impl<T: Arithmetic> Scaling<T> for Fitted {
    type Stiffened = Scaled<T>;
    const RESCALED: bool = false;

    #[inline(always)]
    fn per_mm(&self, cells: T) -> T {
        cells
    }
    #[inline(always)]
    fn length(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn area(&self, mm2: T) -> T {
        mm2
    }
    #[inline(always)]
    fn normal(&self, n: T) -> T {
        n
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm
    }
    #[inline(always)]
    fn limit(&self, n: T, _: T) -> T {
        n
    }
    #[inline(always)]
    fn radius(&self, _: T, _: T) -> T {
        T::of(1.0)
    }
    #[inline(always)]
    fn per_newton(&self, x: T) -> T {
        x
    }
    fn stiffened(&self, factor: T, beta: T) -> Scaled<T>
    where
        T: Scalar,
    {
        Scaled::<T>::same().stiffened(factor, beta)
    }
}
