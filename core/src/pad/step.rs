//! One step of a contact.
//!
//! Main function: [`Pad::step`]. Uses equilibrium and state.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use crate::math::Elementary;
use crate::step::rare;
use crate::{Motion, Regime, Response, Status};

use super::body::{InUnits, Sides, Surface, spread, steepness};
use super::equilibrium::{ActivePatch, Equations, Frame, PatchContact, PlacedPatch, anchor_at};
use super::patch::{Compressed, flat_force_rate, root_of_variance, spread_along, times_spread};
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
/// A patch slips if its stretch exceeds the bound by this factor and by this length, mm. Both are above the rounding of its place.
const SLIPS: [f32; 2] = [1.0 + 4e-6, 4e-6];
/// Least fall of the friction of a patch below its largest value, over its strength, that counts as a decrease, and rise above its least
/// value that counts as an increase. It is above the error of equilibrium.
const NOTICED: f32 = 4e-3;
/// The same as a length of its stretch, over the largest depth; it counts where the bound is short.
const NOTICED_LENGTH: f32 = 5e-5;
/// Friction over strength from which on a patch counts as slipping in part, for the regime.
const FIRM: f32 = 0.9;
/// The regime is stick if at least this share of the area sticks, counted in this way,
const STICKS: f32 = 0.95;
/// and slip if at most this share does.
const SLIDES: f32 = 0.02;

