//! The next experiment: fifteen strokes that separate what the present protocol cannot.
//!
//! For each plan its information is added to that of the present runs; the plan with the largest least separation between
//! the rivals after refitting wins [after Hunter & Reiner 1965].

use std::path::PathBuf;

use super::fit::{Fit, Prior, Task};
use super::laws::Column;
use super::metric::Block;
use super::mixed::{EFFECTS, Scatter};
use super::plans::{Habits, PlannedRun, plans, rows_of};
use super::runs::{Run, RunSet};
use super::scan::{columns_of, start_of};
use super::space::Space;
use super::tangents::Tangents;
use super::walk::Active;

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
    let known: Vec<View> = rivalries.iter().map(|r| View::of(task, fit, r)).collect();
    let mut best: Option<(f64, &'static str, Vec<PlannedRun>)> = None;
    for (factor, plan) in plans(set, [round(low), round(high)]) {
        let more = RunSet::from_rows(PathBuf::new(), rows_of(&plan, habits)).ok()?;
        let mut new = Task::new(&more.runs, task.reference, task.prior.clone(), Vec::new(), task.variances);
        new.sigma_n = noise_like(task, &known[0].with, &new.predict(&fit.theta, &fit.laws));
        let mut runs = set.runs.clone();
        runs.extend(more.runs.iter().cloned());
        let least = rivalries
            .iter()
            .zip(&known)
            .map(|(r, known)| known.and(View::of(&new, fit, r)).separation(task, &runs, fit))
            .fold(f64::INFINITY, f64::min);
        if best.as_ref().is_none_or(|b| least > b.0) {
            best = Some((least, factor, plan));
        }
    }
    let (lambda, factor, runs) = best?;
    let separates =
        rivalries.iter().map(|r| [fit.laws[r.index].law.family.to_owned(), r.rival.law.family.to_owned()]).collect();
    Some(NextExperiment { separates, factor: factor.to_owned(), lambda_rival_expected: lambda, runs })
}

/// Row noise of new rows: that of the present ones at their force.
fn noise_like(task: &Task<'_>, known_n: &[f64], new_n: &[f64]) -> Vec<f64> {
    let like = |force: f64, channel: usize| {
        let mut near = (f64::INFINITY, task.sigma_n[channel]);
        for i in (channel..known_n.len()).step_by(3 * 7) {
            let d = (known_n[i] - force).abs();
            if d < near.0 {
                near = (d, task.sigma_n[i]);
            }
        }
        near.1
    };
    new_n.iter().enumerate().map(|(i, force)| like(*force, i % 3)).collect()
}

/// A rivalry seen in some runs: columns over the row noise at the fit without the law.
struct View {
    /// Prediction with the law, N.
    with: Vec<f64>,
    /// What the law does.
    effect: Vec<f64>,
    /// The rival's linear columns, per shape.
    rival: Vec<Vec<Vec<f64>>>,
    freedoms: Vec<Vec<f64>>,
    scatter: Vec<Vec<f64>>,
    /// Parameters of the other laws in force.
    others: Vec<Vec<f64>>,
    sigma_n: Vec<f64>,
}

/// The fit without a law, its runs drawing nothing.
fn bare(fit: &Fit, index: usize) -> Fit {
    let mut bare = fit.clone();
    bare.laws.remove(index);
    bare.modes.clear();
    bare
}

impl View {
    fn of(task: &Task<'_>, fit: &Fit, rivalry: &Rivalry<'_>) -> Self {
        let law = rivalry.rival.law;
        let bare = bare(fit, rivalry.index);
        let with = task.predict(&fit.theta, &fit.laws);
        let prediction = task.predict(&bare.theta, &bare.laws);
        let tangents = task.tangents(&bare.theta, &bare.laws, &bare.modes, &prediction);
        let own = &rivalry.rival.values[law.linear..];
        // The grid, the rival's own shape, and that with one parameter at either end of its range.
        let mut shapes: Vec<Vec<f64>> = law.shapes.iter().copied().chain([own]).map(<[f64]>::to_vec).collect();
        for (k, parameter) in law.parameters[law.linear..].iter().enumerate() {
            for end in [parameter.low, parameter.high] {
                let mut shape = own.to_vec();
                shape[k] = end;
                shapes.push(shape);
            }
        }
        Self {
            effect: task.column(&with, &prediction, 1.0),
            rival: shapes.iter().map(|s| columns_of(task, &bare, &prediction, &start_of(law, s))).collect(),
            scatter: (0..EFFECTS).map(|k| tangents.scatter.column(k).to_vec()).collect(),
            freedoms: tangents.freedoms.columns.into_iter().map(|c| c.values).collect(),
            others: task.law_columns_of(&bare),
            sigma_n: task.sigma_n.clone(),
            with,
        }
    }

    /// The same in these runs and then others.
    fn and(&self, mut more: Self) -> Self {
        let join = |a: &Vec<f64>, b: &mut Vec<f64>| drop(b.splice(0..0, a.iter().copied()));
        let all = |a: &[Vec<f64>], b: &mut [Vec<f64>]| a.iter().zip(b).for_each(|(a, b)| join(a, b));
        join(&self.with, &mut more.with);
        join(&self.effect, &mut more.effect);
        join(&self.sigma_n, &mut more.sigma_n);
        self.rival.iter().zip(&mut more.rival).for_each(|(a, b)| all(a, b));
        all(&self.freedoms, &mut more.freedoms);
        all(&self.scatter, &mut more.scatter);
        all(&self.others, &mut more.others);
        more
    }

    /// Expected separation of the rivals in `runs`, which are those of this view.
    fn separation(self, task: &Task<'_>, runs: &[Run], fit: &Fit) -> f64 {
        let prior = Prior { mean: fit.theta.clone(), root: task.prior.root.clone() };
        let joint = Task::new(runs, task.reference, prior, self.sigma_n, fit.variances);
        let scatter = Scatter::new(joint.layout.clone(), self.scatter);
        let freedoms = Block::new(self.freedoms.into_iter().map(|c| scatter.seen(c)).collect());
        let tangents = Tangents { freedoms, scatter };
        let mut here = fit.clone();
        here.residual_n = vec![0.0; self.with.len()];
        let space = Space::new(&joint, &here, &tangents, self.others);
        let effect = space.clean(&self.effect);
        let explained = self
            .rival
            .iter()
            .map(|columns| {
                let clean = space.clean_all(columns.iter());
                Space::explained(&effect, &clean.iter().collect::<Vec<_>>())
            })
            .fold(0.0, f64::max);
        (Space::size(&effect) - explained).max(0.0)
    }
}
