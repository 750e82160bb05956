//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, spring, stick_ratio and math.

use crate::at_depth::AtDepth;
use crate::math::{Arithmetic, Scalar, add};
use crate::rescaling::Scaling;
use crate::rolling::Rolled;
use crate::spring::{Limit, NOTHING, Odd, Sums};
use crate::stick_ratio::{Course, Way, led, regime_of, share_of_way};
use crate::table::Row;
use crate::{DataOf, ModelOf, Motion, Regime, Response, StateOf, Status};

/// Longest slide in one step, mm, and largest angle, rad: beyond full slip of every spring, so that a cut loses nothing.
const SLIDE_MAX_MM: f32 = 64.0;
const SPIN_MAX_RAD: f32 = 8.0;
/// Depth below which there is no contact, mm.
pub(crate) const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Deepest depth and longest time that are in order, mm and s.
const LARGEST: f32 = 1e9;

/// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
///
/// A bed of springs (the method of dimensionality reduction: Popov & Heß 2015), each held on the plane at an anchor a_j:
///
/// ```text
/// X = x + C(d)          u_j = (X − y_j theta, Y + x_j theta) − a_j
/// F_x = kx(d) Σ k_j (u_jx − q u_jx²)          F_y = ky(d) Σ k_j u_jy          M_z = Σ (x_j F_jy − y_j F_jx)
/// N = N0(d) + C' F_x + Σ k_j [kx' (u_jx²/2 − q u_jx³/3) + ky' u_jy²/2]
/// (u_jx − alpha R_j)² + (u_jy r/s)² <= R_j(d)² (1 + alpha²), else a_j slips along the friction
/// ```
///
/// with N0, kx, ky, C, alpha, s and R_j from tables over depth and r = ky/kx. R_j is 0 to the depth at which spring j
/// touches: it touches without force and has lost all its force by slip when it leaves. x_j, y_j are 0 without spin, for
/// which a spring is a pair.
///
/// The stiffness shares k_j do not depend on depth, so that a change of depth keeps displacements and forces alike, and the
/// contact remembers nothing but its anchors: a cycle of depth is forgotten after once, as each spring then fits into its
/// smallest limit. N, F and M_z are the derivatives of one energy; anchors move only with F · da >= 0; a change of strength
/// changes R_j alone. That is why no motion yields work ([`DataOf::check`]).
///
/// q is given for the fitted strength and scales with one over the strength factor, so that friction in full slip is
/// proportional to the factor in every direction.
///
/// Bad input is flagged and leaves the axis where it was; see [`Status`]. The stick ratio is in `stick_ratio.rs`.
///
/// No creep: with the motion at rest the state keeps its bits, and increments that add up to nothing lead back. Leaves out:
/// rate, dwell and moisture other than through [`StateOf::set_strength_factor`].
#[inline(always)]
pub fn step<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    state: &mut StateOf<M, P, T>,
    motion: Motion<T>,
) -> Response<T> {
    let begun = match begin(model, state, motion) {
        Ok(begun) => begun,
        Err(in_the_air) => return in_the_air,
    };
    end(model, state, &begun)
}

/// A step up to where its springs move.
pub(crate) struct Begun<'a, const M: usize, T> {
    pub(crate) at: AtDepth<'a, M, T>,
    /// Where the springs are carried: slide and what pressing amounts to, mm, and angle, rad.
    pub(crate) here: [T; 3],
    pub(crate) way: Way<T>,
    pub(crate) status: Status,
}

