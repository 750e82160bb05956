//! The next experiment: fifteen strokes that separate what the present protocol cannot.
//!
//! For each single-factor plan its information is added to that of the present runs; the plan with the largest least
//! separation between the rivals after refitting wins [after Hunter & Reiner 1965].

use std::path::PathBuf;

use super::fit::{Fit, Prior, Task};
use super::laws::Column;
use super::runs::{Labels, RawRow, RunSet};
use super::scan::{columns_of, start_of};
use super::select::space_at;
use super::space::{Clean, Space};
use super::walk::Active;

/// A stroke to be run; missing values are those of the reference conditions.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PlannedRun {
    /// Depth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Speed, mm/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// Direction, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction_deg: Option<f64>,
    /// Hold before sliding, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// Moisture of the skin to be reached, a.u.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hydration_au: Option<f64>,
    /// Temperature of the skin to be reached, °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Length of the stroke, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// Rest in the air before it, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_before_s: Option<f64>,
    /// Whether a new block begins: the finger has recovered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub new_block: Option<bool>,
    /// Whether the stroke goes back at its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reverse: Option<bool>,
}

/// A proposal.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NextExperiment {
    /// The pairs of families that it separates.
    pub separates: Vec<[String; 2]>,
    /// What is varied.
    pub factor: String,
    /// Least separation that is to be expected.
    pub lambda_rival_expected: f64,
    /// The strokes, in this order.
    pub runs: Vec<PlannedRun>,
}

/// Strokes of a plan.
pub const STROKES: usize = 15;

/// Values spread over a range in an order that does not follow the clock.
fn spread(low: f64, high: f64, logarithmic: bool) -> Vec<f64> {
    (0..STROKES)
        .map(|i| {
            let share = ((i * 7) % STROKES) as f64 / (STROKES - 1) as f64;
            let v = if logarithmic { low * (high / low).powf(share) } else { low + (high - low) * share };
            (v * 1000.0).round() / 1000.0
        })
        .collect()
}

fn plan(values: Vec<f64>, make: impl Fn(usize, f64) -> PlannedRun) -> Vec<PlannedRun> {
    values.into_iter().enumerate().map(|(i, v)| make(i, v)).collect()
}

/// The plans that are compared.
fn plans(set: &RunSet, depth: [f64; 2]) -> Vec<(&'static str, Vec<PlannedRun>)> {
    let fresh = || PlannedRun { rest_before_s: Some(60.0), new_block: Some(true), ..PlannedRun::default() };
    let mut out = vec![
        ("dwell_s", plan(spread(0.3, 30.0, true), |_, v| PlannedRun { dwell_s: Some(v), ..fresh() })),
        ("depth_mm", plan(spread(depth[0], depth[1], false), |_, v| PlannedRun { depth_mm: Some(v), ..fresh() })),
        ("speed_mm_s", plan(spread(0.5, 20.0, true), |_, v| PlannedRun { speed_mm_s: Some(v), ..fresh() })),
        ("direction_deg", plan(spread(0.0, 336.0, false), |_, v| PlannedRun { direction_deg: Some(v), ..fresh() })),
        (
            "rest_before_s",
            plan(spread(0.0, 1.0, false), |i, _| {
                let new = i % 5 == 0;
                PlannedRun {
                    rest_before_s: Some(if new { 120.0 } else { 2.0 }),
                    new_block: Some(new),
                    ..PlannedRun::default()
                }
            }),
        ),
        (
            "t_s",
            plan(spread(0.0, 1.0, false), |_, _| PlannedRun {
                rest_before_s: Some(240.0),
                new_block: Some(true),
                ..PlannedRun::default()
            }),
        ),
        (
            "reverse",
            plan(spread(3.0, 8.0, false), |_, v| PlannedRun { length_mm: Some(v), reverse: Some(true), ..fresh() }),
        ),
    ];
    if set.has(Column::Hydration) {
        out.push((
            "hydration_au",
            plan(spread(15.0, 75.0, false), |_, v| PlannedRun { hydration_au: Some(v), ..fresh() }),
        ));
    }
    if set.has(Column::Temperature) {
        out.push((
            "temperature_c",
            plan(spread(27.0, 36.0, false), |_, v| PlannedRun { temperature_c: Some(v), ..fresh() }),
        ));
    }
    // All factors at once, each in its own order.
    let all = (0..STROKES)
        .map(|i| {
            let at = |step: usize, low: f64, high: f64| {
                low + (high - low) * ((i * step + step) % STROKES) as f64 / (STROKES - 1) as f64
            };
            let round = |v: f64| (v * 100.0).round() / 100.0;
            PlannedRun {
                depth_mm: Some(round(at(2, depth[0], depth[1]))),
                speed_mm_s: Some(round(0.5 * 40f64.powf(at(4, 0.0, 1.0)))),
                direction_deg: Some(round(at(7, 0.0, 336.0))),
                dwell_s: Some(round(0.3 * 100f64.powf(at(8, 0.0, 1.0)))),
                hydration_au: set.has(Column::Hydration).then(|| round(at(11, 15.0, 75.0))),
                temperature_c: set.has(Column::Temperature).then(|| round(at(13, 27.0, 36.0))),
                rest_before_s: Some(if i % 4 == 0 { 60.0 } else { 2.0 }),
                new_block: Some(i % 4 == 0),
                ..PlannedRun::default()
            }
        })
        .collect();
    out.push(("all", all));
    out
}

