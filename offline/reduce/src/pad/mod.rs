//! The pad of a finger: its patches and bulk from the compliance at rest, and the few numbers that nonlinear runs decide.
//!
//! Main types: [`PadModel`] (what [`fingerpad::pad`] steps), [`Tuning`] (what is fitted); main functions: [`pad`], [`fit`], [`replay`].
//! Uses fe and runs.

mod bodies;
mod fit;
mod for_bed;
mod make;
mod patches;
mod path;
mod replay;
mod score;

use fingerpad::pad::{Law, Numbers, Pad, Patch};

pub use bodies::body_of;
pub use fit::{FitLimits, fit};
pub use for_bed::runs_for_bed;
pub use make::{MadePad, PadMeta, PadSettings, make_pad};
pub use patches::{PadSize, pad};
pub use path::simulate_path_on_pad;
pub use replay::{replay, replay_on_plane};
pub use score::{PadScores, score_runs};

/// Most patches of a pad on the outline.
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

    /// The same numbers as those of a model file.
    pub fn of(pad: &Pad<'_>) -> Self {
        Self { patches: pad.patches.iter().map(Patch::cast).collect(), numbers: pad.numbers.cast() }
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

/// What was found for the finger that ships; the numbers of another one are near.
impl Default for Tuning {
    fn default() -> Self {
        Self {
            law: Law {
                softness: [1.012, 0.9563],
                stiffening: [0.1082, 403.4],
                flattening_mpa: [0.0008771, 0.01556],
                area: [0.8971, 1.499, 0.8585],
                friction: [0.06995, 0.4279],
                onset: 3.281,
                lift: [
                    [-0.1469, -0.2741, -6.683, -0.4429, -3.359, -1.957, -0.2119, -56.97, -2.048, 7.282, 0.06674, 2.415],
                    [-0.1519, 1.245, -24.26, 0.1385, -6.445, 8.492, 0.4382, 76.71, 6.426, -11.26, 3.598, -41.5],
                ],
                turn: 5.77,
            },
            local: [1.212, 2.646],
            spread: 1.212,
        }
    }
}

#[cfg(test)]
mod tests;
