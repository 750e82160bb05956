//! The refitted baseline as the core's numbers: tables over depth, elements, and two slots for what tables cannot hold.

use fingerpad::{Data, EffectSlot, Effects, Element, Line};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use super::base::{Base, ODD_SHAPE, Reference};
use super::replay::replay;
use super::runs::{Run, RunSet};
use super::walk::{Modes, Nudge, walk_all};

/// Number of the slot: strength × (1 + (a + e u) cos 2θ + b sin 2θ + c cos θ + d sin θ) with u = ln(depth/0.9 mm).
const DIRECTION: u32 = 32;
/// Number of the slot: normal × (1 + s_x m_x² + s_y m_y²) + (p + q d) F_x + r F_y with m = F/L; floats p, q, r, s_x, s_y.
const SHEAR: u32 = 33;

/// Largest slip length over the least; the core takes up to 50.
const SLIP_LENGTHS: f64 = 40.0;

/// Numbers and slots of a baseline.
pub struct Baked {
    /// The numbers.
    pub data: Data,
    /// What of the freedoms is not in them.
    pub slots: Vec<EffectSlot>,
}

/// A straight line from `value` to `next` that does not go beyond it.
fn line(value: f32, next: f32) -> Line {
    let mut change = next - value;
    while change != 0.0 && (value + change - next) * change > 0.0 {
        change = f32::from_bits(change.to_bits() - 1);
    }
    Line { value, change }
}

/// The baseline at `theta` in the form of `data`; what the tables do not hold (bands, stick ratio, area) stays as it is.
///
/// * `runs`: strokes along which the elements' shares and yield points are fitted, so that few follow many
pub fn bake(data: &Data, reference: &Reference, theta: &[f64], runs: &RunSet) -> Baked {
    let base = reference.with(theta);
    let mut out = tables(data, &base);
    let mut slots = Vec::new();
    let slot = |kind, v: [f64; 6]| EffectSlot { kind, reserved: 0, values: v.map(|x| x as f32) };
    let [even, first] = [base.even, base.first];
    slots.push(slot(DIRECTION, [even[0], even[1], first[0], first[1], base.even_slope, 0.0]));
    let [p, r] = base.normal_per_friction;
    let [s_x, s_y] = base.normal_shear;
    slots.push(slot(SHEAR, [p - base.press[0], -base.press[1], r, s_x, s_y, 0.0]));
    fit_elements(&mut out, &slots, &base, runs);
    Baked { data: out, slots }
}

fn tables(data: &Data, base: &Base) -> Data {
    let n = data.rows.len();
    let cell = f64::from(data.depth_max) / (n - 1) as f64;
    let mut out = *data;
    out.pressure_exponent = base.load_exponent.clamp(-1.0, 2.0) as f32;
    // The baseline knows no odd compliance; its direction dependence is in a slot.
    out.twice_odd = 0.0;
    // A chord lies above a convex curve by up to h² f''/8; half of that is taken off at the nodes.
    let node = |i: usize, of: &dyn Fn(f64) -> f64| -> f64 {
        let d = cell * i as f64;
        if i == 0 {
            return 1e-6 * of(cell);
        }
        if i == 1 || i + 1 == n {
            return of(d);
        }
        of(d) - (of(d + cell) - 2.0 * of(d) + of(d - cell)) / 16.0
    };
    let rising = |of: &dyn Fn(f64) -> f64| -> Vec<f32> {
        let mut last = 0.0f64;
        (0..n)
            .map(|i| {
                last = last.max(node(i, of));
                last as f32
            })
            .collect()
    };
    let normal = rising(&|d| base.at(d).normal_n);
    let limit = rising(&|d| base.at(d).strength_n);
    // Where the baseline is extrapolated to touch, its slip length must stay within what a step can bear.
    let longest =
        (1..n).map(|i| base.at(cell * i as f64)).map(|a| a.strength_n / a.tangential_n_mm).fold(0.0, f64::max);
    let stiffness: Vec<f32> = rising(&|d| base.at(d).tangential_n_mm)
        .iter()
        .zip(&limit)
        .map(|(k, l)| k.min((SLIP_LENGTHS * f64::from(*l) / longest) as f32))
        .collect();
    let across = |i: usize| base.at(cell * (i as f64).max(1.0)).ratio.clamp(0.25, 4.0).sqrt() as f32;
    let tilt = |i: usize| ((-(1.0 - ODD_SHAPE) * base.odd * cell * i as f64).clamp(-0.25, 0.25)) as f32;
    let press = |i: usize| ((base.press[0] + base.press[1] * cell * i as f64).clamp(-1.0, 1.0)) as f32;
    let mut pressed = 0.0;
    for i in 0..n {
        let next = (i + 1).min(n - 1);
        let row = &mut out.rows[i];
        row.normal = line(normal[i], normal[next]);
        row.limit = line(limit[i], limit[next]);
        row.stiffness = line(stiffness[i], stiffness[next]);
        row.across = line(across(i), across(next));
        row.round = row.across;
        row.shear_x = line(0.0, 0.0);
        row.shear_y = line(0.0, 0.0);
        row.tilt = line(tilt(i), tilt(next));
        row.press = line(press(i), press(next));
        row.pressed = pressed;
        pressed += press(i) + press(next);
    }
    out
}

