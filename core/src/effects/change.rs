//! Changes of the model by effects: factors on strength and stiffness, a depth offset, additional forces. No effect adds a free function
//! to a force.

use crate::math::Real;

/// Lower bound of every factor.
pub const LEAST_FACTOR: f64 = 0.1;
/// Contact area at which adhesion and drag are given, mm².
pub const REFERENCE_AREA_MM2: f64 = 63.5;

/// Changes of the model by all active effects at one instant. `Default` changes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Change<T> {
    /// Factor on tau_crit.
    pub strength: T,
    /// Factor on the tissue's stiffness.
    pub stiffness: T,
    /// Added to the depth, mm, where the depth is positive.
    pub depth_mm: T,
    /// Added to the reading, N: normal, x, y.
    pub reading_n: [T; 3],
    /// Share of the normal force that appears in x and y.
    pub cross: [T; 2],
    /// Share by which the sensor reads too much of every force.
    pub gain: T,
    /// Force along the motion at the reference area, N.
    pub drag_n: T,
    /// Line tension at the rim, as pull-off at the reference area, N.
    pub adhesion_n: T,
}

impl<T: Real> Default for Change<T> {
    fn default() -> Self {
        Self {
            strength: T::ONE,
            stiffness: T::ONE,
            depth_mm: T::ZERO,
            reading_n: [T::ZERO; 3],
            cross: [T::ZERO; 2],
            gain: T::ZERO,
            drag_n: T::ZERO,
            adhesion_n: T::ZERO,
        }
    }
}

impl<T: Real> Change<T> {
    /// Factors on strength and stiffness.
    pub fn factors(&self) -> (T, T) {
        (self.strength, self.stiffness)
    }

    /// Whether it changes the sensor's readings only.
    pub fn reads(&self) -> bool {
        let forces = [self.cross[0], self.cross[1], self.gain, self.drag_n, self.adhesion_n];
        self.reading_n.iter().chain(&forces).any(|f| *f != T::ZERO)
    }

    /// The sensor's reading of a force, N: normal, x, y.
    pub fn reading(&self, [normal, x, y]: [T; 3]) -> [T; 3] {
        let ([tare, tare_x, tare_y], [to_x, to_y]) = (self.reading_n, self.cross);
        // The gain comes last, so that a sensor without one reads the bits of earlier versions.
        [
            normal + tare + self.gain * normal,
            x + tare_x + to_x * normal + self.gain * (x + to_x * normal),
            y + tare_y + to_y * normal + self.gain * (y + to_y * normal),
        ]
    }

    /// Multiplies the strength by a factor, at least [`LEAST_FACTOR`]. NaN, from an unknown driver, counts as 1.
    pub fn strengthen(&mut self, factor: T) {
        self.strength *= held(factor);
    }

    /// Multiplies the stiffness by a factor, with the same rules.
    pub fn stiffen(&mut self, factor: T) {
        self.stiffness *= held(factor);
    }
}

fn held<T: Real>(factor: T) -> T {
    let least = T::of(LEAST_FACTOR);
    if factor > least {
        factor
    } else if factor <= least {
        least
    } else {
        T::ONE
    }
}
