//! Export to the core: a smooth model as tables over depth, a few elements, and two slots for what tables cannot hold.
//!
//! Main type: [`CoreExport`].

use fingerpad::effects::baseline::{DIRECTION, SHEAR};
use fingerpad::{Data, EffectSlot, Effects, Element, Line};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use crate::core_replay::replay_stroke;
use crate::model::{DepthValues, ODD_SHAPE, SmoothModel};
use crate::simulate;
use crate::trajectory::Stroke;

/// Largest slip length over the least; the core takes up to 50.
const SLIP_LENGTHS: f64 = 40.0;
/// Most strokes along which the elements are fitted.
const MOST_STROKES: usize = 16;

/// A smooth model in the core's form.
pub struct CoreExport {
    /// Tables and elements.
    pub data: Data,
    /// What of the model the tables do not hold: strength over direction, normal force with friction.
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

/// A smooth model in the form of `data`; what its tables do not say (bands, stick ratio, area) stays as it is.
///
/// * `strokes`: motions along which the core's elements are fitted, so that its few follow the model's many
pub fn export_to_core(data: &Data, model: &SmoothModel, strokes: &[Stroke]) -> CoreExport {
    let mut out = tables(data, model);
    let slot = |kind, v: [f64; 6]| EffectSlot { kind, reserved: 0, values: v.map(|x| x as f32) };
    let [even, odd] = [model.even_direction, model.odd_direction];
    let [p, r] = model.normal_per_friction;
    let [s_x, s_y] = model.normal_shear;
    let [press, press_slope] = model.press_coupling;
    let slots = vec![
        slot(DIRECTION, [even[0], even[1], odd[0], odd[1], model.even_direction_slope, 0.0]),
        slot(SHEAR, [p - press, -press_slope, r, s_x, s_y, 0.0]),
    ];
    fit_elements(&mut out, &slots, model, strokes);
    CoreExport { data: out, slots }
}

/// The tables: the model's curves at the nodes of `data`.
fn tables(data: &Data, model: &SmoothModel) -> Data {
    let n = data.rows.len();
    let cell = f64::from(data.depth_max) / (n - 1) as f64;
    let mut out = *data;
    out.pressure_exponent = model.load_exponent.clamp(-1.0, 2.0) as f32;
    // The smooth model knows no odd compliance; its direction dependence is in a slot.
    out.twice_odd = 0.0;
    let normal = rising_nodes(n, cell, &|d| model.at_depth(d).normal_n);
    let limit = rising_nodes(n, cell, &|d| model.at_depth(d).strength_n);
    let stiffness = stiffness_nodes(n, cell, model, &limit);
    let across = |i: usize| model.at_depth(cell * (i as f64).max(1.0)).stiffness_ratio_y.clamp(0.25, 4.0).sqrt() as f32;
    let tilt = |i: usize| ((-(1.0 - ODD_SHAPE) * model.odd_x_per_mm * cell * i as f64).clamp(-0.25, 0.25)) as f32;
    let [constant, slope] = model.press_coupling;
    let press = |i: usize| ((constant + slope * cell * i as f64).clamp(-1.0, 1.0)) as f32;
    let mut pressed = 0.0;
    for i in 0..n {
        let next = (i + 1).min(n - 1);
        let row = &mut out.rows[i];
        row.normal = line(normal[i], normal[next]);
        row.limit = line(limit[i], limit[next]);
        row.stiffness = line(stiffness[i], stiffness[next]);
        row.stiffness_anisotropy = line(across(i), across(next));
        row.strength_anisotropy = row.stiffness_anisotropy;
        row.normal_shear_x = line(0.0, 0.0);
        row.normal_shear_y = line(0.0, 0.0);
        row.yield_shift = line(tilt(i), tilt(next));
        row.press_coupling = line(press(i), press(next));
        row.press_slide = pressed;
        pressed += press(i) + press(next);
    }
    out
}

/// Values of a curve over depth at `n` nodes `cell` mm apart, none below the one before.
///
/// A chord lies above a convex curve by up to h² f''/8; half of that is taken off at the nodes.
fn rising_nodes(n: usize, cell: f64, of: &dyn Fn(f64) -> f64) -> Vec<f32> {
    let node = |i: usize| -> f64 {
        let d = cell * i as f64;
        if i == 0 {
            return 1e-6 * of(cell);
        }
        if i == 1 || i + 1 == n {
            return of(d);
        }
        of(d) - (of(d + cell) - 2.0 * of(d) + of(d - cell)) / 16.0
    };
    let mut last = 0.0f64;
    (0..n)
        .map(|i| {
            last = last.max(node(i));
            last as f32
        })
        .collect()
}

/// Tangential stiffness at the nodes. Where the model is extrapolated to touch, its slip length is held within what a
/// step of the core can bear.
fn stiffness_nodes(n: usize, cell: f64, model: &SmoothModel, limit: &[f32]) -> Vec<f32> {
    let slip_length = |at: DepthValues| at.strength_n / at.tangential_n_mm;
    let longest = (1..n).map(|i| slip_length(model.at_depth(cell * i as f64))).fold(0.0, f64::max);
    rising_nodes(n, cell, &|d| model.at_depth(d).tangential_n_mm)
        .iter()
        .zip(limit)
        .map(|(k, l)| k.min((SLIP_LENGTHS * f64::from(*l) / longest) as f32))
        .collect()
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

/// Fits the elements so that the core follows the smooth model's friction along some strokes.
fn fit_elements(data: &mut Data, slots: &[EffectSlot], model: &SmoothModel, strokes: &[Stroke]) {
    let stride = strokes.len().div_ceil(MOST_STROKES).max(1);
    let strokes: Vec<Stroke> = strokes.iter().step_by(stride).cloned().collect();
    let wanted = simulate(model, &strokes);
    let Ok(effects) = Effects::new(slots) else { return };
    let misfit = |p: &[f64]| -> Option<Vec<f64>> {
        let mut trial = *data;
        elements(p, &mut trial);
        let model = trial.model().ok()?;
        let mut found = Vec::with_capacity(wanted.len());
        strokes.iter().for_each(|stroke| replay_stroke(&model, &effects, stroke, &mut found));
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