/// Least mean square of the arms of a contact about its middle, mm².
const LEAST_ARM_MM2: f32 = 0.01;
/// Depth above which the bands grow with depth, mm.
const DEEP_MM: f32 = 2.6;
/// Angle from the neutral pose at which half of the addition for other poses is applied to the bands, rad.
const AWAY_RAD: f32 = 0.05;

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
    pub fn step<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
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
    fn fitted_step<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
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
        let (status, motion, travel) = self.advance(state, body, motion, pose_deg);
        if !(state.depth >= T::of(TOUCH_MM)) {
            state.end_contact();
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
        for (index, used) in state.used.iter_mut().enumerate() {
            if indices.next_if_eq(&index).is_none() {
                *used -= travel;
            }
        }
        let sums = self.update_anchors_and_sum(state, &equations, &active);
        if !converged {
            // The next step may move the skin anywhere.
            state.used = state.used.map(|used| used.at_most(T::of(APART)));
        }
        let response = self.response(state, &equations, &sums);
        let still = |change: &[T]| change.iter().all(|x| *x == T::of(0.0));
        let rests = converged && status == Status::OK && still(&motion) && still(&state.drift) && !sums.is_changed;
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
    fn is_without_motion<const P: usize>(&self, state: &PadState<P, T>, motion: &Motion<T>, pose_deg: [T; 2]) -> bool {
        motion.slide_increment_mm == [T::of(0.0); 2]
            && motion.spin_increment_rad == T::of(0.0)
            && motion.depth_mm == state.depth
            && motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST)
            && self.tilt(pose_deg) == (state.tilt, true)
    }

    /// Moves body and pose, and begins a contact at first touch. Returns the motion: depth, slides (mm), spin, pitch and
    /// roll (rad); and an upper bound of the approach of the body to any patch, without its shift near first touch, mm.
    fn advance<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
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
            state.move_body(slide, spin);
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
            state.bulk = zeros();
            for ((patch, anchor), used) in self.patches.iter().zip(&mut state.anchors).zip(&mut state.used) {
                *anchor = closest_place(body, &frame.place(patch));
                *used = T::of(APART);
            }
            // The first step of a contact has no earlier change to extrapolate.
            state.drift = zeros();
        }
        let [x, y] = slide;
        (status, [state.depth - depth, x, y, spin, state.tilt[0] - tilt[0], state.tilt[1] - tilt[1]], travel)
    }

    /// Transformation from the finger's frame to that of the body.
    fn frame<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> Frame<T> {
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
    fn may_touch<const P: usize>(
        &self,
        state: &PadState<P, T>,
        active: &[ActivePatch<'_, T>],
        start: &Bulk<T>,
        travel: T,
    ) -> bool {
        let near = T::of(APART) + travel + self.moved_mm(start, &state.bulk);
        let mut indices = active.iter().map(|patch| patch.index).peekable();
        let asleep = |(index, _): &(usize, &T)| indices.next_if_eq(index).is_none();
        state.used.iter().take(self.patches.len()).enumerate().filter(asleep).any(|(_, used)| !(*used > near))
    }

    pub(super) fn equations<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        body: &'a B,
    ) -> Equations<'a, T, B> {
        let frame = self.frame(state, body);
        Equations {
            numbers: self.numbers,
            body,
            // Near first touch the normal force is the patches' times the rate of approach.
            strength_factor: state.strength_factor * self.units.strength * frame.approach.rate,
            frame,
            tolerance: self.effort.tolerance,
        }
    }

    /// Collects the patches that take part in a step, in their order.
    pub(super) fn collect_active<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        equations: &Equations<'_, T, B>,
        which: Candidates<T>,
        active: &mut Vec<ActivePatch<'a, T>, P>,
    ) {
        let (frame, body) = (&equations.frame, equations.body);
        active.clear();
        for (index, ((patch, anchor), used)) in self.patches.iter().zip(&state.anchors).zip(&state.used).enumerate() {
            if let Candidates::Within(travel) = which
                && !(*used <= T::of(APART + NEARBY_MM) + travel)
            {
                continue;
            }
            let mut placed = self.placed(patch, *anchor, frame, body);
            if *used >= T::of(APART) {
                // Without contact the patch has no anchor yet: it is the place below the present position of the skin.
                let moved = Vector3::from(patch.modes.each_ref().map(|row| along(row, &state.bulk)));
                let here = placed.place + frame.soft * moved;
                (placed.anchor, placed.inward) = anchor_at(body, closest_place(body, &here));
            }
            // Cannot fail: the list has room for all patches of a state.
            let _ = active.push(ActivePatch { index, patch, placed, contact: PatchContact::without_contact() });
        }
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

    /// Moves the anchors of patches that slip or do not touch, and sums loads and areas over the patches.
    #[inline(always)]
    fn update_anchors_and_sum<const P: usize, B: Surface<T>>(
        &self,
        state: &mut PadState<P, T>,
        equations: &Equations<'_, T, B>,
        active: &[ActivePatch<'_, T>],
    ) -> Sums<T> {
        let law = &self.numbers.law;
        let zero = T::of(0.0);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let (mut friction, mut friction_spin) = (Vector3::zeros(), zero);
        let mut is_changed = false;
        let noticed_mm = T::of(NOTICED_LENGTH) * self.numbers.depth_max_mm;
        let (mut area, mut stuck_area, mut firm_area, mut strength, mut reach) = (zero, zero, zero, zero, zero);
        let (mut middle, mut turning) = (Vector3::zeros(), Vector3::zeros());
        let apex = Vector3::new(equations.frame.apex.x, equations.frame.apex.y, zero);
        // The bulk's softness stays along the body's axes when the body turns: along over across the normal.
        let [across_soft, along_soft] = law.softness;
        let (soft, stiff) = (along_soft / across_soft, across_soft / along_soft);
        for ActivePatch { index, patch, placed, contact } in active {
            let (Some(anchor), Some(used)) = (state.anchors.get_mut(*index), state.used.get_mut(*index)) else {
                continue;
            };
            let before = (*anchor, *used);
            if !contact.touches {
                *anchor = closest_place(equations.body, &contact.place);
                *used = T::of(APART) - (contact.overlap + placed.compressed.spread);
                is_changed |= before != (*anchor, *used);
                continue;
            }
            if *used >= T::of(APART) {
                // The patch did not touch at the end of the last step.
                *anchor = [placed.anchor[0], placed.anchor[1]];
                *used = zero;
            }
            let used_now = contact.length / (contact.bound + T::of(f32::MIN_POSITIVE));
            let slips = contact.length > contact.bound * T::of(SLIPS[0]) + T::of(SLIPS[1]);
            if slips {
                let to_anchor = contact.stretch * (contact.bound / contact.length);
                *anchor = closest_place(equations.body, &(contact.place + to_anchor));
            }
            let (used_now, used_before, grew) = (used_now.at_most(T::of(1.0)), used.magnitude(), *used >= zero);
            let beyond = if grew { used_before - used_now } else { used_now - used_before };
            let dead_band = T::of(NOTICED) * contact.bound + noticed_mm;
            let at_bound = (T::of(1.0) - used_now) * contact.bound <= dead_band;
            let grows = at_bound || grew != (beyond * contact.bound > dead_band);
            // Within the dead band the extreme value of this rise or fall remains.
            let used_now = if grows == grew && beyond > zero { used_before } else { used_now };
            // Stuck shares: for the stick ratio, and with a narrower transition for the regime.
            let (stuck_share, firm_share) = if slips {
                (zero, zero)
            } else if grows {
                let beyond = (used_now - T::of(FIRM)).not_negative();
                (T::of(1.0) - slipping(used_now, law.onset), T::of(1.0) - beyond * T::of(1.0 / (1.0 - FIRM)))
            } else {
                (T::of(1.0), T::of(1.0))
            };
            *used = if grows { used_now } else { -used_now };
            is_changed |= before != (*anchor, *used);
            let contact_area = placed.compressed.area(contact.below, law);
            area += contact_area;
            stuck_area += contact_area * stuck_share;
            firm_area += contact_area * firm_share;
            strength += contact.strength;
            let traction = contact.stretch * contact.grip;
            let on_skin = traction - contact.inward * contact.force;
            let arm = contact.place + apex;
            friction += traction;
            friction_spin += arm[0] * traction[1] - arm[1] * traction[0];
            force += on_skin;
            let moved = contact.place - placed.place;
            let tilting = (placed.place + apex).cross(&on_skin);
            let soft_tilting = Vector3::new(soft * moved.x, soft * moved.y, stiff * moved.z).cross(&on_skin);
            let spinning = arm[0] * on_skin[1] - arm[1] * on_skin[0];
            moment += Vector3::new(tilting.x + soft_tilting.x, tilting.y + soft_tilting.y, spinning);
            middle += arm * contact.strength;
            reach += contact.strength * (arm[0] * arm[0] + arm[1] * arm[1]);
            // The energy also depends on the spread of the gaps, which changes with the rotation of the body. On a curved body the mean
            // overlap adds a moment about the middle.
            let energy = placed.compressed.energy(contact.overlap, contact.force, flat_force_rate(patch, law));
            let pull = energy.1 / placed.compressed.spread;
            if equations.body.is_plane() {
                // The second moment times the normal.
                let (along, _) = spread_along(patch, &equations.frame.axes.row(2).transpose());
                turning += times_spread(patch, &along) * pull;
                continue;
            }
            let sides = equations.frame.sides(patch);
            let undeformed = spread(equations.body, &placed.place, &sides);
            let mean_moment = spread(equations.body, &contact.place, &sides).moment;
            let by_spread = undeformed.variance_slope * (-pull);
            force += by_spread;
            moment += (placed.place + apex).cross(&by_spread);
            moment -= undeformed.variance_moment * pull + mean_moment * contact.force;
        }
        Sums {
            force,
            moment,
            friction,
            friction_spin,
            turning,
            area,
            stuck_area,
            firm_area,
            strength,
            middle,
            reach,
            is_changed,
        }
    }

    /// The response of a contact with these sums over its patches.
    #[inline(always)]
    fn response<const P: usize, B: Surface<T>>(
        &self,
        state: &PadState<P, T>,
        equations: &Equations<'_, T, B>,
        sums: &Sums<T>,
    ) -> Response<T> {
        let Sums { friction_spin, area, stuck_area, firm_area, strength, reach, .. } = *sums;
        let zero = T::of(0.0);
        let Frame { axes, approach, .. } = &equations.frame;
        let (turning, arm) = (axes * sums.turning, axes * approach.arm);
        let [x, y, normal] = sums.force.into();
        let about = [arm[1] * normal - approach.shift * y, approach.shift * x - arm[0] * normal];
        let moment = sums.moment + Vector3::new(about[0] - turning.y, about[1] + turning.x, zero);
        let force = Vector3::new(x, y, normal * approach.rate);
        // From the body's axes to those of the plane.
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: &Vector3<T>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let (force, moment, friction) = (back(&force), back(&moment), back(&sums.friction));
        let (normal, in_contact) = (force[2], area > zero);
        let pressing = normal.not_negative();
        let strength_or_tiny = strength + T::of(f32::MIN_POSITIVE);
        let resultant = friction.dot(&friction).magnitude().sqrt();
        // The slip margin compares friction, and its moment about the centre of the strengths, with an ellipse.
        let middle = back(&(sums.middle * (T::of(1.0) / strength_or_tiny)));
        let square = (reach / strength_or_tiny - (middle[0] * middle[0] + middle[1] * middle[1])).not_negative();
        // With one patch in contact the difference is rounding only.
        let arm = (square + T::of(LEAST_ARM_MM2)).magnitude().sqrt();
        let about_middle = friction_spin - (middle[0] * friction[1] - middle[1] * friction[0]);
        let (share, turning) = (resultant / strength_or_tiny, about_middle / (strength_or_tiny * arm + T::of(1e-12)));
        let stick_ratio = if in_contact { stuck_area / area } else { zero };
        let (numbers, steepness) = (self.numbers, steepness(equations.body));
        let (away, deep) = (away(state.tilt), (state.depth - T::of(DEEP_MM)).not_negative());
        let added = [0, 1].map(|k| steepness * numbers.band_body[k] + deep * numbers.band_deep[k]);
        let band =
            |[neutral, other]: &[[T; 3]; 2]| parabola(neutral, stick_ratio) + away * parabola(other, stick_ratio);
        let [light, more] = numbers.band_light_n;
        let light = [0, 1].map(|k| light[k] + away * more[k]);
        let per_normal = if pressing > zero { T::of(1.0) / pressing } else { zero };
        Response {
            normal_force_n: normal,
            friction_n: [force[0], force[1]],
            tangential_friction_n: [friction[0], friction[1]],
            stick_ratio,
            friction_limit_n: strength,
            slip_margin: if in_contact {
                (T::of(1.0) - (share * share + turning * turning).magnitude().sqrt()).not_negative()
            } else {
                zero
            },
            spin_moment_n_mm: moment[2],
            tilt_moment_n_mm: [moment[0], moment[1]],
            pressure_centre_mm: [-moment[1] * per_normal, moment[0] * per_normal],
            contact_area_mm2: area,
            band_normal_n: if in_contact {
                (pressing * (band(&numbers.band_normal) + added[0]) + light[0]).not_negative()
            } else {
                zero
            },
            band_friction_n: if in_contact {
                (strength * (band(&numbers.band_friction) + added[1]) + light[1]).not_negative()
            } else {
                zero
            },
            regime: if !in_contact {
                Regime::NoContact
            } else if firm_area >= T::of(STICKS) * area {
                Regime::Stick
            } else if firm_area <= T::of(SLIDES) * area {
                Regime::Slip
            } else {
                Regime::PartialSlip
            },
            status: Status::OK,
        }
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

/// Sums over the patches in contact, along the axes of the body and about the centre of rotation of poses.
struct Sums<T> {
    /// Force on the skin, N.
    force: Vector3<T>,
    /// Its moment, N mm.
    moment: Vector3<T>,
    /// Its part along the surface, N, and the moment of that about the normal, N mm.
    friction: Vector3<T>,
    friction_spin: T,
    /// Moment of a plane due to the spread of the gaps, which changes with its rotation; finger's frame, N mm.
    turning: Vector3<T>,
    /// Area in contact, its stuck part, and its stuck part as counted for the regime, mm².
    area: T,
    stuck_area: T,
    firm_area: T,
    /// Strength, N, and its first and second moment about the centre of rotation, N mm and N mm².
    strength: T,
    middle: Vector3<T>,
    reach: T,
    /// Whether the state of a patch is another one than before the step.
    is_changed: bool,
}

/// The patches that take part in a step.
pub(super) enum Candidates<T> {
    /// Those that touch or may touch where a body approaches any patch by this at most, mm.
    Within(T),
    /// All patches.
    All,
}

/// Value of a parabola b[0] + b[1] x + b[2] x².
fn parabola<T: Elementary>(b: &[T; 3], x: T) -> T {
    b[0] + x * (b[1] + x * b[2])
}

/// Factor of the addition for other poses to the bands: 0 in the neutral pose, 1 far from it.
fn away<T: Elementary>([pitch, roll]: [T; 2]) -> T {
    let rotated = pitch * pitch + roll * roll;
    rotated / (rotated + T::of(AWAY_RAD * AWAY_RAD))
}

/// Rotation from the finger's axes to those of the plane, for pitch and roll in rad.
pub(super) fn axes<T: Elementary>([pitch, roll]: [T; 2]) -> Matrix3<T> {
    let ((ps, pc), (rs, rc)) = (pitch.sin_cos(), roll.sin_cos());
    let zero = T::of(0.0);
    Matrix3::new(pc, ps * rs, ps * rc, zero, rc, -rs, -ps, pc * rs, pc * rc)
}

/// The point of the surface closest to a place, to first order: its x and y in the tangent plane.
#[inline(always)]
fn closest_place<T: Elementary>(body: &impl Surface<T>, place: &Vector3<T>) -> [T; 2] {
    let (overlap, inward) = body.overlap(place);
    [place[0] - overlap * inward[0], place[1] - overlap * inward[1]]
}

/// Slipping share of a patch under growing load.
///
/// * `used`: friction over strength
#[inline(always)]
pub(super) fn slipping<T: Elementary>(used: T, onset: T) -> T {
    (onset * (used + T::of(f32::MIN_POSITIVE)).ln()).exp()
}
