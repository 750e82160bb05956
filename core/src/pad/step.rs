//! One step of a contact.
//!
//! Main function: [`Pad::step`]. Uses equilibrium and state.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use crate::math::Elementary;
use crate::relaxation::Perhaps;
use crate::step::rare;
use crate::{Motion, Response, Status};

use super::body::{InUnits, Sides, Surface, spread};
use super::equilibrium::{ActivePatch, Equations, Frame, PatchContact, PlacedPatch, Stiffening, anchor_at};
use super::memory::Memory;
use super::orthotropy::SkinAxis;
use super::patch::{Compressed, root_of_variance, spread_along};
use super::state::{APART, PadState};
use super::vector::{Bulk, along, zeros};
use super::{Pad, Patch};

/// Least depth of a contact, mm.
const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Largest valid magnitude of depth, mm, of the time step, s, and of a load, N or N mm.
const LARGEST: f32 = 1e9;
/// Longest slide and largest spin of one step, mm and rad.
const LONGEST_STEP: f32 = 64.0;
/// Distance from the finger at which the origin of a plane is moved to it, mm.
const FAR: f32 = 16.0;
/// Distance of the six quadrature points of a patch from its middle over the standard deviation of its points.
const ROOT_3: f32 = 1.732_050_8;
/// Patches within this distance from contact take part in a step, mm. If the skin moves farther in the step, the others are checked.
const NEARBY_MM: f32 = 0.15;
/// Largest distance of a patch from the centre of rotation, mm.
const FARTHEST_MM: f32 = 20.0;
/// A place whose overlap with the body shows whether it is another one, mm.
const PROBE_MM: [f32; 3] = [1.25, 0.5, -0.75];
/// Degrees to rad.
const RAD: f32 = core::f32::consts::PI / 180.0;