/// Moves the plane and reads the tables; a contact in the air is answered at once.
#[inline(always)]
pub(crate) fn begin<'a, const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    model: &ModelOf<'a, M, N, S, T>,
    state: &mut StateOf<M, P, T>,
    motion: Motion<T>,
) -> Result<Begun<'a, M, T>, Response<T>> {
    let (data, scale) = (model.data, &model.scale);
    let mut status = Status::OK;
    let mut depth = motion.depth_mm;
    if !(depth.is_between(TOUCH_MM, LARGEST) & motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST)) {
        rare();
        status = doubt(depth, motion.dt_s);
        if status.contains(Status::BAD_INPUT) {
            depth = state.depth;
        }
        if !(depth >= T::of(TOUCH_MM)) {
            return Err(in_the_air(state, motion, status));
        }
    }
    if S::POSED && !(depth - scale.touch() >= T::of(TOUCH_MM)) {
        return Err(in_the_air(state, motion, status));
    }
    let at = AtDepth::look_up(model, state, depth, &mut status);
    let fresh = !state.in_contact();
    move_plane(model, state, motion, at.press_slide, &mut status);
    state.depth = at.depth;
    let slid = [state.position[0][0], state.position[0][1], state.angle[0]];
    let [press_x, press_y] = at.press_slide;
    let here = [slid[0] + press_x, slid[1] + press_y, slid[2]];
    if fresh {
        touch(state, here, data, scale);
        state.turn = slid;
        state.reached = slid;
        state.rolled = Rolled::at(scale.pressure_place(), [slid[0], slid[1]]);
    }
    if S::POSED && !state.rolled.is_at(scale.pressure_place()) {
        roll(state, model, &at, here);
    }
    if S::POSED && P > 1 && motion.spin_increment_rad.is_number() {
        carry_round(state, here, motion.spin_increment_rad, data, scale);
    }
    let course =
        Course { here: slid, limit: at.limit, stiffness: at.stiffness[0], gyration_mm: scale.length(data.gyration) };
    let way = Way::follow(state, &course, |state| {
        let place = place_of::<P, T>(here, data.springs[0].place::<P, S>(0, scale));
        let [x, y] = state.anchor[0][0];
        [place[0] - x, place[1] - y]
    });
    Ok(Begun { at, here, way, status })
}

/// Moves the springs and answers. The last guard: a memory that holds what is no number, which no step leaves behind, is
/// forgotten, and the answer is a contact of which nothing is known.
#[inline(always)]
pub(crate) fn end<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    state: &mut StateOf<M, P, T>,
    begun: &Begun<'_, M, T>,
) -> Response<T> {
    let at = &begun.at;
    let mut load = carry(model, &mut state.anchor, at, begun.here, &begun.way);
    let mut status = begun.status;
    if !(load.normal + load.friction[1]).is_number() {
        rare();
        status = status.with(Status::MEMORY_LOST);
        let none = T::of(0.0);
        load = Load { normal: none, friction: [none; 2], moment: [none; 2], stick_ratio: none };
        begin_anew(state);
    }
    let mut response = answer::<M, N, P, T, S>(model, at, &load);
    response.regime = regime_of(load.stick_ratio);
    response.status = status.with(model.scale.status());
    response
}

/// What a contact bears.
#[derive(Clone, Copy)]
pub(crate) struct Load<T> {
    /// N.
    pub(crate) normal: T,
    pub(crate) friction: [T; 2],
    /// What the forces along x and y add to the moment, over the stiffness, mm²; 0 without spin.
    moment: [T; 2],
    pub(crate) stick_ratio: T,
}

/// Moves every spring and adds up what they bear.
#[inline(always)]
pub(crate) fn carry<const M: usize, const N: usize, const P: usize, T: Arithmetic, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    anchor: &mut [[[T; 2]; P]; M],
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
) -> Load<T> {
    let (data, scale) = (model.data, &model.scale);
    let odd = Odd(data.odd / at.radius);
    let carried = move_springs(anchor, model, at, here, way, &odd);
    let ([x, y], [energy_x, energy_y]) = (carried.sums.force(&odd), carried.sums.energy(&odd));
    let friction = [at.stiffness[0] * x, at.stiffness[1] * y];
    let mut normal = scale.normal(at.row.normal.at(at.t), at.depth)
        + at.press_coupling[0] * friction[0]
        + at.press_coupling[1] * friction[1]
        + at.stiffness_slope[0] * energy_x
        + at.stiffness_slope[1] * energy_y;
    if S::RESCALED {
        // The odd term changes with depth where the strength grows otherwise than that of the fitted finger.
        let [_, energy] = carried.sums.odd_rates();
        normal += at.stiffness[0] * energy * (odd.0 * -at.growth);
    }
    Load { normal, friction, moment: carried.moment, stick_ratio: carried.stick_ratio }
}

