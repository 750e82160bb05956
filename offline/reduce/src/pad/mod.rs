//! The pad of a finger: patches and bulk from its compliance at small loads, and a few numbers from a fit to nonlinear runs.
//!
//! Main types: [`PadModel`] (the numbers that [`fingerpad::pad`] reads), [`FittedNumbers`] (the fitted numbers); main functions: [`pad`], [`fit`],
//! [`replay`].
//! Uses fe and runs.

mod bodies;
mod fit;
mod for_bed;
mod make;
mod patches;
mod path;
mod relaxation;
mod replay;
mod score;

use fingerpad::pad::{Law, MODES, Numbers, PACKED, Pad, Patch};
use fingerpad_fe::contact::RubberFriction;
use nalgebra::{SMatrix, Vector3};

use crate::Tip;

pub use bodies::body_of;
pub use fit::{FitLimits, fit};
pub use for_bed::{runs_for_bed, runs_in_pose};
pub use make::{MadePad, PadMeta, PadSettings, make_pad};
pub(crate) use patches::tilt;
pub use patches::{PadSize, pad};
pub use path::simulate_path_on_pad;
pub use relaxation::branches_of_force;
pub use replay::{replay, replay_on_plane};
pub use score::{DepthScores, PadScores, score_depths, score_runs};
pub(crate) use score::{is_free, largest};

/// Largest number of patches of a pad.
pub const MOST_PATCHES: usize = 64;

/// The numbers of a pad.
#[derive(Clone, Debug)]
pub struct PadModel {
    /// The patches.
    pub patches: Vec<Patch<f64>>,
    /// Numbers of the finger as a whole.
    pub numbers: Numbers<f64>,
    /// Inner normals of the patches, from which [`Self::fitted`] computes [`Numbers::squash`]; empty for a pad from a file.
    pub normals: Vec<Vector3<f64>>,
}

impl PadModel {
    /// The pad with these numbers.
    pub fn pad(&self) -> Pad<'_, f64> {
        Pad::new(&self.patches, &self.numbers)
    }

    /// The numbers of a pad from a model file.
    pub fn of(pad: &Pad<'_>) -> Self {
        Self {
            patches: pad.patches.iter().map(Patch::cast).collect(),
            numbers: pad.numbers.cast(),
            normals: Vec::new(),
        }
    }

    /// A pad from [`pad`] with fitted numbers.
    pub fn fitted(&self, fitted: &FittedNumbers) -> Self {
        let mut model = self.clone();
        model.numbers.law = fitted.law;
        if !self.normals.is_empty() {
            model.numbers.squash = squash(self, fitted);
        }
        for patch in &mut model.patches {
            (0..2).for_each(|k| patch.compliance_mm_per_n[k] *= fitted.local[k]);
            patch.spread_mm = patch.spread_mm.map(|x| x * fitted.spread);
        }
        model
    }
}

/// The numbers that are fitted to nonlinear runs.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FittedNumbers {
    /// Stiffening, flattening, friction, second order.
    pub law: Law<f64>,
    /// Local compliance along the normal and across, over the part of the compliance that the modes do not represent.
    pub local: [f64; 2],
    /// Spread of the gaps within a patch, over that of its points.
    pub spread: f64,
    /// Weight of the squared displacement across the skin's normal, along x, in the squash.
    #[serde(default)]
    pub sheared: f64,
    /// Weight of a place of the skin in the squash: its logarithm is the sum of these numbers times x, x² and y², from the middle of the skin
    /// in units of 5 mm.
    #[serde(default)]
    pub weight: [f64; 3],
}

/// The fitted numbers of the shipped finger; those of other fingers are similar.
impl Default for FittedNumbers {
    fn default() -> Self {
        Self {
            law: Law {
                softness: [0.9942, 0.9778],
                stiffening: [1.338, 0.5502],
                flattening_mpa: [0.000567, 0.03425],
                area: [0.9858, 1.493, 0.7407],
                friction: [0.1289, 0.5371],
                onset: 3.386,
                lift: [
                    [
                        -0.02939, -0.01733, -18.7, -0.1334, -3.599, -1.668, -0.2079, -54.62, -1.354, 7.385, -0.007186,
                        2.415,
                    ],
                    [-0.1303, 0.1815, -20.59, 0.06465, -6.34, 8.193, 0.4117, 74.73, 1.488, -10.92, 2.992, -35.5],
                ],
                turn: 4.394,
            },
            local: [1.175, 2.696],
            spread: 1.036,
            sheared: 0.1529,
            weight: [2.27, -2.562, -0.7117],
        }
    }
}

impl FittedNumbers {
    /// The start of the fit of a tip with a friction law. The second order of the bulk's rigid motion on a fixed core starts at 0.
    pub fn of_tip(tip: &Tip, friction: &RubberFriction) -> Self {
        let mut start = Self::default();
        crate::retune::scale_law(&mut start.law, tip.length, tip.pressure);
        let human = RubberFriction::default();
        // The strength of a patch is less nonlinear in the pressure than that of a point.
        let [lambda, beta] = start.law.friction;
        let share = (1.0 - friction.beta) / (1.0 - human.beta);
        start.law.friction =
            [friction.lambda * (lambda / human.lambda).powf(share), friction.beta + share * (beta - human.beta)];
        if tip.is_fixed {
            (start.law.lift, start.law.turn, start.weight) = ([[0.0; 12]; 2], 1.0, [0.0; 3]);
        }
        start
    }
}

/// Unit of places on the skin in [`FittedNumbers::weight`], mm.
const SKIN_MM: f64 = 5.0;

/// Weighted mean square of the skin's displacement, mm² per mJ: the lower triangle, row by row.
fn squash(at_rest: &PadModel, fitted: &FittedNumbers) -> [f64; PACKED] {
    let whole: f64 = at_rest.patches.iter().map(|patch| patch.area_mm2).sum();
    let mut square = SMatrix::<f64, MODES, MODES>::zeros();
    for (patch, normal) in at_rest.patches.iter().zip(&at_rest.normals) {
        let modes = SMatrix::<f64, 3, MODES>::from_fn(|axis, mode| patch.modes[axis][mode]);
        let across = (Vector3::x() - normal * normal.x).try_normalize(1e-9).unwrap_or_default();
        let [x, y] = [0, 1].map(|k| (patch.middle_mm[k] - at_rest.numbers.middle_mm[k]) / SKIN_MM);
        let [along_x, along_x2, along_y2] = fitted.weight;
        let weight = (along_x * x + along_x2 * x * x + along_y2 * y * y).clamp(-7.0, 7.0).exp();
        for (direction, share) in [(*normal, 1.0), (across, fitted.sheared)] {
            let along = direction.transpose() * modes;
            square += along.transpose() * along * (patch.area_mm2 / whole * weight * share);
        }
    }
    let mut packed = [0.0; PACKED];
    let lower = (0..MODES).flat_map(|row| (0..=row).map(move |column| (row, column)));
    packed.iter_mut().zip(lower).for_each(|(x, place)| *x = square[place]);
    packed
}

#[cfg(test)]
mod tests;