impl<T: Elementary> Pad<'_, T> {
    /// Pitch relative to the neutral one and roll, rad, clamped to the range of the fit; and whether the pose is within that range.
    pub(crate) fn tilt(&self, [pitch, roll]: [T; 2]) -> ([T; 2], bool) {
        let numbers = self.numbers;
        let within = |x: T, [least, most]: [T; 2]| if x < least { least } else { x.at_most(most) };
        let clamped =
            [within(pitch, numbers.pitch_range_deg), within(roll, [-numbers.roll_max_deg, numbers.roll_max_deg])];
        let rad = T::of(RAD);
        ([(clamped[0] - numbers.neutral_pitch_deg) * rad, clamped[1] * rad], clamped == [pitch, roll])
    }

    /// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
    ///
    /// * `motion`: depth, slide and spin of the body. The depth counts along the normal, from where the plane through the body's apex
    ///   would first touch in the pose.
    /// * `pose_deg`: pitch and roll of the finger relative to the plane at the end of the step
    ///
    /// Bad input sets a flag of [`Response::status`], and the coordinate keeps its value. From the second step at rest on, state and
    /// response are the same bit for bit.
    pub fn step<const P: usize, M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> Response<T> {
        let per_length = self.units.per_length;
        let motion = Motion {
            depth_mm: motion.depth_mm * per_length,
            slide_increment_mm: motion.slide_increment_mm.map(|slide| slide * per_length),
            ..motion
        };
        let blunt = self.blunted(body);
        let seen = InUnits::new(blunt.as_ref().unwrap_or(body), &self.units);
        let response = self.units.response(self.fitted_step(state, &seen, motion, pose_deg));
        let status = if blunt.is_some() { response.status.with(Status::BODY_TOO_SHARP) } else { response.status };
        Response { status, ..response }
    }

    /// [`Self::step`] in the units of the fitted finger.
    #[inline(always)]
    fn fitted_step<const P: usize, M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> Response<T> {
        if !state.is_consistent(self.patches.len()) {
            rare();
            state.reset(self.patches.len());
            return Response { status: Status::MEMORY_LOST, ..Response::default() };
        }
        let probe = body.overlap(&PROBE_MM.map(T::of).into()).0;
        if let Some(response) = state.resting_response()
            && probe == state.probe
            && self.is_without_motion(state, &motion, pose_deg)
        {
            return response;
        }
        let dt_s = motion.dt_s;
        let (status, motion, travel) = self.advance(state, body, motion, pose_deg);
        if let Some(memory) = state.memory.get() {
            let dt_s = if dt_s.is_between(f32::MIN_POSITIVE, LARGEST) { dt_s } else { T::of(0.0) };
            memory.clock.go_on(dt_s, &self.relaxation);
        }
        if !(state.depth >= T::of(TOUCH_MM)) {
            state.end_contact();
            let weights = state.memory.weights(&self.relaxation);
            self.remember(state, &weights, None, &[]);
            return Response { status, ..Response::default() };
        }
        let start = state.bulk;
        state.extrapolate(motion);
        let equations = self.equations(state, body);
        let shift = equations.frame.approach.shift;
        let mut travel = travel + (shift - state.approach).magnitude();
        state.approach = shift;
        if probe != state.probe {
            // Another body may touch any patch.
            travel = T::of(2.0 * FARTHEST_MM);
            state.probe = probe;
        }
        let mut active = Vec::<_, P>::new();
        self.collect_active(state, &equations, Candidates::Within(travel), &mut active);
        let mut evaluations = self.effort.evaluations;
        let mut converged = equations.solve(state, &mut active, &mut evaluations);
        if self.moved_mm(&start, &state.bulk) > T::of(NEARBY_MM) && self.may_touch(state, &active, &start, travel) {
            // A patch that was left out may touch.
            rare();
            self.collect_active(state, &equations, Candidates::All, &mut active);
            converged = equations.solve(state, &mut active, &mut evaluations);
        }
        state.drift = core::array::from_fn(|k| state.bulk[k] - start[k]);
        let travel = travel + self.moved_mm(&start, &state.bulk);
        let mut indices = active.iter().map(|patch| patch.index).peekable();
        for (index, reserve) in state.reserve.iter_mut().enumerate() {
            if indices.next_if_eq(&index).is_none() {
                *reserve -= travel;
            }
        }
        let sums = self.update_anchors_and_sum(state, &equations, &active);
        if equations.weights.get().is_some() {
            let stiffening = Stiffening::at(&self.numbers.squash, &state.bulk, &self.numbers.law);
            let pushes = core::array::from_fn(|k| state.bulk[k] + stiffening.direction[k] * stiffening.first);
            self.remember(state, &equations.weights, Some(&pushes), &active);
        }
        if !converged {
            // The next step may move the skin anywhere.
            state.reserve = state.reserve.map(|reserve| reserve.at_most(T::of(APART)));
        }
        let mut response = self.response(state, &equations, &sums);
        let still = |change: &[T]| change.iter().all(|x| *x == T::of(0.0));
        let mut rests = converged && status == Status::OK && still(&motion) && still(&state.drift) && !sums.is_changed;
        if let Some(memory) = state.memory.get() {
            if !rests {
                memory.unsettle();
            }
            rests &= memory.is_settled(&self.relaxation);
        }
        if rests {
            response.slip_margin_relaxed = response.slip_margin;
        }
        state.rest(rests.then_some(&response));
        // Such numbers mean that the memory was overwritten; their squares could overflow to infinity or NaN.
        let ([x, y], [about_x, about_y], [centre_x, centre_y]) =
            (response.friction_n, response.tilt_moment_n_mm, response.pressure_centre_mm);
        let signed = [response.normal_force_n, x, y, response.spin_moment_n_mm, about_x, about_y, centre_x, centre_y];
        let others = response.band_normal_n + response.band_friction_n + response.slip_margin;
        if !(signed.into_iter().fold(others, |sum, x| sum + x.magnitude()) <= T::of(LARGEST)) {
            state.reset(self.patches.len());
            return Response { status: status.with(Status::MEMORY_LOST), ..Response::default() };
        }
        let status = if converged { status } else { status.with(Status::NOT_CONVERGED) };
        Response { status, ..response }
    }

    /// Whether a motion changes nothing and sets no flag.
    fn is_without_motion<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        motion: &Motion<T>,
        pose_deg: [T; 2],
    ) -> bool {
        motion.slide_increment_mm == [T::of(0.0); 2]
            && motion.spin_increment_rad == T::of(0.0)
            && motion.depth_mm == state.depth
            && motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST)
            && self.tilt(pose_deg) == (state.tilt, true)
    }

    /// Moves body and pose, and begins a contact at first touch. Returns the motion: depth, slides (mm), spin, pitch and
    /// roll (rad); and an upper bound of the approach of the body to any patch, without its shift near first touch, mm.
    fn advance<const P: usize, M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> (Status, [T; 6], T) {
        let mut status = Status::OK;
        if !motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST) {
            rare();
            status = status.with(Status::BAD_TIME_STEP);
        }
        let (depth, tilt) = (state.depth, state.tilt);
        if motion.depth_mm.magnitude() <= T::of(LARGEST) {
            // At twice the depth of the fit a plane would have passed through the bone.
            state.depth = motion.depth_mm.at_most(T::of(2.0) * self.numbers.depth_max_mm);
        } else {
            rare();
            status = status.with(Status::BAD_INPUT);
        }
        if state.depth > self.numbers.depth_max_mm {
            status = status.with(Status::DEPTH_ABOVE_RANGE);
        }
        if pose_deg[0].is_number() && pose_deg[1].is_number() {
            let (tilt, in_range) = self.tilt(pose_deg);
            state.tilt = tilt;
            if !in_range {
                status = status.with(Status::POSE_OUT_OF_RANGE);
            }
        } else {
            rare();
            status = status.with(Status::BAD_INPUT);
        }
        let mut clamp = |x: T| {
            if x.magnitude() <= T::of(LONGEST_STEP) {
                return x;
            }
            rare();
            if !x.is_number() {
                status = status.with(Status::BAD_INPUT);
                return T::of(0.0);
            }
            status = status.with(Status::LARGE_INCREMENT);
            T::of(if x < T::of(0.0) { -LONGEST_STEP } else { LONGEST_STEP })
        };
        let slide = motion.slide_increment_mm.map(&mut clamp);
        let spin = clamp(motion.spin_increment_rad);
        if slide != [T::of(0.0); 2] || spin != T::of(0.0) {
            state.move_body(slide, spin, body.is_plane());
            if body.is_plane()
                && (state.shift[0][0].magnitude() > T::of(FAR) || state.shift[1][0].magnitude() > T::of(FAR))
            {
                state.move_origin();
            }
        }
        let rotated = (state.tilt[0] - tilt[0]).magnitude() + (state.tilt[1] - tilt[1]).magnitude();
        let mut travel = (state.depth - depth).magnitude() + rotated * T::of(FARTHEST_MM);
        if !body.is_plane() {
            travel += slide[0].magnitude() + slide[1].magnitude() + spin.magnitude() * T::of(FARTHEST_MM);
        }
        if state.depth >= T::of(TOUCH_MM) && !state.in_contact() {
            let frame = self.frame(state, body);
            state.touch();
            let weights = state.memory.weights(&self.relaxation);
            state.bulk = weights.get().map_or(zeros(), |w| w.bulk.map(|held| held / w.stiff));
            for ((patch, anchor), reserve) in self.patches.iter().zip(&mut state.anchors).zip(&mut state.reserve) {
                *anchor = closest_place(body, &frame.place(patch));
                *reserve = T::of(APART);
            }
            // The first step of a contact has no earlier change to extrapolate.
            state.drift = zeros();
        }
        let [x, y] = slide;
        (status, [state.depth - depth, x, y, spin, state.tilt[0] - tilt[0], state.tilt[1] - tilt[1]], travel)
    }

    /// Transformation from the finger's frame to that of the body.
    fn frame<const P: usize, M: Memory<P, T>>(&self, state: &PadState<P, T, M>, body: &impl Surface<T>) -> Frame<T> {
        let tilted = axes(state.tilt);
        let (sin, cos) = state.angle[0].sin_cos();
        let [along, across, normal] = [0, 1, 2].map(|k| tilted.row(k));
        let turned = [along * cos + across * sin, across * cos - along * sin, normal.into()];
        let [across_soft, along_soft] = self.numbers.law.softness;
        let soft = Matrix3::from_rows(&[turned[0] * across_soft, turned[1] * across_soft, normal * along_soft]);
        let (normal, pivot) = (normal.transpose(), Vector3::from(state.pivot));
        let [x, y] = [state.shift[0][0], state.shift[1][0]];
        let height = self.fitted_first_touch_mm(&normal) - normal.dot(&pivot) + state.depth;
        let approach = self.approach(state.depth, &tilted, &pivot, body);
        let apex = Vector3::new(cos * x + sin * y, cos * y - sin * x, height + approach.shift);
        Frame { axes: Matrix3::from_rows(&turned), soft, apex, pivot, approach }
    }

    /// Upper bound of the displacement of any patch between two states of the bulk, mm.
    fn moved_mm(&self, from: &Bulk<T>, to: &Bulk<T>) -> T {
        let change: Bulk<T> = core::array::from_fn(|k| to[k] - from[k]);
        // The factor 1.5 covers displacements of second order.
        T::of(1.5) * self.numbers.reach * along(&change, &change).magnitude().sqrt()
    }

    /// Whether a patch that was left out of the step may touch after the bulk has moved from `start` and the body by `travel`, mm.
    fn may_touch<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        active: &[ActivePatch<'_, T>],
        start: &Bulk<T>,
        travel: T,
    ) -> bool {
        let near = T::of(APART) + travel + self.moved_mm(start, &state.bulk);
        let mut indices = active.iter().map(|patch| patch.index).peekable();
        let asleep = |(index, _): &(usize, &T)| indices.next_if_eq(index).is_none();
        state.reserve.iter().take(self.patches.len()).enumerate().filter(asleep).any(|(_, reserve)| !(*reserve > near))
    }

    pub(super) fn equations<'a, const P: usize, B: Surface<T>, M: Memory<P, T>>(
        &'a self,
        state: &PadState<P, T, M>,
        body: &'a B,
    ) -> Equations<'a, P, T, B, M::Weights> {
        let (frame, weights) = (self.frame(state, body), state.memory.weights(&self.relaxation));
        let axis = self.orthotropy.is_some().then(|| {
            SkinAxis::new(&self.orthotropy, |axis| {
                // The skin turns with the bulk, as at the start of the search.
                let [_, _, _, turn @ ..] = self.numbers.rigid.each_ref().map(|row| along(row, &state.bulk));
                frame.axes * (axis + Vector3::from(turn).cross(&axis) * self.numbers.law.softness[0])
            })
        });
        Equations {
            numbers: self.numbers,
            body,
            // Near first touch the normal force is the patches' times the rate of approach.
            strength_factor: state.strength_factor * self.units.strength * frame.approach.rate,
            frame,
            tolerance: self.effort.tolerance,
            weights,
            axis,
        }
    }

    /// Collects the patches that take part in a step, in their order.
    pub(super) fn collect_active<'a, const P: usize, B: Surface<T>, M: Memory<P, T>>(
        &'a self,
        state: &PadState<P, T, M>,
        equations: &Equations<'_, P, T, B, M::Weights>,
        which: Candidates<T>,
        active: &mut Vec<ActivePatch<'a, T>, P>,
    ) {
        let (frame, body) = (&equations.frame, equations.body);
        active.clear();
        for (index, ((patch, anchor), reserve)) in
            self.patches.iter().zip(&state.anchors).zip(&state.reserve).enumerate()
        {
            if let Candidates::Within(travel) = which
                && !(*reserve <= T::of(APART + NEARBY_MM) + travel)
            {
                continue;
            }
            let mut placed = self.placed(patch, *anchor, frame, body);
            if *reserve >= T::of(APART) {
                // Without contact the patch has no anchor yet: it is the place below the present position of the skin.
                let moved = Vector3::from(patch.modes.each_ref().map(|row| along(row, &state.bulk)));
                let here = placed.place + frame.soft * moved;
                (placed.anchor, placed.inward) = anchor_at(body, closest_place(body, &here));
                if let Some(weights) = equations.weights.get() {
                    // The skin there is where its branches leave it.
                    let held = weights.across(index, &placed.inward) * (T::of(1.0) / weights.stiff);
                    (placed.anchor, placed.inward) = anchor_at(body, closest_place(body, &(placed.anchor + held)));
                }
            }
            // Cannot fail: the list has room for all patches of a state.
            let _ = active.push(ActivePatch { index, patch, placed, contact: PatchContact::without_contact() });
        }
    }

    /// Moves the memory of the tissue on to the end of a step.
    ///
    /// * `pushes`: relaxed force of the bulk over its coordinates; none in the air
    fn remember<const P: usize, M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        weights: &M::Weights,
        pushes: Option<&Bulk<T>>,
        active: &[ActivePatch<'_, T>],
    ) {
        let (Some(weights), Some(memory)) = (weights.get(), state.memory.get()) else { return };
        let per_stiff = T::of(1.0) / weights.stiff;
        // What does not touch comes back as its branches let go.
        let free = weights.bulk.map(|held| held * per_stiff);
        let mut active = active.iter().peekable();
        memory.move_on(&self.relaxation, pushes.unwrap_or(&free), self.patches.len(), |index| {
            let mut force = weights.normal(index) * per_stiff;
            let mut stretch = weights.across_of(index);
            if let Some(ActivePatch { contact, .. }) = active.next_if(|patch| patch.index == index) {
                force = contact.relaxed;
                if contact.touches {
                    // The length of a patch that slips ends at its bound.
                    let share = (contact.bound / contact.length).at_most(T::of(1.0));
                    stretch = [0, 1].map(|k| stretch[k] + share * contact.stretch[k]);
                }
            }
            let stretch = stretch.map(|x| x * per_stiff);
            (force, stretch)
        });
    }

    /// The quantities of a patch that are constant within a step.
    fn placed<B: Surface<T>>(&self, patch: &Patch<T>, anchor: [T; 2], frame: &Frame<T>, body: &B) -> PlacedPatch<T> {
        let place = frame.place(patch);
        let spread = if body.is_plane() {
            spread_along(patch, &frame.axes.row(2).transpose()).1
        } else {
            root_of_variance(spread(body, &place, &frame.sides(patch)).variance)
        };
        let (anchor, inward) = anchor_at(body, anchor);
        PlacedPatch { compressed: Compressed::new(patch, spread, &self.numbers.law), place, anchor, inward }
    }
}

