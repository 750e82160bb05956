//! Structure that no law explains: smooth bases of every column inside the model, and the scatter between runs.
//!
//! A basis modulates strength, stiffness or depth of the model, or an offset of the reading; its score is flipped
//! over runs like that of a law.

use std::f64::consts::TAU;

use super::chance::{Flips, Score, f_tail, surprise};
use super::fit::{Fit, Task};
use super::form::Plain;
use super::laws::{Column, Row};
use super::mixed::PerRun;
use super::products::dot;
use super::runs::{Run, RunSet};
use super::select::space_at;
use super::space::Clean;
use super::tangents::Tangents;

/// What is left after the accepted effects.
#[derive(Clone, Debug, Default)]
pub struct Unexplained {
    /// Whether it counts.
    pub significant: bool,
    /// Column of the strongest structure.
    pub column: String,
    /// What it modulates.
    pub channel: String,
    /// Gain in 2 log likelihood of that structure.
    pub gain: f64,
    /// Model-based p over all bases.
    pub p_model: f64,
    /// Sign-flip p over all bases.
    pub p_runs: f64,
    /// Scatter between runs over that of the calibration: of normal force and friction.
    pub scatter_ratio: [f64; 2],
    /// p of the larger scatter ratio.
    pub p_scatter: f64,
}

/// A group of modulations along one column.
struct Group {
    column: String,
    channel: &'static str,
    /// Number among the groups that lie along the stroke, where the baseline's form can be wrong.
    along_stroke: Option<usize>,
    columns: Vec<Vec<f64>>,
}

/// What a modulation acts on.
#[derive(Clone, Copy, PartialEq)]
enum Acts {
    Strength,
    Stiffness,
}

/// A modulation of strength or stiffness by m(run, row, values of the row), over the row noise.
///
/// The random effects' columns are the response to a uniform change; a modulation scales them row by row. What is
/// neglected is the memory of elements that stick.
fn modulated(task: &Task<'_>, uniform: &[f64], m: &dyn Fn(usize, usize, &Row) -> f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(uniform.len());
    for (index, run) in task.runs.iter().enumerate() {
        for (i, row) in run.rows.iter().enumerate() {
            let factor = m(index, i, row);
            let at = out.len();
            out.extend(uniform[at..at + 3].iter().map(|u| u * factor));
        }
    }
    out
}

/// Ranks of the runs' values of a column, mapped to −1 to 1.
fn ranks(set: &RunSet, column: Column) -> Option<Vec<f64>> {
    let values: Vec<f64> = set.runs.iter().map(|r| r.value(column)).collect();
    if values.iter().any(|v| !v.is_finite()) || !(set.spread(column) > 1e-9) {
        return None;
    }
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    let n = values.len() as f64;
    let mut i = 0;
    while i < order.len() {
        // Equal values share the middle of their ranks.
        let mut j = i;
        while j + 1 < order.len() && values[order[j + 1]] == values[order[i]] {
            j += 1;
        }
        let rank = (2.0 * (i + j) as f64 / 2.0 + 1.0) / n - 1.0;
        for k in i..=j {
            out[order[k]] = rank;
        }
        i = j + 1;
    }
    Some(out)
}

/// Columns whose patterns run along a stroke.
const STROKE_COLUMNS: [&str; 7] =
    ["direction_deg", "slide", "contact_time_s", "slide_x_mm", "slide_y_mm", "slide_x_mm,slide_y_mm", "depth_mm"];

