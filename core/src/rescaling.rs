//! The same model for another finger: size, stiffness and friction changed at run time, without a rebuild.
//!
//! Main type: [`Tuning`]. Uses model and math.

use crate::error::Field;
use crate::math::pow;
use crate::{Error, ModelOf};

/// How a finger differs from the one the model was fitted to.
///
/// Lengths scale with `size`, pressures with `stiffness` (e), local friction as tau_0 + lambda sigma^beta:
///
/// ```text
/// N ~ e size²    A ~ size²    K ~ e size    L ~ lambda e^beta size² + tau_0 A
/// ```
///
/// with beta the model's exponent. The first three are exact for geometrically similar fingers and linear tissue;
/// the lambda rule takes the pressure profile as unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tuning {
    /// Factor on all lengths, 0.5 to 2.
    pub size: f32,
    /// Factor on the tissue's stiffness, 0.2 to 5.
    pub stiffness: f32,
    /// Factor on lambda, 0.1 to 10.
    pub lambda: f32,
    /// Shear strength at zero pressure, MPa, 0 to 0.1.
    pub tau0_mpa: f32,
}

impl Default for Tuning {
    /// The finger the model was fitted to.
    fn default() -> Self {
        Self { size: 1.0, stiffness: 1.0, lambda: 1.0, tau0_mpa: 0.0 }
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Fitted {}
    impl Sealed for super::Scaled {}
}

/// What a step makes of the tables' numbers: [`Fitted`] takes them as they are, [`Scaled`] multiplies them for another
/// finger. Sealed. The choice is made when compiling, so that a finger that is not retuned pays nothing for it.
#[doc(hidden)]
pub trait Scaling: Copy + sealed::Sealed {
    /// Cells of the tables per mm, from that of the fitted finger.
    fn per_mm(&self, cells: f32) -> f32;
    /// A length, mm.
    fn length(&self, mm: f32) -> f32;
    /// An area, mm².
    fn area(&self, mm2: f32) -> f32;
    /// A force along the normal, N.
    fn normal(&self, n: f32) -> f32;
    /// A tangential stiffness, N/mm.
    fn stiffness(&self, n_mm: f32) -> f32;
    /// The strength, N, from that of the fitted finger and the scaled area.
    fn limit(&self, n: f32, area_mm2: f32) -> f32;
    /// One over a force, 1/N.
    fn per_newton(&self, x: f32) -> f32;
    /// The odd compliance, mm/N²: what it makes of the slip length at the largest depth stays as it is.
    fn odd(&self, mm_n2: f32) -> f32;
    /// The same finger with the tissue's stiffness times `factor`; `beta` is the exponent of the friction law, `shear_mpa`
    /// the strength over the area at the largest depth.
    fn stiffened(&self, factor: f32, beta: f32, shear_mpa: f32) -> Scaled;
}

/// The finger that the model was fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fitted;

impl Scaling for Fitted {
    #[inline(always)]
    fn per_mm(&self, cells: f32) -> f32 {
        cells
    }
    #[inline(always)]
    fn length(&self, mm: f32) -> f32 {
        mm
    }
    #[inline(always)]
    fn area(&self, mm2: f32) -> f32 {
        mm2
    }
    #[inline(always)]
    fn normal(&self, n: f32) -> f32 {
        n
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: f32) -> f32 {
        n_mm
    }
    #[inline(always)]
    fn limit(&self, n: f32, _: f32) -> f32 {
        n
    }
    #[inline(always)]
    fn per_newton(&self, x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn odd(&self, mm_n2: f32) -> f32 {
        mm_n2
    }
    fn stiffened(&self, factor: f32, beta: f32, shear_mpa: f32) -> Scaled {
        Scaled::new(&Tuning { stiffness: factor, ..Tuning::default() }, beta, shear_mpa)
    }
}

/// Factors for another finger, made by [`ModelOf::tuned`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaled {
    per_length: f32,
    length: f32,
    area: f32,
    normal: f32,
    stiffness: f32,
    limit: f32,
    tau0: f32,
    per_newton: f32,
    odd: f32,
}

impl Scaled {
    /// `shear_mpa` is the strength over the contact area at the largest depth.
    fn new(tuning: &Tuning, beta: f32, shear_mpa: f32) -> Self {
        let Tuning { size, stiffness, lambda, tau0_mpa } = *tuning;
        let area = size * size;
        let strength = if stiffness == 1.0 { lambda } else { lambda * pow(stiffness, beta) };
        Self {
            per_length: 1.0 / size,
            length: size,
            area,
            normal: stiffness * area,
            stiffness: stiffness * size,
            limit: strength * area,
            tau0: tau0_mpa,
            per_newton: 1.0 / (stiffness * area),
            odd: 1.0 / (stiffness * size * area * (strength + tau0_mpa / shear_mpa)),
        }
    }
}

impl Scaling for Scaled {
    #[inline(always)]
    fn per_mm(&self, cells: f32) -> f32 {
        cells * self.per_length
    }
    #[inline(always)]
    fn length(&self, mm: f32) -> f32 {
        mm * self.length
    }
    #[inline(always)]
    fn area(&self, mm2: f32) -> f32 {
        mm2 * self.area
    }
    #[inline(always)]
    fn normal(&self, n: f32) -> f32 {
        n * self.normal
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: f32) -> f32 {
        n_mm * self.stiffness
    }
    #[inline(always)]
    fn limit(&self, n: f32, area_mm2: f32) -> f32 {
        n * self.limit + area_mm2 * self.tau0
    }
    #[inline(always)]
    fn per_newton(&self, x: f32) -> f32 {
        x * self.per_newton
    }
    #[inline(always)]
    fn odd(&self, mm_n2: f32) -> f32 {
        mm_n2 * self.odd
    }
    fn stiffened(&self, factor: f32, beta: f32, _: f32) -> Scaled {
        if factor == 1.0 {
            return *self;
        }
        let strength = pow(factor, beta);
        Scaled {
            normal: self.normal * factor,
            stiffness: self.stiffness * factor,
            limit: self.limit * strength,
            per_newton: self.per_newton / factor,
            odd: self.odd / (factor * strength),
            ..*self
        }
    }
}

impl<'a, const M: usize, const N: usize> ModelOf<'a, M, N> {
    pub(crate) fn from_checked(data: &'a crate::DataOf<M, N>) -> Self {
        Self { data, scale: Fitted }
    }
}

impl<'a, const M: usize, const N: usize, S: Scaling> ModelOf<'a, M, N, S> {
    /// The same model for another finger, counted from the fitted one. A state may be carried over: elements keep their
    /// force.
    ///
    /// Costs about 90 instructions, 200 with a stiffness other than 1; a step of the retuned model costs about 13 more than
    /// one of the fitted.
    pub fn tuned(&self, tuning: Tuning) -> Result<ModelOf<'a, M, N, Scaled>, Error> {
        let ranges = [
            (Field::Size, tuning.size, 0.5, 2.0),
            (Field::Stiffness, tuning.stiffness, 0.2, 5.0),
            (Field::Lambda, tuning.lambda, 0.1, 10.0),
            (Field::Tau0, tuning.tau0_mpa, 0.0, 0.1),
        ];
        for (what, value, low, high) in ranges {
            if !(value >= low && value <= high) {
                return Err(Error::Range { what, index: 0, value });
            }
        }
        let scale = Scaled::new(&tuning, self.data.pressure_exponent, self.data.deepest_shear_mpa());
        Ok(ModelOf { data: self.data, scale })
    }

    /// The same finger with the tissue's stiffness times `factor`, which is held between 0.2 and 5.
    pub(crate) fn stiffened(&self, factor: f32) -> ModelOf<'a, M, N, Scaled> {
        let (beta, shear) = (self.data.pressure_exponent, self.data.deepest_shear_mpa());
        let scale = self.scale.stiffened(factor.clamp(0.2, 5.0), beta, shear);
        ModelOf { data: self.data, scale }
    }
}
