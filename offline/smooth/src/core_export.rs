//! Export to the core: a smooth model as tables over depth, a few springs, and two slots for properties that tables do
//! not represent.
//!
//! Main type: [`CoreExport`].
//!
//! Over a straight slide the slope of the smooth model's friction falls from its tangential stiffness to 0 as one
//! element after the other slips. The springs of the core divide that stiffness: each takes the part of the slope
//! between two levels, the same at all depths, and slips at the mean slide at which the slope falls through its part.
//! Friction in full slip, the area under the slope, is then the smooth model's at every depth; a part that the slope
//! does not reach at some depth is a spring that does not touch there. The parts are fitted together with the springs'
//! odd term, and determine the yield slides.

use fingerpad::build::{Data, EffectSlot, Node, Params, SpringParams};
use fingerpad::effects::baseline::{DIRECTION, SHEAR};
use fingerpad::{Effects, Error, NODES, SPRINGS, Surroundings};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use crate::core_replay::replay_stroke;
use crate::model::{ELEMENTS, MIDDLE_MM, ODD_SHAPE, SmoothModel};
use crate::reference::{middle_node, normal_per_full_shear};
use crate::simulate;
use crate::trajectory::{Sample, Stroke};

/// Most measured strokes along which the springs are fitted.
const MOST_STROKES: usize = 16;
/// Depths of the slides that are always fitted, mm.
const DEPTHS_MM: [f64; 5] = [0.4, 0.7, 1.1, 1.5, 2.0];
/// Depths whose tangential stiffness the springs' parts start from, mm: typical depths of use.
const START_MM: f64 = 1.5;
/// Largest odd term times the longest slide at which a spring slips; the core accepts 0.4 for the whole range of a
/// tilted limit.
const MOST_BENT: f64 = 0.3;
/// By how much the logarithm of the stiffness falls from spring to spring where the fit starts, more than with equal shares of the
/// friction: the fit has several local optima.
const STEEPER: [f64; 2] = [0.0, 0.4];
/// Least share of the contact area of a spring that touches.
const LEAST_SHARE: f32 = 1e-6;

/// A smooth model in the core's form.
pub struct CoreExport {
    /// Tables and springs.
    pub data: Data,
    /// Properties of the model that the tables do not represent: strength over direction, normal force with friction.
    pub slots: Vec<EffectSlot>,
}

/// A smooth model in the form of `data`; values that the smooth model does not determine (bands, stick ratio, area,
/// spin) are those of `data`.
///
/// * `strokes`: motions along which the core's springs are fitted, so that its few follow the model's many
///
/// # Errors
/// The core's reason for refusing the tables (not passive, out of range).
pub fn export_to_core(data: &Data, model: &SmoothModel, strokes: &[Stroke]) -> Result<CoreExport, Error> {
    let curves = Curves::of(model, f64::from(data.depth_max));
    let bed = fit_bed(data, model, &curves, strokes);
    let data = passive(data, model, &curves, &bed)?;
    let slots = slots(&data, model);
    Ok(CoreExport { data, slots })
}

/// Slots for properties of the model that the tables do not represent.
fn slots(data: &Data, model: &SmoothModel) -> Vec<EffectSlot> {
    let slot = |kind, v: [f64; 6]| EffectSlot { kind, reserved: 0, values: v.map(|x| x as f32) };
    let [even, odd] = [model.even_direction, model.odd_direction];
    let [p, r] = model.normal_per_friction;
    let [s_x, s_y] = model.normal_shear;
    let [own_x, own_y] = normal_per_full_shear(data);
    let [press, press_slope] = model.press_coupling;
    vec![
        slot(DIRECTION, [even[0], even[1], odd[0], odd[1], model.even_direction_slope, 0.0]),
        slot(SHEAR, [p - press, -press_slope, r, s_x - own_x, s_y - own_y, 0.0]),
    ]
}

/// Fitted parameters of the core's springs.
struct Bed {
    /// Their parts of the stiffness along x, N/mm; the last to slip first.
    parts_n_mm: [f64; SPRINGS],
    /// q of their force k (u − q u²) along x, 1/mm.
    odd_per_mm: f64,
}

impl Bed {
    /// From logarithms of the parts, and the odd term.
    fn of(p: &[f64]) -> Self {
        Self { parts_n_mm: std::array::from_fn(|j| p[j].exp()), odd_per_mm: p[SPRINGS] }
    }
}

/// The model's curves at the nodes of the tables.
struct Curves {
    cell_mm: f64,
    normal_n: Vec<f64>,
    strength_n: Vec<f64>,
    stiffness_n_mm: Vec<f64>,
    /// Yield position of each element, and its share of the stiffness; the last to slip first.
    elements: [[f64; 2]; ELEMENTS],
}

