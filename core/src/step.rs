//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, memory, plane, springs and stick_ratio.

use crate::at_depth::AtDepth;
use crate::math::Scalar;
use crate::memory::Memory;
use crate::plane::{move_plane, spring_positions, touch};
use crate::relaxation::Perhaps;
use crate::spring::DIV_EPS;
use crate::springs::{Load, check_sum, step_springs};
use crate::stick_ratio::{ContactPoint, GROWTH_DEADBAND_MM, REVERSAL_DEADBAND_MM, Remembers, SlipPath, regime_of};
use crate::table::Row;
use crate::{ForceResponse, ForceStateOf, ModelOf, Motion, Response, StateOf, Status};

/// Depth below which there is no contact, mm.
pub(crate) const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Largest valid depth and time step, mm and s.
const LARGEST: f32 = 1e9;
/// Above the pressure over that of relaxed tissue that any branches reach, and above the pull that skin would need to follow a plane that has
/// left it.
const MOST_PRESSURE: f32 = 1e3;
const MOST_PULL: f32 = 1e12;

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
/// with N0, kx, ky, C, alpha, s and R_j from tables over depth and r = ky/kx. R_j is 0 up to the depth at which spring j
/// touches. It therefore engages at zero force, and slip has released all its force when it disengages. x_j and y_j are 0
/// without spin; with spin a spring is a pair.
///
/// The stiffness shares k_j do not depend on depth, so a change of depth preserves displacements and forces. The anchors are
/// the only memory of the contact. A repeated cycle of depth therefore has an effect only once: after the first cycle each
/// spring fits into its smallest limit. N, F and M_z are the derivatives of one energy; anchors move only with F · da >= 0;
/// a change of strength changes R_j alone. Hence no motion yields work ([`crate::build::DataOf::check`]).
///
/// q belongs to the fitted strength and scales with one over the strength factor, so friction in full slip is
/// proportional to the factor in every direction.
///
/// Bad input is flagged and leaves its axis unchanged; see [`Status`]. `stick_ratio.rs` computes the stick ratio.
///
/// With a state that does not relax there is no creep: without motion it keeps its bits, and increments that add up to zero lead back to it. A
/// state that relaxes ([`StateOf::relaxing`]) follows the branches of the model ([`ModelOf::with_relaxation`]; equations in `memory.rs`) over
/// [`Motion::dt_s`]; without branches, or with steps of more than 80 times the longest time, it gives the same bits as the other. Leaves out
/// dwell and moisture, except through [`StateOf::set_strength_factor`].
#[inline(always)]
pub fn step<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    model: &ModelOf<'_, M, N, T>,
    state: &mut StateOf<M, P, T, R>,
    motion: Motion<T>,
) -> Response<T> {
    advance(model, &mut state.forces, &mut state.history, motion)
}

impl<const M: usize, const N: usize, T: Scalar> ModelOf<'_, M, N, T> {
    /// [`step()`] of a contact whose stick ratio is not needed: the same forces, bit by bit, with less memory and fewer instructions.
    #[inline]
    pub fn step_forces<const P: usize, R: Memory<M, P, T>>(
        &self,
        state: &mut ForceStateOf<M, P, T, R>,
        motion: Motion<T>,
    ) -> ForceResponse<T> {
        advance(self, state, &mut (), motion).into()
    }
}

/// One step. The stick ratio, the regime and the bands of the response are those of the history.
#[inline(always)]
fn advance<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    model: &ModelOf<'_, M, N, T>,
    state: &mut ForceStateOf<M, P, T, R>,
    history: &mut impl Remembers<T>,
    motion: Motion<T>,
) -> Response<T> {
    let dt_s = if is_time_step(motion.dt_s) { motion.dt_s } else { T::of(0.0) };
    let weights = state.memory.go_on(model.relaxation, dt_s);
    let input = match begin(model, state, history, &weights, motion) {
        Ok(input) => input,
        Err(status) => return no_contact(state, history, &weights, status),
    };
    let at = &input.at;
    let load = step_springs(model.data, state, at, &weights, input.here, &input.slip_path);
    if !check_sum::<P, T>(&load, &input.slip_path).is_number() {
        return no_contact(state, history, &weights, input.status.with(Status::MEMORY_LOST));
    }
    response_of::<M, N, P, T>(model, at, &load, input.status, weights.get().is_some())
}

