//! Steps driven by forces instead of displacements.
//!
//! Main types: [`Drive`], [`Driven`]. Uses step, gradient.

use crate::step::step;
use crate::tune::Scaling;
use crate::{ModelOf, Motion, Response, StateOf, Status};

/// What is prescribed along the plane's normal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Normal {
    /// Depth at the end of the step, mm.
    DepthMm(f32),
    /// Normal force at the end of the step, N.
    ForceN(f32),
}

/// What is prescribed in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Tangential {
    /// Slide during the step, mm.
    SlideIncrementMm([f32; 2]),
    /// Friction at the end of the step, N.
    FrictionN([f32; 2]),
}

/// One step's prescription.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    /// Along the normal.
    pub normal: Normal,
    /// In the plane.
    pub tangential: Tangential,
    /// Length of the step, s.
    pub dt_s: f32,
}

/// What a driven step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Driven {
    /// The forces.
    pub response: Response,
    /// The motion that led to them.
    pub motion: Motion,
}

/// Force error at which a driven step is content, share of the target.
const CONTENT: f32 = 4e-6;
const ROUNDS: usize = 12;

impl<const M: usize, const N: usize, S: Scaling> ModelOf<'_, M, N, S> {
    /// Advances a contact by one step driven by displacement or force in each direction.
    ///
    /// Tries standing still first and stays there if the forces fit within 4e-6 of the target (or of the limit), so
    /// that a held load does not creep. Otherwise at most 12 rounds, each one `step` on a copy: depth from the
    /// inverse of N0 with the shear part carried over (converges where |d(N − N0)/dd| < N0'; nothing bounds that
    /// quotient but the flag below tells), slide by Newton's method. A force out of reach (a normal force above that of the largest depth, friction above the limit) gives the nearest state that
    /// the rounds found and [`Status::LOAD_NOT_REACHED`]. A normal force of 0 or less lifts off; NaN stands still.
    ///
    /// Costs 1800 to 7900 instructions when driven by normal force (counted over 512 steps).
    pub fn step_driven(&self, state: &mut StateOf<M>, drive: Drive) -> Driven {
        let mut motion = Motion { depth_mm: state.depth, slide_increment_mm: [0.0; 2], dt_s: drive.dt_s };
        let (mut want_normal, mut want_friction) = (None, None);
        let mut bad = Status::OK;
        match drive.normal {
            Normal::DepthMm(depth) => motion.depth_mm = depth,
            Normal::ForceN(force) if force.is_nan() => bad = Status::BAD_INPUT,
            Normal::ForceN(force) if force <= 0.0 => motion.depth_mm = motion.depth_mm.min(0.0),
            Normal::ForceN(force) => {
                if !state.in_contact() {
                    motion.depth_mm = self.depth_for_normal(force);
                }
                want_normal = Some(force);
            }
        }
        match drive.tangential {
            Tangential::SlideIncrementMm(slide) => motion.slide_increment_mm = slide,
            Tangential::FrictionN([x, y]) if x.is_finite() && y.is_finite() => want_friction = Some([x, y]),
            Tangential::FrictionN(_) => bad = Status::BAD_INPUT,
        }

        let mut best = (f32::INFINITY, *state, Response::default(), motion);
        for _ in 0..ROUNDS {
            let mut trial = *state;
            let response = step(self, &mut trial, motion);
            let mut error = 0.0f32;
            let mut next = motion;
            if let Some(target) = want_normal {
                let lack = target - response.normal_force_n;
                error = error.max(lack.abs() / target.max(1e-6));
                if motion.depth_mm > 0.0 {
                    let plain = self.normal_at(motion.depth_mm);
                    next.depth_mm = self.depth_for_normal((plain + lack).max(0.1 * plain));
                }
            }
            if let (Some(target), true) = (want_friction, motion.depth_mm > 0.0) {
                let lack = [target[0] - response.friction_n[0], target[1] - response.friction_n[1]];
                let size = lack[0].abs().max(lack[1].abs());
                error = error.max(size / response.friction_limit_n);
                let further = self.slide_for(&trial, lack);
                // Only so far as the contact holds together: one slip length a round.
                let longest = trial.limit * trial.compliance;
                for (slide, more) in next.slide_increment_mm.iter_mut().zip(further) {
                    *slide += more.max(-longest).min(longest);
                }
            }
            if error < best.0 {
                best = (error, trial, response, motion);
            }
            if !(error > CONTENT) {
                break;
            }
            motion = next;
        }
        let (error, found, mut response, motion) = best;
        *state = found;
        if error > 1e-3 {
            bad = bad.with(Status::LOAD_NOT_REACHED);
        }
        response.status = response.status.with(bad);
        Driven { response, motion }
    }

    /// The slide that changes friction by `lack`, by the gradient for loading in that direction.
    fn slide_for(&self, state: &StateOf<M>, lack: [f32; 2]) -> [f32; 2] {
        let g = self.gradient(state, [0.0, lack[0], lack[1]]);
        let [[_, a, b], [_, c, d]] = g.friction_n_mm;
        let det = a * d - b * c;
        // A contact in full slip has no stiffness left; then the sticking one's shows the way.
        if det * state.compliance * state.compliance > 1e-3 {
            [(d * lack[0] - b * lack[1]) / det, (a * lack[1] - c * lack[0]) / det]
        } else {
            [4.0 * lack[0] * state.compliance, 4.0 * lack[1] * state.compliance]
        }
    }
}
