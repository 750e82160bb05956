//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, spring, stick_ratio and math.

use crate::math::{Scalar, add};
use crate::rescaling::Scaling;
use crate::rolling::Rolled;
use crate::spring::{Limit, NOTHING, Odd, Sums};
use crate::stick_ratio::{Way, regime_of, share_of_way};
use crate::table::Row;
use crate::{DataOf, ModelOf, Motion, Response, StateOf, Status};

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
            return in_the_air(state, motion, status);
        }
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
        state.rolled = Rolled::at(scale.offset(), [slid[0], slid[1]]);
    }
    if S::POSED && !state.rolled.is_at(scale.offset()) {
        roll(state, model, &at, here);
    }
    let gyration = scale.length(data.gyration);
    let way = Way::follow(state, slid, at.limit, at.stiffness[0], gyration);
    let odd = Odd(data.odd / at.radius);
    let carried = move_springs(state, model, &at, here, &way, &odd);

    // Resultants
    let ([x, y], [energy_x, energy_y]) = (carried.sums.force(&odd), carried.sums.energy(&odd));
    let mut friction = [at.stiffness[0] * x, at.stiffness[1] * y];
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
    let (mut moment, mut stick_ratio) = (carried.moment, carried.stick_ratio);
    // The last guard: a memory that holds what is no number, which no step leaves behind, is forgotten, and the answer is a
    // contact of which nothing is known.
    if !(normal + friction[1]).is_number() {
        rare();
        status = status.with(Status::MEMORY_LOST);
        (normal, stick_ratio) = (T::of(0.0), T::of(0.0));
        [friction, moment] = [[T::of(0.0); 2]; 2];
        begin_anew(state);
    }
    // In shares of the limit; what rounding and the odd stiffness leave beyond it is none.
    let per_limit = T::of(1.0) / at.limit;
    let [along, across] = friction.map(|f| f * per_limit);
    let alone = share_of_limit(at.row, at.t, scale, [along, across]);
    let square = along * along + T::of(NOTHING);
    let friction_limit = at.limit * ((square + across * across).sqrt() / alone.at_most(T::of(1.0)));
    let [offset_x, offset_y] = scale.offset();
    let centre = (scale.length(at.row.friction_centre.at(at.t)) + offset_x) * friction[1] - offset_y * friction[0];
    let spin_moment = if P == 1 { centre } else { at.stiffness[1] * moment[1] - at.stiffness[0] * moment[0] };
    let used = if P == 1 {
        alone
    } else {
        let most = scale.length(at.row.spin_limit.at(at.t) / at.row.limit.at(at.t)) + T::of(NOTHING);
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
                + offset_x
                + scale.per_newton(scale.length(data.pressure_centre_per_n)) * friction[0],
            offset_y,
        ],
        contact_area_mm2: at.area + at.area * data.area_tilt * along,
        band_normal_n: scale.normal(at.row.band_normal.at(at.t), at.depth) * band(&data.band_normal) + band_normal,
        band_friction_n: at.limit * (band(&data.band_friction) + band_friction),
        regime: regime_of(stick_ratio),
        status: status.with(scale.status()),
    }
}

/// Share of what a contact holds in the direction of a friction, given over the strength.
#[inline(always)]
pub(crate) fn share_of_limit<const M: usize, T: Scalar, S: Scaling<T>>(
    row: &Row<M, T>,
    t: T,
    scale: &S,
    [along, across]: [T; 2],
) -> T {
    let square = along * along + T::of(NOTHING);
    let stretched = across / row.limit_ratio.at(t);
    let mut shifted = row.limit_shift.at(t) * along;
    if S::POSED {
        let fitted = row.yield_shift.at(t);
        let [tilt_x, tilt_y] = scale.tilt(fitted);
        shifted += (tilt_x - fitted) * along + tilt_y * stretched;
    }
    (square + stretched * stretched + shifted * shifted).sqrt() - shifted
}

/// The tables at one depth, for the finger and the strength at hand.
struct AtDepth<'a, const M: usize, T> {
    row: &'a Row<M, T>,
    /// Place within the row's cell, 0 to 1.
    t: T,
    depth: T,
    area: T,
    /// Factor on the springs' radii, and the share by which it grows with depth, 1/mm.
    radius: T,
    growth: T,
    limit: T,
    stiffness: [T; 2],
    /// Change of the stiffness with depth, N/mm².
    stiffness_slope: [T; 2],
    press_coupling: [T; 2],
    press_slide: [T; 2],
}

