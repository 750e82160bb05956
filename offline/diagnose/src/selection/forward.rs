//! Which laws are missing: forward selection with refits inside the model, and backward elimination.
//!
//! Main types: [`Selection`], [`LawEvidence`]; main function: [`select`].

use crate::data::runs::RunSet;
use crate::laws::{Column, Law, Place};
use crate::model::active_law::ActiveLaw;
use crate::selection::acceptance::{BY_CALIBRATION, SearchedCells, SelectionSettings, SignFlipP, is_significant};
use crate::selection::discrepancy::ModelDiscrepancy;
use crate::selection::scan::{GridPoint, ScoredGridPoint, grid_of, scored, start_of, why_untestable};
use crate::selection::starts::{refine, starts, wrong_way};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::projection::Projection;
use crate::statistics::sign_flips::{Score, SignFlips};
use crate::statistics::tails::minus_ln_p;
use crate::statistics::task::Task;

/// The test of a law against the baseline alone.
#[derive(Clone, Debug)]
pub struct SingleLawTest {
    /// The law.
    pub law: &'static Law,
    /// Gain in 2 log likelihood at the best shape of the grid, or of the refit where there was one.
    pub gain_2ll: f64,
    /// Model-based p over the whole grid.
    pub p_model: f64,
    /// Sign-flip p over the whole library.
    pub p_runs: SignFlipP,
    /// Whether it would be accepted as the first law.
    pub significant: bool,
    /// Why it cannot be tested.
    pub why_untestable: Option<String>,
}

/// Evidence for an accepted law.
#[derive(Clone, Debug)]
pub struct LawEvidence {
    /// Gain in 2 log likelihood over the model without it.
    pub gain_2ll: f64,
    /// Model-based p, Bonferroni over the grid.
    pub p_model: f64,
    /// Sign-flip p over the library.
    pub p_runs: SignFlipP,
}

/// Outcome of the selection.
pub struct Selection {
    /// The baseline alone, refitted.
    pub null: Fit,
    /// The model with the accepted laws.
    pub fit: Fit,
    /// Derivatives at the baseline alone.
    pub null_derivatives: Derivatives,
    /// Derivatives at `fit`.
    pub derivatives: Derivatives,
    /// How many laws of `fit` are the finger's own, the first ones.
    pub finger_laws: usize,
    /// Evidence for each law of `fit` beyond those.
    pub evidence: Vec<LawEvidence>,
    /// All laws against the baseline alone.
    pub tests: Vec<SingleLawTest>,
    /// The grid at `fit`.
    pub grid: Vec<GridPoint>,
    /// Scores of the grid on the effect-free runs.
    pub of_form: Vec<Option<Score>>,
    /// How many grid points were searched.
    pub cells: SearchedCells,
}

impl Selection {
    /// The accepted laws.
    pub fn accepted(&self) -> &[ActiveLaw] {
        &self.fit.laws[self.finger_laws..]
    }

    /// The laws of the fit without the accepted one of an index, and that one.
    pub fn laws_without(&self, index: usize) -> (Vec<ActiveLaw>, ActiveLaw) {
        let mut others = self.fit.laws.clone();
        let law = others.remove(self.finger_laws + index);
        (others, law)
    }
}

/// A law at its best shape of the grid.
struct Ranked {
    law: &'static Law,
    excess: f64,
    minus_ln_p: f64,
    p_runs: SignFlipP,
}

/// Most laws that are accepted.
const MOST: usize = 3;
/// Most Gauss–Newton steps of a fit whose derivatives are renewed: a large effect that is not in yet takes many.
pub const ROUNDS: usize = 20;

/// −2 log likelihood plus 1 for each shape parameter, by which laws are compared.
fn penalised_minus_2ll(fit: &Fit) -> f64 {
    fit.minus_2ll + fit.laws.iter().map(|a| (a.law.parameters.len() - a.law.linear) as f64).sum::<f64>()
}

/// Laws that modulate the same axis of a protocol: a second one there is more likely the first one's form error. An error
/// of the sensor is none of the finger's.
pub fn same_axis(a: &Law, b: &Law) -> bool {
    let of_sensor = |law: &Law| law.place == Place::Reading;
    of_sensor(a) == of_sensor(b) && a.axes.iter().any(|axis| b.axes.contains(axis))
}

