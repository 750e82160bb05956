//! The normal equations of a round over the blocks, and the weights of the residuals.
//!
//! Main types: [`Round`], [`Scatter`]. Uses math.

use super::UNKNOWNS;
use super::readings::Reading;
use crate::math::{Scalar, sqrt};

/// Residuals beyond this number of standard deviations have a reduced weight (Huber 1964, Ann. Math. Statist. 35:73).
const SURPRISE: f32 = 3.0;

/// Variance of the readings of one kind about the estimate, relative values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// Variance, and the part of it that changes from block to block, as of the last round.
    pub(super) all: f32,
    pub(super) white: f32,
    /// The last residual, and sums of the present round.
    pub(super) last: f32,
    pub(super) squares: f32,
    pub(super) steps: f32,
    pub(super) number: f32,
}

impl Scatter {
    pub(super) const UNKNOWN: Self = Self { all: 0.01, white: 1e-4, last: 0.0, squares: 0.0, steps: 0.0, number: 0.0 };

    /// Records a residual and returns its weight.
    ///
    /// * `model`: variance of the error of the model
    /// * `blocks`: number of blocks with the same error of the model
    pub(super) fn weigh(&mut self, residual: f32, model: f32, blocks: f32) -> f32 {
        let most = SURPRISE * sqrt(self.all.magnitude());
        let held = residual.max(-most).min(most);
        self.squares += held * held;
        self.steps += 0.5 * (held - self.last) * (held - self.last);
        (self.last, self.number) = (held, self.number + 1.0);
        let weight = 1.0 / (self.white + (model + (self.all - self.white).not_negative()) * blocks);
        if residual.magnitude() > most { weight * most / residual.magnitude() } else { weight }
    }

    pub(super) fn end_round(&mut self) {
        if self.number > 0.0 {
            // Square of the least relative difference that the readings resolve.
            let least = 1e-6;
            self.all = (self.squares / self.number).max(least);
            self.white = (self.steps / self.number).max(least).at_most(self.all);
        }
        (self.last, self.squares, self.steps, self.number) = (0.0, 0.0, 0.0, 0.0);
    }
}

pub(super) type Vector = [f32; UNKNOWNS];
pub(super) type Matrix = [[f32; UNKNOWNS]; UNKNOWNS];

/// One round over the blocks: the normal equations.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Round {
    /// The next block.
    pub(super) next: usize,
    /// The last one, and the forces of the twins there, N: normal, along x and y.
    pub(super) last: Reading,
    pub(super) forces: [[f32; 3]; UNKNOWNS + 1],
    pub(super) information: Matrix,
    pub(super) pull: Vector,
    pub(super) slipped_mm: f32,
}

impl Round {
    pub(super) fn add(&mut self, slopes: &Vector, residual: f32, weight: f32) {
        if !(residual.is_number() && weight.is_number()) {
            return;
        }
        for ((row, pull), a) in self.information.iter_mut().zip(&mut self.pull).zip(slopes) {
            *pull += weight * a * residual;
            for (cell, b) in row.iter_mut().zip(slopes) {
                *cell += weight * a * b;
            }
        }
    }
}

/// The inverse of a symmetric positive definite matrix (Gauss and Jordan, without exchanges).
pub(super) fn inverse(mut m: Matrix) -> Option<Matrix> {
    for k in 0..UNKNOWNS {
        let pivot = m.get_mut(k)?;
        let per_pivot = 1.0 / core::mem::replace(pivot.get_mut(k)?, 1.0);
        if !(per_pivot > 0.0 && per_pivot <= f32::MAX) {
            return None;
        }
        *pivot = pivot.map(|cell| cell * per_pivot);
        let pivot = *pivot;
        for (_, row) in m.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = core::mem::take(row.get_mut(k)?);
            for (cell, of_pivot) in row.iter_mut().zip(pivot) {
                *cell -= factor * of_pivot;
            }
        }
    }
    Some(m)
}