impl<T: Elementary> Frame<T> {
    /// Position of an undeformed patch, body's frame, mm.
    #[inline(always)]
    fn place(&self, patch: &Patch<T>) -> Vector3<T> {
        self.axes * (Vector3::from(patch.middle_mm) - self.pivot) - self.apex
    }

    /// Quadrature points of a patch, with the same second moment; see [`Sides`].
    #[inline(always)]
    pub(super) fn sides(&self, patch: &Patch<T>) -> Sides<T> {
        let zero = T::of(0.0);
        let [xx, xy, yy, xz, yz, zz] = patch.spread_mm.map(|x| x * T::of(ROOT_3));
        [[xx, xy, xz], [zero, yy, yz], [zero, zero, zz]].map(|side| self.axes * Vector3::from(side))
    }
}

/// The patches that take part in a step.
pub(super) enum Candidates<T> {
    /// Those that touch or may touch where a body approaches any patch by this at most, mm.
    Within(T),
    /// All patches.
    All,
}

/// Rotation from the finger's axes to those of the plane, for pitch and roll in rad.
pub(crate) fn axes<T: Elementary>([pitch, roll]: [T; 2]) -> Matrix3<T> {
    let ((ps, pc), (rs, rc)) = (pitch.sin_cos(), roll.sin_cos());
    let zero = T::of(0.0);
    Matrix3::new(pc, ps * rs, ps * rc, zero, rc, -rs, -ps, pc * rs, pc * rc)
}

/// The point of the surface closest to a place, to first order: its x and y in the tangent plane.
#[inline(always)]
pub(super) fn closest_place<T: Elementary>(body: &impl Surface<T>, place: &Vector3<T>) -> [T; 2] {
    let (overlap, inward) = body.overlap(place);
    [place[0] - overlap * inward[0], place[1] - overlap * inward[1]]
}
