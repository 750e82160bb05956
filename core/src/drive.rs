//! Steps driven by forces instead of displacements.
//!
//! Main types: [`Drive`], [`Driven`]. Uses step, gradient.

use bytemuck::Pod;

use crate::memory::Memory;
use crate::model::Drivable;
use crate::{Gradient, ModelOf, Motion, Response, StateOf, Status};

/// Prescribed quantity along the plane's normal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Normal {
    /// Depth at the end of the step, mm.
    DepthMm(f32),
    /// Normal force at the end of the step, N.
    ForceN(f32),
}

/// Prescribed quantity in the plane.
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

/// Result of a driven step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Driven {
    /// The forces.
    pub response: Response,
    /// The motion that led to them.
    pub motion: Motion,
}

const ROUNDS: usize = 12;
/// Targets are limited to this force, which is out of reach, so that their squares are finite.
const LARGEST_N: f32 = 1e6;
/// Number of successive rounds without halving of the error after which the force counts as out of reach.
const STALE: u32 = 5;
/// The search for a normal force. Its variable is the normal force without shear, over which the normal force is almost linear.
struct Search {
    /// Bounds of the force without shear: one too small, one too large.
    ends: [f32; 2],
    /// The last force without shear and its error, N.
    last: [f32; 2],
}

impl Search {
    /// The next force without shear to try: by the secant through the last two, or the middle of the bounds if the secant leads beyond
    /// them.
    ///
    /// * `plain`, `lack`: present force without shear and the missing normal force, N
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
    /// The first attempt is no motion. It is accepted if the forces are within 4e-6 of the target (or of the limit), so that a constant load
    /// does not creep. Otherwise at most 12 rounds follow, each with one `step` on a copy: normal force alone by a bounded secant method over
    /// the force without shear; friction by Newton's method with the gradient; both together by Newton's method once the error is small. The
    /// search ends when five successive rounds do not halve the error.
    ///
    /// For a force out of reach (a normal force above that of the largest depth, friction above the limit) the result is the nearest state of
    /// the rounds, with [`Status::LOAD_NOT_REACHED`]. For a normal force of 0 or less the finger lifts off; for NaN it does not move.
    ///
    /// Mostly two or three rounds; 2200 to 6400 instructions when driven by normal force, more when driven by normal
    /// force and friction (counted over 512 steps each; the most where the force is out of reach).
    pub fn step_driven<const P: usize, R: Memory<M, P, f32> + Pod>(
        &self,
        state: &mut StateOf<M, P, f32, R>,
        drive: Drive,
    ) -> Driven {
        driven(self, state, drive)
    }
}

/// [`Drivable::step_driven`].
pub(crate) fn driven<S: Clone, F: Drivable<S>>(finger: &F, state: &mut S, drive: Drive) -> Driven {
    let mut motion = Motion {
        depth_mm: finger.depth_mm(state),
        slide_increment_mm: [0.0; 2],
        spin_increment_rad: drive.spin_increment_rad,
        dt_s: drive.dt_s,
    };
    // Not needed where no motion suffices.
    let mut known = None;
    let (mut want_normal, mut want_friction) = (None, None);
    let mut bad = Status::OK;
    match drive.normal {
        Normal::DepthMm(depth) => motion.depth_mm = depth,
        Normal::ForceN(force) if force.is_nan() => bad = Status::BAD_INPUT,
        Normal::ForceN(force) if force <= 0.0 => motion.depth_mm = motion.depth_mm.min(0.0),
        Normal::ForceN(force) => {
            if !finger.in_contact(state) {
                let scale = known.get_or_insert_with(|| finger.scale(state));
                motion.depth_mm = finger.depth_for_normal(scale, force);
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
    let mut best = (f32::INFINITY, state.clone(), Response::default(), motion);
    let mut stale = 0;
    for _ in 0..ROUNDS {
        let mut trial = state.clone();
        let mut response = finger.step(&mut trial, motion);
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
        if error <= F::CONTENT {
            *state = trial;
            response.status = response.status.with(bad);
            return Driven { response, motion };
        }
        if error < best.0 {
            best = (error, trial.clone(), response, motion);
        }
        if stale > STALE {
            break;
        }
        let mut deeper = 0.0;
        if want_normal.is_some() && motion.depth_mm > 0.0 {
            let scale = known.get_or_insert_with(|| finger.scale(state));
            let plain = finger.normal_at(scale, motion.depth_mm);
            let next = if want_friction.is_some() { plain + lack[0] } else { search.next(plain, lack[0]) };
            deeper = finger.depth_for_normal(scale, next.max(0.1 * plain)) - motion.depth_mm;
        }
        if want_friction.is_some() && motion.depth_mm > 0.0 {
            let together = want_normal.is_some() && F::together(error, halves);
            let scale = known.get_or_insert_with(|| finger.scale(state));
            let stiffness = finger.stiffness_at(scale, finger.depth_mm(&trial));
            let gradient = finger.gradient(&trial, further_on(motion.slide_increment_mm, lack, deeper));
            let (further, slide) = way_for(&gradient, stiffness, lack, deeper, together);
            deeper = further;
            // At most one slip length per round.
            let longest = response.friction_limit_n / stiffness;
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

/// The direction in which the motion goes on: that of the last one, `went`, mm, also where the step shortens that motion.
fn further_on(went: [f32; 2], lack: [f32; 3], deeper: f32) -> [f32; 3] {
    let sign = if went[0] * lack[1] + went[1] * lack[2] < 0.0 { -1.0 } else { 1.0 };
    [deeper, sign * lack[1], sign * lack[2]]
}

/// Change of depth and slide that changes the forces (normal, x, y) by `lack`: Newton's step if `together`, else with the depth as given.
fn way_for(g: &Gradient, stiffness: f32, lack: [f32; 3], deeper: f32, together: bool) -> (f32, [f32; 2]) {
    let [[x_by_depth, a, b], [y_by_depth, c, d]] = g.friction_n_mm;
    let det = a * d - b * c;
    // A contact in full slip has no stiffness; its stiffness in stick then gives the direction.
    if !(det > 1e-3 * stiffness * stiffness) {
        return (deeper, [4.0 * lack[1] / stiffness, 4.0 * lack[2] / stiffness]);
    }
    let slide = |x: f32, y: f32| [(d * x - b * y) / det, (a * y - c * x) / det];
    let alone = slide(lack[1], lack[2]);
    if !together {
        return (deeper, alone);
    }
    // Change of depth while the slide keeps friction constant.
    let [by_depth, by_x, by_y] = g.normal_n_mm;
    let back = slide(x_by_depth, y_by_depth);
    let stiffness = by_depth - by_x * back[0] - by_y * back[1];
    let newton = (lack[0] - by_x * alone[0] - by_y * alone[1]) / stiffness;
    let sound = stiffness > 0.2 * by_depth && (newton - deeper).abs() < 0.5 * deeper.abs() + 1e-3;
    let deeper = if sound { newton } else { deeper };
    (deeper, [alone[0] - back[0] * deeper, alone[1] - back[1] * deeper])
}
