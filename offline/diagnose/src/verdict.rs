//! From the selection to a verdict: rivals, unexplained structure, and what may be claimed.

use super::base::Reference;
use super::calibrate::{Calibration, sigma_of};
use super::covariates::{Correction, CovariateError};
use super::fit::{Start, Task};
use super::form::Plain;
use super::laws::{Change, Law, Place};
use super::mixed::PerRun;
use super::omnibus::{Unexplained, look};
use super::prior::Drift;
use super::rivals::{Contest, contest};
use super::runs::RunSet;
use super::scan::obstacle;
use super::select::{Evidence, Selection, Settings, against_calibration, loosest, select};
use super::walk::Active;
use super::wider::Wider;

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is missing that the data could show.
    None,
    /// Each missing effect has one family.
    Named,
    /// At least one effect has rivals that the protocol cannot separate.
    Ambiguous,
    /// Something is there that no law of the library covers.
    UnexplainedStructure,
}

/// Everything that a verdict rests on.
pub struct Judged<'a> {
    /// The fit's task, for further questions.
    pub task: Task<'a>,
    /// The selection.
    pub selection: Selection,
    /// One contest per accepted law.
    pub contests: Vec<Contest>,
    /// What is left.
    pub unexplained: Unexplained,
    /// The answer.
    pub verdict: Verdict,
    /// Variances between runs that calibration and reading errors explain.
    pub expected: PerRun,
    /// How much the shape of the curves has changed since the calibration.
    pub drift: Drift,
}

/// Families among the candidates of a contest.
pub fn families(contest: &Contest) -> Vec<&'static str> {
    let mut list: Vec<&'static str> = Vec::new();
    for c in &contest.candidates {
        if !list.contains(&c.active.law.family) {
            list.push(c.active.law.family);
        }
    }
    list
}

/// Corrects columns with declared errors; learned on the measured set.
pub fn corrections(set: &RunSet, errors: &[CovariateError]) -> Vec<Correction> {
    errors.iter().filter_map(|e| Correction::learn(set, *e)).collect()
}

/// The task of a measured set after a calibration.
pub fn task_of<'a>(set: &'a RunSet, reference: &'a Reference, calibration: &Calibration) -> Task<'a> {
    let prediction = super::walk::walk_all(
        &reference.with(&calibration.fit.theta),
        &[],
        &Vec::new(),
        super::walk::Nudge::default(),
        &set.runs,
    );
    let sigma = sigma_of(&calibration.noise, &prediction);
    let mut task = Task::new(&set.runs, reference, calibration.prior(), sigma, calibration.fit.variances);
    // The scatter between runs was seen in the calibration; it guides the measured set without binding it.
    task.variance_weight = 4.0;
    task
}

/// The calibration runs at their optimum.
fn plain_of<'a>(set: &'a RunSet, reference: &'a Reference, calibration: &Calibration) -> Plain<'a> {
    let mut task = task_of(set, reference, calibration);
    task.prior = Calibration::before(reference);
    let fit = calibration.fit.clone();
    let tangents = task.tangents_of(&fit);
    Plain { task, fit, tangents }
}