/// Whether a time step has a length.
#[inline(always)]
fn is_time_step<T: Scalar>(dt_s: T) -> bool {
    dt_s > T::of(0.0) && dt_s.is_number()
}

/// Input of the springs of one step: position of the plane, tables at the depth, slip path.
struct StepInput<'a, const M: usize, T> {
    at: AtDepth<'a, M, T>,
    /// Slide including the slide equivalent to the press, mm, and angle, rad.
    here: [T; 3],
    slip_path: SlipPath<T>,
    status: Status,
}

/// Moves the plane and reads the tables. Without contact the error is the status.
#[inline(always)]
fn begin<'a, const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    model: &ModelOf<'a, M, N, T>,
    state: &mut ForceStateOf<M, P, T, R>,
    history: &mut impl Remembers<T>,
    weights: &R::Weights,
    motion: Motion<T>,
) -> Result<StepInput<'a, M, T>, Status> {
    let (data, units) = (model.data, &model.units);
    let mut status = Status::OK;
    let mut depth = motion.depth_mm;
    if !state.is_consistent() {
        return Err(Status::MEMORY_LOST);
    }
    if !(depth.is_between(TOUCH_MM, LARGEST) & motion.dt_s.is_between(f32::MIN_POSITIVE, LARGEST)) {
        rare();
        status = doubt(depth, motion.dt_s);
        if status.contains(Status::BAD_INPUT) {
            depth = state.depth;
        }
        if !(depth >= T::of(TOUCH_MM)) {
            return Err(status.with(in_the_air(motion)));
        }
    }
    let (mut at, press_slide) = AtDepth::look_up(model, state, depth, &mut status);
    if let Some(pressure) = state.memory.press(weights, at.row.normal.at(at.t), data.pressure_exponent) {
        if !(pressure.share >= T::of(-MOST_PULL) && pressure.share <= T::of(MOST_PRESSURE)) {
            return Err(status.with(Status::MEMORY_LOST));
        }
        if !pressure.touches() {
            // The skin lags behind the plane.
            return Err(status.with(in_the_air(motion)));
        }
        at.press(&pressure);
    }
    let fresh = !state.in_contact();
    move_plane(model, state, history, motion, press_slide, &mut status);
    state.depth = at.depth;
    let slid = [state.position[0][0], state.position[0][1], state.angle[0]];
    let here = [slid[0] + press_slide, slid[1], slid[2]];
    if fresh {
        touch(state, here, data, weights);
        history.start(slid);
    }
    let contact = || ContactPoint {
        here: slid,
        limit: at.limit,
        growth_deadband_n: T::of(GROWTH_DEADBAND_MM) * units.per_length * at.limit_slope(data.cells_per_mm),
        reversal_deadband_mm: T::of(REVERSAL_DEADBAND_MM) * units.per_length,
        stiffness: at.stiffness[0],
        gyration_mm: data.gyration,
    };
    let slip_path = history.path::<P>(contact, || {
        let to = spring_positions::<P, T>(here, &data.springs[0])[0];
        let [x, y] = state.anchor[0][0];
        [to[0] - x, to[1] - y]
    });
    Ok(StepInput { at, here, slip_path, status })
}

