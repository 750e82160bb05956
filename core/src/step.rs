//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, yield_surface, stick_ratio and math.

use core::hint::select_unpredictable;

use crate::math::{not_negative, sqrt};
use crate::rescaling::Scaling;
use crate::stick_ratio::{Reversal, follow_reversal, regime_of};
use crate::table::Row;
use crate::yield_surface::{YIELD, YieldSurface};
use crate::{DataOf, ModelOf, Motion, Response, StateOf, Status};

/// Longest slide in one step, in slip lengths: beyond full slip of every element, so that a cut loses nothing, and
/// small enough that no product overflows.
const SLIDE_MAX: f32 = 32.0;
/// Depth below which there is no contact, mm: quotients of forces of shallower ones leave the range of the floats.
pub(crate) const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Share of its stiffness by which a contact grows until most of its rim is new.
const RENEWAL: f32 = 0.1;
/// A square that is added to others, so that quotients of the two are numbers.
pub(crate) const NOTHING: f32 = 1e-26;

/// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
///
/// Elements j carry forces (w_j L u_jx, w_j L s u_jy), u_j within a circle that is shifted by alpha along x:
///
/// ```text
/// u_j += (K/L) (dx + dC(d) − q dF_x², dy rho/s) / y_j      then back to |u_j|² − 2 alpha u_jx = 1
/// F    = L Σ w_j (u_jx, s u_jy)
/// N    = N0(d) + C'(d) F_x + G_x(d) P_x + G_y(d) P_y
/// P_x  = L² Σ w_j y_j u_jx²         P_y = (s² L²/rho) Σ w_j y_j u_jy²
/// ```
///
/// with K, L, s, rho, C, alpha, N0, G from tables over depth. The return to the yield surface is slip along the friction.
/// The limit is (1 + alpha²)^½ + alpha of L along +x, (1 + alpha²)^½ − alpha along −x and s along y: a finger that is
/// pushed back carries more than one that is pulled, and with q > 0 it is stiffer as well. (P_x + P_y)/2K is the elements'
/// elastic energy, 2/3 q F_x³ that of the odd compliance. The state holds u_jy over rho^½/s, so that the same slide
/// increment serves both components.
///
/// # Depth
///
/// A contact is like springs side by side, of which those at the rim came last and go first (the method of dimensionality
/// reduction: Popov & Heß 2015). What comes carries nothing: growth keeps the forces, and the energy that the stiffer
/// elements lack, since what came moved less than what was there, is stored. What goes takes its force along: a loss dK of
/// stiffness changes F by −e dK, e the rim's elastic displacement. The state knows by how much e lags behind F/K; growth
/// renews the rim, e goes to 0, and slides move rim and middle alike. So the way back over a depth that was gained in a
/// slide takes off what that slide brought, in its direction. The lag is paid for from the stored energy: when nothing is
/// left the displacement is the same everywhere.
///
/// Bad input is flagged and leaves the axis where it was; see [`Status`]. The stick ratio is in `stick_ratio.rs`.
///
/// No creep: with the motion at rest the state keeps its bits. Leaves out: rate, dwell and moisture other than
/// through [`StateOf::set_strength_factor`].
#[inline(always)]
pub fn step<const M: usize, const N: usize, S: Scaling>(
    model: &ModelOf<'_, M, N, S>,
    state: &mut StateOf<M>,
    motion: Motion,
) -> Response {
    let (data, scale) = (model.data, &model.scale);
    let mut status = Status::OK;
    let mut depth = motion.depth_mm;
    // Both in one comparison: one of the highest two bits tells that either is out of the ordinary.
    if (above_least(depth) | above_least(motion.dt_s)) >> 30 != 0 {
        rare();
        status = doubt(depth, motion.dt_s.to_bits());
        if status.contains(Status::BAD_INPUT) {
            depth = state.depth;
        }
        if !(depth >= TOUCH_MM) {
            return in_the_air(state, motion, status);
        }
    }
    let at = AtDepth::look_up(model, state, depth, &mut status);
    let per_slip = at.stiffness / at.limit;
    let [mut slide_x, mut slide_y] = slide_in_slip_lengths(model, state, &at, motion, per_slip, &mut status);
    // A quotient, not a product with 1/limit: it is exactly 1 while nothing changes.
    let limit_ratio = state.limit / at.limit;
    let retained = change_depth(state, &at, limit_ratio, per_slip, [&mut slide_x, &mut slide_y]);
    let softening = soften_along_x(state, &at, retained[0], limit_ratio, scale.odd(data.twice_odd), &mut slide_x);
    state.depth = at.depth;
    state.limit = at.limit;
    state.stiffness = at.stiffness;
    state.press_slide = at.press_slide;

    let before = [state.resultant[0], at.strength_anisotropy * state.resultant[1]];
    let shift_twice = at.yield_shift + at.yield_shift;
    let unyielded = [slide_x, slide_y * at.strength_anisotropy];
    let mut reversal = follow_reversal(state, before, unyielded, retained[0], limit_ratio, shift_twice);
    let ratio = at.stiffness_anisotropy * at.stiffness_anisotropy * softening;
    let surface = YieldSurface::new(at.strength_anisotropy, at.yield_shift, ratio);
    let carried = move_elements(state, data, &at, [slide_x, slide_y], retained, &surface, &mut reversal);

    let stick_ratio = reversal.stick_ratio(state, carried.resultant, at.yield_shift, data);

    // Resultants
    let Carried { resultant: [x, y], along_y, energy: [energy_x, energy_y] } = carried;
    let friction_x = at.limit * x;
    let square = at.limit * at.limit;
    state.energy = square / at.stiffness * (energy_x + energy_y);
    let sheared = square * (at.normal_shear_x * energy_x + at.normal_shear_y * energy_y);
    let xx = x * x + NOTHING;
    let shifted = at.yield_shift * x;
    // Share of the limit in use.
    let used = sqrt(xx + y * y + shifted * shifted) - shifted;
    let friction_limit = at.limit * (sqrt(xx + along_y * along_y) / used);
    let normal = scale.normal(at.row.normal.at(at.t)) + at.press_coupling * friction_x + sheared;
    let band = |b: &[f32; 3]| b[0] + stick_ratio * (b[1] + stick_ratio * b[2]);
    Response {
        normal_force_n: not_negative(normal),
        friction_n: [friction_x, at.limit * along_y],
        stick_ratio,
        friction_limit_n: friction_limit,
        slip_margin: 1.0 - used,
        contact_area_mm2: at.area + at.area * data.area_tilt * x,
        band_normal_n: scale.normal(at.row.band_normal.at(at.t)) * band(&data.band_normal),
        band_friction_n: at.limit * band(&data.band_friction),
        regime: regime_of(stick_ratio),
        status,
    }
}

