//! One step of a contact.
//!
//! Main function: [`Pad::step`]. Uses equilibrium and state.

use heapless::Vec;

use crate::math::Elementary;
use crate::step::rare;
use crate::{Motion, Regime, Response, Status};

use super::body::{InUnits, Sides, Surface, spread, steepness};
use super::equilibrium::{Acting, Awake, Equations, Frame, Placed, held};
use super::patch::{Compressed, flat_rate};
use super::state::{APART, PadState};
use super::vector::{Bulk, Mat3, Vec3, along, cross, dot, minus, plus, times, turned, turned_back, zeros};
use super::{Pad, Patch};

/// Depth below which there is no contact, mm.
const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Deepest depth and longest time that are in order, mm and s.
const LARGEST: f32 = 1e9;
/// Longest slide and largest spin of one step, mm and rad.
const LONGEST_STEP: f32 = 64.0;
/// Place of the origin of a plane from which on it is moved along, mm.
const FAR: f32 = 16.0;
/// Least mean square of the gaps within a patch, mm².
const LEAST_SPREAD_MM2: f32 = 1e-8;
/// From standard deviation to the place of one of six points.
const ROOT_3: f32 = 1.732_050_8;
/// Way that the skin of a patch may go in a step before patches that are asleep are looked at, mm.
const WAKE_MM: f32 = 0.15;
/// Longest arm of a patch about the pivot, mm.
const ARM_MM: f32 = 20.0;
/// Degrees to rad.
const RAD: f32 = core::f32::consts::PI / 180.0;
/// Stretch beyond the bound by which a patch slips: as share and in mm. Rounding of its place stays below.
const SLIPS: [f32; 2] = [1.0 + 4e-6, 4e-6];
/// Share of the strength by which the friction of a patch must change before it counts as growing or falling.
const NOTICED: f32 = 1e-6;
/// Used share of its strength beyond which a patch counts as slipping in part, for the regime.
const FIRM: f32 = 0.9;
/// Share of the area that sticks, so counted, in full stick at least and in full slip at most.
const STICKS: f32 = 0.95;
const SLIDES: f32 = 0.02;

/// Least mean square of the arms of a contact about its middle, mm².
const LEAST_ARM_MM2: f32 = 0.01;
/// Depth from which on the bands grow with depth, mm.
const DEEP_MM: f32 = 2.6;
/// Turn from the neutral pose at which half of what other poses add to the bands counts, rad.
const AWAY_RAD: f32 = 0.05;