/// The answer of a contact with this load, without regime and status.
#[inline(always)]
pub(crate) fn answer<const M: usize, const N: usize, const P: usize, T: Arithmetic, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    load: &Load<T>,
) -> Response<T> {
    let (data, scale) = (model.data, &model.scale);
    let Load { normal, friction, moment, stick_ratio } = *load;
    // In shares of the limit; what rounding and the odd stiffness leave beyond it is none.
    let per_limit = T::of(1.0) / at.limit;
    let [along, across] = friction.map(|f| f * per_limit);
    let alone = share_of_limit(at.row, at.t, scale, [along, across]);
    let square = along * along + T::of(NOTHING);
    let friction_limit = at.limit * ((square + across * across).sqrt() / alone.at_most(T::of(1.0)));
    let [offset_x, offset_y] = scale.friction_place();
    let [pressed_x, pressed_y] = scale.pressure_place();
    let centre = (scale.length(at.row.friction_centre.at(at.t)) + offset_x) * friction[1] - offset_y * friction[0];
    let spin_moment = if P == 1 { centre } else { at.stiffness[1] * moment[1] - at.stiffness[0] * moment[0] };
    let used = if P == 1 {
        alone
    } else {
        let most = scale.arm(at.row.spin_limit.at(at.t) / at.row.limit.at(at.t)) + T::of(NOTHING);
        let moment = (spin_moment - centre) * per_limit / most;
        let cross = data.spin_cross * (moment * alone).magnitude();
        (alone * alone + moment * moment + cross).magnitude().sqrt()
    };
    let (mut band_normal, mut band_friction) = (T::of(-0.0), T::of(-0.0));
    if S::POSED {
        let [of_normal, of_limit] = scale.band();
        (band_normal, band_friction) = (of_normal * normal.not_negative(), of_limit);
    }
    let band = |b: &[T; 3]| b[0] + stick_ratio * (b[1] + stick_ratio * b[2]);
    Response {
        normal_force_n: normal.not_negative(),
        friction_n: friction,
        stick_ratio,
        friction_limit_n: friction_limit,
        slip_margin: (T::of(1.0) - used).not_negative(),
        spin_moment_n_mm: spin_moment,
        pressure_centre_mm: [
            scale.length(at.row.pressure_centre.at(at.t))
                + pressed_x
                + scale.per_newton(scale.length(data.pressure_centre_per_n)) * friction[0],
            pressed_y,
        ],
        contact_area_mm2: at.area + at.area * data.area_tilt * along,
        band_normal_n: scale.normal(at.row.band_normal.at(at.t), at.depth) * band(&data.band_normal) + band_normal,
        band_friction_n: at.limit * (band(&data.band_friction) + band_friction),
        regime: Regime::NoContact,
        status: Status::OK,
    }
}

/// Share of what a contact holds in the direction of a friction, given over the strength.
#[inline(always)]
pub(crate) fn share_of_limit<const M: usize, T: Arithmetic, S: Scaling<T>>(
    row: &Row<M, T>,
    t: T,
    scale: &S,
    [along, across]: [T; 2],
) -> T {
    let square = along * along + T::of(NOTHING);
    let stretched = across / scale.strength_ratio(row.limit_ratio.at(t));
    let mut shifted = row.limit_shift.at(t) * along;
    if S::POSED {
        let fitted = row.yield_shift.at(t);
        let [tilt_x, tilt_y] = scale.tilt(fitted);
        shifted += (tilt_x - fitted) * along + tilt_y * stretched;
    }
    (square + stretched * stretched + shifted * shifted).sqrt() - shifted
}

/// Moves the plane, and the state's origin if that is 2 mm away: positions are then accurate to a quarter of a nanometre.
#[inline(always)]
fn move_plane<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    state: &mut StateOf<M, P, T>,
    motion: Motion<T>,
    press_slide: [T; 2],
    status: &mut Status,
) {
    let [mut x, mut y] = motion.slide_increment_mm;
    let mut spin = motion.spin_increment_rad;
    let longest = T::of(SLIDE_MAX_MM * SLIDE_MAX_MM);
    let turns = if P == 1 { spin == T::of(0.0) } else { spin.magnitude() <= T::of(SPIN_MAX_RAD) };
    if !((x * x + y * y <= longest) & turns) {
        rare();
        let bounded = |s: T, most: f32, status: &mut Status| {
            if !s.is_number() {
                *status = status.with(Status::BAD_INPUT);
                return T::of(0.0);
            }
            let most = T::of(most);
            if s < -most { -most } else { s.at_most(most) }
        };
        let finite = x.is_number() && y.is_number();
        [x, y] = [x, y].map(|s| bounded(s, 1e6, status));
        let length = x.magnitude() + y.magnitude();
        if finite && x * x + y * y > longest {
            *status = status.with(Status::LARGE_INCREMENT);
        }
        if length > T::of(SLIDE_MAX_MM) {
            let cut = T::of(SLIDE_MAX_MM) / length;
            [x, y] = [x * cut, y * cut];
        }
        if P == 1 && !turns {
            *status = status.with(Status::SPIN_IGNORED);
        } else if !turns {
            if spin.is_number() {
                *status = status.with(Status::LARGE_INCREMENT);
            }
            spin = bounded(spin, SPIN_MAX_RAD, status);
        }
    }
    let [at, low] = state.position;
    let (to_x, low_x) = add(at[0], low[0], x);
    let (to_y, low_y) = add(at[1], low[1], y);
    state.position = [[to_x, to_y], [low_x, low_y]];
    if P > 1 {
        let (to, low) = add(state.angle[0], state.angle[1], spin);
        state.angle = [to, low];
    }
    if to_x.either_is_far(to_y) | (P > 1 && state.angle[0].magnitude() > T::of(2.0)) {
        rare();
        move_origin(state, press_slide, model.data, &model.scale);
    }
}

