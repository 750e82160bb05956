//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, spring, stick_ratio and math.

use crate::math::Scalar;
use crate::rescaling::Scaling;
use crate::spring::{Limit, NOTHING, Odd};
use crate::stick_ratio::{Way, regime_of, share_of_way};
use crate::table::Row;
use crate::{DataOf, ModelOf, Motion, Response, StateOf, Status};

/// Longest slide in one step, mm, and largest angle, rad: beyond full slip of every spring, so that a cut loses nothing.
const SLIDE_MAX_MM: f32 = 64.0;
const SPIN_MAX_RAD: f32 = 8.0;
/// Slide from the state's origin beyond which the origin is moved, mm; positions are then accurate to half a nanometre.
const FAR_MM: f32 = 4.0;
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
    move_plane(state, motion, at.press_slide, &mut status);
    state.depth = at.depth;
    let slid = [state.position[0][0], state.position[0][1], state.angle[0]];
    let here = [slid[0] + at.press_slide, slid[1], slid[2]];
    if fresh {
        touch(state, here, data, scale);
        state.turn = slid;
        state.reached = slid;
    }
    let gyration = scale.length(data.gyration);
    let way = Way::follow(state, slid, at.limit, at.stiffness[0], gyration);
    let carried = move_springs(state, model, &at, here, &way);

    // Resultants
    let [x, y] = carried.force;
    let friction = [at.stiffness[0] * x, at.stiffness[1] * y];
    let spin_moment = at.stiffness[1] * carried.moment[1] - at.stiffness[0] * carried.moment[0];
    let normal = scale.normal(at.row.normal.at(at.t))
        + at.press_coupling * friction[0]
        + at.stiffness_slope[0] * carried.energy[0]
        + at.stiffness_slope[1] * carried.energy[1];
    let stick_ratio = carried.stick_ratio;
    // In shares of the limit; what rounding and the odd stiffness leave beyond it is none.
    let [along, across] = friction.map(|f| f / at.limit);
    let ratio = at.row.limit_ratio.at(at.t);
    let square = along * along + T::of(NOTHING);
    let shifted = at.row.limit_shift.at(at.t) * along;
    let alone = (square + (across / ratio) * (across / ratio) + shifted * shifted).sqrt() - shifted;
    let friction_limit = at.limit * ((square + across * across).sqrt() / alone.at_most(T::of(1.0)));
    let used = if P == 1 {
        alone
    } else {
        let centred = spin_moment - scale.length(at.row.friction_centre.at(at.t)) * friction[1];
        let moment = centred / (at.limit * scale.length(at.row.spin_limit.at(at.t) / at.row.limit.at(at.t)) + T::of(NOTHING));
        (alone * alone + moment * (moment + data.spin_cross * alone).magnitude()).magnitude().sqrt()
    };
    let band = |b: &[T; 3]| b[0] + stick_ratio * (b[1] + stick_ratio * b[2]);
    let response = Response {
        normal_force_n: normal.not_negative(),
        friction_n: friction,
        stick_ratio,
        friction_limit_n: friction_limit,
        slip_margin: (T::of(1.0) - used).not_negative(),
        spin_moment_n_mm: spin_moment,
        pressure_centre_mm: scale.length(at.row.pressure_centre.at(at.t))
            + scale.per_newton(scale.length(data.pressure_centre_per_n)) * friction[0],
        contact_area_mm2: at.area + at.area * data.area_tilt * along,
        band_normal_n: scale.normal(at.row.band_normal.at(at.t)) * band(&data.band_normal),
        band_friction_n: at.limit * band(&data.band_friction),
        regime: regime_of(stick_ratio),
        status,
    };
    if !(normal + friction_limit + stick_ratio).is_number() {
        return begin_anew(state, response.status);
    }
    response
}

/// The tables at one depth, for the finger and the strength at hand.
struct AtDepth<'a, const M: usize, T> {
    row: &'a Row<M, T>,
    /// Place within the row's cell, 0 to 1.
    t: T,
    depth: T,
    area: T,
    /// Factor on the springs' radii.
    radius: T,
    limit: T,
    stiffness: [T; 2],
    /// Change of the stiffness with depth, N/mm².
    stiffness_slope: [T; 2],
    press_coupling: T,
    press_slide: T,
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
            index = N - 1;
            t = T::of(0.0);
            depth = scale.length(data.depth_max);
            if x > T::of((N - 1) as f32) {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
        }
        let row = &data.rows[index];
        let area = scale.area(row.area.at(t));
        let plain = row.limit.at(t);
        let limit = scale.limit(plain, area);
        Self {
            row,
            t,
            depth,
            area,
            radius: scale.radius(plain, limit) * state.strength_factor,
            limit: limit * state.strength_factor,
            stiffness: [&row.stiffness_x, &row.stiffness_y].map(|k| scale.stiffness(k.at(t))),
            stiffness_slope: [&row.stiffness_x, &row.stiffness_y].map(|k| scale.stiffness(k.slope_at(t)) * per_mm),
            press_coupling: row.press_slide.slope_at(t) * data.cells_per_mm,
            press_slide: scale.length(row.press_slide.at(t)),
        }
    }
}

/// Adds an increment to a number in two parts; exact to the last bit of the second (Knuth's sum of two).
#[inline(always)]
fn add<T: Scalar>(sum: T, low: T, increment: T) -> (T, T) {
    let increment = increment + low;
    let to = sum + increment;
    let part = to - sum;
    (to, (sum - (to - part)) + (increment - part))
}

