//! One step of a contact.
//!
//! Main function: [`step()`]. Uses data, state, yielding, stick and math.

use core::hint::select_unpredictable;

use crate::math::{not_negative, sqrt};
use crate::stick::{follow, regime_of};
use crate::tune::Scaling;
use crate::yielding::{YIELD, drawn_back};
use crate::{ModelOf, Motion, Response, StateOf, Status};

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
/// with K, L, s, rho, C, alpha, N0, G from tables over depth. What is drawn back goes as slip along the friction. The limit
/// is (1 + alpha²)^½ + alpha of L along +x, (1 + alpha²)^½ − alpha along −x and s along y: a finger that is pushed back
/// carries more than one that is pulled, and with q > 0 it is stiffer as well. (P_x + P_y)/2K is the elements' elastic
/// energy, 2/3 q F_x³ that of the odd compliance.
///
/// # Depth
///
/// A contact is like springs side by side, of which those at the rim came last and go first (the method of dimensionality
/// reduction: Popov & Heß 2015). What comes carries nothing: growth keeps the forces, and the energy that the stiffer
/// elements lack, since what came moved less than what was there, is held. What goes takes its force along: a loss dK of
/// stiffness changes F by −e dK, e the rim's elastic displacement. The state knows by how much e lags behind F/K; growth
/// renews the rim, e goes to 0, and slides move rim and middle alike. So the way back over a depth that was gained in a
/// slide takes off what that slide brought, in its direction. The lag is paid for from what is held: when nothing is left
/// the displacement is the same everywhere.
///
/// Bad input is flagged and leaves the axis where it was; see [`Status`]. The stick ratio is in `stick.rs`.
///
/// No creep: with the motion at rest the state keeps its bits. Leaves out: rate, dwell and moisture other than
/// through [`StateOf::set_strength_factor`].
#[inline(always)]
pub fn step<const M: usize, const N: usize, S: Scaling>(
    model: &ModelOf<'_, M, N, S>,
    state: &mut StateOf<M>,
    motion: Motion,
) -> Response {
    let data = model.data;
    let scale = &model.scale;
    let mut depth = motion.depth_mm;
    let mut status = Status::OK;
    // Both in one comparison: one of the highest two bits tells that either is out of the ordinary.
    if (above_least(depth) | above_least(motion.dt_s)) >> 30 != 0 {
        rare();
        status = doubt(depth, motion.dt_s.to_bits());
        if status.contains(Status::BAD_INPUT) {
            depth = state.depth;
        }
        if !(depth >= TOUCH_MM) {
            if !motion.slide_increment_mm.iter().all(|s| s.is_finite()) {
                status = status.with(Status::BAD_INPUT);
            }
            lift_off(state);
            return Response { slip_margin: 1.0, status, ..Response::default() };
        }
    }
    let x = depth * scale.per_mm(data.cells_per_mm);
    let mut index = x as u32 as usize;
    let mut t = x - index as f32;
    if index >= N - 1 {
        index = N - 1;
        t = 0.0;
        depth = scale.length(data.depth_max);
        if x > (N - 1) as f32 {
            status = status.with(Status::DEPTH_ABOVE_RANGE);
        }
    }
    let row = &data.rows[index];

    // Tables
    let area = scale.area(row.area.at(t));
    let plain_limit = scale.limit(row.limit.at(t), area);
    let limit = plain_limit * state.strength_factor;
    let stiffness = scale.stiffness(row.stiffness.at(t));
    let across = row.across.at(t);
    let round = row.round.at(t);
    let tilt = row.tilt.at(t);
    let tilt_twice = tilt + tilt;
    let shear_x = scale.per_newton(row.shear_x.at(t));
    let shear_y = scale.per_newton(row.shear_y.at(t));
    let press = row.press.at(t);
    let pressed = row.pressed + t * (row.press.value + press);

    // Slide, in slip lengths
    let per_slip = stiffness / limit;
    let [way_x, way_y] = motion.slide_increment_mm;
    let coupled = (pressed - state.pressed) * scale.length(data.half_cell);
    let way_x = way_x + coupled;
    let mut slide_x = way_x * per_slip;
    let mut slide_y = way_y * per_slip;
    // Numbers that are not negative order like their bits, and what is no number lies above them.
    if (slide_x * slide_x + slide_y * slide_y).to_bits() > (SLIDE_MAX * SLIDE_MAX).to_bits() {
        let whole = way_x.abs() <= f32::MAX && way_y.abs() <= f32::MAX;
        status = status.with(if whole { Status::LARGE_INCREMENT } else { Status::BAD_INPUT });
        [slide_x, slide_y] = tame(way_x, way_y, coupled, per_slip);
    }
    slide_y *= across;

    // Depth
    let grown = stiffness - state.stiffness;
    let deeper = stiffness * (depth - state.depth);
    // A quotient, not a product with 1/limit: it is exactly 1 while nothing changes.
    let scarcer = state.limit / limit;
    let mut keep = scarcer;
    let [lag_x, lag_y] = state.lag;
    if grown >= 0.0 {
        // What comes carries nothing, so that the rim lags by the whole displacement once most of it is new.
        let share = grown / stiffness;
        state.held += share * state.energy;
        let renewed = share / (RENEWAL + (1.0 - RENEWAL) * share);
        let slip_length = state.limit / stiffness;
        let (old, new) = (1.0 - renewed, slip_length * renewed);
        let renew = |lag: f32, mean: f32| old * lag + new * mean;
        state.lag = [renew(lag_x, state.mean[0]), renew(lag_y, state.mean[1])];
    } else {
        // What goes takes the rim's force along: displacement kept, and the lag slid back as far as the energy held pays.
        let mut share = -grown / stiffness;
        let before = 1.0 + share;
        let taken = -grown * before * (lag_x * lag_x + lag_y * lag_y);
        keep /= before;
        if taken > state.held {
            share *= state.held / taken;
            state.held = 0.0;
        } else {
            state.held -= taken;
        }
        let back = [share * lag_x, share * lag_y];
        state.lag = [lag_x + back[0], lag_y + back[1]];
        slide_x += back[0] * per_slip;
        slide_y += back[1] * per_slip;
    }
    // The work of G.
    let kept_deeper = keep * deeper;
    let keep_y = keep + kept_deeper * shear_y;
    keep += kept_deeper * shear_x;

    // The finger is softer along +x the more it carries there: the slide's square root law, solved for its end.
    let twice_odd = scale.odd(data.twice_odd) * (stiffness * plain_limit);
    let was = state.mean[0] * scarcer;
    let kept = state.mean[0] * keep - was;
    slide_x += kept;
    slide_x += slide_x;
    let begin = 1.0 + twice_odd * was;
    let end = sqrt((begin * begin + twice_odd * slide_x).abs());
    slide_x /= begin + end;
    slide_x -= kept;
    state.depth = depth;
    state.limit = limit;
    state.stiffness = stiffness;
    state.pressed = pressed;

    let mean = [state.mean[0], round * state.mean[1]];
    let mut turn = follow(state, mean, [slide_x, slide_y * round], keep, scarcer, tilt_twice);

    // Elements
    let ratio = across * across * end;
    let lack = 1.0 - ratio;
    let rest = ratio - lack;
    // Adding to −0 is nothing, to 0 an instruction.
    let (mut mean_x, mut mean_y, mut energy_x, mut energy_y) = (-0.0, -0.0, -0.0, -0.0);
    for (u, element) in state.force.iter_mut().zip(&data.elements) {
        let mut x = u[0] * keep + slide_x * element.inverse_yield;
        let mut y = u[1] * keep_y + slide_y * element.inverse_yield;
        let y_round = y * round;
        let level = y_round * y_round + x * (x - tilt_twice);
        turn.note(level);
        // Computed whether it is wanted or not: a step takes the same time in stick and in slip.
        let [back_x, back_y] = drawn_back([x, y], round, level, tilt, lack, rest);
        x = select_unpredictable(level > YIELD, back_x, x);
        y = select_unpredictable(level > YIELD, back_y, y);
        *u = [x, y];
        mean_x += element.strength * x;
        mean_y += element.strength * y;
        energy_x += element.energy * x * x;
        energy_y += element.energy * y * y;
    }
    state.mean = [mean_x, mean_y];
    let across_y = across * mean_y;
    mean_y *= round;
    let stick_ratio = turn.stick_ratio(state, [mean_x, mean_y], tilt, data);

    // Resultants
    let friction_x = limit * mean_x;
    let square = limit * limit;
    state.energy = square / stiffness * (energy_x + energy_y);
    let sheared = square * (shear_x * energy_x + shear_y * energy_y);
    let xx = mean_x * mean_x + NOTHING;
    let ahead = tilt * mean_x;
    // Share of the limit in use.
    let used = sqrt(xx + mean_y * mean_y + ahead * ahead) - ahead;
    let friction_limit = limit * (sqrt(xx + across_y * across_y) / used);
    let normal = scale.normal(row.normal.at(t)) + press * friction_x + sheared;
    let band = |b: &[f32; 3]| b[0] + stick_ratio * (b[1] + stick_ratio * b[2]);
    Response {
        normal_force_n: not_negative(normal),
        friction_n: [friction_x, limit * across_y],
        stick_ratio,
        friction_limit_n: friction_limit,
        slip_margin: 1.0 - used,
        contact_area_mm2: area + area * data.area_tilt * mean_x,
        band_normal_n: scale.normal(row.band_normal.at(t)) * band(&data.band_normal),
        band_friction_n: limit * band(&data.band_friction),
        regime: regime_of(stick_ratio),
        status,
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

/// No contact: the elements are forgotten, the strength factor stays.
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
fn tame(way_x: f32, way_y: f32, coupled: f32, per_slip: f32) -> [f32; 2] {
    let number = |s: f32, none: f32| if s.abs() <= f32::MAX { s.clamp(-1e6, 1e6) } else { none };
    let (x, y) = (number(way_x, coupled) * per_slip, number(way_y, 0.0) * per_slip);
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
