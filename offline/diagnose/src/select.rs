//! Which laws are missing: forward selection with refits inside the model, backward elimination, swaps.

use super::chance::{Flips, surprise};
use super::fit::{Fit, Start, Task};
use super::form::Plain;
use super::laws::{Column, LAWS, Law};
use super::runs::RunSet;
use super::scan::{Candidate, Scored, candidates, obstacle, scored};
use super::space::Space;
use super::tangents::Tangents;
use super::walk::Active;

/// What decides.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Level of the sign-flip test.
    pub alpha: f64,
    /// Seed of the sign flips.
    pub seed: u64,
    /// The library: laws that are tested, and that rival each other.
    pub laws: &'static [&'static Law],
}

impl Default for Settings {
    fn default() -> Self {
        Self { alpha: 0.01, seed: 1, laws: LAWS }
    }
}

/// The test of a law against the baseline alone.
#[derive(Clone, Debug)]
pub struct Test {
    /// The law.
    pub law: &'static Law,
    /// Gain in 2 log likelihood at the best shape of the grid, or of the refit where there was one.
    pub gain_2ll: f64,
    /// Model-based p over the whole grid.
    pub p_model: f64,
    /// Sign-flip p over the whole library.
    pub p_runs: RunsP,
    /// Whether it would be accepted as the first law.
    pub significant: bool,
    /// Why it cannot be tested.
    pub obstacle: Option<String>,
}

/// Evidence for an accepted law.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Gain in 2 log likelihood over the model without it.
    pub gain_2ll: f64,
    /// Model-based p, Bonferroni over the grid.
    pub p_model: f64,
    /// Sign-flip p over the library.
    pub p_runs: RunsP,
}

/// Outcome of the selection.
pub struct Selection {
    /// The baseline alone, refitted.
    pub null: Fit,
    /// The model with the accepted laws.
    pub fit: Fit,
    /// Tangents at the baseline alone.
    pub null_tangents: Tangents,
    /// Tangents there.
    pub tangents: Tangents,
    /// Evidence for each law of `fit`.
    pub evidence: Vec<Evidence>,
    /// All laws against the baseline alone.
    pub tests: Vec<Test>,
    /// The grid.
    pub grid: Vec<Candidate>,
    /// How many places were searched.
    pub cells: Cells,
}

/// A law at its best shape of the grid.
struct Ranked {
    law: &'static Law,
    excess: f64,
    surprise: f64,
    p_runs: RunsP,
}

/// p of the sign flips.
#[derive(Clone, Copy, Debug)]
pub struct RunsP {
    /// The p.
    pub p: f64,
    /// Whether the evidence lies in the calibration, so that flips of the measured runs speak neither for nor against.
    pub by_calibration: bool,
}

/// Most laws that are accepted.
const MOST: usize = 3;
/// Most Gauss–Newton rounds of a fit with tangents of its own: a large effect that is not in yet takes many.
pub const ROUNDS: usize = 20;

/// The level in the three-way rule that accepts a law.
fn significant(settings: &Settings, law: &Law, gain: f64, runs: usize, p_model: f64, p_runs: RunsP) -> bool {
    let penalised = gain - (runs as f64).ln() * law.parameters.len() as f64 > 0.0;
    if p_runs.by_calibration {
        return penalised && p_model <= against_calibration(settings);
    }
    penalised
        && p_runs.p <= few_runs(law)
        && ((p_runs.p <= settings.alpha && p_model <= loosest(settings))
            || (p_model <= 1e-2 * settings.alpha && p_runs.p <= 0.25)
            || (p_model <= 1e-9 && p_runs.p <= 0.5))
}

/// How far the evidence for a law may rest on few runs. The onset of sliding is where a baseline's form is known least:
/// what shows there in a few runs only is no law that fades along the stroke.
fn few_runs(law: &Law) -> f64 {
    if law.drivers.contains(&Column::Slide) { 0.05 } else { 1.0 }
}

/// Share of a gain that comes from the calibration's prior from which on the evidence is called the calibration's.
const BY_CALIBRATION: f64 = 0.3;

/// Bonferroni over a grid: the scores of a law's own kind, those of laws that show against the calibration or those of
/// laws that show between the measured runs.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    calibration: f64,
    runs: f64,
}

