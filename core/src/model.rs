//! The reduced model and its step.
//!
//! Main types: [`ModelOf`] (immutable, its numbers stay in flash), [`StateOf`] (all the memory), [`Motion`],
//! [`Response`]. Uses table and math.

use bytemuck::{AnyBitPattern, Pod, Zeroable};

use crate::math::sqrt;
use crate::table::Row;
use crate::tune::{Fitted, Scaled, Scaling};
use crate::{Regime, Status};

/// Elements of the default model.
pub const ELEMENTS: usize = 2;
/// Depths at which the tables of the default model are given.
pub const NODES: usize = 25;

/// The default model; see [`ModelOf`].
pub type Model<'a> = ModelOf<'a, ELEMENTS, NODES>;
/// The default model retuned to another finger; see [`ModelOf::tuned`].
pub type Tuned<'a> = ModelOf<'a, ELEMENTS, NODES, Scaled>;
/// The numbers of the default model; see [`DataOf`].
pub type Data = DataOf<ELEMENTS, NODES>;
/// The memory of the default model; see [`StateOf`].
pub type State = StateOf<ELEMENTS>;

/// One elasto-slip element as the step reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Element {
    /// 1 over the relative slide at which it yields.
    pub inverse_yield: f32,
    /// Its share of the strength.
    pub strength: f32,
}

/// The numbers of a model as they lie in flash, made by [`crate::ParamsOf::try_build`] or read from a file.
///
/// Plain 32-bit floats throughout, so that a file can be used where it lies.
#[derive(Clone, Copy, Debug, PartialEq, AnyBitPattern)]
#[repr(C)]
pub struct DataOf<const M: usize, const N: usize> {
    /// Largest depth of the tables, mm.
    pub depth_max: f32,
    /// Cells of the tables per mm.
    pub cells_per_mm: f32,
    /// Half of a cell, mm.
    pub half_cell: f32,
    /// See [`crate::ParamsOf::turn_slip`].
    pub turn_slip: f32,
    /// Growth of the area at full shear along +x, share; the same is lost along −x.
    pub area_tilt: f32,
    /// See [`crate::ParamsOf::growth_loss`].
    pub growth_loss: f32,
    /// See [`crate::ParamsOf::fall_loss`].
    pub fall_loss: f32,
    /// Half-width of the normal force's band in full slip over that of the table.
    pub band_normal_top: f32,
    /// What sticking takes off that.
    pub band_normal_slip: f32,
    /// Half-width of friction's band in full slip, share of the strength.
    pub band_friction_top: f32,
    /// What sticking takes off that.
    pub band_friction_slip: f32,
    /// Exponent of the local friction law, for retuning.
    pub pressure_exponent: f32,
    /// The elements.
    pub elements: [Element; M],
    /// The tables.
    pub rows: [Row; N],
}

/// A model ready to step: the numbers in flash and, once [`ModelOf::tuned`], the factors for another finger.
#[derive(Clone, Copy, Debug)]
pub struct ModelOf<'a, const M: usize, const N: usize, S = Fitted> {
    pub(crate) data: &'a DataOf<M, N>,
    pub(crate) scale: S,
}

impl<'a, const M: usize, const N: usize, S: Scaling> ModelOf<'a, M, N, S> {
    /// The numbers the model reads.
    pub fn data(&self) -> &'a DataOf<M, N> {
        self.data
    }

    /// Largest depth for which the model was fitted, mm.
    pub fn depth_max_mm(&self) -> f32 {
        self.scale.length(self.data.depth_max)
    }

    /// [`step`] as a method.
    #[inline]
    pub fn step(&self, state: &mut StateOf<M>, motion: Motion) -> Response {
        step(self, state, motion)
    }
}

/// Stiffness in the air, N/mm: more than any contact's, so that the first step takes its own for the reference.
pub(crate) const FRESH: f32 = 1e9;

