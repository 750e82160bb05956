//! What a laboratory adds to the finger: scatter between runs and noise of the rows.
//!
//! Main types: [`Noise`] (of a laboratory), [`Scatter`] (what a run draws of it).

use std::f64::consts::TAU;

use super::Random;
use super::protocol::Stroke;

/// Depth at which a trembling finger still touches, mm.
const LEAST_CONTACT_MM: f64 = 1e-3;

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

/// Noise of a laboratory; `Default` has none.
#[derive(Clone, Debug, Default)]
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
    /// Share of the runs that scatter by [`OUTLIER`] times as much as the others.
    pub outlier_runs: f64,
    /// Root mean square of a tremor of the depth that the file does not have, mm.
    pub tremor_mm: f64,
    /// Play of the plate's drive, which the file does not have, mm.
    pub backlash_mm: f64,
    /// Share of each force that the sensor reads in each other channel.
    pub cross_talk: f64,
    /// Standard deviation of the change of each offset from run to run, N.
    pub walk_n: f64,
}

/// Scatter of an outlier run over that of the others.
pub const OUTLIER: f64 = 5.0;
/// Frequencies of a physiological tremor, Hz.
const TREMOR_HZ: [f64; 2] = [8.0, 12.0];

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
            ..Self::default()
        }
    }

    /// The scatter of a run.
    pub fn run(&self, random: &mut Random) -> Scatter {
        let is_outlier = self.outlier_runs > 0.0 && random.unit() < self.outlier_runs;
        let times = if is_outlier { OUTLIER } else { 1.0 };
        Scatter {
            stiffness: 1.0 + times * self.gain[0] * random.normal(),
            strength: 1.0 + times * self.gain[1] * random.normal(),
            depth_mm: times * self.depth_mm * random.normal(),
            offset_n: [0, 1, 2].map(|_| times * self.offset_n * random.normal()),
        }
    }

    /// The stroke as the finger makes it: its depth trembles by two sines, and the plate follows the drive with its play. The file has both
    /// without.
    pub fn trembling(&self, stroke: &Stroke, random: &mut Random) -> Stroke {
        let mut out = stroke.clone();
        if self.tremor_mm > 0.0 {
            let sines = [0, 1].map(|_| (TAU * random.between(TREMOR_HZ[0], TREMOR_HZ[1]), TAU * random.unit()));
            for row in out.rows.iter_mut().filter(|row| row.depth_mm > 0.0) {
                let tremor: f64 = sines.iter().map(|(rate, phase)| (rate * row.contact_s + phase).sin()).sum();
                // Two sines have a mean square of one.
                row.depth_mm = (row.depth_mm + self.tremor_mm * tremor).max(LEAST_CONTACT_MM);
            }
        }
        let mut plate = [0.0f64; 2];
        for row in &mut out.rows {
            for (at, drive) in plate.iter_mut().zip(&mut row.slide_mm) {
                *at = at.clamp(*drive - 0.5 * self.backlash_mm, *drive + 0.5 * self.backlash_mm);
                *drive = *at;
            }
        }
        out
    }

    /// What the sensor makes of the forces on it: a share of each is read in the others, with the signs of one sensor.
    pub fn mixed(&self, [n, x, y]: [f64; 3]) -> [f64; 3] {
        let share = self.cross_talk;
        [n + share * (x - 0.6 * y), x + share * (n + 0.4 * y), y + share * (-0.8 * n + 0.5 * x)]
    }

    /// A reading with row noise.
    pub fn row(&self, reading: [f64; 3], random: &mut Random) -> [f64; 3] {
        reading.map(|f| f + self.additive_n.hypot(self.multiplicative * f) * random.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic_truth::protocol::{Plan, strokes};

    #[test]
    fn a_tremor_has_the_root_mean_square_and_outliers_the_share_that_are_wanted() {
        let mut random = Random::new(3);
        let noise = Noise { outlier_runs: 0.05, tremor_mm: 0.005, ..Noise::random(&mut random) };
        let plans = vec![Plan { dwell_s: 5.0, ..Plan::reference() }; 200];
        let (mut square, mut rows) = (0.0, 0.0);
        for stroke in strokes(&plans, 30) {
            let trembling = noise.trembling(&stroke, &mut random);
            for (a, b) in stroke.rows.iter().zip(&trembling.rows).filter(|(a, _)| a.depth_mm > 0.1) {
                square += (a.depth_mm - b.depth_mm).powi(2);
                rows += 1.0;
            }
        }
        assert!((f64::sqrt(square / rows) / 0.005 - 1.0).abs() < 0.05, "{}", f64::sqrt(square / rows));
        let gains: Vec<f64> = (0..20_000).map(|_| (noise.run(&mut random).strength - 1.0) / noise.gain[1]).collect();
        let beyond = gains.iter().filter(|g| g.abs() > 4.0).count() as f64 / 20_000.0;
        // Of a normal with five times the spread 42 % lie beyond four standard deviations of the others.
        assert!((beyond / (0.05 * 0.42) - 1.0).abs() < 0.2, "{beyond}");
        assert_eq!(noise.trembling(&strokes(&plans[..1], 30)[0], &mut random).rows[0].depth_mm, -0.2);
    }
}
