//! Competing hypotheses: which other law could stand in an accepted law's place, by the data and by what the protocol can
//! separate.
//!
//! Main types: [`CompetingHypotheses`], [`CompetingLaw`].

use crate::data::runs::Run;
use crate::laws::{Change, Column, Law, Place};
use crate::model::active_law::ActiveLaw;
use crate::schema::INDISTINGUISHABLE;
use crate::selection::alternative_drift::AlternativeDrift;
use crate::selection::scan::{GridPoint, ScoredGridPoint, columns_of, scored};
use crate::selection::starts::{refine, starts};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::projection::{ProjectedColumn, Projection};
use crate::statistics::sign_flips::Score;
use crate::statistics::task::Task;

/// A law that may stand in the place of an accepted one.
#[derive(Clone, Debug)]
pub struct CompetingLaw {
    /// The law with its best parameters.
    pub active: ActiveLaw,
    /// −2 log likelihood above that of the accepted law.
    pub delta_2ll: f64,
    /// Separation from the accepted law, in 2 log likelihood, that the protocol can be expected to give.
    pub lambda_rival: f64,
}

/// The hypotheses for the place of one accepted law.
#[derive(Clone)]
pub struct CompetingHypotheses {
    /// Gain of the law over leaving it out, in 2 log likelihood.
    pub gain_2ll: f64,
    /// Gain of the law that this protocol can be expected to give.
    pub lambda_detect: f64,
    /// Laws that cannot be excluded; the accepted law comes first with a separation of 0.
    pub candidates: Vec<CompetingLaw>,
    /// The best model with another law in the place, where it beats the accepted one.
    pub better: Option<Fit>,
}

/// Hypotheses for the place of law `index` of a fit.
///
/// * `grid`, `of_form`: all testable laws on their grid of shapes, with columns at the fit, and their scores on the effect-free
///   runs
/// * `alternative`: the wider drift prior, where laws of depth must beat it
pub fn competing_hypotheses(
    task: &Task<'_>,
    fit: &Fit,
    derivatives: &Derivatives,
    index: usize,
    (grid, of_form): (&[GridPoint], &[Option<Score>]),
    testable: &[&'static Law],
    alternative: Option<&AlternativeDrift<'_>>,
) -> CompetingHypotheses {
    let comparison = Comparison::new(task, fit, derivatives, index, (grid, of_form), alternative);
    let own = comparison.own.clone();
    let mut candidates = vec![CompetingLaw { active: own.clone(), delta_2ll: 0.0, lambda_rival: 0.0 }];
    let shapes = |law: &Law| (law.parameters.len() - law.linear) as f64;
    let own_of_form = comparison.gain_of_form(fit, own.law);
    let (mut best, mut better) = (-1.0, None);
    let in_force = |law: &Law| law == own.law || comparison.others.iter().any(|o| o.law == law);
    for &law in testable.iter().filter(|law| !in_force(law)) {
        let Some((refit, separation)) = comparison.refit_with(law) else { continue };
        let active = refit.laws[refit.laws.len() - 1].clone();
        // What an error of form explains speaks for neither law.
        let of_form = comparison.gain_of_form(&refit, law) - own_of_form;
        let delta_2ll = comparison.minus_2ll_or_drift(&refit, law) - fit.minus_2ll + of_form;
        let lambda_rival = comparison.separation_of_refit(&active, separation);
        // The less a protocol can separate, the more of a difference may be the error of a form.
        let inseparable = 1.0 - lambda_rival / (0.035 * comparison.lambda_detect).max(10.0);
        if delta_2ll < INDISTINGUISHABLE + 0.15 * comparison.gain_2ll * inseparable.max(0.0) {
            candidates.push(CompetingLaw { active, delta_2ll, lambda_rival });
        }
        let penalised = refit.minus_2ll - fit.minus_2ll + of_form + shapes(law) - shapes(own.law);
        if penalised < best {
            (best, better) = (penalised, Some(refit));
        }
    }
    candidates[1..].sort_by(|a, b| a.delta_2ll.total_cmp(&b.delta_2ll));
    let Comparison { gain_2ll, lambda_detect, .. } = comparison;
    CompetingHypotheses { gain_2ll, lambda_detect, candidates, better }
}

/// An accepted law against the others of the library, seen by the protocol and by the data.
struct Comparison<'a> {
    task: &'a Task<'a>,
    fit: &'a Fit,
    derivatives: &'a Derivatives,
    grid: &'a [GridPoint],
    /// Its scores on the effect-free runs.
    of_form: &'a [Option<Score>],
    alternative: Option<&'a AlternativeDrift<'a>>,
    /// The accepted law.
    own: ActiveLaw,
    /// The other laws in force.
    others: Vec<ActiveLaw>,
    /// The fit without the accepted law.
    without: Fit,
    /// The accepted fit with the law switched off and all else kept.
    switched_off: Fit,
    /// Prediction of that, N.
    switched_off_n: Vec<f64>,
    /// The linear picture there.
    projection: Projection<'a>,
    /// Change of the readings by the accepted law, nuisance projected out.
    effect: ProjectedColumn,
    gain_2ll: f64,
    lambda_detect: f64,
    /// The grid as the protocol sees it: at the accepted fit with the law switched off.
    by_protocol: Vec<ScoredGridPoint>,
    /// The grid as the data see it: at the fit without the law.
    by_data: Vec<ScoredGridPoint>,
}

