//! The pad of a finger: its patches and bulk from the compliance at rest, and the few numbers that nonlinear runs decide.
//!
//! Main types: [`PadModel`] (what [`fingerpad::pad`] steps), [`Tuning`] (what is fitted); main functions: [`pad`], [`fit`], [`replay`].
//! Uses fe and runs.

mod fit;
mod make;
mod patches;
mod path;
mod replay;
mod score;

use fingerpad::pad::{Law, Numbers, Pad, Patch};

pub use fit::{FitLimits, fit};
pub use make::{MadePad, PadMeta, PadSettings, make_pad};
pub use patches::{PadSize, pad};
pub use path::simulate_path_on_pad;
pub use replay::{Host, replay};
pub use score::{PadScores, score_runs};

/// Most patches of a pad on the host.
pub const MOST_PATCHES: usize = 64;

/// The numbers of a pad.
#[derive(Clone, Debug)]
pub struct PadModel {
    /// The patches.
    pub patches: Vec<Patch<f64>>,
    /// What holds for all of them.
    pub numbers: Numbers<f64>,
}

impl PadModel {
    /// The pad, ready to step.
    pub fn pad(&self) -> Pad<'_, f64> {
        Pad { patches: &self.patches, numbers: &self.numbers }
    }

    /// The pad of a finger at rest with what was fitted.
    pub fn tuned(&self, tuning: &Tuning) -> Self {
        let mut model = self.clone();
        model.numbers.law = tuning.law;
        for patch in &mut model.patches {
            (0..2).for_each(|k| patch.compliance_mm_per_n[k] *= tuning.local[k]);
            patch.spread_mm = patch.spread_mm.map(|x| x * tuning.spread);
        }
        model
    }
}

/// What is fitted to nonlinear runs.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tuning {
    /// Stiffening, flattening, friction, second order.
    pub law: Law<f64>,
    /// Local compliance along the normal and across, over what the modes leave.
    pub local: [f64; 2],
    /// Spread of the gaps within a patch, over that of its points.
    pub spread: f64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            law: Law {
                softness: [1.0, 1.04],
                stiffening: [0.3, 3.0],
                flattening_mpa: [0.0004, 0.027],
                area: [1.06, 1.8, 0.9],
                friction: [0.084, 0.46],
                onset: 6.5,
                lift: [[0.0; 12]; 2],
                turn: 1.0,
            },
            local: [1.0, 1.0],
            spread: 1.07,
        }
    }
}

#[cfg(test)]
mod tests;