impl Cells {
    fn of(scores: &[super::chance::Score]) -> Self {
        let calibration = scores.iter().filter(|s| s.prior_share() > BY_CALIBRATION && s.surprise() > 1.0).count();
        Self { calibration: calibration.max(1) as f64, runs: scores.len().max(1) as f64 }
    }

    /// Model-based p of a gain.
    pub fn p(&self, gain: f64, parameters: usize, by_calibration: bool) -> f64 {
        let cells = if by_calibration { self.calibration } else { self.runs };
        (cells * (-surprise(gain.max(0.0), parameters)).exp()).min(1.0)
    }
}

/// The model-based p at which a law stands whose evidence lies against the calibration.
pub fn against_calibration(settings: &Settings) -> f64 {
    0.1 * settings.alpha
}

/// The loosest model-based p at which any law stands: what a law that came in by a swap must reach, too.
pub fn loosest(settings: &Settings) -> f64 {
    0.3 * settings.alpha
}

/// Fits a law beside those in force, from a shape of the grid and the linear estimate of its size.
pub fn refine(task: &Task<'_>, fit: &Fit, tangents: &Tangents, start: &Active, most: usize) -> Fit {
    let mut laws = fit.laws.clone();
    let mut one = start.clone();
    // A size of exactly zero has no tangent in its shape.
    for k in 0..one.law.linear {
        if one.values[k] == 0.0 {
            one.values[k] = 0.02 * one.law.parameters[k].typical;
        }
    }
    laws.push(one);
    task.fit(Start { laws, ..Start::from(fit) }, Some(tangents), false, most)
}

/// Whether the linear estimate of a law that acts one way only (a pull-off pulls, a bell is a bell) has the other sign.
fn wrong_way(law: &Law, score: &super::chance::Score) -> bool {
    law.linear == 1 && law.parameters[0].low >= 0.0 && score.estimate().0[0] < 0.0
}

/// A start with the size that the linear picture gives it.
fn sized(candidate: &Candidate, scored: &Scored) -> Active {
    let mut start = candidate.start.clone();
    let Some(score) = &scored.score else { return start };
    if score.columns() == start.law.linear {
        let k = score.columns();
        let mut sum = score.fixed.clone();
        for g in score.per_run.chunks_exact(k) {
            for (s, g) in sum.iter_mut().zip(g) {
                *s += g;
            }
        }
        for a in 0..k {
            let p = &start.law.parameters[a];
            let value: f64 = (0..k).map(|b| score.inverse[(a, b)] * sum[b]).sum();
            let bound = 8.0 * p.typical.abs();
            start.values[a] = value.clamp((-bound).max(p.low), bound.min(p.high));
        }
    }
    start
}

/// Starts of a law that are worth a refit, best first: its best shapes of the grid.
pub fn starts(grid: &[Candidate], scores: &[Scored], law: &Law, most: usize) -> Vec<(f64, Active)> {
    let mut list: Vec<(f64, Active)> = scores
        .iter()
        .filter(|s| grid[s.candidate].start.law == law)
        .filter_map(|s| s.score.as_ref().map(|score| (s, score)))
        .filter(|(_, score)| !wrong_way(law, score))
        .map(|(s, score)| (score.gain(), sized(&grid[s.candidate], s)))
        .collect();
    list.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Two shape parameters make valleys that one start does not cross.
    list.truncate(if law.parameters.len() - law.linear > 1 { most + 2 } else { most });
    list
}

/// The space at a fit with its laws as nuisance.
pub fn space_at<'a>(task: &'a Task<'a>, fit: &Fit, tangents: &'a Tangents) -> Space<'a> {
    Space::new(task, fit, tangents, task.law_columns_of(fit))
}

/// −2LL with a price on shape parameters, by which laws are compared.
pub fn priced(fit: &Fit) -> f64 {
    fit.minus_2ll + fit.laws.iter().map(|a| (a.law.parameters.len() - a.law.linear) as f64).sum::<f64>()
}

/// Laws that modulate the same axis of a protocol: a second one there is more likely the first one's form error.
fn same_axis(a: &Law, b: &Law) -> bool {
    a.axes.iter().any(|axis| b.axes.contains(axis))
}