/// Reference conditions of the strokes.
#[derive(Clone, Copy, Debug)]
struct Habits {
    depth_mm: f64,
    press_mm_s: f64,
    length_mm: f64,
    start_s: f64,
    width_mm: f64,
}

/// Rows that a plan would give; readings are 0.
fn rows_of(plan: &[PlannedRun], habits: Habits) -> Vec<(Labels, Vec<RawRow>)> {
    let mut clock = habits.start_s;
    let mut occluded = 0.0;
    plan.iter()
        .enumerate()
        .map(|(i, run)| {
            let rest = run.rest_before_s.unwrap_or(60.0);
            clock += rest.max(1.0);
            if run.new_block.unwrap_or(rest >= 30.0) {
                occluded = 0.0;
            }
            let depth = run.depth_mm.unwrap_or(habits.depth_mm);
            let (speed, dwell) = (run.speed_mm_s.unwrap_or(2.0), run.dwell_s.unwrap_or(1.0));
            let length = run.length_mm.unwrap_or(habits.length_mm);
            let (s, c) = run.direction_deg.unwrap_or(0.0).to_radians().sin_cos();
            let press_s = depth / habits.press_mm_s;
            let mut points = vec![(-0.1, -0.2, 0.0), (-0.03, -0.05, 0.0)];
            for k in 1..=6 {
                points.push((press_s * f64::from(k) / 6.0, depth * f64::from(k) / 6.0, 0.0));
            }
            points.push((press_s + dwell, depth, 0.0));
            let total = if run.reverse == Some(true) { 1.5 } else { 1.0 } * length;
            for k in 1..=16 {
                let way = total * (f64::from(k) / 16.0).powf(1.3);
                let place = if way > length { 2.0 * length - way } else { way };
                points.push((press_s + dwell + way / speed, depth, place));
            }
            let rows = points
                .iter()
                .map(|&(t, depth_mm, place)| RawRow {
                    line: 0,
                    t_s: clock + t,
                    depth_mm,
                    slide_mm: [place * c, place * s],
                    force_n: [0.0; 3],
                    contact_time_s: t,
                    speed_mm_s: speed,
                    direction_deg: f64::NAN,
                    dwell_s: dwell,
                    occlusion_time_s: occluded + t.max(0.0),
                    hydration_au: run.hydration_au.unwrap_or(35.0),
                    temperature_c: run.temperature_c.unwrap_or(32.0),
                    finger_width_mm: habits.width_mm,
                })
                .collect();
            let end = points[points.len() - 1].0;
            clock += end;
            occluded += end;
            (Labels { run: format!("next{i}"), ..Labels::default() }, rows)
        })
        .collect()
}

/// A pair of rivals: the fit with the first, and the second with its best parameters.
pub struct Rivalry<'a> {
    /// Index of the law in the fit.
    pub index: usize,
    /// The rival.
    pub rival: &'a Active,
}