/// Runs the selection.
///
/// * `laws`: those that are tried
/// * `discrepancy`: what the effect-free runs show of each law is taken off its evidence
pub fn select(
    task: &Task<'_>,
    set: &RunSet,
    laws: &[&'static Law],
    discrepancy: Option<&ModelDiscrepancy<'_>>,
    settings: &SelectionSettings,
) -> Selection {
    let mut search = Search::new(task, set, laws, discrepancy, settings);
    for round in 0..MOST {
        let scan = Scan::new(&search, round);
        let ranking = search.rank(&scan, round);
        let Some(top) = ranking.first().map(|r| r.minus_ln_p) else { break };
        // A baseline that had to leave the calibration hides what pulled it away; then the laws of depth are tried from
        // the calibrated point.
        let strained = round == 0 && task.squared_distance_from_prior(&search.fit.parameters) > 16.0;
        if top < 4.0 && !strained {
            break;
        }
        let refits = search.refit_ranked(&scan, &ranking, top, strained, round);
        let mut accepted = search.accepted(refits, &scan.cells, round);
        accepted.sort_by(|a, b| penalised_minus_2ll(&a.0).total_cmp(&penalised_minus_2ll(&b.0)));
        let Some((start, proof)) = accepted.into_iter().next() else { break };
        search.take(&start, proof);
        search.cells = scan.cells;
    }
    search.finish()
}

/// A selection on its way.
struct Search<'a> {
    task: &'a Task<'a>,
    settings: &'a SelectionSettings,
    /// Laws that are tried.
    laws: &'a [&'static Law],
    /// Why each of them cannot be tested.
    untestable: Vec<Option<String>>,
    /// The others.
    testable: Vec<&'static Law>,
    /// Scores of the grid on the effect-free runs.
    of_form: Vec<Option<Score>>,
    null: Fit,
    null_derivatives: Derivatives,
    fit: Fit,
    derivatives: Derivatives,
    evidence: Vec<LawEvidence>,
    tests: Vec<SingleLawTest>,
    grid: Vec<GridPoint>,
    cells: SearchedCells,
}

/// The grid's scores at the present fit, with their sign flips.
struct Scan {
    scores: Vec<ScoredGridPoint>,
    flips: SignFlips,
    cells: SearchedCells,
}

/// A refit with one law more.
struct Refit {
    fit: Fit,
    p_runs: SignFlipP,
    /// Share of its gain that is not an error of the baseline's form.
    share: f64,
}

impl Scan {
    fn new(search: &Search<'_>, round: usize) -> Self {
        let projection = Projection::at(search.task, &search.fit, &search.derivatives);
        let scores = scored(&projection, &search.grid);
        let all: Vec<Score> = scores.iter().filter_map(|s| s.score.clone()).collect();
        let flips = SignFlips::of(&all, search.task.layout.runs(), search.settings.seed + round as u64);
        Self { scores, flips, cells: SearchedCells::of(&all) }
    }
}