impl Curves {
    fn of(model: &SmoothModel, depth_max_mm: f64) -> Self {
        let cell_mm = depth_max_mm / (NODES - 1) as f64;
        let strength_n = rising_nodes(cell_mm, &|d| model.at_depth(d).strength_n);
        let mut elements = model.elements.map(|[inverse_yield, w]| [1.0 / inverse_yield, w * inverse_yield]);
        elements.sort_by(|a, b| b[0].total_cmp(&a[0]));
        Self {
            cell_mm,
            normal_n: rising_nodes(cell_mm, &|d| model.at_depth(d).normal_n),
            stiffness_n_mm: stiffness_nodes(cell_mm, model, &strength_n),
            strength_n,
            elements,
        }
    }

    /// Mean slide, mm, at which the slope of friction at a node falls through each spring's part of the stiffness,
    /// N/mm; if the model is stiffer than all springs together, its slope is taken as theirs.
    fn yield_slides_mm(&self, node: usize, parts: &[f64; SPRINGS]) -> [f64; SPRINGS] {
        let all: f64 = parts.iter().sum();
        let stiffness = self.stiffness_n_mm[node].min(all);
        let slip_length = self.strength_n[node] / stiffness;
        let mut below = 0.0;
        parts.map(|part| {
            let (from, to) = (below, below + part);
            below = to;
            let (mut level, mut area) = (0.0, 0.0);
            for [yield_position, share] in self.elements {
                let next = level + share * stiffness;
                area += (next.min(to) - level.max(from)).max(0.0) * yield_position * slip_length;
                level = next;
            }
            area / part
        })
    }

    /// Parts of the stiffness whose springs carry equal shares of the friction in full slip.
    fn equal_parts(&self) -> [f64; SPRINGS] {
        let node = ((START_MM / self.cell_mm).round() as usize).min(NODES - 1);
        let (mut parts, mut carried) = ([0.0; SPRINGS], 0.0);
        for [yield_position, share] in self.elements {
            let carries = yield_position * share;
            // An element that carries more than the rest of a spring's share is divided among several.
            let mut left = carries;
            while left > 1e-9 {
                let j = ((carried * SPRINGS as f64 + 1e-9) as usize).min(SPRINGS - 1);
                let room = if j + 1 == SPRINGS { left } else { (j + 1) as f64 / SPRINGS as f64 - carried };
                let taken = left.min(room);
                parts[j] += taken / yield_position * self.stiffness_n_mm[node];
                carried += taken;
                left -= taken;
            }
        }
        parts
    }
}

/// Places of the springs of `data` in the order in which they slip in its middle, the last one first.
fn order(data: &Data) -> [usize; SPRINGS] {
    let row = &data.rows[middle_node(data)];
    let mut order = std::array::from_fn(|j| j);
    order.sort_by(|&a: &usize, &b: &usize| row.radius[b].value.total_cmp(&row.radius[a].value));
    order
}