impl<'a> Comparison<'a> {
    fn new(
        task: &'a Task<'a>,
        fit: &'a Fit,
        derivatives: &'a Derivatives,
        index: usize,
        (grid, of_form): (&'a [GridPoint], &'a [Option<Score>]),
        alternative: Option<&'a AlternativeDrift<'a>>,
    ) -> Self {
        let own = fit.laws[index].clone();
        let mut others = fit.laws.clone();
        others.remove(index);
        let start = FitStart { laws: others.clone(), ..FitStart::from(fit) };
        let without = task.fit_near(start, derivatives, 9);
        let alternative = alternative.filter(|_| AlternativeDrift::concerns(own.law));
        let drifted = alternative.map_or(f64::INFINITY, |a| a.minus_2ll(FitStart::from(&without), derivatives));
        let gain_2ll = without.minus_2ll.min(drifted) - fit.minus_2ll;

        let switched_off = Fit {
            variances: fit.variances,
            parameters: fit.parameters,
            random_effects: fit.random_effects.clone(),
            ..without.clone()
        };
        let projection = Projection::at(task, &switched_off, derivatives);
        let with_n = task.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
        let switched_off_n = task.predict_at(&fit.parameters, &others, &fit.random_effects);
        let effect = projection.project(&task.difference_column(&with_n, &switched_off_n, 1.0));
        let lambda_detect = Projection::size(&effect);
        let by_protocol = scored(&projection, grid);
        let by_data = scored(&Projection::at(task, &without, derivatives), grid);
        Self {
            task,
            fit,
            derivatives,
            grid,
            of_form,
            alternative,
            own,
            others,
            without,
            switched_off,
            switched_off_n,
            projection,
            effect,
            gain_2ll,
            lambda_detect,
            by_protocol,
            by_data,
        }
    }

    /// The largest part of the accepted law's effect that the derivatives of another law explain, over its grid.
    fn explained_by_grid(&self, law: &Law) -> f64 {
        self.by_protocol
            .iter()
            .filter(|s| self.grid[s.grid_point].start.law == law && s.score.is_some())
            .map(|s| Projection::explained(&self.effect, &s.projected.iter().collect::<Vec<_>>()))
            .fold(0.0, f64::max)
    }

    /// The part of the accepted law's effect that another law does not explain at its size, which for a large effect its
    /// derivative at size 0 does not show.
    fn separation_at_size(&self, active: &ActiveLaw) -> f64 {
        let mut laws = self.others.clone();
        laws.push(active.clone());
        let with_n = self.task.predict_at(&self.fit.parameters, &laws, &self.fit.random_effects);
        let effect = self.projection.project(&self.task.difference_column(&with_n, &self.switched_off_n, 1.0));
        self.lambda_detect - Projection::explained(&self.effect, &[&effect])
    }

    /// The best fit with another law in the place, and the separation that the grid and the law's imitation give; `None`
    /// where the law is near neither in the data nor by design, so that no refit is needed.
    fn refit_with(&self, law: &'static Law) -> Option<(Fit, f64)> {
        let imitation = imitation(&self.own, law, self.task.runs);
        let at_size = imitation.as_ref().map_or(f64::INFINITY, |active| self.separation_at_size(active));
        let separation = at_size.min(self.lambda_detect - self.explained_by_grid(law));
        let list = starts(self.grid, &self.by_data, law, 2);
        let score = list.first().map_or(0.0, |s| s.0);
        if score < 0.4 * self.gain_2ll - 10.0 && separation > (0.3 * self.lambda_detect).max(30.0) {
            return None;
        }
        let from_grid =
            list.into_iter().map(|(_, start)| refine(self.task, &self.without, self.derivatives, &start, 7));
        let from_imitation = imitation.map(|start| {
            let from = Fit { laws: self.others.clone(), ..self.fit.clone() };
            refine(self.task, &from, self.derivatives, &start, 7)
        });
        let best = from_grid.chain(from_imitation).min_by(|a, b| a.minus_2ll.total_cmp(&b.minus_2ll))?;
        Some((best, separation))
    }