/// Proposes the strokes that best separate all rivalries of a fit.
pub fn propose(task: &Task<'_>, set: &RunSet, fit: &Fit, rivalries: &[Rivalry<'_>]) -> Option<NextExperiment> {
    let mut depths: Vec<f64> = set.runs.iter().map(|r| r.depth_mm()).collect();
    depths.sort_by(f64::total_cmp);
    let reach = [depths[depths.len() / 20], depths[depths.len() - 1 - depths.len() / 20]];
    let middle = depths[depths.len() / 2];
    let (low, high) = (reach[0].min(0.5 * middle), reach[1].max(1.4 * middle));
    let round = |v: f64| (v * 100.0).round() / 100.0;
    let mut widths: Vec<f64> = set.runs.iter().map(|r| r.value(Column::Width)).filter(|w| w.is_finite()).collect();
    widths.sort_by(f64::total_cmp);
    let habits = Habits {
        depth_mm: round(middle),
        press_mm_s: 2.0,
        length_mm: 5.0,
        start_s: set.runs.iter().flat_map(|r| &r.rows).map(|r| r.t_s).fold(0.0, f64::max),
        width_mm: widths.get(widths.len() / 2).copied().unwrap_or(16.0),
    };
    let mut best: Option<(f64, &'static str, Vec<PlannedRun>)> = None;
    for (factor, plan) in plans(set, [round(low), round(high)]) {
        let more = RunSet::from_rows(PathBuf::new(), rows_of(&plan, habits)).ok()?;
        let mut runs = set.runs.clone();
        runs.extend(more.runs);
        let least = separation(task, &runs, fit, rivalries);
        if best.as_ref().is_none_or(|b| least > b.0) {
            best = Some((least, factor, plan));
        }
    }
    let (lambda, factor, runs) = best?;
    let separates =
        rivalries.iter().map(|r| [fit.laws[r.index].law.family.to_owned(), r.rival.law.family.to_owned()]).collect();
    Some(NextExperiment { separates, factor: factor.to_owned(), lambda_rival_expected: lambda, runs })
}

/// Least separation of the rivalries on some runs.
fn separation(task: &Task<'_>, runs: &[super::runs::Run], fit: &Fit, rivalries: &[Rivalry<'_>]) -> f64 {
    let prior = Prior { mean: fit.theta.clone(), root: task.prior.root.clone() };
    let mut joint = Task::new(runs, task.reference, prior, Vec::new(), fit.variances);
    let with = joint.predict(&fit.theta, &fit.laws);
    let known = task.sigma_n.len();
    joint.sigma_n = task.sigma_n.clone();
    // New rows are as noisy as the present ones at their force.
    let like = |force: f64, channel: usize| {
        let mut near = (f64::INFINITY, task.sigma_n[channel]);
        for i in (channel..known).step_by(3 * 7) {
            let d = (with[i] - force).abs();
            if d < near.0 {
                near = (d, task.sigma_n[i]);
            }
        }
        near.1
    };
    for i in known..with.len() {
        joint.sigma_n.push(like(with[i], i % 3));
    }
    let mut least = f64::INFINITY;
    for r in rivalries {
        let mut others = fit.laws.clone();
        others.remove(r.index);
        let mut bare = fit.clone();
        bare.laws.clone_from(&others);
        let prediction = joint.predict(&bare.theta, &others);
        bare.residual_n = vec![0.0; with.len()];
        bare.modes.clear();
        let tangents = joint.tangents_of(&bare);
        let space = space_at(&joint, &bare, &tangents);
        let effect = space.clean(&joint.column(&with, &prediction, 1.0));
        let mut shapes: Vec<Vec<f64>> = r.rival.law.shapes.iter().map(|s| s.to_vec()).collect();
        shapes.push(r.rival.values[r.rival.law.linear..].to_vec());
        let mut explained = 0.0f64;
        for shape in shapes {
            let start = start_of(r.rival.law, &shape);
            let columns: Vec<Clean> =
                columns_of(&joint, &bare, &prediction, &start).iter().map(|c| space.clean(c)).collect();
            explained = explained.max(Space::explained(&effect, &columns.iter().collect::<Vec<_>>()));
        }
        least = least.min((Space::size(&effect) - explained).max(0.0));
    }
    least
}