fn groups(task: &Task<'_>, set: &RunSet, tangents: &Tangents, only_strokes: bool) -> Vec<Group> {
    let runs: &[Run] = task.runs;
    let mut out = Vec::new();
    let mut strokes = 0;
    let mut add = |column: &str, acts: Acts, functions: Vec<Box<dyn Fn(usize, usize, &Row) -> f64 + '_>>| {
        if only_strokes && !STROKE_COLUMNS.contains(&column) {
            return;
        }
        let columns = functions
            .iter()
            .map(|f| modulated(task, tangents.scatter.column(usize::from(acts == Acts::Strength)), f.as_ref()))
            .collect();
        let channel = if acts == Acts::Strength { "friction" } else { "normal" };
        let along_stroke = STROKE_COLUMNS.contains(&column).then(|| {
            strokes += 1;
            strokes
        });
        if along_stroke.is_some() || !only_strokes {
            out.push(Group { column: column.to_owned(), channel, along_stroke, columns });
        }
    };
    // Run-level columns: cubic in the rank, and slow waves of the clock.
    let state = [
        Column::Time,
        Column::Speed,
        Column::Dwell,
        Column::Occlusion,
        Column::Hydration,
        Column::Temperature,
        Column::Width,
        Column::Depth,
    ];
    let mut ranked: Vec<(Column, Vec<f64>)> = Vec::new();
    for column in state.into_iter().filter(|c| set.has(*c)) {
        if let Some(r) = ranks(set, column) {
            ranked.push((column, r));
        }
    }
    let per_run =
        |values: Vec<f64>| -> Box<dyn Fn(usize, usize, &Row) -> f64 + '_> { Box::new(move |run, _, _| values[run]) };
    for (column, r) in &ranked {
        for acts in [Acts::Strength, Acts::Stiffness] {
            let powers = |p: i32| per_run(r.iter().map(|x| x.powi(p)).collect());
            add(column.name(), acts, vec![powers(1), powers(2), powers(3)]);
        }
    }
    if let Some((_, r)) = ranked.iter().find(|(c, _)| *c == Column::Time) {
        for waves in [1.5, 2.5, 3.5, 5.0, 7.0] {
            for acts in [Acts::Strength, Acts::Stiffness] {
                let wave = |shift: f64| per_run(r.iter().map(|x| (TAU * 0.5 * waves * x + shift).sin()).collect());
                add("t_s", acts, vec![wave(0.0), wave(TAU / 4.0)]);
            }
        }
    }
    // Direction.
    for harmonic in [1.0, 3.0, 4.0] {
        let wave = |shift: f64| -> Box<dyn Fn(usize, usize, &Row) -> f64 + '_> {
            Box::new(move |_, _, row| {
                if row.along == [0.0; 2] { 0.0 } else { (harmonic * row.along[1].atan2(row.along[0]) + shift).cos() }
            })
        };
        add("direction_deg", Acts::Strength, vec![wave(0.0), wave(-TAU / 4.0)]);
    }
    // Position of the plate: waves along x and y, and bumps.
    for period in [0.6, 0.8, 1.05, 1.4, 1.9, 2.6, 3.6] {
        for axis in 0..2 {
            let wave = |shift: f64| -> Box<dyn Fn(usize, usize, &Row) -> f64 + '_> {
                Box::new(move |run, i, row| {
                    if row.path_mm > 0.0 { (TAU * runs[run].slide_mm[i][axis] / period + shift).sin() } else { 0.0 }
                })
            };
            add(if axis == 0 { "slide_x_mm" } else { "slide_y_mm" }, Acts::Strength, vec![wave(0.0), wave(TAU / 4.0)]);
        }
    }
    for cx in [-3.0, -1.0, 1.0, 3.0] {
        let bump = |cy: f64| -> Box<dyn Fn(usize, usize, &Row) -> f64 + '_> {
            Box::new(move |run, i, _| {
                (-0.5 * ((runs[run].slide_mm[i][0] - cx).powi(2) + (runs[run].slide_mm[i][1] - cy).powi(2)) / 1.4).exp()
            })
        };
        add("slide_x_mm,slide_y_mm", Acts::Strength, vec![bump(-3.0), bump(-1.0), bump(1.0), bump(3.0)]);
    }
    // Within a stroke.
    for length in [0.3, 1.0, 3.0] {
        add("slide", Acts::Strength, vec![Box::new(move |_, _, row: &Row| (-row.path_mm / length).exp())]);
    }
    for time in [0.3, 1.5, 8.0] {
        add(
            "contact_time_s",
            Acts::Stiffness,
            vec![Box::new(move |_, _, row: &Row| (-row.contact_time_s.max(0.0) / time).exp())],
        );
    }
    // Products of pairs.
    for i in 0..ranked.len() {
        for j in i + 1..ranked.len() {
            let product: Vec<f64> = ranked[i].1.iter().zip(&ranked[j].1).map(|(a, b)| a * b).collect();
            let name = format!("{} x {}", ranked[i].0.name(), ranked[j].0.name());
            add(&name, Acts::Strength, vec![per_run(product.clone())]);
            add(&name, Acts::Stiffness, vec![per_run(product)]);
        }
    }
    out
}