/// Moves the plane, and the state's origin if that is far away.
#[inline(always)]
fn move_plane<const M: usize, const P: usize, T: Scalar>(
    state: &mut StateOf<M, P, T>,
    motion: Motion<T>,
    press_slide: T,
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
            s.at_most(T::of(most)) + (s + T::of(most)).at_most(T::of(0.0))
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
    let far = T::of(FAR_MM);
    let is_far = |s: T| s.magnitude() > far;
    if is_far(to_x) | is_far(to_y) | (P > 1 && is_far(state.angle[0])) {
        rare();
        move_origin(state, press_slide);
    }
}

/// Moves the state's origin to where the plane is. Displacements keep their bits: those that a step computes from the
/// anchors are what the anchors become.
#[inline(always)]
fn move_origin<const M: usize, const P: usize, T: Scalar>(state: &mut StateOf<M, P, T>, press_slide: T) {
    let [x, y] = state.position[0];
    let here = [x + press_slide, y];
    for anchor in state.anchor.as_flattened_mut() {
        *anchor = [anchor[0] - here[0], anchor[1] - here[1]];
    }
    for place in [&mut state.turn, &mut state.reached, &mut state.turn_before] {
        *place = [place[0] - here[0], place[1] - here[1], place[2]];
    }
    state.position[0] = [-press_slide, T::of(0.0)];
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
            *anchor = place_of::<P, T>(here, spring.place::<P>(k).map(|p| scale.length(p)));
        }
    }
}

/// Where the plane has carried a spring at `place`.
#[inline(always)]
pub(crate) fn place_of<const P: usize, T: Scalar>([x, y, angle]: [T; 3], place: [T; 2]) -> [T; 2] {
    if P == 1 { [x, y] } else { [x - place[1] * angle, y + place[0] * angle] }
}

/// What the springs carry together, over the stiffness.
struct Carried<T> {
    /// Force, mm.
    force: [T; 2],
    /// What the forces along x and y add to the moment, mm².
    moment: [T; 2],
    /// Energy along x and y, mm².
    energy: [T; 2],
    stick_ratio: T,
}

/// Moves every spring and returns those that slip to their limit; the state keeps their anchors.
#[inline(always)]
fn move_springs<const M: usize, const N: usize, const P: usize, T: Scalar, S: Scaling<T>>(
    state: &mut StateOf<M, P, T>,
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
) -> Carried<T> {
    let (data, scale) = (model.data, &model.scale);
    let odd = Odd(data.odd / at.radius);
    let limit =
        Limit::new(at.row.yield_shift.at(at.t), at.row.anisotropy.at(at.t), at.stiffness[1] / at.stiffness[0]);
    // Adding to −0 is nothing, to 0 an instruction.
    let none = T::of(-0.0);
    let mut sum = Carried { force: [none; 2], moment: [none; 2], energy: [none; 2], stick_ratio: none };
    let springs = data.springs.iter().zip(&at.row.radius).zip(&at.row.area_share);
    for (pair, ((spring, radius), area)) in state.anchor.iter_mut().zip(springs) {
        let radius = radius.at(at.t) * at.radius;
        let mut slipping = none;
        for (k, anchor) in pair.iter_mut().enumerate() {
            let place = spring.place::<P>(k).map(|p| scale.length(p));
            let to = place_of::<P, T>(here, place);
            let r = limit.return_map([to[0] - anchor[0], to[1] - anchor[1]], radius);
            *anchor = [
                T::select(r.slips, to[0] - r.u[0], anchor[0]),
                T::select(r.slips, to[1] - r.u[1], anchor[1]),
            ];
            let [along, energy] = odd.force_and_energy(r.u[0]);
            let across = r.u[1];
            sum.force[0] += spring.stiffness * along;
            sum.force[1] += spring.stiffness * across;
            sum.energy[0] += spring.stiffness * energy;
            sum.energy[1] += spring.stiffness * (across * across);
            if P > 1 {
                sum.moment[0] += spring.stiffness * (place[1] * along);
                sum.moment[1] += spring.stiffness * (place[0] * across);
            } else {
                sum.moment[1] += spring.stiffness * (place[0] * across);
            }
            let gone = place_of::<P, T>(way.0, place);
            let p = share_of_way([gone[0], gone[1] * limit.anisotropy], r.v, r.room);
            let square = p * p;
            slipping += square + square * (spring.sharpness * (square - T::of(1.0)));
        }
        sum.stick_ratio += area.at(at.t) * slipping;
    }
    let share = T::of(1.0 / P as f32);
    let both = |[x, y]: [T; 2]| [share * x, share * y];
    let [energy_x, energy_y] = both(sum.energy);
    Carried {
        force: both(sum.force),
        moment: both(sum.moment),
        energy: [energy_x, T::of(0.5) * energy_y],
        stick_ratio: (T::of(1.0) - share * sum.stick_ratio).not_negative(),
    }
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

/// The last guard: a memory that holds what is no number, which no step leaves behind, is forgotten, and the answer is a
/// contact of which nothing is known: no force, no margin.
#[cold]
#[inline(never)]
fn begin_anew<const M: usize, const P: usize, T: Scalar>(
    state: &mut StateOf<M, P, T>,
    status: Status,
) -> Response<T> {
    lift_off(state);
    let factor = state.strength_factor;
    if !(factor >= T::of(0.1) && factor <= T::of(5.0)) {
        state.strength_factor = T::of(1.0);
    }
    Response { status: status.with(Status::MEMORY_LOST), regime: crate::Regime::Slip, ..Response::default() }
}
