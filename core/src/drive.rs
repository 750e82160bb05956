//! Steps driven by forces instead of displacements.
//!
//! Main types: [`Drive`], [`Driven`]. Uses step, gradient.

use crate::step::step;
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
    /// Turn of the plane during the step, rad; see [`Motion::spin_increment_rad`].
    pub spin_increment_rad: f32,
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
/// Forces beyond are out of reach like this one; their squares are numbers.
const LARGEST_N: f32 = 1e6;
/// Rounds in a row that do not halve the error after which the force counts as out of reach.
const STALE: u32 = 5;
/// Force error below which depth and slide go by Newton's method together. Farther off, where full slip comes between,
/// each on its own gets there more often.
const NEAR: f32 = 0.1;

/// The search for a normal force: over the force without shear, where it is nearly a straight line.
struct Search {
    /// Forces without shear that were too little and too much.
    ends: [f32; 2],
    /// The last one and what it lacked.
    last: [f32; 2],
}

impl Search {
    /// The force without shear to try after `plain`, which lacked `lack`: along the line through the last two, and
    /// in the middle of the ends if that leads beyond them.
    fn next(&mut self, plain: f32, lack: f32) -> f32 {
        self.ends[usize::from(lack < 0.0)] = plain;
        let slope = (self.last[1] - lack) / (plain - self.last[0]);
        self.last = [plain, lack];
        let next = if (0.2..5.0).contains(&slope) { plain + lack / slope } else { plain + lack };
        let [low, high] = self.ends;
        if high < f32::INFINITY && !(next > low && next < high) { 0.5 * (low + high) } else { next }
    }
}