impl<'a> Search<'a> {
    fn new(
        task: &'a Task<'a>,
        set: &RunSet,
        laws: &'a [&'static Law],
        discrepancy: Option<&ModelDiscrepancy<'_>>,
        settings: &'a SelectionSettings,
    ) -> Self {
        let untestable: Vec<Option<String>> = laws.iter().map(|law| why_untestable(law, set)).collect();
        let pairs = laws.iter().zip(&untestable);
        let testable: Vec<&Law> = pairs.filter(|(_, reason)| reason.is_none()).map(|(law, _)| *law).collect();
        let start = FitStart {
            parameters: task.prior.mean,
            laws: task.calibrated_laws(),
            variances: task.variances,
            random_effects: Vec::new(),
        };
        let (null, null_derivatives) = task.fit(start, ROUNDS);
        let grid = grid_of(task, &null, &testable);
        let of_form = discrepancy
            .map_or_else(|| vec![None; grid.len()], |known| known.scores(&grid, task, &null, &null_derivatives));
        Self {
            task,
            settings,
            laws,
            untestable,
            testable,
            of_form,
            fit: null.clone(),
            derivatives: null_derivatives.clone(),
            null,
            null_derivatives,
            evidence: Vec::new(),
            tests: Vec::new(),
            cells: SearchedCells::all(grid.len()),
            grid,
        }
    }

    fn runs(&self) -> usize {
        self.task.layout.runs()
    }

    /// The best grid point of a law: gain less the error of form, its −ln p, and the p of the sign flips.
    fn best_of(&self, scan: &Scan, law: &Law) -> (f64, f64, SignFlipP) {
        scan.scores
            .iter()
            .filter(|s| self.grid[s.grid_point].start.law == law)
            .filter_map(|s| s.score.as_ref().map(|score| (score, self.of_form[s.grid_point].as_ref())))
            .filter(|(s, _)| !wrong_way(law, s))
            .map(|(s, of_form)| {
                let excess = s.excess(of_form);
                (excess, minus_ln_p(excess, s.columns()), s)
            })
            .fold(None, |a: Option<(f64, f64, &Score)>, b| match a {
                Some(a) if a.1 >= b.1 => Some(a),
                _ => Some(b),
            })
            .map_or((0.0, 0.0, SignFlipP { p: 1.0, by_calibration: false }), |(gain, minus_ln_p, score)| {
                // Where the evidence lies in the calibration, flips of the measured runs cannot speak for or against it.
                let by_calibration = score.prior_share() > BY_CALIBRATION;
                (gain, minus_ln_p, SignFlipP { p: scan.flips.p(score), by_calibration })
            })
    }

    /// The laws that are not in force, best first; in the first round also the test of every law.
    fn rank(&mut self, scan: &Scan, round: usize) -> Vec<Ranked> {
        let mut ranking: Vec<Ranked> = Vec::new();
        for (i, law) in self.laws.iter().copied().enumerate() {
            let (excess, minus_ln_p, p_runs) = self.best_of(scan, law);
            if round == 0 {
                let p_model = scan.cells.p(excess, law.linear, p_runs.by_calibration);
                self.tests.push(SingleLawTest {
                    law,
                    gain_2ll: excess,
                    p_model,
                    p_runs,
                    significant: is_significant(self.settings, law, excess, self.runs(), p_model, p_runs),
                    why_untestable: self.untestable[i].clone(),
                });
            }
            // A law of the finger may be stronger in the measured runs than the calibration lets it be.
            let accepted = &self.fit.laws[self.task.finger_laws.len()..];
            if minus_ln_p > 0.0 && accepted.iter().all(|a| a.law != law) {
                ranking.push(Ranked { law, excess, minus_ln_p, p_runs });
            }
        }
        ranking.sort_by(|a, b| b.minus_ln_p.total_cmp(&a.minus_ln_p));
        ranking
    }

    /// Refits of the ranked laws that are near the best one.
    fn refit_ranked(&mut self, scan: &Scan, ranking: &[Ranked], top: f64, strained: bool, round: usize) -> Vec<Refit> {
        let mut out: Vec<Refit> = Vec::new();
        for (place, ranked) in ranking.iter().enumerate() {
            let &Ranked { law, excess, minus_ln_p, p_runs } = ranked;
            let of_depth = strained && law.drivers.contains(&Column::Depth);
            // One outlying run may put a law on top that has nothing to it once it is refitted.
            let near = minus_ln_p > 0.35 * top || (minus_ln_p > 4.0 && p_runs.p <= self.settings.alpha);
            if !(of_depth || (place < 6 && near && top >= 4.0)) {
                continue;
            }
            let (best, scanned) = self.refit_law(scan, law, of_depth);
            if let Some(fit) = best {
                if round == 0
                    && let Some(test) = self.tests.iter_mut().find(|t| t.law == law)
                {
                    test.gain_2ll = (self.null.minus_2ll - fit.minus_2ll).max(0.0);
                }
                // The baseline's error of form has the same share of the refit's gain as of the scan's.
                let share = if of_depth { 1.0 } else { (excess / scanned.max(1e-9)).min(1.0) };
                out.push(Refit { fit, p_runs, share });
            }
        }
        out
    }

    /// The best refit with a law more, and the gain that the scan gave it.
    ///
    /// `of_depth`: start from the calibrated point with either sign, too
    fn refit_law(&self, scan: &Scan, law: &'static Law, of_depth: bool) -> (Option<Fit>, f64) {
        let mut best: Option<Fit> = None;
        let mut keep_better = |refined: Fit| {
            if best.as_ref().is_none_or(|b| refined.minus_2ll < b.minus_2ll) {
                best = Some(refined);
            }
        };
        let list = starts(&self.grid, &scan.scores, law, 2);
        let scanned = list.first().map_or(0.0, |s| s.0);
        for (gain, start) in list {
            if gain >= 3.0 {
                keep_better(refine(self.task, &self.fit, &self.derivatives, &start, 7));
            }
        }
        if of_depth {
            let from = Fit { parameters: self.task.prior.mean, ..self.fit.clone() };
            for sign in [1.0, -1.0] {
                let mut start = start_of(law, law.shapes[0]);
                start.values[0] = sign * law.parameters[0].typical;
                keep_better(refine(self.task, &from, &self.derivatives, &start, 9));
            }
        }
        (best, scanned)
    }

    /// The refits that pass the tests; a law that fits better by a few outlying runs does not stand in the way of another.
    fn accepted(&mut self, refits: Vec<Refit>, cells: &SearchedCells, round: usize) -> Vec<(Fit, LawEvidence)> {
        let mut out: Vec<(Fit, LawEvidence)> = Vec::new();
        for Refit { fit, p_runs, share } in refits {
            let law = fit.laws[fit.laws.len() - 1].law;
            let test = |gain: f64| {
                let p_model = cells.p(gain, law.parameters.len(), p_runs.by_calibration);
                (is_significant(self.settings, law, gain, self.runs(), p_model, p_runs), p_model)
            };
            let mut gain = share * (self.fit.minus_2ll - fit.minus_2ll);
            if test(gain).0 {
                gain = share * self.gain_over_nested(&fit);
            }
            let (stands, p_model) = test(gain);
            if round == 0
                && let Some(test) = self.tests.iter_mut().find(|t| t.law == law)
            {
                // The refit is better than the scan's estimate.
                (test.gain_2ll, test.p_model, test.significant) = (gain.max(0.0), p_model, stands);
            }
            if gain >= self.least_gain(law) && stands {
                out.push((fit, LawEvidence { gain_2ll: gain, p_model, p_runs }));
            }
        }
        out
    }

    /// Gain of a refit over itself without its last law: it may have found a better optimum of the baseline, which is no
    /// evidence for its law.
    fn gain_over_nested(&self, refit: &Fit) -> f64 {
        let mut laws = refit.laws.clone();
        laws.pop();
        let nested = self.task.fit_near(FitStart { laws, ..FitStart::from(refit) }, &self.derivatives, 9);
        nested.minus_2ll.min(self.fit.minus_2ll) - refit.minus_2ll
    }

    /// Least gain of a law beside those in force that modulate the same axis of the protocol.
    fn least_gain(&self, law: &Law) -> f64 {
        let accepted = &self.fit.laws[self.task.finger_laws.len()..];
        let along = accepted.iter().zip(&self.evidence).filter(|(a, _)| same_axis(a.law, law));
        along.map(|(_, e)| 0.10 * e.gain_2ll).fold(0.0, f64::max)
    }

    /// Takes a law into the model, drops those that it makes needless, and scans again from there.
    fn take(&mut self, start: &Fit, proof: LawEvidence) {
        (self.fit, self.derivatives) = self.task.fit(FitStart::from(start), ROUNDS);
        self.evidence.push(proof);
        eliminate(self.task, &mut self.fit, &mut self.derivatives, &mut self.evidence, self.task.layout.runs());
        self.grid = grid_of(self.task, &self.fit, &self.testable);
        debug_assert_eq!(self.grid.len(), self.of_form.len());
    }

    fn finish(self) -> Selection {
        let finger_laws = self.task.finger_laws.len();
        let Self { null, null_derivatives, fit, derivatives, evidence, tests, grid, of_form, cells, .. } = self;
        Selection { null, fit, null_derivatives, derivatives, finger_laws, evidence, tests, grid, of_form, cells }
    }
}

/// Renews the evidence of each law by leaving it out, and drops those that are no longer needed.
fn eliminate(
    task: &Task<'_>,
    fit: &mut Fit,
    derivatives: &mut Derivatives,
    evidence: &mut Vec<LawEvidence>,
    runs: usize,
) {
    let own = task.finger_laws.len();
    if evidence.len() < 2 {
        return;
    }
    let mut i = 0;
    while i < evidence.len() {
        let mut laws = fit.laws.clone();
        let law = laws.remove(own + i).law;
        let without = task.fit_near(FitStart { laws, ..FitStart::from(&*fit) }, derivatives, 9);
        let gain = without.minus_2ll - fit.minus_2ll;
        evidence[i].gain_2ll = gain.max(0.0);
        let parameters = law.parameters.len();
        if gain < (runs as f64).ln() * parameters as f64 && evidence.len() > 1 {
            evidence.remove(i);
            *fit = without;
            *derivatives = task.derivatives_of(fit);
        } else {
            i += 1;
        }
    }
}