/// The model's curves and the springs' parts of the stiffness in the core's form.
///
/// * `varying`: share of the change of the stiffness along y over depth that the core's model has, 0 to 1
fn params(data: &Data, model: &SmoothModel, curves: &Curves, bed: &Bed, varying: f64) -> Params {
    let depth = |i: usize| curves.cell_mm * i as f64;
    let parts = &bed.parts_n_mm;
    let all: f64 = parts.iter().sum();
    let longest_mm = curves.yield_slides_mm(NODES - 1, parts).into_iter().fold(0.0, f64::max);
    let odd_per_mm = bed.odd_per_mm.clamp(-MOST_BENT / longest_mm, MOST_BENT / longest_mm);
    // The model's friction in full slip has an odd part along x, of which the springs' own odd term contributes some;
    // this is the rest.
    let tilt = |i: usize, slides: &[f64; SPRINGS]| {
        let mean = |power: i32| slides.iter().zip(parts).map(|(s, part)| part * s.powi(power)).sum::<f64>();
        let own = odd_per_mm * mean(2) / mean(1);
        (own - (1.0 - ODD_SHAPE) * model.odd_x_per_mm * depth(i)).clamp(-0.25, 0.25)
    };
    let middle = model.at_depth(MIDDLE_MM).stiffness_ratio_y;
    let across = |i: usize| {
        let own = model.at_depth(depth(i.max(1))).stiffness_ratio_y;
        all * (middle + varying * (own - middle)).clamp(0.25, 4.0)
    };
    let across_slope = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(NODES - 1));
        (across(after) - across(before)) / (depth(after) - depth(before))
    };
    let [press, press_slope] = model.press_coupling;
    let order = order(data);
    let mut last = [0.0f32; SPRINGS];
    let node = |i: usize| {
        let row = &data.rows[i];
        let slides = curves.yield_slides_mm(i, parts);
        let mut node = Node {
            normal_force_n: curves.normal_n[i] as f32,
            contact_area_mm2: row.area.value,
            stiffness_slope_n_mm2: [0.0, across_slope(i) as f32],
            strength_ratio: 1.0,
            tilt_x: tilt(i, &slides) as f32,
            press_coupling: (press + press_slope * depth(i)).clamp(-1.0, 1.0) as f32,
            pressure_centre_mm: row.pressure_centre.value,
            spin_limit_share: data.spin_limit_share(i),
            band_normal_n: row.band_normal.value,
            ..Node::default()
        };
        for (slide, &j) in slides.iter().zip(&order) {
            last[j] = last[j].max(*slide as f32);
            node.yield_slide_mm[j] = last[j];
            // A spring that does not touch has no area.
            node.area_share[j] = if last[j] > 0.0 { row.area_share[j].value.max(LEAST_SHARE) } else { 0.0 };
        }
        node
    };
    let nodes = std::array::from_fn(node);
    let [slip, rate, bend] = data.band_normal;
    let [friction_slip, friction_rate, friction_bend] = data.band_friction;
    let middle_of = |slip: f32, rate: f32, bend: f32| slip + 0.5 * rate + 0.25 * bend;
    let mut springs = data.springs.map(|s| SpringParams {
        stiffness_share: 0.0,
        sharpness: s.sharpness,
        centre_mm: s.centre_mm,
        arm_mm: s.arm_mm,
    });
    order.iter().zip(parts).for_each(|(&j, part)| springs[j].stiffness_share = (part / all) as f32);
    Params {
        depth_max_mm: data.depth_max,
        stiffness_n_mm: [all as f32, across(0) as f32],
        springs,
        nodes,
        odd_per_mm: odd_per_mm as f32,
        area_tilt: data.area_tilt,
        pressure_centre_per_n: data.pressure_centre_per_n,
        spin_cross: data.spin_cross,
        slip_lead: [data.slip_lead[0], data.slip_lead[0] + data.slip_lead[1] * (NODES - 1) as f32],
        band_normal_middle: middle_of(slip, rate, bend),
        band_normal_slip: slip,
        band_friction_stick: friction_slip + friction_rate + friction_bend,
        band_friction_middle: middle_of(friction_slip, friction_rate, friction_bend),
        band_friction_slip: friction_slip,
        pressure_exponent: model.load_exponent.clamp(-1.0, 2.0) as f32,
        pose_deg: data.pose_deg,
    }
}

/// The tables with as much of the change of the stiffness along y over depth as is passive.
fn passive(data: &Data, model: &SmoothModel, curves: &Curves, bed: &Bed) -> Result<Data, Error> {
    let built = |varying: f64| params(data, model, curves, bed, varying).try_build();
    [1.0, 0.5, 0.25].into_iter().find_map(|varying| built(varying).ok()).map_or_else(|| built(0.0), Ok)
}

/// Values of a curve over depth at the nodes, `cell_mm` apart, none below the one before.
///
/// A chord lies above a convex curve by h² f''/12 on average, which is subtracted at the nodes.
fn rising_nodes(cell_mm: f64, of: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let node = |i: usize| -> f64 {
        let d = cell_mm * i as f64;
        if i == 0 {
            return 1e-6 * of(cell_mm);
        }
        if i == 1 || i + 1 == NODES {
            return of(d);
        }
        of(d) - (of(d + cell_mm) - 2.0 * of(d) + of(d - cell_mm)) / 12.0
    };
    let mut last = 0.0f64;
    (0..NODES)
        .map(|i| {
            last = last.max(node(i));
            last
        })
        .collect()
}

/// Tangential stiffness at the nodes, N/mm. Springs that touch with depth let neither stiffness nor slip length fall as
/// depth grows; where the model's would, it is kept constant, from 0.9 mm outward.
fn stiffness_nodes(cell_mm: f64, model: &SmoothModel, strength_n: &[f64]) -> Vec<f64> {
    let mut stiffness: Vec<f64> =
        (0..NODES).map(|i| model.at_depth(cell_mm * (i as f64).max(1.0)).tangential_n_mm).collect();
    let middle = ((MIDDLE_MM / cell_mm).round() as usize).min(NODES - 1);
    for i in middle + 1..NODES {
        let grown = strength_n[i] / strength_n[i - 1];
        stiffness[i] = stiffness[i].clamp(stiffness[i - 1], stiffness[i - 1] * grown);
    }
    for i in (0..middle).rev() {
        let grown = strength_n[i + 1] / strength_n[i];
        stiffness[i] = stiffness[i].clamp(stiffness[i + 1] / grown, stiffness[i + 1]);
    }
    stiffness
}