impl<T: Elementary> Pad<'_, T> {
    /// Pitch from the neutral one and roll, rad, of a pose, held within what the pad was fitted for, and whether it was.
    pub(crate) fn tilt(&self, [pitch, roll]: [T; 2]) -> ([T; 2], bool) {
        let numbers = self.numbers;
        let within = |x: T, [least, most]: [T; 2]| if x < least { least } else { x.at_most(most) };
        let held =
            [within(pitch, numbers.pitch_range_deg), within(roll, [-numbers.roll_max_deg, numbers.roll_max_deg])];
        let rad = T::of(RAD);
        ([(held[0] - numbers.neutral_pitch_deg) * rad, held[1] * rad], held == [pitch, roll])
    }

    /// The point of the undeformed finger that a plane touches first in a pose (pitch and roll, degrees, held within those of the fit),
    /// along the axes of the finger, mm.
    pub fn first_touch_point_mm(&self, pose_deg: [T; 2]) -> [T; 3] {
        self.fitted_first_touch_point_mm(pose_deg).map(|x| x * self.units.length)
    }

    /// The same of the fitted finger.
    pub(crate) fn fitted_first_touch_point_mm(&self, pose_deg: [T; 2]) -> [T; 3] {
        let axes = axes(self.tilt(pose_deg).0);
        // The slope of the height over the plane's turn is the place along the plane.
        let step = 1.0 / 1024.0;
        let height = |axis: usize, by: f32| {
            let raw = plus(&axes[2], &times(&axes[axis], T::of(by)));
            let one = T::of(1.0) / dot(&raw, &raw).magnitude().sqrt();
            self.fitted_first_touch_mm(&times(&raw, one))
        };
        let along = [0, 1].map(|k| (height(k, step) - height(k, -step)) / T::of(2.0 * step));
        turned_back(&axes, &[along[0], along[1], self.fitted_first_touch_mm(&axes[2])])
    }

    /// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
    ///
    /// * `motion`: depth, slide and spin of the body. The depth counts along the normal, from where the plane through the body's apex
    ///   would first touch in the pose.
    /// * `pose_deg`: pitch and roll of the finger against the plane, at the end of the step
    ///
    /// Bad input is flagged and leaves its axis where it was. From the second step at rest on, state and answer keep their bits.
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
        self.units.response(self.fitted_step(state, &InUnits::new(body, &self.units), motion, pose_deg))
    }

    /// The same in the units of the fitted finger.
    #[inline(always)]
    fn fitted_step<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> Response<T> {
        if !state.is_consistent() {
            rare();
            state.forget();
            return Response { status: Status::MEMORY_LOST, ..Response::default() };
        }
        let (status, motion) = self.advance(state, body, motion, pose_deg);
        if !(state.depth >= T::of(TOUCH_MM)) || self.patches.len() > P {
            state.lift_off();
            return Response { status, ..Response::default() };
        }
        let start = state.bulk;
        state.foresee(motion);
        let equations = self.equations(state, body);
        let mut awake = Vec::<_, P>::new();
        self.wake(state, &equations, Wake::Near, &mut awake);
        let mut is_met = equations.solve(state, &mut awake);
        if self.moved_mm(&start, &state.bulk) > T::of(WAKE_MM) && self.may_touch(state, &awake, &start) {
            // A patch that was taken to be far.
            rare();
            self.wake(state, &equations, Wake::All, &mut awake);
            is_met = equations.solve(state, &mut awake);
        }
        state.drift = core::array::from_fn(|k| state.bulk[k] - start[k]);
        let travel = state.travel + self.moved_mm(&start, &state.bulk);
        let mut indices = awake.iter().map(|patch| patch.index).peekable();
        for (index, used) in state.used.iter_mut().enumerate() {
            if indices.next_if_eq(&index).is_none() {
                *used -= travel;
            }
        }
        let response = self.settle(state, &equations, &awake);
        // No contact bears so much: the memory was overwritten, and squares of such numbers overflow to infinity or NaN.
        let [x, y] = response.friction_n;
        let borne = response.normal_force_n + x.magnitude() + y.magnitude() + response.spin_moment_n_mm.magnitude();
        if !(borne <= T::of(LARGEST)) {
            state.forget();
            return Response { status: status.with(Status::MEMORY_LOST), ..Response::default() };
        }
        let status = if is_met { status } else { status.with(Status::NOT_CONVERGED) };
        Response { status, ..response }
    }

    /// Follows body and pose, and begins a contact.
    fn advance<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> (Status, [T; 6]) {
        let mut status = Status::OK;
        if !motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST) {
            rare();
            status = status.with(Status::BAD_TIME_STEP);
        }
        let (depth, tilt) = (state.depth, state.tilt);
        if motion.depth_mm.magnitude() <= T::of(LARGEST) {
            // Twice as deep as it was fitted it has gone through its own bone.
            state.depth = motion.depth_mm.at_most(T::of(2.0) * self.numbers.depth_max_mm);
        } else {
            rare();
            status = status.with(Status::BAD_INPUT);
        }
        if state.depth > self.numbers.depth_max_mm {
            status = status.with(Status::DEPTH_ABOVE_RANGE);
        }
        if pose_deg[0].is_number() && pose_deg[1].is_number() {
            let (tilt, known) = self.tilt(pose_deg);
            state.tilt = tilt;
            if !known {
                status = status.with(Status::POSE_OUT_OF_RANGE);
            }
        } else {
            rare();
            status = status.with(Status::BAD_INPUT);
        }
        let mut usual = |x: T| {
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
        let slide = motion.slide_increment_mm.map(&mut usual);
        let spin = usual(motion.spin_increment_rad);
        if slide != [T::of(0.0); 2] || spin != T::of(0.0) {
            state.carry(slide, spin);
            if body.is_plane()
                && (state.shift[0][0].magnitude() > T::of(FAR) || state.shift[1][0].magnitude() > T::of(FAR))
            {
                state.move_origin();
            }
        }
        let turned = (state.tilt[0] - tilt[0]).magnitude() + (state.tilt[1] - tilt[1]).magnitude();
        state.travel = (state.depth - depth).magnitude() + turned * T::of(ARM_MM);
        if !body.is_plane() {
            state.travel += slide[0].magnitude() + slide[1].magnitude() + spin.magnitude() * T::of(ARM_MM);
        }
        if state.depth >= T::of(TOUCH_MM) && !state.in_contact() {
            let frame = self.frame(state);
            state.touch();
            state.bulk = zeros();
            for ((patch, anchor), used) in self.patches.iter().zip(&mut state.anchors).zip(&mut state.used) {
                *anchor = foot(body, &frame.place(patch));
                *used = T::of(APART);
            }
            // The first step of a contact has no way behind it.
            state.drift = zeros();
        }
        let [x, y] = slide;
        (status, [state.depth - depth, x, y, spin, state.tilt[0] - tilt[0], state.tilt[1] - tilt[1]])
    }

    fn frame<const P: usize>(&self, state: &PadState<P, T>) -> Frame<T> {
        let [along, across, normal] = axes(state.tilt);
        let (sin, cos) = state.angle[0].sin_cos();
        let turned_axes =
            [plus(&times(&along, cos), &times(&across, sin)), minus(&times(&across, cos), &times(&along, sin)), normal];
        let [across_soft, along_soft] = self.numbers.law.softness;
        let soft =
            [times(&turned_axes[0], across_soft), times(&turned_axes[1], across_soft), times(&normal, along_soft)];
        let [x, y] = [state.shift[0][0], state.shift[1][0]];
        let height = self.fitted_first_touch_mm(&normal) - dot(&normal, &state.pivot) + state.depth;
        Frame { axes: turned_axes, soft, apex: [cos * x + sin * y, cos * y - sin * x, height], pivot: state.pivot }
    }

    /// Bound of the way of any patch between two states of the bulk, mm.
    fn moved_mm(&self, from: &Bulk<T>, to: &Bulk<T>) -> T {
        let way: Bulk<T> = core::array::from_fn(|k| to[k] - from[k]);
        // Half as much again for what is of second order.
        T::of(1.5) * self.numbers.reach * along(&way, &way).magnitude().sqrt()
    }

    /// Whether a patch that is asleep may touch now that the bulk has moved from `start`.
    fn may_touch<const P: usize>(&self, state: &PadState<P, T>, awake: &[Awake<'_, T>], start: &Bulk<T>) -> bool {
        let near = T::of(APART) + state.travel + self.moved_mm(start, &state.bulk);
        let mut indices = awake.iter().map(|patch| patch.index).peekable();
        let asleep = |(index, _): &(usize, &T)| indices.next_if_eq(index).is_none();
        state.used.iter().take(self.patches.len()).enumerate().filter(asleep).any(|(_, used)| !(*used > near))
    }

    pub(super) fn equations<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        body: &'a B,
    ) -> Equations<'a, T, B> {
        Equations {
            numbers: self.numbers,
            body,
            frame: self.frame(state),
            strength_factor: state.strength_factor * self.units.strength,
        }
    }

    /// Finds the patches that are to be looked at, in their order.
    pub(super) fn wake<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        equations: &Equations<'_, T, B>,
        which: Wake,
        awake: &mut Vec<Awake<'a, T>, P>,
    ) {
        let (frame, body) = (&equations.frame, equations.body);
        let near = T::of(APART + WAKE_MM) + state.travel;
        awake.clear();
        for (index, ((patch, anchor), used)) in self.patches.iter().zip(&state.anchors).zip(&state.used).enumerate() {
            if which == Wake::Near && !(*used <= near) {
                continue;
            }
            let mut placed = self.placed(patch, *anchor, frame, body);
            if *used >= T::of(APART) {
                // Where it is with the bulk as it was: apart it may be held anywhere.
                let moved = patch.modes.each_ref().map(|row| along(row, &state.bulk));
                let here = plus(&placed.place, &turned(&frame.soft, &moved));
                (placed.anchor, placed.inward) = held(body, foot(body, &here));
            }
            // There is room for all that a state has.
            let _ = awake.push(Awake { index, patch, placed, acting: Acting::nothing() });
        }
    }

    fn placed<B: Surface<T>>(&self, patch: &Patch<T>, anchor: [T; 2], frame: &Frame<T>, body: &B) -> Placed<T> {
        let place = frame.place(patch);
        let variance = if body.is_plane() {
            let along = spread_along(patch, &frame.axes[2]);
            dot(&along, &along)
        } else {
            spread(body, &place, &frame.sides(patch)).variance
        };
        let spread = (variance + T::of(LEAST_SPREAD_MM2)).magnitude().sqrt();
        let (anchor, inward) = held(body, anchor);
        Placed { compressed: Compressed::new(patch, spread, &self.numbers.law), place, anchor, inward }
    }

    /// Moves what slips or is apart, and sums up.
    fn settle<const P: usize, B: Surface<T>>(
        &self,
        state: &mut PadState<P, T>,
        equations: &Equations<'_, T, B>,
        awake: &[Awake<'_, T>],
    ) -> Response<T> {
        let law = &self.numbers.law;
        let zero = T::of(0.0);
        let (mut force, mut moment) = (zeros::<T, 3>(), zeros::<T, 3>());
        let (mut area, mut stuck, mut held, mut strength, mut reach) = (zero, zero, zero, zero, zero);
        let mut middle = zeros::<T, 3>();
        // Of a plane that turns against the spread of the gaps; finger's frame.
        let mut turning = zeros::<T, 3>();
        let apex = [equations.frame.apex[0], equations.frame.apex[1], zero];
        for Awake { index, patch, placed, acting } in awake {
            let (Some(anchor), Some(used)) = (state.anchors.get_mut(*index), state.used.get_mut(*index)) else {
                continue;
            };
            if !acting.touches {
                *anchor = foot(equations.body, &acting.place);
                *used = T::of(APART) - (acting.overlap + placed.compressed.spread);
                continue;
            }
            if *used >= T::of(APART) {
                // It was apart at the end of the last step.
                *anchor = [placed.anchor[0], placed.anchor[1]];
                *used = zero;
            }
            let now = acting.length / (acting.bound + T::of(f32::MIN_POSITIVE));
            let slips = acting.length > acting.bound * T::of(SLIPS[0]) + T::of(SLIPS[1]);
            if slips {
                let way = times(&acting.stretch, acting.bound / acting.length);
                *anchor = foot(equations.body, &plus(&acting.place, &way));
            }
            let now = now.at_most(T::of(1.0));
            let before = used.magnitude();
            let grows =
                now - before > T::of(NOTICED) || ((now - before).magnitude() <= T::of(NOTICED) && *used >= zero);
            // Shares that stick: for the ratio, and a narrower transition for the regime.
            let (share, firm) = if slips {
                (zero, zero)
            } else if grows {
                let beyond = (now - T::of(FIRM)).not_negative();
                (T::of(1.0) - slipping(now, law.onset), T::of(1.0) - beyond * T::of(1.0 / (1.0 - FIRM)))
            } else {
                (T::of(1.0), T::of(1.0))
            };
            *used = if grows { now } else { -now };
            let touching = placed.compressed.area(acting.below, law);
            area += touching;
            stuck += touching * share;
            held += touching * firm;
            strength += acting.strength;
            let on_skin = minus(&times(&acting.stretch, acting.grip), &times(&acting.inward, acting.force));
            let arm = plus(&acting.place, &apex);
            force = plus(&force, &on_skin);
            moment = plus(&moment, &cross(&arm, &on_skin));
            middle = plus(&middle, &times(&arm, acting.strength));
            reach += acting.strength * (arm[0] * arm[0] + arm[1] * arm[1]);
            // The spread of the gaps within the patch changes as the body turns against it, and the gaps' mean lies beside the middle.
            let energy = placed.compressed.energy(acting.overlap, acting.force, flat_rate(patch, law));
            let pull = energy.1 / placed.compressed.spread;
            if equations.body.is_plane() {
                // The normal through the second moment.
                let [xx, xy, yy, xz, yz, zz] = patch.spread_mm;
                let [a, b, c] = spread_along(patch, &equations.frame.axes[2]);
                turning = plus(&turning, &times(&[xx * a, xy * a + yy * b, xz * a + yz * b + zz * c], pull));
                continue;
            }
            let sides = equations.frame.sides(patch);
            let undeformed = spread(equations.body, &placed.place, &sides);
            let couple = spread(equations.body, &acting.place, &sides).moment;
            let by_spread = times(&undeformed.variance_slope, -pull);
            force = plus(&force, &by_spread);
            moment = plus(&moment, &cross(&plus(&placed.place, &apex), &by_spread));
            moment = minus(&moment, &plus(&times(&undeformed.variance_moment, pull), &times(&couple, acting.force)));
        }
        let turning = turned(&equations.frame.axes, &turning);
        moment = plus(&moment, &[-turning[1], turning[0], zero]);
        // Back from the body's axes to those of the plane.
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: &Vec3<T>| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]];
        let (force, moment) = (back(&force), back(&moment));
        let normal = force[2].not_negative();
        let some = strength + T::of(f32::MIN_POSITIVE);
        let friction = (force[0] * force[0] + force[1] * force[1]).magnitude().sqrt();
        // Friction and moment about the middle of the strength against an ellipse.
        let middle = back(&times(&middle, T::of(1.0) / some));
        let square = (reach / some - (middle[0] * middle[0] + middle[1] * middle[1])).not_negative();
        // Of a contact of one patch nothing is left but rounding.
        let arm = (square + T::of(LEAST_ARM_MM2)).magnitude().sqrt();
        let about_middle = moment[2] - (middle[0] * force[1] - middle[1] * force[0]);
        let (share, turning) = (friction / some, about_middle / (some * arm + T::of(1e-12)));
        let stick_ratio = if area > zero { stuck / area } else { zero };
        let in_contact = normal > zero;
        let (numbers, steepness) = (self.numbers, steepness(equations.body));
        let (away, deep) = (away(state.tilt), (state.depth - T::of(DEEP_MM)).not_negative());
        let added = [0, 1].map(|k| steepness * numbers.band_body[k] + deep * numbers.band_deep[k]);
        let band =
            |[neutral, other]: &[[T; 3]; 2]| parabola(neutral, stick_ratio) + away * parabola(other, stick_ratio);
        let [light, more] = numbers.band_light_n;
        let light = [0, 1].map(|k| light[k] + away * more[k]);
        let per_normal = T::of(1.0) / (normal + T::of(f32::MIN_POSITIVE));
        Response {
            normal_force_n: normal,
            friction_n: [force[0], force[1]],
            stick_ratio,
            friction_limit_n: strength,
            slip_margin: if in_contact {
                (T::of(1.0) - (share * share + turning * turning).magnitude().sqrt()).not_negative()
            } else {
                zero
            },
            spin_moment_n_mm: moment[2],
            pressure_centre_mm: if in_contact { [-moment[1] * per_normal, moment[0] * per_normal] } else { [zero; 2] },
            contact_area_mm2: area,
            band_normal_n: if in_contact { normal * (band(&numbers.band_normal) + added[0]) + light[0] } else { zero },
            band_friction_n: if in_contact {
                strength * (band(&numbers.band_friction) + added[1]) + light[1]
            } else {
                zero
            },
            regime: if !in_contact {
                Regime::NoContact
            } else if held >= T::of(STICKS) * area {
                Regime::Stick
            } else if held <= T::of(SLIDES) * area {
                Regime::Slip
            } else {
                Regime::PartialSlip
            },
            status: Status::OK,
        }
    }
}