/// All that a contact remembers. `Default` is a finger in the air.
///
/// Plain data of `2 M + 12` words: copy it to save it, or use [`StateOf::write_bytes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateOf<const M: usize> {
    /// Force of each element over its strength.
    pub(crate) force: [[f32; 2]; M],
    /// Their resultant over the strength.
    pub(crate) mean: [f32; 2],
    /// The way that it has gone since the motion last turned back, or from 0 in a fresh contact and after full slip.
    pub(crate) way: [f32; 2],
    /// The yield function where it turned; growth makes it less.
    pub(crate) worn: f32,
    pub(crate) depth: f32,
    pub(crate) limit: f32,
    pub(crate) stiffness: f32,
    /// Stiffness of that part of the contact which holds the forces, at most `stiffness`.
    pub(crate) reference: f32,
    /// Square of the friction and `NOTHING`, N².
    pub(crate) square: f32,
    /// Slide that pressing amounts to, half cells.
    pub(crate) pressed: f32,
    pub(crate) strength_factor: f32,
}

impl<const M: usize> Default for StateOf<M> {
    fn default() -> Self {
        Self {
            force: [[0.0; 2]; M],
            mean: [0.0; 2],
            way: [0.0; 2],
            worn: 0.0,
            depth: 0.0,
            limit: 0.0,
            stiffness: FRESH,
            reference: FRESH,
            square: 0.0,
            pressed: 0.0,
            strength_factor: 1.0,
        }
    }
}

impl<const M: usize> StateOf<M> {
    /// Whether the last step left the finger in contact.
    pub(crate) fn in_contact(&self) -> bool {
        self.limit > 0.0
    }

    /// The depth of the last step, mm.
    pub fn depth_mm(&self) -> f32 {
        self.depth
    }

    /// The factor on the strength; 1 unless set.
    pub fn strength_factor(&self) -> f32 {
        self.strength_factor
    }

    /// Sets the factor by which all strengths are multiplied from the next step on: the product of what moisture,
    /// speed, dwell or another finger make of the friction. Elements keep their force while it fits.
    ///
    /// Range 0.2 to 5; anything else is moved to the nearer end and NaN changes nothing. Returns the factor in use.
    pub fn set_strength_factor(&mut self, factor: f32) -> f32 {
        if !factor.is_nan() {
            self.strength_factor = factor.clamp(0.2, 5.0);
        }
        self.strength_factor
    }
}

/// What the plane does in one step.
///
/// The slide is an increment because an absolute one would lose microns in 32 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion {
    /// Depth at the end of the step, mm, positive into the finger; 0 or less is no contact.
    pub depth_mm: f32,
    /// Slide of the plane against the finger's base during the step, mm.
    pub slide_increment_mm: [f32; 2],
    /// Length of the step, s, > 0. The law itself is rate-independent.
    pub dt_s: f32,
}

/// Forces that the plane exerts on the finger, and how far the contact is from slipping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Response {
    /// Normal force, N, >= 0.
    pub normal_force_n: f32,
    /// Friction along x and y, N; points along the plane's motion.
    pub friction_n: [f32; 2],
    /// Stuck area over contact area: 1 in a fresh contact, 0 in full slip and without contact.
    pub stick_ratio: f32,
    /// Largest friction in the direction of the present one, N.
    pub friction_limit_n: f32,
    /// 1 − |friction| / friction_limit, 0 to 1; 1 without contact.
    pub slip_margin: f32,
    /// Contact area, mm².
    pub contact_area_mm2: f32,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: f32,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: f32,
    /// What the contact as a whole does.
    pub regime: Regime,
    /// Remarks.
    pub status: Status,
}

/// Longest slide in one step, in slip lengths: beyond full slip of every element, so that a cut loses nothing, and
/// small enough that no product overflows.
const SLIDE_MAX: f32 = 32.0;
/// Depth below which there is no contact, mm: quotients of forces of shallower ones leave the range of the floats.
pub(crate) const TOUCH_MM: f32 = 1.0 / (1 << 20) as f32;
/// Share of the way to the limit from which everything slips.
const FULL: f32 = 1.0 - 1e-4;
/// Square of a force, N², that is added to that of the friction, so that quotients of the two are numbers.
const NOTHING: f32 = 1e-26;
/// Value of the yield function at which an element yields. It is drawn back to 1, up to rounding; the gap between the
/// two is wider than that, so that an element on its limit stays where it is when nothing moves.
pub(crate) const YIELD: f32 = 1.0 + 1.0 / (1u32 << 18) as f32;

/// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
///
/// Elements j carry forces F_j = w_j L u_j within a circle that is shifted by alpha along x:
///
/// ```text
/// u_j += (K/L) (dx + dC(d), rho dy) / y_j      then back to |u_j|² − 2 alpha u_jx = 1, so that friction opposes slip
/// F    = L Σ w_j u_j
/// N    = N0(d) + C'(d) F_x + G_x(d) F_x² + G_y(d) F_y²
/// ```
///
/// with K, L, rho, C, alpha, N0, G from tables over depth. The shift makes the limit (1 + alpha²)^½ + alpha of L along
/// +x, (1 + alpha²)^½ − alpha along −x and L along y: a finger that is pushed back carries more than one that is pulled.
/// When the contact grows an element keeps its force. When it shrinks it retraces that down to the stiffness at which
/// the force came about, less a small loss, and keeps its displacement below. Bad input is flagged and leaves the axis
/// where it was; see [`Status`].
///
/// The stick ratio is (1 − p²) (1 − e v). p is the way that the resultant m = F/L has gone from where it last turned back,
/// m0, as a share of the way from there to the limit; v the yield function at m0, which is 1 on the limit, so that e is the
/// slip right after a turn back from full slip. Growth of the contact draws m0 to m and v to 0: what is pressed anew
/// sticks.
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
    if !(is_contact(depth) && is_time(motion.dt_s.to_bits())) {
        status = doubt(depth, motion.dt_s.to_bits());
        if status.contains(Status::BAD_INPUT) {
            depth = state.depth;
        }
        if !(depth >= TOUCH_MM) {
            if !motion.slide_increment_mm.iter().all(|s| s.is_finite()) {
                status = status.with(Status::BAD_INPUT);
            }
            lift_off(state, depth);
            return Response { slip_margin: 1.0, status, ..Response::default() };
        }
    }
    let x = depth * scale.per_mm(data.cells_per_mm);
    let mut index = x as u32 as usize;
    let mut t = x - index as f32;
    if index >= N - 1 {
        index = N - 1;
        t = 0.0;
        if x > (N - 1) as f32 {
            status = status.with(Status::DEPTH_ABOVE_RANGE);
        }
    }
    let row = &data.rows[index];

    // Tables
    let area = scale.area(row.area.at(t));
    let limit = scale.limit(row.limit.at(t), area) * state.strength_factor;
    let stiffness = scale.stiffness(row.stiffness.at(t));
    let ratio = row.ratio.at(t);
    let tilt = row.tilt.at(t);
    let tilt_twice = tilt + tilt;
    let press = row.press.at(t);
    let pressed = row.pressed + t * (row.press.value + press);

    // Depth: a growing contact keeps the elements' force, a shrinking one their displacement.
    let mut keep = 1.0;
    let mut reference = state.reference;
    let growth = stiffness - state.stiffness;
    if growth < 0.0 {
        keep += data.fall_loss * (growth / state.stiffness);
        if stiffness < reference {
            keep *= stiffness / reference;
            reference = stiffness;
        }
    } else {
        reference += data.growth_loss * growth;
    }
    let before = keep * keep * state.square;
    // A quotient, not a product with 1/limit: it is exactly 1 while nothing changes.
    let scarcer = state.limit / limit;
    keep *= scarcer;

    // Slide, in slip lengths
    let per_slip = stiffness / limit;
    let [way_x, way_y] = motion.slide_increment_mm;
    let coupled = (pressed - state.pressed) * scale.length(data.half_cell);
    let mut slide_x = (way_x + coupled) * per_slip;
    let mut slide_y = way_y * per_slip;
    // Numbers that are not negative order like their bits, and what is no number lies above them.
    if (slide_x * slide_x + slide_y * slide_y).to_bits() > (SLIDE_MAX * SLIDE_MAX).to_bits() {
        let whole = way_x.abs() <= f32::MAX && way_y.abs() <= f32::MAX;
        status = status.with(if whole { Status::LARGE_INCREMENT } else { Status::BAD_INPUT });
        [slide_x, slide_y] = tame(way_x, way_y, coupled, per_slip);
    }
    slide_y *= ratio;
    state.depth = depth;
    state.limit = limit;
    state.stiffness = stiffness;
    state.pressed = pressed;

    // Where it turns back: against the way that the resultant has gone since it last did.
    let grown = at_most_one(scarcer);
    let [mean_x, mean_y] = state.mean;
    let [mut way_x, mut way_y] = state.way;
    // A contact that shrinks loads by itself, one that grows unloads; both are positive, and so order like their bits.
    let swell = f32::from_bits(keep.to_bits().max(grown.to_bits())) - 1.0;
    let turns = (slide_x + swell * mean_x) * way_x + (slide_y + swell * mean_y) * way_y < 0.0;
    if turns {
        [way_x, way_y] = [0.0, 0.0];
    }
    let twice = grown * grown;
    let forgets = twice * twice * twice;
    let from_x = grown * mean_x - forgets * way_x;
    let from_y = grown * mean_y - forgets * way_y;
    // The yield function there, from its far side.
    let room = 1.0 - (from_y * from_y + from_x * (from_x - tilt_twice));
    let room = at_most_one(not_negative(room));
    let worn = if turns { 1.0 - room } else { state.worn * forgets };
    state.worn = worn;

    let lack = 1.0 - ratio;
    let rest = ratio - lack;
    // Adding to −0 is nothing, to 0 an instruction.
    let (mut mean_x, mut mean_y) = (-0.0, -0.0);
    for (u, element) in state.force.iter_mut().zip(&data.elements) {
        let mut ux = u[0] * keep + slide_x * element.inverse_yield;
        let mut uy = u[1] * keep + slide_y * element.inverse_yield;
        let level = uy * uy + ux * (ux - tilt_twice);
        // Computed whether it is wanted or not: a step takes the same time in stick and in slip.
        let back = drawn_back(ux, uy, level, tilt, lack, rest);
        if level > YIELD {
            [ux, uy] = back;
        }
        *u = [ux, uy];
        mean_x += element.strength * ux;
        mean_y += element.strength * uy;
    }
    state.mean = [mean_x, mean_y];

    // Stick ratio
    let way = [mean_x - from_x, mean_y - from_y];
    let used = used_up(way, [from_x - tilt, from_y], room);
    let mut stick_ratio = (1.0 - used * used) * (1.0 - data.turn_slip * worn);
    state.way = way;
    if used >= FULL {
        stick_ratio = 0.0;
        state.way = state.mean;
    }

    // Resultants
    let friction_x = limit * mean_x;
    let friction_y = limit * mean_y;
    let xx = friction_x * friction_x;
    let yy = friction_y * friction_y;
    let square = xx + yy + NOTHING;
    if square > before {
        let carried = reference * square;
        reference = stiffness * (carried / (carried + before * (stiffness - reference)));
    }
    state.reference = reference;
    state.square = square;
    // Share of the limit in use, times the strength: the friction's length over the limit in its direction.
    let ahead = tilt * friction_x;
    let used = sqrt(square + ahead * ahead) - ahead;
    let friction_limit = limit * (sqrt(square) / used);
    let shear = scale.per_newton(row.shear_x.at(t) * xx + row.shear_y.at(t) * yy);
    let normal = scale.normal(row.normal.at(t)) + press * friction_x + shear;
    Response {
        normal_force_n: not_negative(normal),
        friction_n: [friction_x, friction_y],
        stick_ratio,
        friction_limit_n: friction_limit,
        slip_margin: 1.0 - used / limit,
        contact_area_mm2: area + area * data.area_tilt * mean_x,
        band_normal_n: scale.normal(row.band_normal.at(t))
            * (data.band_normal_top - data.band_normal_slip * stick_ratio),
        band_friction_n: limit * (data.band_friction_top - data.band_friction_slip * stick_ratio),
        regime: regime_of(stick_ratio),
        status,
    }
}

