//! The same model for another finger: size, stiffness and friction changed at run time, without a rebuild.
//!
//! Main type: [`Tuning`]. Uses model and math.

use crate::error::Field;
use crate::math::{Arithmetic, Scalar};
pub use crate::scaling::{Fitted, Scaling, SimdScaling};
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
/// the lambda rule assumes an unchanged pressure profile.
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

/// Range of the factor on the tissue's stiffness.
pub(crate) const STIFFNESS_FACTOR: core::ops::RangeInclusive<f32> = 0.2..=5.0;

impl SimdScaling for Scaled<f32> {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Scaled<crate::lanes::Lanes>;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes {
        let of = <crate::lanes::Lanes as Arithmetic>::of;
        Scaled {
            per_length: of(self.per_length),
            length: of(self.length),
            area: of(self.area),
            normal: of(self.normal),
            stiffness: of(self.stiffness),
            limit: of(self.limit),
            tau0: of(self.tau0),
            per_newton: of(self.per_newton),
            softness: of(self.softness),
        }
    }
}

/// Factors for another finger, made by [`ModelOf::tuned`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scaled<T = f32> {
    per_length: T,
    length: T,
    per_newton: T,
    tau0: T,
    area: T,
    normal: T,
    stiffness: T,
    limit: T,
    /// One over `stiffness`.
    softness: T,
}

impl<T: Arithmetic> Scaled<T> {
    /// The fitted finger.
    pub(crate) fn same() -> Self {
        let one = T::of(1.0);
        Self {
            per_length: one,
            length: one,
            per_newton: one,
            tau0: T::of(0.0),
            area: one,
            normal: one,
            stiffness: one,
            limit: one,
            softness: one,
        }
    }

    fn new(tuning: &Tuning, beta: T) -> Self
    where
        T: Scalar,
    {
        let Tuning { size, stiffness, lambda, tau0_mpa } = *tuning;
        let [size, e, lambda, tau0] = [size, stiffness, lambda, tau0_mpa].map(T::of);
        let area = size * size;
        let strength = if stiffness == 1.0 { lambda } else { lambda * e.power(beta) };
        let one = T::of(1.0);
        Self {
            per_length: one / size,
            length: size,
            area,
            normal: e * area,
            stiffness: e * size,
            limit: strength * area,
            tau0,
            per_newton: one / (e * area),
            softness: one / (e * size),
        }
    }
}

impl<T: Arithmetic> Scaling<T> for Scaled<T> {
    type Stiffened = Self;
    const RESCALED: bool = true;

    #[inline(always)]
    fn per_mm(&self, cells: T) -> T {
        cells * self.per_length
    }
    #[inline(always)]
    fn length(&self, mm: T) -> T {
        mm * self.length
    }
    #[inline(always)]
    fn area(&self, mm2: T) -> T {
        mm2 * self.area
    }
    #[inline(always)]
    fn normal(&self, n: T) -> T {
        n * self.normal
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm * self.stiffness
    }
    #[inline(always)]
    fn limit(&self, n: T, area_mm2: T) -> T {
        n * self.limit + area_mm2 * self.tau0
    }
    #[inline(always)]
    fn radius(&self, fitted_n: T, scaled_n: T) -> T {
        scaled_n / fitted_n * self.softness
    }
    #[inline(always)]
    fn per_newton(&self, x: T) -> T {
        x * self.per_newton
    }
    fn stiffened(&self, factor: T, beta: T) -> Self
    where
        T: Scalar,
    {
        if factor == T::of(1.0) {
            return *self;
        }
        let strength = factor.power(beta);
        Self {
            normal: self.normal * factor,
            stiffness: self.stiffness * factor,
            limit: self.limit * strength,
            per_newton: self.per_newton / factor,
            softness: self.softness / factor,
            ..*self
        }
    }
}

impl<'a, const M: usize, const N: usize, T: Scalar, S: Scaling<T>> ModelOf<'a, M, N, S, T> {
    /// The same model for another finger, relative to the fitted one. A state may be used with both; springs keep their
    /// displacement.
    ///
    /// Costs about 150 instructions, 250 with a stiffness other than 1.
    pub fn tuned(&self, tuning: Tuning) -> Result<ModelOf<'a, M, N, Scaled<T>, T>, Error> {
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
        let scale = Scaled::new(&tuning, self.data.pressure_exponent);
        Ok(ModelOf { data: self.data, scale })
    }

    /// The same finger with the tissue's stiffness times `factor`, which is held within [`STIFFNESS_FACTOR`].
    pub(crate) fn stiffened(&self, factor: T) -> ModelOf<'a, M, N, S::Stiffened, T> {
        let [least, most] = [*STIFFNESS_FACTOR.start(), *STIFFNESS_FACTOR.end()].map(T::of);
        let factor = if factor < least { least } else { factor.at_most(most) };
        let scale = self.scale.stiffened(factor, self.data.pressure_exponent);
        ModelOf { data: self.data, scale }
    }
}
