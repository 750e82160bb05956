//! Turn about the normal and its moment, where a finger has them.
//!
//! Main type: [`Turned`]. Uses input.

use super::input::Reading;
use crate::math::Scalar;

/// Arm at which a turn counts as a slide, and a moment as a force, mm.
pub(super) const ARM_MM: f32 = 2.0;

/// Turns and moments since the last block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turned {
    /// Angle since the last block, rad: measured, delayed as the forces, and the sum of the latter.
    here: f32,
    delayed: f32,
    sum: f32,
    /// Number of readings with a moment, sum of the moments and that of their variances.
    moment: [f32; 3],
    /// Zero of the moment, N mm, and the number of its readings in the air.
    zero: f32,
    in_air: f32,
}

/// Means of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turn {
    pub(super) by_rad: f32,
    /// Moment, N mm, and the variance of its noise; `None` where it is not measured.
    pub(super) moment: Option<(f32, f32)>,
}

impl Turned {
    /// A finger in the air.
    pub(super) fn leave(&mut self) {
        *self = Self { zero: self.zero, ..Self::default() };
    }

    /// Takes a reading in the air: the zero of the moment.
    pub(super) fn tare(&mut self, reading: &Reading) {
        if reading.spin_variance_n2_mm2 > 0.0 {
            self.in_air = (self.in_air + 1.0).at_most(1000.0);
            self.zero += (reading.spin_moment_n_mm - self.zero) / self.in_air;
        }
    }

    /// Takes a reading in contact.
    ///
    /// * `share`: by which the delayed angle approaches the measured one
    pub(super) fn add(&mut self, reading: &Reading, share: f32) {
        self.here += reading.spin_increment_rad;
        self.delayed += share * (self.here - self.delayed);
        self.sum += self.delayed;
        if reading.spin_variance_n2_mm2 > 0.0 {
            let [number, sum, variances] = self.moment;
            let moment = reading.spin_moment_n_mm - self.zero;
            self.moment = [number + 1.0, sum + moment, variances + reading.spin_variance_n2_mm2];
        }
    }

    /// The turn of the block so far, rad.
    ///
    /// * `number`: readings of the block
    pub(super) fn by(&self, number: f32) -> f32 {
        self.sum / number.max(1.0)
    }

    /// Ends a block.
    pub(super) fn take(&mut self, number: f32) -> Turn {
        let by_rad = self.by(number);
        let [moments, sum, variances] = core::mem::take(&mut self.moment);
        (self.here, self.delayed, self.sum) = (self.here - by_rad, self.delayed - by_rad, 0.0);
        Turn { by_rad, moment: (moments > 0.0).then(|| (sum / moments, variances / (moments * moments))) }
    }
}
