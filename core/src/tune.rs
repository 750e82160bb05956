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

/// The factors that a step multiplies with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    pub(crate) per_mm: f32,
    pub(crate) area: f32,
    pub(crate) limit: f32,
    pub(crate) tau0: f32,
    pub(crate) stiffness: f32,
    pub(crate) half_cell: f32,
    pub(crate) length: f32,
    pub(crate) normal: f32,
    pub(crate) shear: f32,
}

impl Scale {
    fn new(tuning: &Tuning, cell: f32, beta: f32) -> Self {
        let Tuning { size, stiffness, lambda, tau0_mpa } = *tuning;
        let area = size * size;
        let strength = if stiffness == 1.0 { lambda } else { lambda * pow(stiffness, beta) };
        Self {
            per_mm: 1.0 / (cell * size),
            area,
            limit: strength * area,
            tau0: tau0_mpa,
            stiffness: stiffness * size,
            half_cell: 0.5 * cell,
            length: size,
            normal: stiffness * area,
            // Like L²/(K length), so that what was passive stays passive.
            shear: strength * strength * area / stiffness,
        }
    }
}

impl<'a, const M: usize, const N: usize> ModelOf<'a, M, N> {
    pub(crate) fn from_checked(data: &'a crate::DataOf<M, N>) -> Self {
        let cell = data.depth_max / (N - 1) as f32;
        Self { data, scale: Scale::new(&Tuning::default(), cell, data.pressure_exponent) }
    }

    /// The same model for another finger. A state may be carried over: elements keep their force.
    ///
    /// Costs about 160 instructions; the step that follows costs what it always does.
    pub fn tuned(&self, tuning: Tuning) -> Result<Self, Error> {
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
        let cell = self.data.depth_max / (N - 1) as f32;
        Ok(Self { data: self.data, scale: Scale::new(&tuning, cell, self.data.pressure_exponent) })
    }
}
