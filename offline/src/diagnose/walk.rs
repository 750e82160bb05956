//! The baseline with its laws along a run: elasto-slip elements in f64, simpler than `fingerpad`'s, which also remember what
//! a change of depth holds and by how much the rim lags.

use super::base::{Base, ELEMENTS};
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

/// Largest change of depth in one step, mm.
const DEPTH_STEP_MM: f64 = 0.08;

struct State {
    force: [[f64; 2]; ELEMENTS],
    limit: f64,
    stiffness: f64,
    pressed: f64,
    depth: f64,
}

impl State {
    const AIR: Self = Self { force: [[0.0; 2]; ELEMENTS], limit: 0.0, stiffness: 0.0, pressed: 0.0, depth: 0.0 };
}

/// Predicted readings of a run, three per row, N: normal, x, y; appended to `out`.
pub fn walk(base: &Base, laws: &[Active], nudge: Nudge, run: &Run, out: &mut Vec<f64>) {
    let mut state = State::AIR;
    for (i, row) in run.rows.iter().enumerate() {
        let mut change = Change {
            strength: nudge.strength,
            stiffness: nudge.stiffness,
            depth_mm: nudge.depth_mm,
            ..Change::default()
        };
        for active in laws {
            (active.law.apply)(&active.values, row, &mut change);
        }
        let depth = if row.depth_mm > 0.0 { row.depth_mm + change.depth_mm } else { row.depth_mm };
        let [b_n, b_x, b_y] = change.reading_n;
        if !(depth > 0.0) {
            state = State::AIR;
            out.extend([b_n, b_x, b_y]);
            continue;
        }
        let even = base.turned(depth, row.double_angle, row.along);
        let strength = change.strength * (1.0 + even) * load_power(change.stiffness, base.load_exponent);
        let slide = run.increment(i);
        let steps = ((depth - state.depth).abs() / DEPTH_STEP_MM).ceil().clamp(1.0, 12.0);
        let (from, share) = (state.depth, 1.0 / steps);
        let mut at = super::base::AtDepth::default();
        for k in 1..=steps as usize {
            let d = if k == steps as usize { depth } else { from + (depth - from) * k as f64 * share };
            at = base.at(d);
            at.strength_n *= strength;
            at.tangential_n_mm *= change.stiffness;
            step(base, &mut state, &at, [slide[0] * share, slide[1] * share]);
            state.depth = d;
        }
        let (mut mx, mut my) = (0.0, 0.0);
        for (u, element) in state.force.iter().zip(&base.elements) {
            mx += element[1] * u[0];
            my += element[1] * u[1];
        }
        let xx = mx * mx;
        let alpha = base.odd * depth;
        let fx = at.strength_n * (mx - alpha * (xx - super::base::ODD_SHAPE * xx * xx));
        let fy = at.strength_n * my;
        let area = at.area_mm2 / REFERENCE_AREA_MM2;
        let elastic =
            at.normal_n * change.stiffness * (1.0 + base.normal_shear[0] * xx + base.normal_shear[1] * my * my)
                + base.normal_per_friction[0] * fx
                + base.normal_per_friction[1] * fy;
        let normal = elastic - change.adhesion_n * area.sqrt();
        let drag = change.drag_n * area;
        out.push(normal + b_n);
        out.push(fx + drag * row.along[0] + change.cross[0] * normal + b_x);
        out.push(fy + drag * row.along[1] + change.cross[1] * normal + b_y);
    }
}

fn load_power(stiffness: f64, exponent: f64) -> f64 {
    if stiffness == 1.0 { 1.0 } else { stiffness.powf(exponent) }
}

/// One step of all elements; a growing contact keeps their forces, a shrinking one their displacements.
fn step(base: &Base, state: &mut State, at: &super::base::AtDepth, slide: [f64; 2]) {
    let (limit, stiffness) = (at.strength_n, at.tangential_n_mm);
    let mut keep = state.limit / limit;
    if stiffness < state.stiffness {
        keep *= stiffness / state.stiffness;
    }
    let per_slip = stiffness / limit;
    let x = (slide[0] + at.pressed_mm - state.pressed) * per_slip;
    let y = slide[1] * per_slip * at.ratio;
    (state.limit, state.stiffness, state.pressed) = (limit, stiffness, at.pressed_mm);
    let rho = at.ratio;
    let lack = 1.0 - rho;
    for (u, element) in state.force.iter_mut().zip(&base.elements) {
        let mut ux = u[0] * keep + x * element[0];
        let mut uy = u[1] * keep + y * element[0];
        let square = ux * ux + uy * uy;
        if square > 1.0 {
            let fourth = square * square;
            let along_y = fourth + square - 2.0 * lack * uy * uy;
            ux *= along_y - lack * (fourth - square);
            uy *= along_y;
            let back = 1.0 / (ux * ux + uy * uy).sqrt();
            ux *= back;
            uy *= back;
        }
        *u = [ux, uy];
    }
}

/// What each run drew: logarithms of the factors on stiffness and strength, and the error of the touch point, mm.
/// Empty where all are taken as 0.
pub type Modes = Vec<[f64; 3]>;

/// Predicted readings of all runs, three per row, each with what it drew and a nudge for all.
pub fn walk_all(base: &Base, laws: &[Active], modes: &Modes, nudge: Nudge, runs: &[Run]) -> Vec<f64> {
    let mut out = Vec::with_capacity(3 * runs.iter().map(|r| r.rows.len()).sum::<usize>());
    for (i, run) in runs.iter().enumerate() {
        let own = modes.get(i).map_or(nudge, |u| Nudge {
            stiffness: nudge.stiffness * u[0].exp(),
            strength: nudge.strength * u[1].exp(),
            depth_mm: nudge.depth_mm + u[2],
        });
        walk(base, laws, own, run, &mut out);
    }
    out
}