/// The tables at one depth, for the finger and the strength at hand.
struct AtDepth<'a> {
    row: &'a Row,
    /// Place within the row's cell, 0 to 1.
    t: f32,
    depth: f32,
    area: f32,
    /// Strength without the factor of the state, N.
    plain_limit: f32,
    limit: f32,
    stiffness: f32,
    stiffness_anisotropy: f32,
    strength_anisotropy: f32,
    yield_shift: f32,
    normal_shear_x: f32,
    normal_shear_y: f32,
    press_coupling: f32,
    press_slide: f32,
}

impl<'a> AtDepth<'a> {
    /// Reads the tables; a depth beyond them is held at their end and flagged.
    #[inline(always)]
    fn look_up<const M: usize, const N: usize, S: Scaling>(
        model: &ModelOf<'a, M, N, S>,
        state: &StateOf<M>,
        mut depth: f32,
        status: &mut Status,
    ) -> Self {
        let (data, scale) = (model.data, &model.scale);
        let x = depth * scale.per_mm(data.cells_per_mm);
        let mut index = x as u32 as usize;
        let mut t = x - index as f32;
        if index >= N - 1 {
            index = N - 1;
            t = 0.0;
            depth = scale.length(data.depth_max);
            if x > (N - 1) as f32 {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
        }
        let row = &data.rows[index];
        let area = scale.area(row.area.at(t));
        let plain_limit = scale.limit(row.limit.at(t), area);
        let limit = plain_limit * state.strength_factor;
        let stiffness = scale.stiffness(row.stiffness.at(t));
        let stiffness_anisotropy = row.stiffness_anisotropy.at(t);
        let strength_anisotropy = row.strength_anisotropy.at(t);
        let yield_shift = row.yield_shift.at(t);
        let normal_shear_x = scale.per_newton(row.normal_shear_x.at(t));
        let normal_shear_y = scale.per_newton(row.normal_shear_y.at(t));
        let press_coupling = row.press_coupling.at(t);
        let press_slide = row.press_slide + t * (row.press_coupling.value + press_coupling);
        Self {
            row,
            t,
            depth,
            area,
            plain_limit,
            limit,
            stiffness,
            stiffness_anisotropy,
            strength_anisotropy,
            yield_shift,
            normal_shear_x,
            normal_shear_y,
            press_coupling,
            press_slide,
        }
    }
}

/// Slide of the step, that of pressing included, in slip lengths; along y times the stiffness anisotropy.
#[inline(always)]
fn slide_in_slip_lengths<const M: usize, const N: usize, S: Scaling>(
    model: &ModelOf<'_, M, N, S>,
    state: &StateOf<M>,
    at: &AtDepth<'_>,
    motion: Motion,
    per_slip: f32,
    status: &mut Status,
) -> [f32; 2] {
    let [x, y] = motion.slide_increment_mm;
    let coupled = (at.press_slide - state.press_slide) * model.scale.length(model.data.half_cell);
    let x = x + coupled;
    let mut slide = [x * per_slip, y * per_slip];
    // Numbers that are not negative order like their bits, and what is no number lies above them.
    if (slide[0] * slide[0] + slide[1] * slide[1]).to_bits() > (SLIDE_MAX * SLIDE_MAX).to_bits() {
        let finite = x.abs() <= f32::MAX && y.abs() <= f32::MAX;
        *status = status.with(if finite { Status::LARGE_INCREMENT } else { Status::BAD_INPUT });
        slide = bounded_slide(x, y, coupled, per_slip);
    }
    slide[1] *= at.stiffness_anisotropy;
    slide
}

/// Lets the contact grow or shrink to its new depth; a shrinking one also slides back by what its rim takes along.
///
/// Returns the share of their force that the elements retain along x and y, over the new limit.
#[inline(always)]
fn change_depth<const M: usize>(
    state: &mut StateOf<M>,
    at: &AtDepth<'_>,
    limit_ratio: f32,
    per_slip: f32,
    [slide_x, slide_y]: [&mut f32; 2],
) -> [f32; 2] {
    let grown = at.stiffness - state.stiffness;
    let deeper = at.stiffness * (at.depth - state.depth);
    let mut retained = limit_ratio;
    let [lag_x, lag_y] = state.rim_lag;
    if grown >= 0.0 {
        // What comes carries nothing, so that the rim lags by the whole displacement once most of it is new.
        let share = grown / at.stiffness;
        state.stored_energy += share * state.energy;
        let renewed = share / (RENEWAL + (1.0 - RENEWAL) * share);
        let slip_length = state.limit / at.stiffness;
        let (old, new) = (1.0 - renewed, slip_length * renewed);
        let renew = |lag: f32, resultant: f32| old * lag + new * resultant;
        state.rim_lag = [renew(lag_x, state.resultant[0]), renew(lag_y, state.resultant[1])];
    } else {
        // What goes takes the rim's force along: displacement kept, and the lag slid back as far as the stored energy pays.
        let mut share = -grown / at.stiffness;
        let before = 1.0 + share;
        let taken = -grown * before * (lag_x * lag_x + lag_y * lag_y);
        retained /= before;
        if taken > state.stored_energy {
            share *= state.stored_energy / taken;
            state.stored_energy = 0.0;
        } else {
            state.stored_energy -= taken;
        }
        let back = [share * lag_x, share * lag_y];
        state.rim_lag = [lag_x + back[0], lag_y + back[1]];
        *slide_x += back[0] * per_slip;
        *slide_y += back[1] * per_slip;
    }
    // The normal force that comes with shear does work on the way.
    let retained_deeper = retained * deeper;
    let retained_y = retained + retained_deeper * at.normal_shear_y;
    [retained + retained_deeper * at.normal_shear_x, retained_y]
}

/// The finger is softer along +x the more it carries there: the slide's square root law, solved for its end.
///
/// `odd_mm_n2` is twice the odd compliance. Returns the compliance at the end of the slide over the linear one.
#[inline(always)]
fn soften_along_x<const M: usize>(
    state: &StateOf<M>,
    at: &AtDepth<'_>,
    retained: f32,
    limit_ratio: f32,
    odd_mm_n2: f32,
    slide_x: &mut f32,
) -> f32 {
    let twice_odd = odd_mm_n2 * (at.stiffness * at.plain_limit);
    let was = state.resultant[0] * limit_ratio;
    let kept = state.resultant[0] * retained - was;
    *slide_x += kept;
    *slide_x += *slide_x;
    let begin = 1.0 + twice_odd * was;
    let end = sqrt((begin * begin + twice_odd * *slide_x).abs());
    *slide_x /= begin + end;
    *slide_x -= kept;
    end
}

/// What the elements carry together.
struct Carried {
    /// F/L along x, F/(s L) along y.
    resultant: [f32; 2],
    /// F/L along y.
    along_y: f32,
    /// Σ w_j y_j u_j² along x and y, u_jy as the state holds it.
    energy: [f32; 2],
}

/// Moves every element and returns those that yield to their yield surface; the state keeps forces and resultant.
#[inline(always)]
fn move_elements<const M: usize, const N: usize>(
    state: &mut StateOf<M>,
    data: &DataOf<M, N>,
    at: &AtDepth<'_>,
    [slide_x, slide_y]: [f32; 2],
    [retained_x, retained_y]: [f32; 2],
    surface: &YieldSurface,
    reversal: &mut Reversal,
) -> Carried {
    // Adding to −0 is nothing, to 0 an instruction.
    let (mut resultant_x, mut resultant_y, mut energy_x, mut energy_y) = (-0.0, -0.0, -0.0, -0.0);
    for (u, element) in state.force.iter_mut().zip(&data.elements) {
        let mut x = u[0] * retained_x + slide_x * element.inverse_yield;
        let mut y = u[1] * retained_y + slide_y * element.inverse_yield;
        let level = surface.level([x, y]);
        reversal.note(level);
        // Computed whether it is wanted or not: a step takes the same time in stick and in slip.
        let [back_x, back_y] = surface.return_map([x, y], level);
        x = select_unpredictable(level > YIELD, back_x, x);
        y = select_unpredictable(level > YIELD, back_y, y);
        *u = [x, y];
        resultant_x += element.strength * x;
        resultant_y += element.strength * y;
        energy_x += element.energy * x * x;
        energy_y += element.energy * y * y;
    }
    state.resultant = [resultant_x, resultant_y];
    Carried {
        along_y: at.stiffness_anisotropy * resultant_y,
        resultant: [resultant_x, resultant_y * at.strength_anisotropy],
        energy: [energy_x, energy_y],
    }
}

/// Whether the bits of a time step are a positive number that is not subnormal.
#[inline(always)]
fn is_time(dt: u32) -> bool {
    const LEAST: u32 = f32::MIN_POSITIVE.to_bits();
    dt.wrapping_sub(LEAST) < f32::INFINITY.to_bits() - LEAST
}

/// How far the bits of a number are above those of 2^-20; for 2^-20 to 2^108 the highest two are not set. A time step
/// below 1 µs is as good as another, it only takes a few instructions more.
#[inline(always)]
fn above_least(x: f32) -> u32 {
    x.to_bits().wrapping_sub(TOUCH_MM.to_bits())
}

/// Tells the compiler that what comes with it is rare.
#[inline]
#[cold]
fn rare() {}

/// What is to be remarked about a depth and a time step that are out of the ordinary, which they may be rightly.
#[inline(always)]
fn doubt(depth: f32, dt: u32) -> Status {
    let time = if is_time(dt) { Status::OK } else { Status::BAD_TIME_STEP };
    if depth.abs() <= f32::MAX { time } else { time.with(Status::BAD_INPUT) }
}

/// Without contact the elements are forgotten, the strength factor stays.
#[inline(always)]
fn in_the_air<const M: usize>(state: &mut StateOf<M>, motion: Motion, mut status: Status) -> Response {
    if !motion.slide_increment_mm.iter().all(|s| s.is_finite()) {
        status = status.with(Status::BAD_INPUT);
    }
    lift_off(state);
    Response { slip_margin: 1.0, status, ..Response::default() }
}

#[cold]
#[inline(never)]
fn lift_off<const M: usize>(state: &mut StateOf<M>) {
    *state = StateOf { strength_factor: state.strength_factor, ..StateOf::default() };
}

/// A slide that is no number or too long, made harmless: components that are no numbers become 0, or what pressing
/// amounts to along x, the rest is cut in proportion. Returns the whole in slip lengths.
///
/// Part of the step and no call: a call would want registers and stack of every step.
#[inline(always)]
fn bounded_slide(x_mm: f32, y_mm: f32, coupled: f32, per_slip: f32) -> [f32; 2] {
    let number = |s: f32, none: f32| if s.abs() <= f32::MAX { s.clamp(-1e6, 1e6) } else { none };
    let (x, y) = (number(x_mm, coupled) * per_slip, number(y_mm, 0.0) * per_slip);
    let length = x.abs() + y.abs();
    let cut = if length > SLIDE_MAX { SLIDE_MAX / length } else { 1.0 };
    [x * cut, y * cut]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Data, Params, Regime, State};

