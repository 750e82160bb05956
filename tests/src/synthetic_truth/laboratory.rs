//! What a laboratory adds to the finger: scatter between runs and noise of the rows.
//!
//! Main types: [`Noise`] (of a laboratory), [`Scatter`] (what a run draws of it).

use super::Random;

/// What a run draws once.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Factor on the stiffness.
    pub stiffness: f64,
    /// Factor on the strength.
    pub strength: f64,
    /// Error of the touch point, mm.
    pub depth_mm: f64,
    /// Offsets of the readings, N.
    pub offset_n: [f64; 3],
}

impl Default for Scatter {
    fn default() -> Self {
        Self { stiffness: 1.0, strength: 1.0, depth_mm: 0.0, offset_n: [0.0; 3] }
    }
}

/// Noise of a laboratory.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Row noise, N.
    pub additive_n: f64,
    /// Row noise, share of the reading.
    pub multiplicative: f64,
    /// Scatter of stiffness and strength between runs.
    pub gain: [f64; 2],
    /// Scatter of the touch point, mm.
    pub depth_mm: f64,
    /// Scatter of the offsets, N.
    pub offset_n: f64,
    /// Error of the corneometer, a.u.
    pub hydration_au: f64,
}

impl Noise {
    /// A laboratory of a seed.
    pub fn random(random: &mut Random) -> Self {
        Self {
            additive_n: random.between(0.002, 0.005),
            multiplicative: random.between(0.01, 0.03),
            gain: [random.between(0.01, 0.025), random.between(0.01, 0.025)],
            depth_mm: random.between(0.005, 0.015),
            offset_n: random.between(0.001, 0.004),
            hydration_au: 2.0,
        }
    }

    /// The scatter of a run.
    pub fn run(&self, random: &mut Random) -> Scatter {
        Scatter {
            stiffness: 1.0 + self.gain[0] * random.normal(),
            strength: 1.0 + self.gain[1] * random.normal(),
            depth_mm: self.depth_mm * random.normal(),
            offset_n: [0, 1, 2].map(|_| self.offset_n * random.normal()),
        }
    }

    /// A reading with row noise.
    pub fn row(&self, reading: [f64; 3], random: &mut Random) -> [f64; 3] {
        reading.map(|f| f + self.additive_n.hypot(self.multiplicative * f) * random.normal())
    }
}