/// Scores of the groups that say something beyond the nuisance.
fn group_scores(space: &super::space::Space<'_>, groups: &[Group]) -> Vec<(usize, Score)> {
    let mut scores: Vec<(usize, Score)> = Vec::new();
    let mut cleaned = space.clean_all(groups.iter().flat_map(|g| &g.columns)).into_iter();
    for (i, group) in groups.iter().enumerate() {
        let raw = group.columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max);
        let clean: Vec<Clean> = cleaned.by_ref().take(group.columns.len()).collect();
        if let Some(score) = space.score(&clean.iter().collect::<Vec<_>>(), 0.02 * raw) {
            scores.push((i, score));
        }
    }
    scores
}

/// Looks for structure at a fit.
///
/// * `calibration`: run-level variances of the calibration set and its number of runs
/// * `null`: run-level variances of the baseline alone
/// * `explained`: gain of the accepted laws, against which structure is weighed
pub fn look(
    task: &Task<'_>,
    set: &RunSet,
    plain: (&Plain<'_>, &RunSet),
    fit: &Fit,
    tangents: &Tangents,
    calibration: (&PerRun, usize),
    null: &PerRun,
    explained: f64,
    seed: u64,
) -> Unexplained {
    let space = space_at(task, fit, tangents);
    let groups = groups(task, set, tangents, false);
    let scores = group_scores(&space, &groups);
    let plain_space = space_at(&plain.0.task, &plain.0.fit, &plain.0.tangents);
    let plain_groups = self::groups(&plain.0.task, plain.1, &plain.0.tangents, true);
    let plain_scores = group_scores(&plain_space, &plain_groups);
    let form = |group: &Group| {
        let number = group.along_stroke?;
        plain_scores.iter().find(|s| plain_groups[s.0].along_stroke == Some(number)).map(|s| &s.1)
    };
    let excess = |s: &(usize, Score)| s.1.excess(form(&groups[s.0]));
    let list: Vec<Score> = scores.iter().map(|s| s.1.clone()).collect();
    let runs = task.layout.runs();
    let flips = Flips::of(&list, runs, seed ^ 0x55);
    let mut out = Unexplained { p_model: 1.0, p_runs: 1.0, p_scatter: 1.0, ..Unexplained::default() };
    let size = |s: &(usize, Score)| surprise(excess(s), s.1.columns());
    if let Some(best) = scores.iter().max_by(|a, b| size(a).total_cmp(&size(b))) {
        let (i, score) = best;
        out.column.clone_from(&groups[*i].column);
        groups[*i].channel.clone_into(&mut out.channel);
        out.gain = excess(best);
        out.p_model = (list.len() as f64 * (-size(best)).exp()).min(1.0);
        out.p_runs = flips.p(score);
    }
    // Scatter between runs, with what the rows' noise makes of it on both sides.
    let (n1, n2) = ((runs as f64 - 3.0).max(1.0), (calibration.1 as f64 - 3.0).max(1.0));
    for k in 0..2 {
        let floor = 0.004f64.powi(2);
        let ratio = (fit.variances[k] + floor) / (calibration.0[k] + floor);
        out.scatter_ratio[k] = ratio;
        let p = 2.0 * f_tail(ratio, n1, n2);
        // Of the scatter that the laws were to explain, most must be gone; a law's form is never exact.
        let (left, before) = (fit.variances[k] - calibration.0[k], null[k] - calibration.0[k]);
        if ratio > 2.0 && left > 0.3 * before && p < out.p_scatter {
            out.p_scatter = p;
        }
    }
    let structure = out.gain > (0.15 * explained).max(16.0)
        && ((out.p_runs <= 0.01 && out.p_model <= 3e-4) || (out.p_model <= 1e-6 && out.p_runs <= 0.1));
    let scatter = out.p_scatter < 1e-3;
    // A law whose size differs from run to run by more than its form's error stands for something unrecorded.
    let columns = task.law_columns_of(fit);
    let (mut uneven, mut at) = (false, 0);
    for active in &fit.laws {
        let (variance, surprise) = space.dispersion(&columns[at]);
        at += active.values.len();
        uneven |= surprise > 6.0 && variance.max(0.0).sqrt() > 0.2 * active.values[0].abs();
    }
    out.significant = structure || scatter || uneven;
    if (scatter || uneven) && !structure {
        out.column = "run_id".to_owned();
        out.channel = if out.scatter_ratio[0] > out.scatter_ratio[1] { "normal" } else { "friction" }.to_owned();
    }
    out
}
