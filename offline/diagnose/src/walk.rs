//! The baseline with its laws along runs: elasto-slip elements in f64, simpler than `fingerpad`'s, which also remember what
//! a change of depth holds and by how much the rim lags.
//!
//! Main types: [`Plan`] (what of a prediction the freedoms do not touch: where runs go, what laws and draws do to each
//! row), [`Path`] (what the elements carry along it). Eight runs are walked at once, a run to a lane ([`Course`]);
//! logarithms and exponentials are those of `wide`, within 3e-16 of the standard ones (`tests::curves`).

use std::borrow::Cow;

use bytemuck::cast;
use wide::f64x8;

use super::base::{Base, ELEMENTS, LOAD_EXPONENT, ODD_SHAPE, READ_ONLY};
use super::course::{Course, Depths, LANES, Leg, Stop};
use super::laws::{Change, Law, REFERENCE_AREA_MM2};
use super::runs::Run;

/// A law in force.
#[derive(Clone, Debug, PartialEq)]
pub struct Active {
    /// The law.
    pub law: &'static Law,
    /// Its parameters as they are fitted.
    pub values: Vec<f64>,
}

/// What the random effects of a run, and nothing else, do to it.
#[derive(Clone, Copy, Debug)]
pub struct Nudge {
    /// Factor on the stiffness.
    pub stiffness: f64,
    /// Factor on the strength.
    pub strength: f64,
    /// Added to the depth, mm.
    pub depth_mm: f64,
}

impl Default for Nudge {
    fn default() -> Self {
        Self { stiffness: 1.0, strength: 1.0, depth_mm: 0.0 }
    }
}

/// What each run drew: logarithms of the factors on stiffness and strength, and the error of the touch point, mm.
/// Empty where all are taken as 0.
pub type Modes = Vec<[f64; 3]>;

/// What of a prediction the freedoms do not touch.
pub struct Plan<'a> {
    course: Cow<'a, Course>,
    changes: Vec<Change>,
    /// Factors on strength and stiffness at each stop.
    factors: Vec<[f64x8; 2]>,
    /// Whether anything acts on the readings alone.
    reads: bool,
}

/// What the elements carry at each stop: mean force along x and y over the strength, and the strength, N.
pub struct Path(Vec<[f64x8; 3]>);

impl<'a> Plan<'a> {
    /// The plan of runs with laws, what each run drew, and a nudge for all. `course`: that of the runs at their own
    /// depths.
    pub fn new(course: &'a Course, laws: &[Active], modes: &Modes, nudge: Nudge, runs: &[Run]) -> Self {
        let mut changes = Vec::with_capacity(course.rows);
        for (i, run) in runs.iter().enumerate() {
            let drew = modes.get(i).map_or([0.0; 3], |u| *u);
            let own = Change {
                strength: nudge.strength * drew[1].exp(),
                stiffness: nudge.stiffness * drew[0].exp(),
                depth_mm: nudge.depth_mm + drew[2],
                ..Change::default()
            };
            let first = changes.len();
            changes.resize(first + run.rows.len(), own);
            for active in laws {
                for (row, change) in run.rows.iter().zip(&mut changes[first..]) {
                    active.law.apply(&active.values, row, change);
                }
            }
        }
        let course = if changes.iter().all(|c| c.depth_mm == 0.0) {
            Cow::Borrowed(course)
        } else {
            let rows = runs.iter().flat_map(|r| &r.rows).zip(&changes);
            let depth_mm: Vec<f64> =
                rows.map(|(r, c)| if r.depth_mm > 0.0 { r.depth_mm + c.depth_mm } else { r.depth_mm }).collect();
            Cow::Owned(Course::new(runs, &depth_mm))
        };
        let at = |row: Option<u32>| row.map_or((1.0, 1.0), |row| changes[row as usize].factors());
        let lanes = |stop: &Stop| {
            let pairs = stop.row.map(at);
            [f64x8::new(pairs.map(|p| p.0)), f64x8::new(pairs.map(|p| p.1))]
        };
        let factors = course.stops.iter().map(lanes).collect();
        let reads = changes.iter().any(Change::reads);
        Self { course, changes, factors, reads }
    }