/// An element beyond its limit drawn back onto it.
///
/// The overshoot goes back along (u_x, rho u_y) as slip, which makes friction oppose it. With the slope
/// f = 2 (u_x² + rho u_y²) − 2 alpha u_x and o = v² − v the direction is (u_x (f + rho o), u_y (f + o)), where
/// f + o = v² + u_x² + (2 rho − 1) u_y².
#[inline(always)]
fn drawn_back(mut x: f32, mut y: f32, level: f32, tilt: f32, lack: f32, rest: f32) -> [f32; 2] {
    let mut along = level * level;
    let over = along - level;
    along += x * x;
    along += rest * y * y;
    y *= along;
    x *= along - lack * over;
    let ahead = tilt * x;
    let back = 1.0 / (sqrt(x * x + y * y + ahead * ahead) - ahead);
    [x * back, y * back]
}

/// How much of the way to the limit a resultant has gone, 0 to 1; at the limit it may be a little off 1.
///
/// p solves |from + way/p| = limit, a circle around the tilt. `from` is counted from there, `room` is 1 less the yield
/// function there.
#[inline(always)]
fn used_up(way: [f32; 2], from: [f32; 2], room: f32) -> f32 {
    let [x, y] = way;
    let square = x * x + y * y;
    let ahead = x * from[0] + y * from[1];
    let root = sqrt(ahead * ahead + square * room);
    square / (root - ahead + NOTHING)
}