/// Moves the state's origin to where the plane is, and its angle to 0. Displacements keep their bits: those that a step
/// computes from the anchors are what the anchors become.
#[inline(always)]
fn move_origin<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    [press_x, press_y]: [T; 2],
    data: &DataOf<M, N, T>,
    scale: &S,
) {
    let [x, y] = state.position[0];
    let here = [x + press_x, y + press_y, state.angle[0]];
    for (pair, spring) in state.anchor.iter_mut().zip(&data.springs) {
        for (k, anchor) in pair.iter_mut().enumerate() {
            let to = place_of::<P, T>(here, spring.place::<P, S>(k, scale));
            *anchor = [anchor[0] - to[0], anchor[1] - to[1]];
        }
    }
    for place in [&mut state.turn, &mut state.reached, &mut state.turn_before] {
        *place = [place[0] - here[0], place[1] - here[1], place[2] - here[2]];
    }
    let [rolled_x, rolled_y] = state.rolled.slide;
    state.rolled.slide = [rolled_x - here[0], rolled_y - here[1]];
    state.position[0] = [-press_x, -press_y];
    state.angle[0] = T::of(0.0);
}

/// A contact begins: all springs are held where they are.
#[inline(always)]
fn touch<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    here: [T; 3],
    data: &DataOf<M, N, T>,
    scale: &S,
) {
    for (pair, spring) in state.anchor.iter_mut().zip(&data.springs) {
        for (k, anchor) in pair.iter_mut().enumerate() {
            *anchor = place_of::<P, T>(here, spring.place::<P, S>(k, scale));
        }
    }
}

/// Turns the stretch of the springs with the plane: what holds them there goes round with it.
#[inline(always)]
fn carry_round<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    here: [T; 3],
    spin: T,
    data: &DataOf<M, N, T>,
    scale: &S,
) {
    for (pair, spring) in state.anchor.iter_mut().zip(&data.springs) {
        for (k, anchor) in pair.iter_mut().enumerate() {
            let to = place_of::<P, T>(here, spring.place::<P, S>(k, scale));
            let u = [to[0] - anchor[0], to[1] - anchor[1]];
            *anchor = [anchor[0] + spin * u[1], anchor[1] - spin * u[0]];
        }
    }
}

/// Where the plane has carried a spring at `place`.
#[inline(always)]
pub(crate) fn place_of<const P: usize, T: Arithmetic>([x, y, angle]: [T; 3], place: [T; 2]) -> [T; 2] {
    if P == 1 { [x, y] } else { [x - place[1] * angle, y + place[0] * angle] }
}

/// Rolls the finger to where the contact lies in the pose: springs lose the stretch of what has left.
#[inline(never)]
fn roll<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
) {
    let (data, scale) = (model.data, &model.scale);
    if !(data.pose.rolling_length > T::of(0.0)) {
        return;
    }
    let length = data.pose.rolling_length * (at.area * T::of(core::f32::consts::FRAC_1_PI)).magnitude().sqrt();
    let full = at.limit / at.stiffness[0];
    let [x, y] = state.position[0];
    let lost = T::of(1.0) - state.rolled.roll_to(scale.pressure_place(), [x, y], full, length);
    if !(lost > T::of(0.0)) {
        return;
    }
    for (pair, spring) in state.anchor.iter_mut().zip(&data.springs) {
        for (k, anchor) in pair.iter_mut().enumerate() {
            let to = place_of::<P, T>(here, spring.place::<P, S>(k, scale));
            *anchor = [anchor[0] + lost * (to[0] - anchor[0]), anchor[1] + lost * (to[1] - anchor[1])];
        }
    }
}

/// What the springs carry together.
struct Carried<T> {
    /// Sums over the springs.
    sums: Sums<T>,
    /// What the forces along x and y add to the moment, over the stiffness, mm²; 0 without spin.
    moment: [T; 2],
    stick_ratio: T,
}