    /// Whether a freedom, by its place among them, moves the elements; the others act on the readings alone.
    pub fn path_depends_on(&self, freedom: usize) -> bool {
        match freedom {
            LOAD_EXPONENT => self.changes.iter().any(|c| c.stiffness != 1.0),
            _ => !READ_ONLY.contains(&freedom),
        }
    }

    /// The elements along the plan.
    pub fn path(&self, base: &Base) -> Path {
        let mut out = Vec::with_capacity(self.course.stops.len());
        let elements = base.elements.map(|e| e.map(f64x8::splat));
        for group in self.course.groups.windows(2) {
            let mut state = State::AIR;
            let stops = group[0]..group[1];
            for (stop, factors) in self.course.stops[stops.clone()].iter().zip(&self.factors[stops]) {
                let legs = &self.course.legs[stop.legs.clone()];
                let Some(last) = legs.last() else {
                    out.push([f64x8::ZERO; 3]);
                    continue;
                };
                let [mut strength, stiffness] = *factors;
                strength *= turned(base, &last.depth, &stop.heading);
                if stiffness != f64x8::ONE {
                    strength *= (stiffness.ln() * f64x8::splat(base.load_exponent)).exp();
                }
                let mut held = stop.held;
                for leg in legs {
                    state.step(base, &elements, leg, stop.slide_mm, (strength, stiffness), held);
                    held = f64x8::ONE;
                }
                let mut mean = [f64x8::ZERO; 2];
                for (u, element) in state.force.iter().zip(&elements) {
                    mean = [element[1].mul_add(u[0], mean[0]), element[1].mul_add(u[1], mean[1])];
                }
                out.push([mean[0], mean[1], state.limit]);
            }
        }
        Path(out)
    }

    /// Readings along a path of this plan, three per row, N: normal, x, y.
    pub fn readings(&self, base: &Base, path: &Path) -> Vec<f64> {
        let mut out = vec![0.0; 3 * self.course.rows];
        let splat = |v: [f64; 2]| v.map(f64x8::splat);
        let (shear, per_friction) = (splat(base.normal_shear), splat(base.normal_per_friction));
        for ((stop, [mx, my, limit]), factors) in self.course.stops.iter().zip(&path.0).zip(&self.factors) {
            let (mut elastic, mut force, mut depth_mm) = ([0.0; LANES], [[0.0; LANES]; 2], [0.0; LANES]);
            if let Some(Leg { depth, .. }) = self.course.legs[stop.legs.clone()].last() {
                let xx = *mx * *mx;
                let odd = f64x8::splat(base.odd) * depth.mm * (xx - f64x8::splat(ODD_SHAPE) * xx * xx);
                let (fx, fy) = (*limit * (*mx - odd), *limit * *my);
                let normal = depth.cubic(&base.normal).exp() * factors[1];
                let sheared = f64x8::ONE + shear[0] * xx + shear[1] * *my * *my;
                elastic = (normal * sheared + per_friction[0] * fx + per_friction[1] * fy).to_array();
                (force, depth_mm) = ([fx.to_array(), fy.to_array()], depth.mm.to_array());
            }
            for (l, row) in stop.row.iter().enumerate() {
                let Some(row) = row.map(|r| r as usize) else { continue };
                let reading = &mut out[3 * row..3 * row + 3];
                if !self.reads {
                    if stop.contact[l] {
                        reading.copy_from_slice(&[elastic[l], force[0][l], force[1][l]]);
                    }
                    continue;
                }
                let change = &self.changes[row];
                reading.copy_from_slice(&change.reading_n);
                if stop.contact[l] {
                    let (mut normal, mut drag) = (elastic[l], 0.0);
                    if change.adhesion_n != 0.0 || change.drag_n != 0.0 {
                        let area = base.at(depth_mm[l]).area_mm2 / REFERENCE_AREA_MM2;
                        normal -= change.adhesion_n * area.sqrt();
                        drag = change.drag_n * area;
                    }
                    reading[0] += normal;
                    for k in 0..2 {
                        let along = stop.heading[2 + k].as_array()[l];
                        reading[1 + k] += force[k][l] + drag * along + change.cross[k] * normal;
                    }
                }
            }
        }
        out
    }

    /// Predicted readings, three per row, N: normal, x, y.
    pub fn predict(&self, base: &Base) -> Vec<f64> {
        self.readings(base, &self.path(base))
    }
}