/// Runs the selection.
pub fn select(task: &Task<'_>, set: &RunSet, plain: &Plain<'_>, settings: &Settings) -> Selection {
    let runs = task.layout.runs();
    let obstacles: Vec<Option<String>> = settings.laws.iter().map(|law| obstacle(law, set)).collect();
    let testable: Vec<&Law> =
        settings.laws.iter().zip(&obstacles).filter(|(_, o)| o.is_none()).map(|(law, _)| *law).collect();

    let start =
        Start { theta: task.prior.mean.clone(), laws: Vec::new(), variances: task.variances, modes: Vec::new() };
    let null = task.fit(start, None, true, ROUNDS);
    let null_tangents = task.tangents_of(&null);
    let mut grid = candidates(task, &null, &testable);
    let form = plain.scores(&grid, task, &null, &null_tangents);
    let mut fit = null.clone();
    let mut tangents = null_tangents.clone();
    let mut evidence: Vec<Evidence> = Vec::new();
    let mut tests: Vec<Test> = Vec::new();

    let mut searched = Cells { calibration: 1.0, runs: grid.len().max(1) as f64 };
    for round in 0..MOST {
        let space = space_at(task, &fit, &tangents);
        let scores = scored(&space, &grid);
        let all: Vec<_> = scores.iter().filter_map(|s| s.score.clone()).collect();
        let flips = Flips::of(&all, runs, settings.seed + round as u64);
        let cells = Cells::of(&all);
        let mut ranking: Vec<Ranked> = Vec::new();
        for (i, law) in settings.laws.iter().copied().enumerate() {
            let best = scores
                .iter()
                .filter(|s| grid[s.candidate].start.law == law)
                .filter_map(|s| s.score.as_ref().map(|score| (score, form[s.candidate].as_ref())))
                .filter(|(s, _)| !wrong_way(law, s))
                .map(|(s, form)| {
                    let excess = s.excess(form);
                    (excess, surprise(excess, s.columns()), s)
                })
                .fold(None, |a: Option<(f64, f64, &super::chance::Score)>, b| match a {
                    Some(a) if a.1 >= b.1 => Some(a),
                    _ => Some(b),
                })
                .map_or((0.0, 0.0, RunsP { p: 1.0, by_calibration: false }), |(gain, surprise, score)| {
                    // Where the evidence lies in the calibration, flips of the measured runs cannot speak for or
                    // against it.
                    let by_calibration = score.prior_share() > BY_CALIBRATION;
                    (gain, surprise, RunsP { p: flips.p(score), by_calibration })
                });
            if round == 0 {
                let p_runs = best.2;
                let p_model = cells.p(best.0, law.linear, p_runs.by_calibration);
                tests.push(Test {
                    law,
                    gain_2ll: best.0,
                    p_model,
                    p_runs,
                    significant: significant(settings, law, best.0, runs, p_model, p_runs),
                    obstacle: obstacles[i].clone(),
                });
            }
            if best.1 > 0.0 && fit.laws.iter().all(|a| a.law != law) {
                ranking.push(Ranked { law, excess: best.0, surprise: best.1, p_runs: best.2 });
            }
        }
        ranking.sort_by(|a, b| b.surprise.total_cmp(&a.surprise));
        let Some(top) = ranking.first().map(|r| r.surprise) else { break };
        // A baseline that had to leave the calibration hides what pulled it away; then the laws of depth are tried
        // from the calibrated point.
        let strained = round == 0 && task.pull(&fit.theta) > 16.0;
        if top < 4.0 && !strained {
            break;
        }
        let mut found: Vec<(Fit, RunsP, f64)> = Vec::new();
        for (place, ranked) in ranking.iter().enumerate() {
            let &Ranked { law, excess, surprise, p_runs } = ranked;
            let of_depth = strained && law.drivers.contains(&Column::Depth);
            // One wild run may put a law on top that has nothing to it once it is refitted.
            let near = surprise > 0.35 * top || (surprise > 4.0 && p_runs.p <= settings.alpha);
            if !(of_depth || (place < 6 && near && top >= 4.0)) {
                continue;
            }
            let mut best: Option<Fit> = None;
            let list = starts(&grid, &scores, law, 2);
            let scanned = list.first().map_or(0.0, |s| s.0);
            for (gain, start) in list {
                if gain < 3.0 {
                    continue;
                }
                let refined = refine(task, &fit, &tangents, &start, 7);
                if best.as_ref().is_none_or(|b| refined.minus_2ll < b.minus_2ll) {
                    best = Some(refined);
                }
            }
            if of_depth {
                let mut from = fit.clone();
                from.theta.clone_from(&task.prior.mean);
                for sign in [1.0, -1.0] {
                    let mut start = super::scan::start_of(law, law.shapes[0]);
                    start.values[0] = sign * law.parameters[0].typical;
                    let refined = refine(task, &from, &tangents, &start, 9);
                    if best.as_ref().is_none_or(|b| refined.minus_2ll < b.minus_2ll) {
                        best = Some(refined);
                    }
                }
            }
            if let Some(best) = best {
                if round == 0
                    && let Some(test) = tests.iter_mut().find(|t| t.law == law)
                {
                    test.gain_2ll = (null.minus_2ll - best.minus_2ll).max(0.0);
                }
                // What the baseline's form explains of the scan's gain it explains of the refit's.
                let share = if of_depth { 1.0 } else { (excess / scanned.max(1e-9)).min(1.0) };
                found.push((best, p_runs, share));
            }
        }
        // The best of those that pass; a law that fits better by a few wild runs does not stand in the way.
        let mut passed: Vec<(Fit, Evidence)> = Vec::new();
        for (refit, p_runs, share) in found {
            let new = &refit.laws[refit.laws.len() - 1];
            let parameters = new.law.parameters.len();
            let stands = |gain: f64| {
                let p_model = cells.p(gain, parameters, p_runs.by_calibration);
                (significant(settings, new.law, gain, runs, p_model, p_runs), p_model)
            };
            let mut gain = share * (fit.minus_2ll - refit.minus_2ll);
            if stands(gain).0 {
                // A refit may have found a better optimum of the baseline, which is no evidence for its law.
                let mut laws = refit.laws.clone();
                laws.pop();
                let nested = task.fit(Start { laws, ..Start::from(&refit) }, Some(&tangents), false, 9);
                gain = share * (nested.minus_2ll.min(fit.minus_2ll) - refit.minus_2ll);
            }
            let (stands, p_model) = stands(gain);
            let least = fit.laws.iter().zip(&evidence).filter(|(a, _)| same_axis(a.law, new.law));
            let least = least.map(|(_, e)| 0.10 * e.gain_2ll).fold(0.0, f64::max);
            if gain >= least && stands {
                if round == 0
                    && let Some(test) = tests.iter_mut().find(|t| t.law == new.law)
                {
                    // The refit knows more than the scan.
                    (test.gain_2ll, test.p_model, test.significant) = (gain, p_model, true);
                }
                passed.push((refit, Evidence { gain_2ll: gain, p_model, p_runs }));
            }
        }
        passed.sort_by(|a, b| priced(&a.0).total_cmp(&priced(&b.0)));
        let Some((start, proof)) = passed.into_iter().next() else { break };
        fit = task.fit(Start::from(&start), None, true, ROUNDS);
        tangents = task.tangents_of(&fit);
        evidence.push(proof);
        eliminate(task, &mut fit, &mut tangents, &mut evidence, runs);
        grid = candidates(task, &fit, &testable);
        debug_assert_eq!(grid.len(), form.len());
        searched = cells;
    }
    Selection { null, fit, null_tangents, tangents, evidence, tests, grid, cells: searched }
}

/// Renews the evidence of each law by leaving it out, and drops those that are no longer needed.
fn eliminate(task: &Task<'_>, fit: &mut Fit, tangents: &mut Tangents, evidence: &mut Vec<Evidence>, runs: usize) {
    if fit.laws.len() < 2 {
        return;
    }
    let mut i = 0;
    while i < fit.laws.len() {
        let mut laws = fit.laws.clone();
        laws.remove(i);
        let without = task.fit(Start { laws, ..Start::from(&*fit) }, Some(tangents), false, 9);
        let gain = without.minus_2ll - fit.minus_2ll;
        evidence[i].gain_2ll = gain.max(0.0);
        let parameters = fit.laws[i].law.parameters.len();
        if gain < (runs as f64).ln() * parameters as f64 && fit.laws.len() > 1 {
            evidence.remove(i);
            *fit = without;
            *tangents = task.tangents_of(fit);
        } else {
            i += 1;
        }
    }
}