/// `x`, or 1 if it is above; `x` is not negative. In whole numbers, which order like the floats.
#[inline(always)]
fn at_most_one(x: f32) -> f32 {
    f32::from_bits(x.to_bits().min(1.0f32.to_bits()))
}

/// `x`, or 0 if it is negative.
#[inline(always)]
fn not_negative(x: f32) -> f32 {
    f32::from_bits((x.to_bits() as i32).max(0) as u32)
}

/// [`Regime::classify`] of a contact, for a stick ratio within 0 and 1.
#[inline(always)]
fn regime_of(stick_ratio: f32) -> Regime {
    let bits = stick_ratio.to_bits();
    if bits >= 0.99f32.to_bits() {
        Regime::Stick
    } else if bits <= 0.01f32.to_bits() {
        Regime::Slip
    } else {
        Regime::PartialSlip
    }
}

/// Limit over the strength L in a direction; `shift` is the tilt times its cosine to x.
#[inline(always)]
pub(crate) fn limit_share(shift: f32) -> f32 {
    shift + sqrt(1.0 + shift * shift)
}

/// Whether the bits of a time step are a positive number that is not subnormal.
#[inline(always)]
fn is_time(dt: u32) -> bool {
    const LEAST: u32 = f32::MIN_POSITIVE.to_bits();
    dt.wrapping_sub(LEAST) < f32::INFINITY.to_bits() - LEAST
}

/// Whether a depth is a number deep enough for contact.
#[inline(always)]
fn is_contact(depth: f32) -> bool {
    const LEAST: u32 = TOUCH_MM.to_bits();
    depth.to_bits().wrapping_sub(LEAST) < f32::INFINITY.to_bits() - LEAST
}

/// What is to be remarked about a depth and a time step that are not both positive numbers.
#[cold]
#[inline(never)]
fn doubt(depth: f32, dt: u32) -> Status {
    let time = if is_time(dt) { Status::OK } else { Status::BAD_TIME_STEP };
    if depth.abs() <= f32::MAX { time } else { time.with(Status::BAD_INPUT) }
}

/// No contact: the elements are forgotten, the strength factor stays.
#[cold]
#[inline(never)]
fn lift_off<const M: usize>(state: &mut StateOf<M>, depth: f32) {
    *state = StateOf { strength_factor: state.strength_factor, depth, ..StateOf::default() };
}

