//! The next experiment: fifteen strokes, or up to four times these, that separate what the present protocol cannot.
//!
//! For each candidate design the information of its strokes is added to that of the present runs; the design with the
//! largest least separation between the competing laws after refitting wins [after Hunter & Reiner 1965].
//!
//! Main function: [`propose`].

use std::path::PathBuf;

use crate::data::median::median;
use crate::data::runs::{Run, RunSet};
use crate::laws::{Column, OwnColumn};
use crate::model::active_law::ActiveLaw;
use crate::model::prior::Prior;
use crate::plan::candidate_designs::{PlanConstraints, ReferenceConditions, candidate_designs, rows_of};
use crate::schema::{FactorPrice, NextExperiment, PlannedRun, minutes};
use crate::selection::scan::{columns_of, start_of};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::Fit;
use crate::statistics::precision::Block;
use crate::statistics::projection::Projection;
use crate::statistics::random_effects::RandomEffectColumns;
use crate::statistics::task::{NO_READING_N, Task};

/// Share of what the best plan adds to the expected separation from which on a plan suffices.
const OF_BEST: f64 = 0.9;

/// What fifteen strokes must add to the expected separation to be enough: what two laws then differ by scatters by about
/// twice its root, and one in fifty stays below what separates candidates.
const ENOUGH: f64 = 30.0;
/// Designs that are weighed with repetitions where none is enough.
const REPEATED: usize = 2;
/// Most times that a design is repeated.
const MOST_TIMES: usize = 4;

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
    let [low, middle, high] = depths_mm(set);
    let known = pairs.iter().map(|r| PairInRuns::of(task, fit, r)).collect();
    let conditions = reference_conditions(set, middle);
    let scales = Scales { task, set, fit, pairs, known, constraints, own, conditions };
    let designs = candidate_designs(set, [low, high], own);
    let mut plans = scales.weigh_all(&designs);
    plans.sort_by(|a, b| b.price.lambda_rival_expected.total_cmp(&a.price.lambda_rival_expected));
    let mut prices: Vec<FactorPrice> = Vec::new();
    for WeighedPlan { price, .. } in &plans {
        if prices.iter().all(|p| p.factor != price.factor) {
            prices.push(price.clone());
        }
    }
    prices.sort_by(|a, b| a.minutes.total_cmp(&b.minutes));
    let best = plans.first()?.price.lambda_rival_expected;
    // The plan that adds least stands for what the present runs separate, which this linear picture takes for more than
    // they do: what counts is what a plan adds to it.
    let least = plans.last()?.price.lambda_rival_expected;
    let suffices = |p: &FactorPrice| p.lambda_rival_expected - least >= OF_BEST * (best - least);
    let cost = |p: &FactorPrice| p.minutes * if p.factor == "all" { 2.0 } else { 1.0 };
    let of_enough = plans.into_iter().filter(|plan| suffices(&plan.price));
    let WeighedPlan { price: FactorPrice { factor, lambda_rival_expected, minutes }, runs, .. } =
        of_enough.min_by(|a, b| cost(&a.price).total_cmp(&cost(&b.price)))?;
    let separates =
        pairs.iter().map(|r| [fit.laws[r.index].law.family.to_owned(), r.competitor.law.family.to_owned()]).collect();
    Some(NextExperiment { separates, factor, lambda_rival_expected, minutes, prices, runs })
}

fn round(v: f64) -> f64 {
    (v * 100.0).round() / 100.0
}

/// Least, middle and largest depth of new strokes, mm.
fn depths_mm(set: &RunSet) -> [f64; 3] {
    let mut depths: Vec<f64> = set.runs.iter().map(|r| r.depth_mm()).collect();
    depths.sort_by(f64::total_cmp);
    let reach = [depths[depths.len() / 20], depths[depths.len() - 1 - depths.len() / 20]];
    let middle = depths[depths.len() / 2];
    [reach[0].min(0.5 * middle), middle, reach[1].max(1.4 * middle)].map(round)
}

/// Conditions of new strokes where a design says nothing.
fn reference_conditions(set: &RunSet, depth_mm: f64) -> ReferenceConditions {
    let usual = |of: &dyn Fn(&Run) -> f64| median(set.runs.iter().map(of).filter(|v| v.is_finite()));
    let own_of = |run: &Run, place: usize| run.rows.last().map_or(f64::NAN, |row| row.own[place]);
    ReferenceConditions {
        depth_mm,
        press_mm_s: 2.0,
        length_mm: 5.0,
        start_s: set.runs.iter().flat_map(|r| &r.rows).map(|r| r.t_s).fold(0.0, f64::max),
        width_mm: usual(&|r| r.value(Column::Width)).unwrap_or(16.0),
        own: std::array::from_fn(|place| usual(&|r| own_of(r, place)).unwrap_or(f64::NAN)),
    }
}

/// A plan with what it is expected to give and its price.
struct WeighedPlan {
    /// Index of its design.
    design: usize,
    price: FactorPrice,
    runs: Vec<PlannedRun>,
}

/// What plans are weighed by.
struct Scales<'a> {
    task: &'a Task<'a>,
    set: &'a RunSet,
    fit: &'a Fit,
    pairs: &'a [HypothesisPair<'a>],
    /// The pairs in the present runs.
    known: Vec<PairInRuns>,
    constraints: &'a PlanConstraints,
    own: &'a [OwnColumn],
    conditions: ReferenceConditions,
}

impl Scales<'_> {
    /// All designs, and repetitions of the best of them where none is enough.
    fn weigh_all(&self, designs: &[(&str, Vec<PlannedRun>)]) -> Vec<WeighedPlan> {
        let separation = |plan: &WeighedPlan| plan.price.lambda_rival_expected;
        let mut plans: Vec<WeighedPlan> = (0..designs.len()).filter_map(|i| self.weigh(designs, i, 1)).collect();
        let least = plans.iter().map(separation).fold(f64::INFINITY, f64::min);
        let mut best: Vec<(f64, usize)> = plans.iter().map(|plan| (separation(plan), plan.design)).collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.truncate(REPEATED);
        for times in 2..=MOST_TIMES {
            if plans.iter().any(|plan| separation(plan) - least >= ENOUGH) {
                break;
            }
            plans.extend(best.iter().filter_map(|(_, design)| self.weigh(designs, *design, times)));
        }
        plans
    }

    /// A design so many times, within the constraints; `None` where these leave nothing of it.
    fn weigh(&self, designs: &[(&str, Vec<PlannedRun>)], design: usize, times: usize) -> Option<WeighedPlan> {
        let Self { task, set, fit, .. } = self;
        let (factor, strokes) = &designs[design];
        let strokes = std::iter::repeat_n(strokes, times).flatten().cloned().collect();
        let plan = self.constraints.apply(factor, strokes, self.own)?;
        let more = RunSet::from_rows(PathBuf::new(), rows_of(&plan, self.conditions, self.own)).ok()?;
        let mut new = Task::new(&more.runs, task.reference, task.prior.clone(), Vec::new(), task.variances);
        new.sigma_n = noise_like(task, &self.known[0].with, &new.predict(&fit.parameters, &fit.laws));
        let mut runs = set.runs.clone();
        runs.extend(more.runs.iter().cloned());
        let least = self
            .pairs
            .iter()
            .zip(&self.known)
            .map(|(r, known)| known.and(PairInRuns::of(&new, fit, r)).separation(task, &runs, fit))
            .fold(f64::INFINITY, f64::min);
        let price = FactorPrice { factor: (*factor).to_owned(), lambda_rival_expected: least, minutes: minutes(&plan) };
        Some(WeighedPlan { design, price, runs: plan })
    }
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
