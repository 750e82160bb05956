//! The same model for another finger: size, stiffness and friction changed at run time, without a rebuild.
//!
//! Main types: [`Tuning`], [`Units`]. Uses model and math.

use crate::error::Field;
use crate::math::Scalar;
use crate::{Error, ModelOf, Response};

/// How a finger differs from the one that the model was fitted to.
///
/// Lengths scale with `size`, pressures with `stiffness`, local friction with `lambda`. A tuned model is the fitted one in
/// other units:
///
/// ```text
/// length ~ size    force ~ stiffness size²    strength factor ~ lambda stiffness^(beta − 1)
/// ```
///
/// with beta the model's exponent, because the law tau = lambda sigma^beta keeps its form under a change of units. The result is
/// exact for geometrically similar fingers whose tissue differs by a factor.
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
}

impl Default for Tuning {
    /// The finger that the model was fitted to.
    fn default() -> Self {
        Self { size: 1.0, stiffness: 1.0, lambda: 1.0 }
    }
}

/// Range of the factor on the tissue's stiffness.
pub(crate) const STIFFNESS_FACTOR: core::ops::RangeInclusive<f32> = 0.2..=5.0;

/// Units of a finger over those of the fitted one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Units<T> {
    pub(crate) length: T,
    /// One over `length`.
    pub(crate) per_length: T,
    pub(crate) force: T,
    /// Factor on the strength in the units of the fitted finger.
    pub(crate) strength: T,
}

impl<T: Scalar> Units<T> {
    /// Units of the fitted finger.
    pub(crate) fn fitted() -> Self {
        let one = T::of(1.0);
        Self { length: one, per_length: one, force: one, strength: one }
    }

    /// Units of another finger; `beta` is the exponent of the friction law.
    ///
    /// # Errors
    /// [`Error::Range`] with the factor.
    pub(crate) fn new(tuning: &Tuning, beta: T) -> Result<Self, Error> {
        let Tuning { size, stiffness, lambda } = *tuning;
        let ranges = [
            (Field::Size, size, 0.5, 2.0),
            (Field::Stiffness, stiffness, *STIFFNESS_FACTOR.start(), *STIFFNESS_FACTOR.end()),
            (Field::Lambda, lambda, 0.1, 10.0),
        ];
        for (what, value, low, high) in ranges {
            if !(value >= low && value <= high) {
                return Err(Error::Range { what, index: 0, value });
            }
        }
        let length = T::of(size);
        let units = Self { length, per_length: T::of(1.0) / length, force: length * length, strength: T::of(lambda) };
        Ok(units.stiffened(T::of(stiffness), beta))
    }

    /// Units of the same finger with the tissue's stiffness times `factor`.
    #[inline]
    fn stiffened(self, factor: T, beta: T) -> Self {
        if factor == T::of(1.0) {
            return self;
        }
        let softened = factor.power(beta - T::of(1.0));
        Self { force: self.force * factor, strength: self.strength * softened, ..self }
    }

    /// A response in units of the fitted finger, in those of this one.
    #[inline(always)]
    pub(crate) fn response(&self, of: Response<T>) -> Response<T> {
        let Self { length, force, .. } = *self;
        Response {
            normal_force_n: of.normal_force_n * force,
            friction_n: of.friction_n.map(|f| f * force),
            tangential_friction_n: of.tangential_friction_n.map(|f| f * force),
            friction_limit_n: of.friction_limit_n * force,
            spin_moment_n_mm: of.spin_moment_n_mm * (force * length),
            tilt_moment_n_mm: of.tilt_moment_n_mm.map(|m| m * (force * length)),
            pressure_centre_mm: of.pressure_centre_mm.map(|x| x * length),
            contact_area_mm2: of.contact_area_mm2 * (length * length),
            band_normal_n: of.band_normal_n * force,
            band_friction_n: of.band_friction_n * force,
            ..of
        }
    }
}

impl<const M: usize, const N: usize, T: Scalar> ModelOf<'_, M, N, T> {
    /// The same model for another finger, relative to the fitted one. A state may be used with both; springs keep their
    /// displacement over the size.
    ///
    /// Costs about 70 instructions, 180 with a stiffness other than 1.
    ///
    /// # Errors
    /// [`Error::Range`] with the factor that is out of its range.
    pub fn tuned(&self, tuning: Tuning) -> Result<Self, Error> {
        Ok(Self { units: Units::new(&tuning, self.data.pressure_exponent)?, ..*self })
    }

    /// The same finger with the tissue's stiffness times `factor`, which is clamped to [`STIFFNESS_FACTOR`].
    pub(crate) fn stiffened(&self, factor: T) -> Self {
        let [least, most] = [*STIFFNESS_FACTOR.start(), *STIFFNESS_FACTOR.end()].map(T::of);
        let factor = if factor < least { least } else { factor.at_most(most) };
        Self { units: self.units.stiffened(factor, self.data.pressure_exponent), ..*self }
    }
}