    /// Part of a law's gain in the place over none there that an error of the baseline's form explains: what the scan takes off its
    /// best shape. Where the effect-free runs cannot show the law itself (they have one hold, say), those along the same stroke
    /// stand for it.
    fn gain_of_form(&self, with: &Fit, law: &Law) -> f64 {
        let known = |s: &&ScoredGridPoint| s.score.is_some() && self.of_form[s.grid_point].is_some();
        let law_of = |s: &ScoredGridPoint| self.grid[s.grid_point].start.law;
        let along_slide = |law: &Law| law.drivers.contains(&Column::Slide);
        let of_law = self.by_data.iter().filter(|s| law_of(s) == law).filter(known);
        let alike = self.by_data.iter().filter(|s| along_slide(law) && along_slide(law_of(s))).filter(known);
        let gain = |s: &&ScoredGridPoint| s.score.as_ref().map_or(0.0, Score::gain);
        let best = |a: &&ScoredGridPoint, b: &&ScoredGridPoint| gain(a).total_cmp(&gain(b));
        let Some(scored) = of_law.max_by(best).or_else(|| alike.max_by(best)) else { return 0.0 };
        let Some(score) = &scored.score else { return 0.0 };
        let of_form = score.gain() - score.excess(self.of_form[scored.grid_point].as_ref());
        of_form.max(0.0).min((self.without.minus_2ll - with.minus_2ll).max(0.0))
    }

    /// −2 log likelihood of a refit, or of the wider drift from there, where that is better and concerns the law.
    fn minus_2ll_or_drift(&self, refit: &Fit, law: &Law) -> f64 {
        let alternative = self.alternative.filter(|_| AlternativeDrift::concerns(law));
        let drifted = alternative.map_or(f64::INFINITY, |a| a.minus_2ll(FitStart::from(refit), self.derivatives));
        refit.minus_2ll.min(drifted)
    }

    /// The separation at the competitor's best shape by the refit, which the grid may miss.
    fn separation_of_refit(&self, active: &ActiveLaw, separation: f64) -> f64 {
        let columns = columns_of(self.task, &self.switched_off, &self.switched_off_n, &zero_size(active));
        let columns: Vec<ProjectedColumn> = columns.iter().map(|c| self.projection.project(c)).collect();
        let explained = Projection::explained(&self.effect, &columns.iter().collect::<Vec<_>>());
        separation.min(self.lambda_detect - explained).min(self.separation_at_size(active)).max(0.0)
    }
}

/// Another law with the parameters by which it comes nearest to what the accepted law does to strength or stiffness, row
/// by row; shape parameters of the same name are taken over.
///
/// Two laws that a protocol cannot separate end at the same likelihood, but for a large effect a refit that starts
/// without either may stop on its way. `None` where the two act in different places.
fn imitation(own: &ActiveLaw, law: &'static Law, runs: &[Run]) -> Option<ActiveLaw> {
    let acts: fn(&Change) -> f64 = match (own.law.place, law.place) {
        (Place::Strength, Place::Strength) => |c| c.strength - 1.0,
        (Place::Stiffness, Place::Stiffness) => |c| c.stiffness - 1.0,
        _ => return None,
    };
    if law.linear != 1 {
        return None;
    }
    let values = law.parameters.iter().map(|p| {
        let same = own.law.parameters.iter().position(|o| o.name == p.name);
        same.map_or(p.typical, |k| own.values[k].clamp(p.low, p.high))
    });
    let mut out = ActiveLaw { law, values: values.collect() };
    out.values[0] = 1e-3 * law.parameters[0].typical;
    let (mut product, mut square) = (0.0, 0.0);
    for row in runs.iter().flat_map(|r| &r.rows) {
        let change = |active: &ActiveLaw| {
            let mut change = Change::default();
            active.law.apply(&active.values, row, &mut change);
            acts(&change)
        };
        let one = change(&out) / out.values[0];
        product += one * change(own);
        square += one * one;
    }
    let size = product / square;
    out.values[0] = size.clamp(law.parameters[0].low, law.parameters[0].high);
    (size.is_finite() && size != 0.0).then_some(out)
}

/// The law with its shape and size 0.
fn zero_size(active: &ActiveLaw) -> ActiveLaw {
    let mut zero = active.clone();
    zero.values[..active.law.linear].fill(0.0);
    zero
}