/// The response of a contact with this load.
#[inline(always)]
fn response_of<const M: usize, const N: usize, const P: usize, T: Scalar>(
    model: &ModelOf<'_, M, N, T>,
    at: &AtDepth<'_, M, T>,
    load: &Load<T>,
    status: Status,
    relaxes: bool,
) -> Response<T> {
    let data = model.data;
    let Load { normal, friction, moment, stick_ratio } = *load;
    // In shares of the limit, at most 1 in spite of rounding and the quadratic stiffness.
    let per_limit = T::of(1.0) / at.limit;
    let [along, across] = friction.map(|f| f * per_limit);
    let alone = share_of_limit(at.row, at.t, [along, across]).at_most(T::of(1.0));
    let magnitude = (along * along + T::of(DIV_EPS) + across * across).sqrt();
    let centre = at.row.friction_centre.at(at.t) * friction[1];
    let [lean_x, lean_y] = [0, 1].map(|k| data.pressure_centre_per_n[k] * friction[k]);
    let pressure_centre = [at.row.pressure_centre.at(at.t) + lean_x, lean_y];
    let spin_moment = if P == 1 { centre } else { at.stiffness[1] * moment[1] - at.stiffness[0] * moment[0] };
    let used = if P == 1 {
        alone
    } else {
        let most = at.row.spin_limit.at(at.t) / at.row.limit.at(at.t) + T::of(DIV_EPS);
        let moment = (spin_moment - centre) * per_limit / most;
        let cross = data.spin_cross * (moment * alone).magnitude();
        (alone * alone + moment * moment + cross).magnitude().sqrt()
    };
    let margin = if P == 1 { T::of(1.0) - used } else { (T::of(1.0) - used).not_negative() };
    // The load stays, the strength falls to that of relaxed tissue.
    let later = if relaxes { (T::of(1.0) - used * at.gain).not_negative() } else { margin };
    let band = |b: &[T; 3]| b[0] + stick_ratio * (b[1] + stick_ratio * b[2]);
    let area = at.row.area.at(at.t);
    let response = Response {
        normal_force_n: normal.not_negative(),
        friction_n: friction,
        stick_ratio,
        friction_limit_n: at.limit * (magnitude / alone),
        slip_margin: margin,
        slip_margin_relaxed: later,
        spin_moment_n_mm: spin_moment,
        pressure_centre_mm: pressure_centre,
        contact_area_mm2: area + area * data.area_tilt * along,
        band_normal_n: at.row.band_normal.at(at.t) * at.pressure * band(&data.band_normal),
        band_friction_n: at.limit * band(&data.band_friction),
        regime: regime_of(stick_ratio),
        status,
        ..Response::default()
    };
    model.units.response(response).on_plane()
}

/// Friction over the friction limit in its direction; `along` and `across` are friction over the strength.
#[inline(always)]
pub(crate) fn share_of_limit<const M: usize, T: Scalar>(row: &Row<M, T>, t: T, [along, across]: [T; 2]) -> T {
    let square = along * along + T::of(DIV_EPS);
    let stretched = across / row.limit_ratio.at(t);
    let shifted = row.limit_shift.at(t) * along;
    (square + stretched * stretched + shifted * shifted).sqrt() - shifted
}

/// Marks a branch as unlikely for the compiler.
#[inline]
#[cold]
pub(crate) fn rare() {}

/// Flags of a depth and a time step outside the usual range, some of which are valid.
#[inline(always)]
fn doubt<T: Scalar>(depth: T, dt: T) -> Status {
    let time = if is_time_step(dt) { Status::OK } else { Status::BAD_TIME_STEP };
    if depth.is_number() { time } else { time.with(Status::BAD_INPUT) }
}

/// Flags of the motion of a finger without contact.
#[inline(always)]
fn in_the_air<T: Scalar>(motion: Motion<T>) -> Status {
    let [x, y] = motion.slide_increment_mm;
    let is_finite = x.is_number() && y.is_number() && motion.spin_increment_rad.is_number();
    if is_finite { Status::OK } else { Status::BAD_INPUT }
}

/// The response without contact. Resets all but the strength factor, which is brought into its range, and what the tissue remembers.
#[inline(always)]
fn no_contact<const M: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    state: &mut ForceStateOf<M, P, T, R>,
    history: &mut impl Remembers<T>,
    weights: &R::Weights,
    status: Status,
) -> Response<T> {
    if status.contains(Status::MEMORY_LOST) {
        state.memory = R::default();
    } else if let (Some(weights), Some(memory)) = (weights.get(), state.memory.get()) {
        memory.let_go(weights);
    }
    reset(state, history);
    Response { status, ..Response::default() }
}

#[cold]
#[inline(never)]
fn reset<const M: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    state: &mut ForceStateOf<M, P, T, R>,
    history: &mut impl Remembers<T>,
) {
    let ForceStateOf { strength_factor, memory, .. } = *state;
    *state = ForceStateOf { memory, ..ForceStateOf::default() };
    state.set_strength_factor(strength_factor);
    history.reset();
}