    #[test]
    fn example_presses_and_slides() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let mut state = State::default();
        let mut last = Response::default();
        for i in 1..=100 {
            last = step(&model, &mut state, Motion { depth_mm: 0.01 * i as f32, dt_s: 1e-3, ..Default::default() });
        }
        assert_eq!(last.regime, Regime::Stick);
        for _ in 0..3000 {
            last = step(&model, &mut state, Motion { depth_mm: 1.0, slide_increment_mm: [0.01, 0.01], dt_s: 1e-3 });
        }
        // Steady slip: friction along the motion although the finger is softer and weaker along y.
        assert_eq!(last.regime, Regime::Slip);
        let quotient = last.friction_n[0] / last.friction_n[1];
        assert!((quotient - 1.0).abs() < 0.01, "{quotient}");
    }

    /// The plane's work around: press to 1 mm, load along x, back to 0.5 mm, unload, lift.
    fn work_of_a_loop(data: &Data) -> f64 {
        let model = ModelOf::from_checked(data);
        let mut state = State::default();
        let mut work = 0.0;
        let mut go = |depth: i32, x: f32| {
            let motion = Motion { depth_mm: 1e-3 * depth as f32, slide_increment_mm: [x, 0.0], dt_s: 1e-3 };
            let before = state.depth;
            let r = step(&model, &mut state, motion);
            work += f64::from(r.normal_force_n) * f64::from(state.depth - before) + f64::from(r.friction_n[0] * x);
            r.friction_n[0]
        };
        (1..=1000).for_each(|d| _ = go(d, 0.0));
        (0..600).for_each(|_| _ = go(1000, 0.001));
        (500..1000).rev().for_each(|d| _ = go(d, 0.0));
        while go(500, -0.001) > 0.0 {}
        (0..500).rev().for_each(|d| _ = go(d, 0.0));
        work
    }

    /// The work test can fail: normal force from energy that the elements do not hold comes back as work.
    #[test]
    fn the_check_is_what_keeps_energy_from_nothing() {
        let mut params = Params::example();
        for node in &mut params.nodes {
            node.normal_shear_x_n *= 3.0;
        }
        let mut data = params.try_build().unwrap();
        let honest = work_of_a_loop(&data);
        for element in &mut data.elements {
            element.energy *= 10.0;
        }
        assert!(data.check().is_err());
        let forged = work_of_a_loop(&data);
        assert!(honest > 0.0 && forged < 0.0, "{honest} and {forged} mJ");
    }
}