/// Judges a measured set (with corrected columns).
pub fn judge<'a>(
    set: &'a RunSet,
    effect_free: &RunSet,
    reference: &'a Reference,
    calibration: &Calibration,
    corrections: &[Correction],
    settings: &Settings,
) -> Judged<'a> {
    let mut task = task_of(set, reference, calibration);
    let plain = plain_of(effect_free, reference, calibration);
    let mut selection = select(&task, set, &plain, settings);
    let wider = Wider::new(set, reference, calibration, &task, &selection.null, &selection.null_tangents);
    // Without a law both are the same fit.
    let starts = [&selection.null, &selection.fit];
    let drifted = starts[..1 + usize::from(!selection.fit.laws.is_empty())]
        .iter()
        .map(|fit| wider.minus_2ll(Start::from(*fit), &selection.tangents))
        .fold(f64::INFINITY, f64::min);
    let drift = if drifted < selection.fit.minus_2ll { Drift::Allowed } else { Drift::Small };
    let wider = (drift == Drift::Small).then_some(wider);
    if drift == Drift::Allowed {
        task = task_of(set, reference, &calibration.drifting(drift));
        selection = select(&task, set, &plain, settings);
    }
    let testable: Vec<&Law> = settings.laws.iter().copied().filter(|law| obstacle(law, set).is_none()).collect();
    let mut contests: Vec<Contest> = Vec::new();
    for _ in 0..3 {
        contests = (0..selection.fit.laws.len())
            .map(|i| contest(&task, &selection.fit, &selection.tangents, i, &selection.grid, &testable, wider.as_ref()))
            .collect();
        let Some(i) = contests.iter().position(|c| c.better.is_some()) else { break };
        // Another law does better in this place, now that the others are there.
        let better = contests[i].better.take().expect("just found");
        let evidence = selection.evidence.remove(i);
        selection.evidence.push(Evidence { gain_2ll: evidence.gain_2ll, ..evidence });
        selection.fit = task.fit(Start::from(&better), None, true, super::select::ROUNDS);
        selection.tangents = task.tangents_of(&selection.fit);
    }
    while let Some(i) = weakest(&selection, &contests, settings) {
        // It came in by a swap, or beside a law that has gone.
        let mut laws = selection.fit.laws.clone();
        laws.remove(i);
        selection.evidence.remove(i);
        selection.fit = task.fit(Start { laws, ..Start::from(&selection.fit) }, None, true, super::select::ROUNDS);
        selection.tangents = task.tangents_of(&selection.fit);
        contests = (0..selection.fit.laws.len())
            .map(|i| contest(&task, &selection.fit, &selection.tangents, i, &selection.grid, &testable, wider.as_ref()))
            .collect();
    }
    for ((e, c), law) in selection.evidence.iter_mut().zip(&contests).zip(&selection.fit.laws) {
        e.gain_2ll = c.gain_2ll;
        e.p_model = selection.cells.p(c.gain_2ll, law.law.parameters.len(), e.p_runs.by_calibration);
    }
    let explained = selection.null.minus_2ll - selection.fit.minus_2ll;
    let mut expected = calibration.fit.variances;
    for k in 0..2 {
        expected[k] += reading_scatter(&task, &selection.fit.laws, corrections)[k];
    }
    let unexplained = look(
        &task,
        set,
        (&plain, effect_free),
        &selection.fit,
        &selection.tangents,
        (&expected, calibration.runs),
        &selection.null.variances,
        explained,
        settings.seed,
    );
    let verdict = if unexplained.significant {
        Verdict::UnexplainedStructure
    } else if selection.fit.laws.is_empty() {
        Verdict::None
    } else if contests.iter().any(|c| families(c).len() > 1) {
        Verdict::Ambiguous
    } else {
        Verdict::Named
    };
    Judged { task, selection, contests, unexplained, verdict, expected, drift }
}

/// The law with the least gain, where that would not have been accepted.
fn weakest(selection: &Selection, contests: &[Contest], settings: &Settings) -> Option<usize> {
    let p = |i: usize| {
        let parameters = selection.fit.laws[i].law.parameters.len();
        selection.cells.p(contests[i].gain_2ll, parameters, selection.evidence[i].p_runs.by_calibration)
    };
    let level = |i: usize| {
        if selection.evidence[i].p_runs.by_calibration { against_calibration(settings) } else { loosest(settings) }
    };
    (0..contests.len()).filter(|&i| p(i) > level(i)).max_by(|&a, &b| p(a).total_cmp(&p(b)))
}

/// Variance of stiffness and strength between runs that the errors of the state's columns cause through the laws.
fn reading_scatter(task: &Task<'_>, laws: &[Active], corrections: &[Correction]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for correction in corrections {
        for active in laws.iter().filter(|a| a.law.drivers.contains(&correction.column())) {
            for run in task.runs {
                let Some(row) = run.rows.last() else { continue };
                let at = |by: f64| {
                    let mut moved = *row;
                    match correction.column() {
                        super::laws::Column::Hydration => moved.hydration_au += by,
                        super::laws::Column::Temperature => moved.temperature_c += by,
                        super::laws::Column::Width => moved.width_mm += by,
                        super::laws::Column::Dwell => moved.dwell_s += by,
                        _ => {}
                    }
                    let mut change = Change::default();
                    active.law.apply(&active.values, &moved, &mut change);
                    change
                };
                let (low, high) = (at(-correction.left_sd), at(correction.left_sd));
                let k = usize::from(active.law.place == Place::Strength);
                let pair = if k == 0 { [low.stiffness, high.stiffness] } else { [low.strength, high.strength] };
                sum[k] += (0.5 * (pair[1] / pair[0]).ln()).powi(2) / task.runs.len() as f64;
            }
        }
    }
    sum
}