/// Moves every spring and returns those that slip to their limit; the state keeps their anchors.
///
/// Anchors are stored on slip alone, so that a contact at rest keeps its bits.
#[inline(always)]
fn move_springs<const M: usize, const N: usize, const P: usize, T: Arithmetic, S: Scaling<T>>(
    anchors: &mut [[[T; 2]; P]; M],
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
    odd: &Odd<T>,
) -> Carried<T> {
    let (data, scale) = (model.data, &model.scale);
    let limit = Limit::new(
        scale.tilt(at.row.yield_shift.at(at.t)),
        scale.anisotropy(at.row.anisotropy.at(at.t)),
        at.stiffness[1] / at.stiffness[0],
    );
    let none = T::of(-0.0);
    let mut carried = Carried { sums: Sums::new(), moment: [none; 2], stick_ratio: T::of(1.0) };
    let share = T::of(1.0 / P as f32);
    let springs = data.springs.iter().zip(&at.row.radius).zip(&at.row.area_share);
    for (pair, ((spring, radius), area)) in anchors.iter_mut().zip(springs) {
        let radius = radius.at(at.t) * at.radius;
        let mut slipping = none;
        for (k, anchor) in pair.iter_mut().enumerate() {
            let place = spring.place::<P, S>(k, scale);
            let to = place_of::<P, T>(here, place);
            let u = [to[0] - anchor[0], to[1] - anchor[1]];
            let seen = if S::POSED { limit.see::<true>(u, radius) } else { limit.see::<false>(u, radius) };
            let gone = place_of::<P, T>(way.0, place);
            let gone = [gone[0], gone[1] * limit.anisotropy];
            let ([mut ux, mut uy], [mut vx, mut vy], mut room) = (u, seen.v, -seen.over);
            let [held_x, held_y] = anchor;
            seen.over.where_positive([held_x, held_y, &mut ux, &mut uy, &mut vx, &mut vy, &mut room], || {
                let u = if S::POSED { limit.return_map::<true>(u, &seen) } else { limit.return_map::<false>(u, &seen) };
                let v = limit.place_in(u, &seen);
                [to[0] - u[0], to[1] - u[1], u[0], u[1], v[0], v[1], T::of(0.0)]
            });
            let u = [ux, uy];
            let p = share_of_way(gone, [vx, vy], room);
            let square = p * p;
            slipping += share * (square + square * (spring.sharpness * (square - T::of(1.0))));
            let [along, across] = carried.sums.add(share * spring.stiffness, u);
            if P > 1 {
                // In a pose what holds the spring on the plane goes round with it.
                let lever = if S::POSED { [place[0] + u[0], place[1] + u[1]] } else { place };
                carried.moment[0] += lever[1] * (along - odd.0 * along * u[0]);
                carried.moment[1] += lever[0] * across;
            }
        }
        carried.stick_ratio -= area.at(at.t) * slipping;
    }
    carried.stick_ratio = led(carried.stick_ratio.not_negative(), at.slip_lead, way);
    carried
}

/// Tells the compiler that what comes with it is rare.
#[inline]
#[cold]
fn rare() {}

/// What is to be remarked about a depth and a time step that are out of the ordinary, which they may be rightly.
#[inline(always)]
fn doubt<T: Scalar>(depth: T, dt: T) -> Status {
    let time = if dt > T::of(0.0) && dt.is_number() { Status::OK } else { Status::BAD_TIME_STEP };
    if depth.is_number() { time } else { time.with(Status::BAD_INPUT) }
}

/// Without contact the springs are forgotten, the strength factor stays.
#[inline(always)]
fn in_the_air<const M: usize, const P: usize, T: Scalar>(
    state: &mut StateOf<M, P, T>,
    motion: Motion<T>,
    mut status: Status,
) -> Response<T> {
    let [x, y] = motion.slide_increment_mm;
    if !(x.is_number() && y.is_number() && motion.spin_increment_rad.is_number()) {
        status = status.with(Status::BAD_INPUT);
    }
    lift_off(state);
    Response { slip_margin: T::of(1.0), status, ..Response::default() }
}

#[cold]
#[inline(never)]
fn lift_off<const M: usize, const P: usize, T: Scalar>(state: &mut StateOf<M, P, T>) {
    *state = StateOf { strength_factor: state.strength_factor, ..StateOf::default() };
}

/// Forgets a contact and a strength factor that is out of range.
#[cold]
#[inline(never)]
fn begin_anew<const M: usize, const P: usize, T: Scalar>(state: &mut StateOf<M, P, T>) {
    let factor = state.strength_factor;
    *state = StateOf::default();
    state.set_strength_factor(factor);
}