impl<T: Elementary> Frame<T> {
    /// Place of an undeformed patch, body's frame, mm.
    #[inline(always)]
    fn place(&self, patch: &Patch<T>) -> Vec3<T> {
        minus(&turned(&self.axes, &minus(&patch.middle_mm, &self.pivot)), &self.apex)
    }

    /// Points beside the middle of a patch that have its second moment, three to either side, body's axes, mm.
    #[inline(always)]
    pub(super) fn sides(&self, patch: &Patch<T>) -> Sides<T> {
        let zero = T::of(0.0);
        let [xx, xy, yy, xz, yz, zz] = patch.spread_mm.map(|x| x * T::of(ROOT_3));
        [[xx, xy, xz], [zero, yy, yz], [zero, zero, zz]].map(|side| turned(&self.axes, &side))
    }
}

/// Which patches are looked at.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Wake {
    /// Those that touch or may touch in this step.
    Near,
    All,
}

/// Value of a parabola.
fn parabola<T: Elementary>(b: &[T; 3], x: T) -> T {
    b[0] + x * (b[1] + x * b[2])
}

/// How much of what other poses add to the bands counts: 0 in the neutral pose, 1 far from it.
fn away<T: Elementary>([pitch, roll]: [T; 2]) -> T {
    let turned = pitch * pitch + roll * roll;
    turned / (turned + T::of(AWAY_RAD * AWAY_RAD))
}