/// A slide that is no number or too long, made harmless: components that are no numbers become 0, the rest is cut
/// in proportion. Returns the whole in slip lengths.
#[cold]
#[inline(never)]
fn tame(way_x: f32, way_y: f32, coupled: f32, per_slip: f32) -> [f32; 2] {
    let number = |s: f32| if s.abs() <= f32::MAX { s.clamp(-1e6, 1e6) } else { 0.0 };
    let (way_x, way_y) = (number(way_x), number(way_y));
    let (x, y) = ((way_x + coupled) * per_slip, way_y * per_slip);
    let length = x.abs() + y.abs();
    let cut = if length > SLIDE_MAX { SLIDE_MAX / length } else { 1.0 };
    [x * cut, y * cut]
}

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// A model on these numbers, after [`DataOf::check`].
    pub fn model(&self) -> Result<ModelOf<'_, M, N>, crate::Error> {
        self.check()?;
        Ok(ModelOf::from_checked(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;

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
        // Steady slip: friction along the motion although the finger is softer along y.
        assert_eq!(last.regime, Regime::Slip);
        assert!((last.friction_n[0] / last.friction_n[1] - 1.0).abs() < 0.02);
    }

    /// The plane's work around: press to one depth, load along x there, go to the other, unload, lift.
    fn work_of_a_loop(data: &Data, depths: [u32; 2]) -> f64 {
        let model = ModelOf::from_checked(data);
        let mut state = State::default();
        let mut work = 0.0;
        let mut go = |depth: f32, x: f32| {
            let before = state.depth;
            let motion = Motion { depth_mm: depth, slide_increment_mm: [x, 0.0], dt_s: 1e-3 };
            let r = step(&model, &mut state, motion);
            work += f64::from(r.normal_force_n) * f64::from(depth - before) + f64::from(r.friction_n[0]) * f64::from(x);
        };
        let [loaded, unloaded] = depths;
        let at = |i: u32| 0.002 * i as f32;
        for i in 1..=loaded {
            go(at(i), 0.0);
        }
        for _ in 0..500 {
            go(at(loaded), 0.001);
        }
        for i in 1..=loaded.abs_diff(unloaded) {
            go(at(if unloaded > loaded { loaded + i } else { loaded - i }), 0.0);
        }
        for _ in 0..500 {
            go(at(unloaded), -0.001);
        }
        for i in (0..unloaded).rev() {
            go(at(i), 0.0);
        }
        work
    }

    /// The work test can fail: a shear term beyond the check's limit makes energy, one at the limit does not.
    #[test]
    fn the_check_is_what_keeps_energy_from_nothing() {
        let mut data = Params::example().try_build().unwrap();
        data.growth_loss = 0.3;
        // What is added pays when the contact falls under load, what is taken off when it grows.
        for (sign, depths) in [(1.0, [1000, 500]), (-1.0, [500, 1000])] {
            let set = |data: &mut Data, newtons: f32| {
                for i in 0..NODES {
                    let at = |i: usize| sign * newtons * i as f32 / (NODES - 1) as f32;
                    data.rows[i].shear_x = crate::Line::between(at(i), at((i + 1).min(NODES - 1)));
                }
            };
            set(&mut data, 0.0);
            assert!(work_of_a_loop(&data, depths) > 0.0);
            let mut newtons = 40.0;
            set(&mut data, newtons);
            assert!(matches!(data.check(), Err(crate::Error::NotPassive { what: crate::Field::NormalShearX, .. })));
            assert!(work_of_a_loop(&data, depths) < 0.0, "{sign} {}", work_of_a_loop(&data, depths));
            while data.check().is_err() {
                newtons *= 0.95;
                set(&mut data, newtons);
            }
            assert!(newtons > 1e-3 && work_of_a_loop(&data, depths) > 0.0, "{sign} {newtons}");
        }
    }

    /// Drawing an element back onto its limit never gives energy: F · plastic slip >= 0 for any stiffness ratio,
    /// tilt, direction and overshoot, and what was drawn back does not yield again.
    #[test]
    fn yielding_dissipates() {
        for ratio in [0.25f64, 0.4, 0.6, 0.8, 1.0, 1.3, 2.0, 4.0] {
            for tilt in [-0.25f64, -0.1, 0.0, 0.03, 0.2, 0.25] {
                for degrees in 0..=180 {
                    for overshoot in [2e-3f64, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0] {
                        let (s, c) = f64::from(degrees).to_radians().sin_cos();
                        let limit = tilt * c + (1.0 + tilt * tilt * c * c).sqrt();
                        let (ux, uy) = (c * limit * (1.0 + overshoot), s * limit * (1.0 + overshoot));
                        let square = ux * ux + uy * uy;
                        let level = square - 2.0 * tilt * ux;
                        let lack = 1.0 - ratio;
                        let over = level * level - level;
                        let along_y = over + level + square - 2.0 * lack * uy * uy;
                        let along_x = along_y - lack * over;
                        let (wx, wy) = (ux * along_x, uy * along_y);
                        let length = wx * wx + wy * wy;
                        let back = (tilt * wx + (tilt * tilt * wx * wx + length).sqrt()) / length;
                        let (nx, ny) = (wx * back, wy * back);
                        let slip = [ux - nx, (uy - ny) / ratio];
                        let gain = nx * slip[0] + ny * slip[1];
                        assert!(gain >= 0.0, "{ratio} {tilt} {degrees} {overshoot}: {gain}");
                        let again = nx * nx + ny * ny - 2.0 * tilt * nx;
                        assert!((again - 1.0).abs() < 1e-12, "{tilt} {degrees}: {again}");
                    }
                }
            }
        }
    }
}