/// What the strength gains in a direction of motion.
fn turned(base: &Base, depth: &Depths, heading: &[f64x8; 4]) -> f64x8 {
    let [c2, s2, c, s] = heading;
    let slope = f64x8::splat(base.even_slope).mul_add(depth.inside, f64x8::splat(base.even[0]));
    let even = slope * *c2 + f64x8::splat(base.even[1]) * *s2;
    f64x8::ONE + (even + f64x8::splat(base.first[0]) * *c + f64x8::splat(base.first[1]) * *s)
}

/// 1/√x of normal numbers, within 5e-16: half the exponent for a start [Lomont 2003, "Fast inverse square root"], then
/// Newton's steps. Root and quotient would take most of a walk's time.
fn inverse_root(x: f64x8) -> f64x8 {
    let bits: [u64; LANES] = cast(x);
    let mut y: f64x8 = cast(bits.map(|b| 0x5FE6_EB50_C7B5_37A9u64.wrapping_sub(b >> 1)));
    let half = x * f64x8::HALF;
    for _ in 0..4 {
        y *= (half * y).mul_neg_add(y, f64x8::splat(1.5));
    }
    y
}

struct State {
    force: [[f64x8; 2]; ELEMENTS],
    limit: f64x8,
    stiffness: f64x8,
    pressed: f64x8,
}

impl State {
    const AIR: Self =
        Self { force: [[f64x8::ZERO; 2]; ELEMENTS], limit: f64x8::ZERO, stiffness: f64x8::ZERO, pressed: f64x8::ZERO };

    /// One step of all elements; a growing contact keeps their forces, a shrinking one their displacements.
    ///
    /// * `changes`: factors on strength and stiffness
    /// * `held`: 0 where the finger comes from the air
    fn step(
        &mut self,
        base: &Base,
        elements: &[[f64x8; 2]; ELEMENTS],
        leg: &Leg,
        slide_mm: [f64x8; 2],
        changes: (f64x8, f64x8),
        held: f64x8,
    ) {
        let depth = &leg.depth;
        let limit = depth.cubic(&base.strength).exp() * changes.0;
        let stiffness = depth.cubic(&base.tangential).exp() * changes.1;
        let ratio = f64x8::splat(base.ratio[1]).mul_add(depth.inside, f64x8::splat(base.ratio[0])).exp();
        let pressed = depth.mm * f64x8::splat(0.5 * base.press[1]).mul_add(depth.mm, f64x8::splat(base.press[0]));
        let softer = stiffness.simd_lt(self.stiffness);
        let softer = if softer.any() { softer.select(stiffness / self.stiffness, f64x8::ONE) } else { f64x8::ONE };
        let keep = self.limit / limit * softer * held;
        let per_slip = stiffness / limit;
        let x = (slide_mm[0] * leg.share + pressed - self.pressed * held) * per_slip;
        let y = slide_mm[1] * leg.share * per_slip * ratio;
        (self.limit, self.stiffness, self.pressed) = (limit, stiffness, pressed);
        let lack = f64x8::ONE - ratio;
        let moves = leg.share.simd_gt(f64x8::ZERO);
        for (u, element) in self.force.iter_mut().zip(elements) {
            let ux = u[0].mul_add(keep, x * element[0]);
            let uy = u[1].mul_add(keep, y * element[0]);
            let square = ux.mul_add(ux, uy * uy);
            let slips = square.simd_gt(f64x8::ONE) & moves;
            *u = [ux, uy];
            if slips.any() {
                let fourth = square * square;
                let along_y = fourth + square - (lack + lack) * uy * uy;
                let along_x = along_y - lack * (fourth - square);
                let (sx, sy) = (ux * along_x, uy * along_y);
                let back = inverse_root(sx.mul_add(sx, sy * sy));
                *u = [slips.select(sx * back, ux), slips.select(sy * back, uy)];
            }
        }
    }
}

/// Predicted readings of all runs, three per row, each with what it drew and a nudge for all.
pub fn walk_all(base: &Base, laws: &[Active], modes: &Modes, nudge: Nudge, runs: &[Run]) -> Vec<f64> {
    Plan::new(&Course::of(runs), laws, modes, nudge, runs).predict(base)
}

#[cfg(test)]
mod tests;