/// Presses to typical depths, each with a slide into full slip along x or y or against them, and half of it back:
/// measured strokes alone may leave out the motions of another finger or another day.
fn slides_everywhere(model: &SmoothModel) -> Vec<Stroke> {
    const SAMPLES: usize = 20;
    let slide = |depth_mm: f64, [x, y]: [f64; 2]| {
        let at = model.at_depth(depth_mm);
        let step_mm = 3.0 * at.strength_n / at.tangential_n_mm / SAMPLES as f64;
        let sample = |k: usize| {
            let sign = if k >= 2 * SAMPLES { -1.0 } else { 1.0 };
            let way_mm = if k < SAMPLES { 0.0 } else { sign * step_mm };
            Sample {
                t_s: 0.05 * (k + 1) as f64,
                depth_mm: depth_mm * ((k + 1) as f64 / SAMPLES as f64).min(1.0),
                slide_mm: [way_mm * x, way_mm * y],
                double_angle: [x * x - y * y, 2.0 * x * y],
                direction: [sign * x, sign * y],
                surroundings: Surroundings::default(),
            }
        };
        Stroke { start_s: 0.0, samples: (0..5 * SAMPLES / 2).map(sample).collect(), time_constant_s: 0.0 }
    };
    let directions = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    DEPTHS_MM.iter().flat_map(|depth_mm| directions.map(|direction| slide(*depth_mm, direction))).collect()
}

/// Fits the springs so that the core follows the smooth model's friction along some strokes and along slides everywhere.
fn fit_bed(data: &Data, model: &SmoothModel, curves: &Curves, strokes: &[Stroke]) -> Bed {
    let stride = strokes.len().div_ceil(MOST_STROKES).max(1);
    let mut strokes: Vec<Stroke> = strokes.iter().step_by(stride).cloned().collect();
    let measured: usize = strokes.iter().map(|s| s.samples.len()).sum();
    strokes.extend(slides_everywhere(model));
    // Measured strokes count by their forces, the others by shares of the strength at their depth.
    let strength_n = |depth_mm: f64| model.at_depth(depth_mm).strength_n;
    let deepest_mm = |stroke: &Stroke| stroke.samples.iter().map(|s| s.depth_mm).fold(0.0, f64::max);
    let weight = |stroke: &Stroke| strength_n(MIDDLE_MM) / strength_n(deepest_mm(stroke));
    let samples = strokes.iter().flat_map(|stroke| stroke.samples.iter().map(move |_| stroke)).enumerate();
    let weights: Vec<f64> = samples.map(|(i, stroke)| if i < measured { 1.0 } else { weight(stroke) }).collect();
    let wanted = simulate(model, &strokes);
    let misfit = |p: &[f64]| -> Option<Vec<f64>> {
        let trial = passive(data, model, curves, &Bed::of(p)).ok()?;
        let slots = slots(&trial, model);
        let effects = Effects::new(&slots).ok()?;
        let mut found = Vec::with_capacity(wanted.len());
        strokes.iter().for_each(|stroke| replay_stroke(&trial.model_unchecked(), &effects, stroke, &mut found));
        let friction = wanted.iter().zip(&found).enumerate().filter(|(i, _)| i % 3 != 0);
        Some(friction.map(|(i, (w, f))| (w - f) * weights[i / 3]).collect())
    };
    let start = curves.equal_parts().map(f64::ln);
    let squares = |p: &[f64]| misfit(p).map_or(f64::INFINITY, |m| m.iter().map(|v| v * v).sum());
    let fits = STEEPER.iter().map(|by| {
        let steeper: Vec<f64> = start
            .iter()
            .zip(0..SPRINGS)
            .map(|(ln, j)| ln + by * (0.5 * (SPRINGS - 1) as f64 - j as f64))
            .chain([0.0])
            .collect();
        least_squares(steeper.clone(), &misfit).unwrap_or(steeper)
    });
    let best = fits.map(|p| (squares(&p), p)).min_by(|a, b| a.0.total_cmp(&b.0));
    Bed::of(&best.expect("two starts").1)
}

/// Misfits as a least-squares problem; a point whose numbers the core refuses has a large constant misfit.
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
        const STEP: f64 = 0.002;
        let here = self.at(point);
        let column = |k: usize| {
            let mut moved = point.to_vec();
            moved[k] += STEP;
            self.at(&moved).iter().zip(&here).map(|(m, h)| (m - h) / STEP).collect()
        };
        Some((0..point.len()).map(column).collect())
    }
}

/// The point of least squares of some misfits; `None` if the start has none.
fn least_squares(start: Vec<f64>, of: &dyn Fn(&[f64]) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    let number = of(&start)?.len();
    let minimiser = LevenbergMarquardt::new().with_ftol(1e-5).with_xtol(1e-5).with_patience(20);
    Some(minimise(&mut Misfits { of, number }, &start, &minimiser).0)
}
