//! The next experiment: fifteen strokes that separate what the present protocol cannot.
//!
//! For each candidate design the information of its strokes is added to that of the present runs; the design with the
//! largest least separation between the competing laws after refitting wins [after Hunter & Reiner 1965].
//!
//! Main function: [`propose`].

use std::path::PathBuf;

use crate::data::runs::{Run, RunSet};
use crate::laws::{Column, OwnColumn};
use crate::model::active_law::ActiveLaw;
use crate::model::prior::Prior;
use crate::schema::{FactorPrice, NextExperiment, PlannedRun, minutes};
use crate::selection::scan::{columns_of, start_of};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::Fit;
use crate::statistics::precision::Block;
use crate::statistics::projection::Projection;
use crate::statistics::random_effects::RandomEffectColumns;
use crate::statistics::task::{NO_READING_N, Task};
use crate::verdict::candidate_designs::{PlanConstraints, ReferenceConditions, candidate_designs, rows_of};

/// Share of what the best plan adds to the expected separation from which on a plan suffices.
const OF_BEST: f64 = 0.9;

/// Two competing laws: the first is in force in a fit, the second has its best parameters.
pub struct HypothesisPair<'a> {
    /// Index of the first law in the fit.
    pub index: usize,
    /// The second law.
    pub competitor: &'a ActiveLaw,
}

