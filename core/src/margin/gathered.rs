//! Readings between two steps of the twins: sums of a block, and filtered forces.
//!
//! Main types: [`Gathered`], [`Load`]. Uses input.

use super::input::Variances;

/// Time constant of the forces that the margin is made of, s, and of their rates.
pub(super) const SMOOTH_S: f32 = 0.005;
const RATE_S: f32 = 0.05;

/// Readings since the last block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gathered {
    pub(super) number: f32,
    pub(super) time_s: f32,
    pub(super) normal_n: f32,
    pub(super) friction_n: [f32; 2],
    /// Sum of the positions since the last block.
    pub(super) position_mm: [f32; 2],
    pub(super) variances: [f32; 3],
    /// Number of readings with a stick ratio, their sum and that of their variances.
    pub(super) stick: [f32; 3],
}

/// Filtered forces and their rates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Load {
    /// Normal, along x and y, N.
    pub(super) now: [f32; 3],
    pub(super) slow: [f32; 3],
    pub(super) per_s: [f32; 3],
}

impl Gathered {
    pub(super) fn add(
        &mut self,
        [normal, x, y]: [f32; 3],
        position_mm: [f32; 2],
        stick: f32,
        variances: &Variances,
        dt_s: f32,
    ) {
        self.number += 1.0;
        self.time_s += dt_s;
        self.normal_n += normal;
        self.friction_n = [self.friction_n[0] + x, self.friction_n[1] + y];
        self.position_mm = [self.position_mm[0] + position_mm[0], self.position_mm[1] + position_mm[1]];
        for (sum, variance) in self.variances.iter_mut().zip([variances.normal, variances.friction, variances.slide]) {
            *sum += variance;
        }
        if variances.stick > 0.0 {
            let [number, sum, variance] = self.stick;
            self.stick = [number + 1.0, sum + stick, variance + variances.stick];
        }
    }

    pub(super) fn mean_position(&self) -> [f32; 2] {
        self.position_mm.map(|sum| sum / self.number.max(1.0))
    }

    /// Variances of the means: normal force, friction, position.
    pub(super) fn errors(&self) -> [f32; 3] {
        let per_square = 1.0 / (self.number * self.number).max(1.0);
        self.variances.map(|sum| sum * per_square)
    }
}

impl Load {
    /// Takes a reading into the filters.
    ///
    /// * `fresh`: whether the contact begins; the rates are then zero
    pub(super) fn follow(&mut self, reading: [f32; 3], dt_s: f32, fresh: bool) {
        let (quick, slow) = (dt_s / (SMOOTH_S + dt_s), dt_s / (RATE_S + dt_s));
        let filters = self.now.iter_mut().zip(&mut self.slow).zip(&mut self.per_s);
        for (((now, lagging), rate), value) in filters.zip(reading) {
            *now += quick * (value - *now);
            *lagging += slow * (*now - *lagging);
            *rate = if fresh { 0.0 } else { (*now - *lagging) / RATE_S };
        }
    }
}