/// Elements from logarithms of yield positions and shares, normalised as the core wants them.
fn elements(p: &[f64], out: &mut Data) {
    let m = out.elements.len();
    let (yields, shares) = p.split_at(m);
    let shares: Vec<f64> = shares.iter().map(|s| s.exp()).collect();
    let sum: f64 = shares.iter().sum();
    let softness: f64 = (0..m).map(|j| shares[j] / sum * (-yields[j]).exp()).sum();
    for j in 0..m {
        let inverse_yield = ((-yields[j]).exp() / softness).clamp(0.1, 20.0);
        let share = shares[j] / sum;
        out.elements[j] = Element {
            inverse_yield: inverse_yield as f32,
            strength: (share * (1.0 - 8e-6)) as f32,
            energy: (share / inverse_yield) as f32,
        };
    }
}

/// Runs at which the elements are fitted.
const MOST_RUNS: usize = 16;

/// Fits the elements so that the core follows the baseline's friction along some runs.
fn fit_elements(data: &mut Data, slots: &[EffectSlot], base: &Base, set: &RunSet) {
    let stride = set.runs.len().div_ceil(MOST_RUNS).max(1);
    let runs: Vec<Run> = set.runs.iter().step_by(stride).cloned().collect();
    let wanted = walk_all(base, &[], &Modes::new(), Nudge::default(), &runs);
    let Ok(effects) = Effects::new(slots) else { return };
    let misfit = |p: &[f64]| -> Option<Vec<f64>> {
        let mut trial = *data;
        elements(p, &mut trial);
        let model = trial.model().ok()?;
        let mut found = Vec::with_capacity(wanted.len());
        runs.iter().for_each(|run| replay(&model, &effects, run, &mut found));
        let friction = wanted.iter().zip(&found).enumerate().filter(|(i, _)| i % 3 != 0);
        Some(friction.map(|(_, (w, f))| w - f).collect())
    };
    let start: Vec<f64> = data
        .elements
        .iter()
        .map(|e| -f64::from(e.inverse_yield).ln())
        .chain(data.elements.iter().map(|e| f64::from(e.strength.max(1e-3)).ln()))
        .collect();
    if let Some(best) = least_squares(start, &misfit) {
        elements(&best, data);
    }
}

/// Misfits as a least-squares problem; a point where the core refuses its numbers turns it back.
struct Misfits<'a> {
    of: &'a dyn Fn(&[f64]) -> Option<Vec<f64>>,
    number: usize,
}

impl Misfits<'_> {
    fn at(&self, point: &[f64]) -> Vec<f64> {
        const TURNED_BACK_N: f64 = 1e3;
        (self.of)(point).unwrap_or_else(|| vec![TURNED_BACK_N; self.number])
    }
}

impl Problem for Misfits<'_> {
    fn residuals(&mut self, point: &[f64]) -> Option<Vec<f64>> {
        Some(self.at(point))
    }

    fn jacobian(&mut self, point: &[f64]) -> Option<Vec<Vec<f64>>> {
        // Wide enough for readings in single precision.
        const STEP: f64 = 0.01;
        let here = self.at(point);
        let column = |k: usize| {
            let mut moved = point.to_vec();
            moved[k] += STEP;
            self.at(&moved).iter().zip(&here).map(|(m, h)| (m - h) / STEP).collect()
        };
        Some((0..point.len()).map(column).collect())
    }
}

/// The point of least squares of some misfits; `None` where the start has none.
fn least_squares(start: Vec<f64>, of: &dyn Fn(&[f64]) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    let number = of(&start)?.len();
    let minimiser = LevenbergMarquardt::new().with_ftol(1e-3).with_xtol(1e-4).with_patience(20);
    Some(minimise(&mut Misfits { of, number }, &start, &minimiser).0)
}