/// Proposes the cheapest strokes that separate all pairs of competing laws of a fit, or those that separate them best where
/// none suffices.
///
/// * `own`: columns of the user's own, which are varied as well
pub fn propose(
    task: &Task<'_>,
    set: &RunSet,
    fit: &Fit,
    pairs: &[HypothesisPair<'_>],
    constraints: &PlanConstraints,
    own: &[OwnColumn],
) -> Option<NextExperiment> {
    let mut depths: Vec<f64> = set.runs.iter().map(|r| r.depth_mm()).collect();
    depths.sort_by(f64::total_cmp);
    let reach = [depths[depths.len() / 20], depths[depths.len() - 1 - depths.len() / 20]];
    let middle = depths[depths.len() / 2];
    let (low, high) = (reach[0].min(0.5 * middle), reach[1].max(1.4 * middle));
    let round = |v: f64| (v * 100.0).round() / 100.0;
    let median = |of: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = set.runs.iter().map(of).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let own_of = |run: &Run, place: usize| run.rows.last().map_or(f64::NAN, |row| row.own[place]);
    let conditions = ReferenceConditions {
        depth_mm: round(middle),
        press_mm_s: 2.0,
        length_mm: 5.0,
        start_s: set.runs.iter().flat_map(|r| &r.rows).map(|r| r.t_s).fold(0.0, f64::max),
        width_mm: median(&|r| r.value(Column::Width)).unwrap_or(16.0),
        own: std::array::from_fn(|place| median(&|r| own_of(r, place)).unwrap_or(f64::NAN)),
    };
    let known: Vec<PairInRuns> = pairs.iter().map(|r| PairInRuns::of(task, fit, r)).collect();
    let mut plans: Vec<(FactorPrice, Vec<PlannedRun>)> = Vec::new();
    for (factor, plan) in candidate_designs(set, [round(low), round(high)], own) {
        let Some(plan) = constraints.apply(factor, plan, own) else { continue };
        let more = RunSet::from_rows(PathBuf::new(), rows_of(&plan, conditions, own)).ok()?;
        let mut new = Task::new(&more.runs, task.reference, task.prior.clone(), Vec::new(), task.variances);
        new.sigma_n = noise_like(task, &known[0].with, &new.predict(&fit.parameters, &fit.laws));
        let mut runs = set.runs.clone();
        runs.extend(more.runs.iter().cloned());
        let least = pairs
            .iter()
            .zip(&known)
            .map(|(r, known)| known.and(PairInRuns::of(&new, fit, r)).separation(task, &runs, fit))
            .fold(f64::INFINITY, f64::min);
        let price = FactorPrice { factor: factor.to_owned(), lambda_rival_expected: least, minutes: minutes(&plan) };
        plans.push((price, plan));
    }
    plans.sort_by(|a, b| b.0.lambda_rival_expected.total_cmp(&a.0.lambda_rival_expected));
    let mut prices: Vec<FactorPrice> = Vec::new();
    for (price, _) in &plans {
        if prices.iter().all(|p| p.factor != price.factor) {
            prices.push(price.clone());
        }
    }
    prices.sort_by(|a, b| a.minutes.total_cmp(&b.minutes));
    let best = plans.first()?.0.lambda_rival_expected;
    // The plan that adds least stands for what the present runs separate, which this linear picture takes for more than
    // they do: what counts is what a plan adds to it.
    let least = plans.last()?.0.lambda_rival_expected;
    let suffices = |p: &FactorPrice| p.lambda_rival_expected - least >= OF_BEST * (best - least);
    let cost = |p: &FactorPrice| p.minutes * if p.factor == "all" { 2.0 } else { 1.0 };
    let of_enough = plans.into_iter().filter(|(p, _)| suffices(p));
    let (FactorPrice { factor, lambda_rival_expected, minutes }, runs) =
        of_enough.min_by(|a, b| cost(&a.0).total_cmp(&cost(&b.0)))?;
    let separates =
        pairs.iter().map(|r| [fit.laws[r.index].law.family.to_owned(), r.competitor.law.family.to_owned()]).collect();
    Some(NextExperiment { separates, factor, lambda_rival_expected, minutes, prices, runs })
}

/// Row noise of new rows, N: that of the present row with the nearest force in the same channel.
fn noise_like(task: &Task<'_>, known_n: &[f64], new_n: &[f64]) -> Vec<f64> {
    let like = |force: f64, channel: usize| {
        let mut near = (f64::INFINITY, task.sigma_n[channel]);
        for i in (channel..known_n.len()).step_by(3 * 7) {
            let d = (known_n[i] - force).abs();
            if d < near.0 && task.sigma_n[i] < NO_READING_N {
                near = (d, task.sigma_n[i]);
            }
        }
        near.1
    };
    new_n.iter().enumerate().map(|(i, force)| like(*force, i % 3)).collect()
}

/// A pair of competing laws in some runs: columns over the row noise at the fit without the first law.
struct PairInRuns {
    /// Prediction with the law, N.
    with: Vec<f64>,
    /// Difference that the first law makes.
    effect: Vec<f64>,
    /// Columns of the second law's linear parameters, per shape.
    competitor: Vec<Vec<Vec<f64>>>,
    /// Columns of the smooth model's parameters.
    parameters: Vec<Vec<f64>>,
    /// Columns of the random effects.
    random_effects: Vec<Vec<f64>>,
    /// Columns of the other laws in force.
    others: Vec<Vec<f64>>,
    sigma_n: Vec<f64>,
}

/// The fit without a law, with all random effects 0.
fn without_law(fit: &Fit, index: usize) -> Fit {
    let mut bare = fit.clone();
    bare.laws.remove(index);
    bare.random_effects.clear();
    bare
}

impl PairInRuns {
    fn of(task: &Task<'_>, fit: &Fit, pair: &HypothesisPair<'_>) -> Self {
        let law = pair.competitor.law;
        let bare = without_law(fit, pair.index);
        let with = task.predict(&fit.parameters, &fit.laws);
        let prediction = task.predict(&bare.parameters, &bare.laws);
        let derivatives = task.derivatives(&bare.parameters, &bare.laws, &bare.random_effects, &prediction);
        let own = &pair.competitor.values[law.linear..];
        // The grid, the competitor's own shape, and that with one parameter at either end of its range.
        let mut shapes: Vec<Vec<f64>> = law.shapes.iter().copied().chain([own]).map(<[f64]>::to_vec).collect();
        for (k, parameter) in law.parameters[law.linear..].iter().enumerate() {
            for end in [parameter.low, parameter.high] {
                let mut shape = own.to_vec();
                shape[k] = end;
                shapes.push(shape);
            }
        }
        Self {
            effect: task.difference_column(&with, &prediction, 1.0),
            competitor: shapes.iter().map(|s| columns_of(task, &bare, &prediction, &start_of(law, s))).collect(),
            random_effects: derivatives.random_effects.columns().to_vec(),
            parameters: derivatives.parameters.columns.into_iter().map(|c| c.values).collect(),
            others: task.law_columns_of(&bare),
            sigma_n: task.sigma_n.clone(),
            with,
        }
    }

    /// The pair in these runs and then others.
    fn and(&self, mut more: Self) -> Self {
        let join = |a: &Vec<f64>, b: &mut Vec<f64>| drop(b.splice(0..0, a.iter().copied()));
        let all = |a: &[Vec<f64>], b: &mut [Vec<f64>]| a.iter().zip(b).for_each(|(a, b)| join(a, b));
        join(&self.with, &mut more.with);
        join(&self.effect, &mut more.effect);
        join(&self.sigma_n, &mut more.sigma_n);
        self.competitor.iter().zip(&mut more.competitor).for_each(|(a, b)| all(a, b));
        all(&self.parameters, &mut more.parameters);
        all(&self.random_effects, &mut more.random_effects);
        all(&self.others, &mut more.others);
        more
    }

    /// Expected separation of the two laws in `runs`, which are those of these columns.
    fn separation(self, task: &Task<'_>, runs: &[Run], fit: &Fit) -> f64 {
        let prior = Prior { mean: fit.parameters, root: task.prior.root.clone() };
        let joint = Task::new(runs, task.reference, prior, self.sigma_n, fit.variances);
        let random_effects = RandomEffectColumns::new(joint.layout.clone(), self.random_effects);
        let parameters = Block::new(self.parameters.into_iter().map(|c| random_effects.observed(c)).collect());
        let derivatives = Derivatives { parameters, random_effects };
        let mut here = fit.clone();
        here.residual_n = vec![0.0; self.with.len()];
        let projection = Projection::new(&joint, &here, &derivatives, self.others);
        let effect = projection.project(&self.effect);
        let explained = self
            .competitor
            .iter()
            .map(|columns| {
                let projected = projection.project_all(columns.iter());
                Projection::explained(&effect, &projected.iter().collect::<Vec<_>>())
            })
            .fold(0.0, f64::max);
        (Projection::size(&effect) - explained).max(0.0)
    }
}