/// From the finger's axes to those of a plane against which it is pitched and rolled.
fn axes<T: Elementary>([pitch, roll]: [T; 2]) -> Mat3<T> {
    let ((ps, pc), (rs, rc)) = (pitch.sin_cos(), roll.sin_cos());
    [[pc, ps * rs, ps * rc], [T::of(0.0), rc, -rs], [-ps, pc * rs, pc * rc]]
}

/// Where a place is held that is not in contact: on the surface beside it.
#[inline(always)]
fn foot<T: Elementary>(body: &impl Surface<T>, place: &Vec3<T>) -> [T; 2] {
    let (overlap, inward) = body.overlap(place);
    [place[0] - overlap * inward[0], place[1] - overlap * inward[1]]
}

/// Standard deviations of the points of a patch along a direction, by the rows of the root of their second moment, mm.
#[inline(always)]
fn spread_along<T: Elementary>(patch: &Patch<T>, direction: &Vec3<T>) -> Vec3<T> {
    let [xx, xy, yy, xz, yz, zz] = patch.spread_mm;
    let [x, y, z] = direction;
    [xx * *x + xy * *y + xz * *z, yy * *y + yz * *z, zz * *z]
}

/// Share of a patch that slips under a growing load.
#[inline(always)]
pub(super) fn slipping<T: Elementary>(used: T, onset: T) -> T {
    (onset * (used + T::of(f32::MIN_POSITIVE)).ln()).exp()
}