impl<'a, const M: usize, T: Scalar> AtDepth<'a, M, T> {
    /// Reads the tables; a depth beyond them is held at their end and flagged.
    #[inline(always)]
    fn look_up<const N: usize, const P: usize, S: Scaling<T>>(
        model: &ModelOf<'a, M, N, S, T>,
        state: &StateOf<M, P, T>,
        mut depth: T,
        status: &mut Status,
    ) -> Self {
        let (data, scale) = (model.data, &model.scale);
        let per_mm = scale.per_mm(data.cells_per_mm);
        let x = depth * per_mm;
        let mut index = x.index();
        let mut t = x - T::of(index as f32);
        if index >= N - 1 {
            // The end of the last cell, with its slopes: the normal force does not jump there.
            index = N - 2;
            t = T::of(1.0);
            depth = scale.depth(data.depth_max);
            if x > T::of((N - 1) as f32) {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
        }
        let row = &data.rows[index];
        let area = scale.area(row.area.at(t), depth);
        let plain = row.limit.at(t);
        let limit = scale.limit(plain, area, depth);
        let [press_x, press_y] = scale.press();
        Self {
            row,
            t,
            depth,
            area,
            radius: scale.radius(plain, limit) * state.strength_factor,
            growth: if S::RESCALED { growth(row, t, depth, per_mm, scale) } else { T::of(0.0) },
            limit: limit * state.strength_factor,
            stiffness: [&row.stiffness_x, &row.stiffness_y].map(|k| scale.stiffness(k.at(t))),
            stiffness_slope: [&row.stiffness_x, &row.stiffness_y].map(|k| scale.stiffness(k.slope_at(t)) * per_mm),
            press_coupling: [row.press_slide.slope_at(t) * data.cells_per_mm + press_x, press_y],
            press_slide: [scale.depth(row.press_slide.at(t)) + press_x * depth, press_y * depth],
        }
    }
}

/// Share by which the factor on the springs' radii grows with depth, 1/mm: that of a fraction of two lines.
#[inline(always)]
pub(crate) fn growth<const M: usize, T: Scalar, S: Scaling<T>>(
    row: &Row<M, T>,
    t: T,
    depth: T,
    per_mm: T,
    scale: &S,
) -> T {
    let (plain, area) = (row.limit.at(t), row.area.at(t));
    let limit = |plain: T, area: T| scale.limit(plain, scale.area(area, depth), depth);
    let strength = limit(plain, area);
    let grown = limit(row.limit.change * per_mm, row.area.change * per_mm) + scale.limit_slope(plain, area);
    grown / strength - row.limit.change * per_mm / plain
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

/// Where the plane has carried a spring at `place`.
#[inline(always)]
pub(crate) fn place_of<const P: usize, T: Scalar>([x, y, angle]: [T; 3], place: [T; 2]) -> [T; 2] {
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
    let lost = T::of(1.0) - state.rolled.roll_to(scale.offset(), [x, y], full, length);
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
fn move_springs<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
    odd: &Odd<T>,
) -> Carried<T> {
    let (data, scale) = (model.data, &model.scale);
    let limit = Limit::new(
        scale.tilt(at.row.yield_shift.at(at.t)),
        at.row.anisotropy.at(at.t),
        at.stiffness[1] / at.stiffness[0],
    );
    let none = T::of(-0.0);
    let mut carried = Carried { sums: Sums::new(), moment: [none; 2], stick_ratio: T::of(1.0) };
    let share = T::of(1.0 / P as f32);
    let springs = data.springs.iter().zip(&at.row.radius).zip(&at.row.area_share);
    for (pair, ((spring, radius), area)) in state.anchor.iter_mut().zip(springs) {
        let radius = radius.at(at.t) * at.radius;
        let mut slipping = none;
        for (k, anchor) in pair.iter_mut().enumerate() {
            let place = spring.place::<P, S>(k, scale);
            let to = place_of::<P, T>(here, place);
            let mut u = [to[0] - anchor[0], to[1] - anchor[1]];
            let seen = if S::POSED { limit.see::<true>(u, radius) } else { limit.see::<false>(u, radius) };
            let gone = place_of::<P, T>(way.0, place);
            let gone = [gone[0], gone[1] * limit.anisotropy];
            let (mut v, mut room) = (seen.v, -seen.over);
            if seen.over > T::of(0.0) {
                u = if S::POSED { limit.return_map::<true>(u, &seen) } else { limit.return_map::<false>(u, &seen) };
                *anchor = [to[0] - u[0], to[1] - u[1]];
                v = limit.place_in(u, &seen);
                room = T::of(0.0);
            }
            let p = share_of_way(gone, v, room);
            let square = p * p;
            slipping += share * (square + square * (spring.sharpness * (square - T::of(1.0))));
            let [along, across] = carried.sums.add(share * spring.stiffness, u);
            if P > 1 {
                carried.moment[0] += place[1] * (along - odd.0 * along * u[0]);
                carried.moment[1] += place[0] * across;
            }
        }
        carried.stick_ratio -= area.at(at.t) * slipping;
    }
    carried.stick_ratio = carried.stick_ratio.not_negative();
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
