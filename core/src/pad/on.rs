//! A pad on a body in a pose: what a bed can do in its own pose, driven by forces, with gradient and least grip.
//!
//! Main type: [`PadOn`]. Uses step and drive.

use bytemuck::Pod;

use crate::drive::driven;
use crate::math::{Elementary, Scalar, sqrt};
use crate::model::{Drivable, FingerModel};
use crate::{Drive, Driven, Error, Gradient, Grip, Motion, Normal, Response, Status, Tangential, Tuning};

use super::memory::Memory;
use super::{Effort, Pad, PadState, Surface};

/// A pad on a body in a pose, driven by depth, slide and spin alone.
#[derive(Clone, Copy, Debug)]
pub struct PadOn<'a, B> {
    /// The pad.
    pub pad: Pad<'a>,
    /// The body.
    pub body: &'a B,
    /// Pitch and roll of the finger, degrees.
    pub pose_deg: [f32; 2],
}

/// Equilibrium of the steps in a search: forces to about 1e-5.
const EXACT: Effort = Effort { evaluations: 200, tolerance: 1e-5 };
/// Half the motion between two forces of a derivative, mm, and the motion before, in the direction that is to be continued.
const SMALL_MM: f32 = 2e-3;
const AHEAD: f32 = 2.0;
/// A strength factor at which everything sticks.
const STICKS: f32 = 5.0;
/// Exponent of the normal force over depth, about.
const EXPONENT: f32 = 1.7;
/// Depth at which the scale of a finger in the air is taken, over the largest one.
const SCALE_DEPTH: f32 = 0.3;
/// Halvings of the depth range in the search for the least grip, and the longest step of a press, mm.
const HALVINGS: usize = 12;
const PRESS_MM: f32 = 0.1;
/// Parts of the load in which the slide after a press takes it up.
const SLIDES: u32 = 5;
const DT_S: f32 = 1e-3;

/// Depth, mm, the normal force there, N, and the stiffness of friction while everything sticks, N/mm.
pub struct Scale {
    depth_mm: f32,
    normal_n: f32,
    stiffness_n_mm: f32,
}

fn power(base: f32, exponent: f32) -> f32 {
    Elementary::exp(exponent * Elementary::ln(base))
}

impl<'a, B: Surface<f32>> PadOn<'a, B> {
    /// The same with more exact steps.
    fn exact(&self) -> Self {
        Self { pad: self.pad.with_effort(EXACT), ..*self }
    }

    /// A finger without contact. On a curved body it turns about the point above the apex.
    fn in_the_air<const P: usize, M: Memory<P, f32>>(&self) -> Result<PadState<P, f32, M>, Error> {
        if self.body.is_plane() { PadState::fresh(&self.pad) } else { PadState::fresh_over(&self.pad, self.pose_deg) }
    }

    /// Forces after a motion from a state: normal force, friction x and y, N.
    fn forces<const P: usize, M: Memory<P, f32> + Pod>(
        &self,
        state: &PadState<P, f32, M>,
        [deeper, x, y]: [f32; 3],
    ) -> [f32; 3] {
        let mut moved = *state;
        let depth_mm = self.pad.depth_mm(state) + deeper;
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad: 0.0, dt_s: DT_S };
        let Response { normal_force_n, friction_n: [x, y], .. } = self.step(&mut moved, motion);
        [normal_force_n, x, y]
    }

    /// The least depth and normal force at which friction of `load_n` leaves a slip margin of at least `margin` after a press and a slide to
    /// the load, even if the limit of the finger is below that of the pad by the half-width of its 95 % band of friction.
    ///
    /// * `load_n`: friction that the contact has to carry, N
    /// * `margin`: share of the limit kept in reserve, 0 to 0.95 (moved into that range)
    /// * `strength_factor`: as in [`PadState::set_strength_factor`]
    ///
    /// By bisection to 1 part in 4096 of the depth range, rounded up. Each depth takes a press of many steps and a slide in
    /// five driven ones: for hosts, and for controllers that plan.
    pub fn least_grip<const P: usize>(&self, load_n: [f32; 2], margin: f32, strength_factor: f32) -> Grip {
        let deepest = self.pad.depth_max_mm();
        let [x, y] = load_n;
        let size = sqrt(x * x + y * y);
        let fresh = self.in_the_air::<P, ()>();
        let (true, Ok(fresh)) = (size <= f32::MAX && margin.is_finite() && strength_factor.is_finite(), fresh) else {
            return Grip { status: Status::BAD_INPUT, depth_mm: deepest, ..Grip::default() };
        };
        if size == 0.0 {
            return Grip::default();
        }
        let share = 1.0 - margin.clamp(0.0, 0.95);
        let loaded = |depth: f32| -> (bool, Grip) {
            let mut state = fresh;
            state.set_strength_factor(strength_factor);
            let presses = (depth / PRESS_MM) as u32 + 1;
            for k in 1..=presses {
                let depth_mm = depth * (k as f32 / presses as f32);
                self.step(&mut state, Motion { depth_mm, dt_s: DT_S, ..Motion::default() });
            }
            let mut r = Response::default();
            for k in 1..=SLIDES {
                let load_n = load_n.map(|part| part * (k as f32 / SLIDES as f32));
                let drive = Drive {
                    normal: Normal::DepthMm(depth),
                    tangential: Tangential::FrictionN(load_n),
                    spin_increment_rad: 0.0,
                    dt_s: DT_S,
                };
                r = self.step_driven(&mut state, drive).response;
            }
            let kept = 1.0 - r.band_friction_n / (r.friction_limit_n + f32::MIN_POSITIVE);
            let holds = !r.status.contains(Status::LOAD_NOT_REACHED) && r.slip_margin >= 1.0 - share * kept;
            (holds, Grip { depth_mm: depth, normal_force_n: r.normal_force_n, status: r.status })
        };
        let (holds, mut best) = loaded(deepest);
        if !holds {
            return Grip { status: best.status.with(Status::LOAD_NOT_REACHED), ..best };
        }
        let (mut low, mut high) = (0.0, deepest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let (holds, grip) = loaded(middle);
            if holds {
                (high, best) = (middle, grip);
            } else {
                low = middle;
            }
        }
        best
    }
}