impl<const M: usize, const N: usize> ModelOf<'_, M, N> {
    /// Advances a contact by one step driven by displacement or force in each direction.
    ///
    /// Tries standing still first and stays there if the forces fit within 4e-6 of the target (or of the limit), so
    /// that a held load does not creep. Otherwise at most 12 rounds, each one `step` on a copy: normal force alone by
    /// the secant method, kept within bounds, over the force without shear; friction by Newton's method with the
    /// gradient; both together by Newton's method once they are near. It gives up when five rounds in a row do not
    /// halve the error. A force out of reach (a normal force above that of the largest depth, friction above the
    /// limit) gives the nearest state that the rounds found and [`Status::LOAD_NOT_REACHED`]. A normal force of 0 or
    /// less lifts off; NaN stands still.
    ///
    /// Mostly two or three rounds; 2400 to 6600 instructions when driven by normal force, more when driven by normal
    /// force and friction (counted over 512 steps each; the most where the force is out of reach).
    pub fn step_driven<const P: usize>(&self, state: &mut StateOf<M, P>, drive: Drive) -> Driven {
        let mut motion = Motion {
            depth_mm: state.depth,
            slide_increment_mm: [0.0; 2],
            spin_increment_rad: drive.spin_increment_rad,
            dt_s: drive.dt_s,
        };
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
                want_normal = Some(force.min(LARGEST_N));
            }
        }
        match drive.tangential {
            Tangential::SlideIncrementMm(slide) => motion.slide_increment_mm = slide,
            Tangential::FrictionN([x, y]) if x.is_finite() && y.is_finite() => {
                want_friction = Some([x, y].map(|f| f.clamp(-LARGEST_N, LARGEST_N)));
            }
            Tangential::FrictionN(_) => bad = Status::BAD_INPUT,
        }

        let mut search = Search { ends: [0.0, f32::INFINITY], last: [f32::NAN; 2] };
        let mut best = (f32::INFINITY, *state, Response::default(), motion);
        let mut stale = 0;
        for _ in 0..ROUNDS {
            let mut trial = *state;
            let mut response = step(self, &mut trial, motion);
            let mut error = 0.0f32;
            let mut lack = [0.0f32; 3];
            if let Some(target) = want_normal {
                lack[0] = target - response.normal_force_n;
                error = lack[0].abs() / target.max(1e-6);
            }
            if let (Some([x, y]), true) = (want_friction, motion.depth_mm > 0.0) {
                lack[1] = x - response.friction_n[0];
                lack[2] = y - response.friction_n[1];
                error = error.max(lack[1].abs().max(lack[2].abs()) / response.friction_limit_n);
            }
            let halves = error < 0.5 * best.0;
            stale = if halves { 0 } else { stale + 1 };
            if error <= CONTENT {
                *state = trial;
                response.status = response.status.with(bad);
                return Driven { response, motion };
            }
            if error < best.0 {
                best = (error, trial, response, motion);
            }
            if stale > STALE {
                break;
            }
            let mut deeper = 0.0;
            if want_normal.is_some() && motion.depth_mm > 0.0 {
                let plain = self.normal_at(motion.depth_mm);
                let next = if want_friction.is_some() { plain + lack[0] } else { search.next(plain, lack[0]) };
                deeper = self.depth_for_normal(next.max(0.1 * plain)) - motion.depth_mm;
            }
            if want_friction.is_some() && motion.depth_mm > 0.0 {
                let together = want_normal.is_some() && halves && error < NEAR;
                let (further, slide) = self.way_for(&trial, motion.slide_increment_mm, lack, deeper, together);
                deeper = further;
                // Only so far as the contact holds together: one slip length a round.
                let longest = response.friction_limit_n / self.stiffness_at(trial.depth);
                for (slide, more) in motion.slide_increment_mm.iter_mut().zip(slide) {
                    *slide += more.max(-longest).min(longest);
                }
            } else if deeper == 0.0 {
                break;
            }
            motion.depth_mm += deeper;
        }
        let (error, found, mut response, motion) = best;
        *state = found;
        if error > 1e-3 {
            bad = bad.with(Status::LOAD_NOT_REACHED);
        }
        response.status = response.status.with(bad);
        Driven { response, motion }
    }

    /// Change of depth and slide that change the forces (normal, x, y) by `lack`: Newton's step if they go `together`, else
    /// the depth as given. A step that went too far is shortened, so that the gradient is that of going on as it `went`, mm.
    fn way_for<const P: usize>(
        &self,
        state: &StateOf<M, P>,
        went: [f32; 2],
        lack: [f32; 3],
        deeper: f32,
        together: bool,
    ) -> (f32, [f32; 2]) {
        let sign = if went[0] * lack[1] + went[1] * lack[2] < 0.0 { -1.0 } else { 1.0 };
        let g = self.gradient(state, [deeper, sign * lack[1], sign * lack[2]]);
        let [[x_by_depth, a, b], [y_by_depth, c, d]] = g.friction_n_mm;
        let stiffness = self.stiffness_at(state.depth);
        let det = a * d - b * c;
        // A contact in full slip has no stiffness left; then the sticking one's shows the way.
        if !(det > 1e-3 * stiffness * stiffness) {
            return (deeper, [4.0 * lack[1] / stiffness, 4.0 * lack[2] / stiffness]);
        }
        let slide = |x: f32, y: f32| [(d * x - b * y) / det, (a * y - c * x) / det];
        let alone = slide(lack[1], lack[2]);
        if !together {
            return (deeper, alone);
        }
        // Depth with friction held by the slide.
        let [by_depth, by_x, by_y] = g.normal_n_mm;
        let back = slide(x_by_depth, y_by_depth);
        let stiffness = by_depth - by_x * back[0] - by_y * back[1];
        let newton = (lack[0] - by_x * alone[0] - by_y * alone[1]) / stiffness;
        let sound = stiffness > 0.2 * by_depth && (newton - deeper).abs() < 0.5 * deeper.abs() + 1e-3;
        let deeper = if sound { newton } else { deeper };
        (deeper, [alone[0] - back[0] * deeper, alone[1] - back[1] * deeper])
    }
}
