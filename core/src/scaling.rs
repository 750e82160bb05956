//! What a step makes of the tables' numbers for the finger at hand.
//!
//! Main traits: [`Scaling`], and [`Unposed`] for what may still be brought into a pose. The fitted finger is [`Fitted`], another one or
//! another pose [`Scaled`]. Uses math and pose.

use crate::Status;
use crate::math::{Arithmetic, Scalar};
use crate::pose::PoseFactors;
use crate::rescaling::Scaled;
use crate::rolling::Posture;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Fitted {}
    impl<T, const POSED: bool> Sealed for crate::rescaling::Scaled<T, POSED> {}
}

/// What a step makes of the tables' numbers: [`Fitted`] takes them as they are, [`Scaled`] multiplies them for another
/// finger. Sealed. The choice is made when compiling, so that a finger that is not retuned pays nothing for it.
#[doc(hidden)]
pub trait Scaling<T: Arithmetic>: Copy + sealed::Sealed {
    /// The same with the tissue's stiffness changed.
    type Stiffened: Scaling<T>;
    /// Cells of the tables per mm, from that of the fitted finger.
    fn per_mm(&self, cells: T) -> T;
    /// A length within the contact, mm.
    fn length(&self, mm: T) -> T;
    /// A depth, mm, or a slide that pressing amounts to.
    fn depth(&self, mm: T) -> T;
    /// Whether the strength may change over depth otherwise than that of the fitted finger.
    const RESCALED: bool;
    /// Whether the finger is in another pose than the fitted one.
    const POSED: bool;
    /// Tilt of a limit along x and y, from that along x in the fitted pose.
    fn tilt(&self, fitted: T) -> [T; 2];
    /// What is to be remarked about the pose.
    fn status(&self) -> Status;
    /// 1 where the model's bands of other poses count, else 0.
    fn elsewhere(&self) -> T;
    /// Slides along x and y, mm/mm, that a depth increment amounts to in the pose, beyond that of the fitted one.
    fn press(&self) -> [T; 2];
    /// From a pair's middle to one of its springs, mm.
    fn arm(&self, mm: T) -> T;
    /// The pose as rolling sees it.
    fn posture(&self) -> Posture<T>;
    /// Where the contact lies in the pose, mm along x and y from where it does in the fitted one.
    fn place(&self) -> [T; 2];
    /// An area at a depth, mm², mm.
    fn area(&self, mm2: T, depth: T) -> T;
    /// A force along the normal at a depth, N, mm.
    fn normal(&self, n: T, depth: T) -> T;
    /// The tangential stiffness along x, N/mm.
    fn stiffness(&self, n_mm: T) -> T;
    /// Those along x and y.
    fn stiffnesses(&self, n_mm: [T; 2]) -> [T; 2];
    /// Stiffness along y over that along x, over the ratio of the strengths.
    fn anisotropy(&self, fitted: T) -> T;
    /// The strength at a depth, N, mm, from that of the fitted finger and the scaled area.
    fn limit(&self, n: T, area_mm2: T, depth: T) -> T;
    /// What the pose adds to the change with depth, N/mm: of the normal force, and of the strength on `area_mm2`, both of the
    /// fitted finger.
    fn normal_slope(&self, n: T, depth: T) -> T
    where
        T: Scalar;
    fn limit_slope(&self, n: T, area_mm2: T, depth: T) -> T
    where
        T: Scalar;
    /// Factor on the slides at which springs slip, from the strength of the fitted finger and the scaled one.
    fn radius(&self, fitted_n: T, scaled_n: T) -> T;
    /// One over a force, 1/N.
    fn per_newton(&self, x: T) -> T;
    /// The same finger with the tissue's stiffness times `factor`; `beta` is the exponent of the friction law.
    fn stiffened(&self, factor: T, beta: T) -> Self::Stiffened
    where
        T: Scalar;
}

/// What eight contacts can share. Sealed.
#[doc(hidden)]
pub trait Wide: Scaling<f32> {
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes: Scaling<crate::lanes::Lanes>;
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes;
}

impl Wide for Fitted {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Fitted;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Fitted {
        Fitted
    }
}

/// What may still be brought into another pose: a finger in the fitted one. Sealed.
#[doc(hidden)]
pub trait Unposed<T: Scalar>: Scaling<T> {
    /// The same finger in a pose.
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true>;
}

/// The finger that the model was fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fitted;

impl<T: Arithmetic> Scaling<T> for Fitted {
    type Stiffened = Scaled<T>;
    const RESCALED: bool = false;
    const POSED: bool = false;

    #[inline(always)]
    fn per_mm(&self, cells: T) -> T {
        cells
    }
    #[inline(always)]
    fn length(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn depth(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn tilt(&self, fitted: T) -> [T; 2] {
        [fitted, T::of(0.0)]
    }
    #[inline(always)]
    fn status(&self) -> Status {
        Status::OK
    }
    #[inline(always)]
    fn elsewhere(&self) -> T {
        T::of(0.0)
    }
    #[inline(always)]
    fn press(&self) -> [T; 2] {
        [T::of(0.0); 2]
    }
    #[inline(always)]
    fn arm(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn posture(&self) -> Posture<T> {
        Posture { place: [T::of(0.0); 2], angles: [T::of(0.0); 2], stiffness: T::of(1.0) }
    }
    #[inline(always)]
    fn place(&self) -> [T; 2] {
        [T::of(0.0); 2]
    }
    #[inline(always)]
    fn area(&self, mm2: T, _: T) -> T {
        mm2
    }
    #[inline(always)]
    fn normal(&self, n: T, _: T) -> T {
        n
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm
    }
    #[inline(always)]
    fn stiffnesses(&self, n_mm: [T; 2]) -> [T; 2] {
        n_mm
    }
    #[inline(always)]
    fn anisotropy(&self, fitted: T) -> T {
        fitted
    }
    #[inline(always)]
    fn limit(&self, n: T, _: T, _: T) -> T {
        n
    }
    fn normal_slope(&self, _: T, _: T) -> T
    where
        T: Scalar,
    {
        T::of(0.0)
    }
    fn limit_slope(&self, _: T, _: T, _: T) -> T
    where
        T: Scalar,
    {
        T::of(0.0)
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

impl<T: Scalar> Unposed<T> for Fitted {
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true> {
        Scaled::<T>::same().posed(pose)
    }
}