impl<B: Surface<f32>, const P: usize, M: Memory<P, f32> + Pod> FingerModel<PadState<P, f32, M>> for PadOn<'_, B> {
    fn fresh(&self) -> Result<PadState<P, f32, M>, Error> {
        self.in_the_air()
    }
    fn step(&self, state: &mut PadState<P, f32, M>, motion: Motion) -> Response {
        self.pad.step(state, self.body, motion, self.pose_deg)
    }
    fn in_contact(&self, state: &PadState<P, f32, M>) -> bool {
        state.in_contact()
    }
    fn depth_mm(&self, state: &PadState<P, f32, M>) -> f32 {
        self.pad.depth_mm(state)
    }
    fn depth_max_mm(&self) -> f32 {
        self.pad.depth_max_mm()
    }
    fn set_strength_factor(&self, state: &mut PadState<P, f32, M>, factor: f32) -> f32 {
        state.set_strength_factor(factor)
    }
    fn tuned(&self, tuning: Tuning) -> Result<Self, Error> {
        Ok(Self { pad: self.pad.tuned(tuning)?, ..*self })
    }
    fn save(&self, state: &PadState<P, f32, M>, model: u32, out: &mut [u8]) -> Result<usize, Error> {
        state.write_bytes(model, out)
    }
    fn restore(&self, model: u32, bytes: &[u8]) -> Result<PadState<P, f32, M>, Error> {
        PadState::read_bytes(model, bytes)
    }
}

impl<B: Surface<f32>, const P: usize, M: Memory<P, f32> + Pod> Drivable<PadState<P, f32, M>> for PadOn<'_, B> {
    const CONTENT: f32 = 1e-4;
    type Scale = Scale;

    fn together(error: f32, _: bool) -> bool {
        error < 1.0
    }
    fn scale(&self, state: &PadState<P, f32, M>) -> Scale {
        let mut pressed = *state;
        if !state.in_contact() {
            let depth_mm = SCALE_DEPTH * self.pad.depth_max_mm();
            self.step(&mut pressed, Motion { depth_mm, dt_s: DT_S, ..Motion::default() });
        }
        pressed.set_strength_factor(STICKS);
        let [normal, x, y] = self.forces(&pressed, [0.0; 3]);
        let [_, further, aside] = self.forces(&pressed, [0.0, SMALL_MM, 0.0]);
        let change = (further - x).magnitude() + (aside - y).magnitude();
        Scale {
            depth_mm: self.pad.depth_mm(&pressed),
            normal_n: normal.max(1e-6),
            stiffness_n_mm: (change / SMALL_MM).max(1e-3),
        }
    }
    fn normal_at(&self, scale: &Scale, depth_mm: f32) -> f32 {
        scale.normal_n * power((depth_mm / scale.depth_mm).max(1e-6), EXPONENT)
    }
    fn depth_for_normal(&self, scale: &Scale, force_n: f32) -> f32 {
        let depth = scale.depth_mm * power((force_n / scale.normal_n).max(1e-9), 1.0 / EXPONENT);
        depth.min(self.pad.depth_max_mm())
    }
    fn stiffness_at(&self, scale: &Scale, _: f32) -> f32 {
        scale.stiffness_n_mm
    }

    /// By differences of seven steps.
    fn gradient(&self, state: &PadState<P, f32, M>, direction: [f32; 3]) -> Gradient {
        if !state.in_contact() {
            return Gradient::default();
        }
        let exact = self.exact();
        let direction = direction.map(|d| if d.is_finite() { d } else { 0.0 });
        let length = sqrt(direction.iter().map(|d| d * d).sum());
        let mut base = *state;
        if length > 0.0 {
            let [deeper, x, y] = direction.map(|d| d / length * (AHEAD * SMALL_MM));
            let depth_mm = self.pad.depth_mm(state) + deeper;
            let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad: 0.0, dt_s: DT_S };
            exact.step(&mut base, motion);
        } else {
            base.set_strength_factor(STICKS);
        }
        let mut gradient = Gradient::default();
        for axis in 0..3 {
            let at = |by: f32| exact.forces(&base, core::array::from_fn(|k| if k == axis { by } else { 0.0 }));
            let (more, less) = (at(SMALL_MM), at(-SMALL_MM));
            let [normal, x, y] = core::array::from_fn(|k| (more[k] - less[k]) / (2.0 * SMALL_MM));
            gradient.normal_n_mm[axis] = normal;
            (gradient.friction_n_mm[0][axis], gradient.friction_n_mm[1][axis]) = (x, y);
        }
        gradient
    }

    /// A finger in the air is pressed first, and then loaded along the body: the step in which it touches has no friction yet.
    fn step_driven(&self, state: &mut PadState<P, f32, M>, drive: Drive) -> Driven {
        let exact = self.exact();
        if !state.in_contact() && matches!(drive.tangential, Tangential::FrictionN(_)) {
            driven(&exact, state, Drive { tangential: Tangential::SlideIncrementMm([0.0; 2]), ..drive });
        }
        driven(&exact, state, drive)
    }
}
