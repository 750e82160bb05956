//! The diagnosis as a whole: calibrate, select laws, decide, predict held-out runs, report.
//!
//! Main function: [`diagnose`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::checks::{check, check_distinct, check_pair};
use crate::data::covariates::CovariateError;
use crate::data::lag::{Lag, with_lag};
use crate::data::own_columns::{at_reference, require, with_ranges_of};
use crate::data::runs::RunSet;
use crate::data::suspicions::suspicions;
use crate::error::DiagnoseError;
use crate::laws::LawsFile;
use crate::schema::{Caution, Diagnosis, Verdict};
use crate::selection::acceptance::SelectionSettings;
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::Fit;
use crate::verdict::calibrated_range::CalibratedRange;
use crate::verdict::candidate_designs::PlanConstraints;
use crate::verdict::cross_validation::{by_folds, noise_floor_n, on_file};
use crate::verdict::decision::{Decision, decide, learn_corrections};
use crate::verdict::effects_found::{calibrated_laws, effects};
use crate::verdict::evidence::Evidence;
use crate::verdict::exchanged;
use crate::verdict::instrument::{self, Chosen};
use crate::verdict::preparation::{Prepared, clean, lag_of, prepare};
use crate::verdict::regions::residual_map;
use crate::verdict::report_sections as sections;
use crate::verdict::traces::worst_traces;

/// Choices of a diagnosis beside the data.
#[derive(Clone, Debug)]
pub struct Options {
    /// Level and seed of the tests.
    pub settings: SelectionSettings,
    /// Declared errors of state columns.
    pub errors: Vec<CovariateError>,
    /// Name of the model file that the baseline starts from.
    pub model: String,
    /// What the next experiment may do.
    pub plan: PlanConstraints,
    /// Laws of the user's own; `settings.laws` has them as well.
    pub own: LawsFile,
}

/// Diagnoses a measured set. `open_holdout` is called once, after the laws are chosen; `stage` names what begins.
///
/// # Errors
/// [`DiagnoseError`] for sets that cannot carry a diagnosis, and what `open_holdout` returns.
pub fn diagnose<E: From<DiagnoseError>>(
    calibration_set: &RunSet,
    measured: &RunSet,
    reference: &ReferenceCurves,
    options: &Options,
    open_holdout: impl FnOnce() -> Result<Option<RunSet>, E>,
    stage: &mut dyn FnMut(&str),
) -> Result<(Diagnosis, Evidence), E> {
    check(calibration_set)?;
    check(measured)?;
    check_pair(calibration_set, measured)?;
    check_distinct(measured, calibration_set, IN_CALIBRATION)?;
    require(measured, &options.own)?;
    let mut cautions = told_of_file(calibration_set, "calibration")?;
    cautions.extend(told_of_file(measured, "measured")?);
    let calibration_set = &at_reference(calibration_set, &options.own);
    stage("calibrating");
    cautions.extend(exchanged::look(
        calibration_set,
        measured,
        reference,
        &options.settings,
        &options.errors,
        &options.own,
    )?);
    let prepared = prepare(calibration_set, measured, reference, &options.settings)?;
    cautions.extend(prepared.cautions);
    let Prepared { calibration_set, measured, calibration, lag, .. } = prepared;
    let calibration = finite(calibration, &calibration_set)?;
    let corrections = learn_corrections(&measured, &options.errors);
    let mut corrected = measured.clone();
    corrections.iter().for_each(|c| c.apply(&mut corrected));
    stage("comparing laws");
    let decided = |set| decide(set, &calibration_set, reference, &calibration, &corrections, &options.settings);
    let plain = decided(&corrected);
    let differing = instrument::differing(&corrected, reference, &calibration, &plain.selection.null);
    let with_own_lag = differing.as_ref().map(|differing| (differing, decided(&differing.set)));
    let Chosen { decision, lagging, lag_effect, verdict } =
        instrument::chosen(&plain, with_own_lag.as_ref(), &calibration_set);
    let set = lagging.map_or(&corrected, |differing| &differing.set);
    // What stands before any effect, the lag among them.
    let (before, set_before) = if lag_effect.is_some() { (&plain, &corrected) } else { (decision, set) };
    let calibration = calibration.clone().drifting(decision.drift);
    let null = &decision.selection.null;
    let full = if is_claimed(verdict) { &decision.selection.fit } else { null };
    let next_experiment = sections::next_experiment(decision, set, &options.plan, &options.own);

    stage("predicting held-out runs");
    let mut held_out = open_holdout()?;
    let expected = &decision.expected_variances;
    let holdout = match &mut held_out {
        Some(held) => {
            check_pair(&calibration_set, held)?;
            for fitted in [&measured, &calibration_set] {
                check_distinct(held, fitted, IN_FIT)?;
            }
            cautions.extend(told_of_file(held, "holdout")?);
            require(held, &options.own)?;
            *held = clean(&with_lag(held, lag_of(&lag)), "holdout", &calibration, reference, &mut cautions)?;
            corrections.iter().for_each(|c| c.apply(held));
            let null_before = &before.selection.null;
            let without =
                lag_effect.map(|_| on_file(held, reference, &calibration, expected, null_before, null_before));
            if let Some(differing) = lagging {
                *held = with_lag(held, differing.lag.lag);
            }
            on_file(held, reference, &calibration, expected, null, full).instead_of(without)
        }
        None => {
            let null_before = &before.selection.null;
            let without =
                lag_effect.map(|_| by_folds(set_before, reference, &calibration, expected, null_before, null_before));
            by_folds(set, reference, &calibration, expected, null, full).instead_of(without)
        }
    }
    .or_refused();
    let claimed = verdict;
    let verdict = bounded_by_gap(claimed, holdout.ratio_after);
    let taken_back = verdict != claimed;
    let holdout = if taken_back { holdout.without_correction() } else { holdout };
    let full = if is_claimed(verdict) { full } else { null };

    stage("writing the report");
    let (mut effects, drivers) = if is_claimed(verdict) { effects(decision, set) } else { (Vec::new(), Vec::new()) };
    if let Some(differing) = lag_effect.filter(|_| is_claimed(verdict)) {
        effects.push(instrument::effect(differing, (set_before, before), (set, decision)));
        effects.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
    }
    effects.iter_mut().for_each(|e| e.own = options.own.formula_of(&e.law));
    let mut disagreement = sections::disagreement(before, set_before, &options.own);
    let range = CalibratedRange::of(&calibration_set);
    let mut unexplained = sections::unexplained(decision, verdict);
    if taken_back {
        let lag = lag_effect.map(|differing| instrument::effect(differing, (set_before, before), (set, decision)));
        unexplained.locate(&holdout, lag.as_ref());
    }
    range.mark(set, options.settings.laws, &mut disagreement.regions, &mut effects, &mut unexplained);
    cautions.extend(range.cautions(set));
    cautions.extend(sections::scatter_caution(decision));
    cautions.extend(sections::too_small_cautions(decision));
    let of_calibration = lag.map(|found| instrument::found("calibration", &found, Lag::default(), &calibration_set));
    let of_measured = lagging.map(|differing| instrument::found("measured", &differing.lag, lag_of(&lag), set));
    let report = Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        verdict,
        cautions,
        effects,
        disagreement,
        baseline: sections::baseline(decision, &calibration, &options.model),
        noise: sections::noise(&calibration),
        instrument: of_calibration.into_iter().chain(of_measured).collect(),
        finger_laws: calibrated_laws(&calibration, reference.ln_area_sd),
        tests: sections::tests(decision),
        unexplained,
        holdout,
        power: None,
        stability: None,
        fe_confirmation: None,
        next_experiment,
        corrected_model: None,
        corrected_rms_n: None,
        corrected_tables: Vec::new(),
        input: Vec::new(),
        seed: options.settings.seed,
        version: env!("CARGO_PKG_VERSION").into(),
        elapsed_s: 0.0,
    };
    let map_of = |decision: &Decision<'_>, set: &RunSet, fit: &Fit| {
        residual_map(set, &options.own, &decision.task.residual_without_random_effects_n(fit))
    };
    let floor_n = noise_floor_n(&decision.task, &null.parameters, &null.laws, expected);
    let mut sets = vec![&calibration_set, set];
    sets.extend(held_out.as_ref());
    let own = with_ranges_of(&options.own, &sets);
    let evidence = Evidence {
        own,
        traces: worst_traces(&decision.task, set, &calibration.fit, [null, full], &floor_n, 3),
        map_before: map_of(before, set_before, &before.selection.null),
        map_after: map_of(decision, set, full),
        drivers,
        parameters: full.parameters,
        laws: full.laws.clone(),
        parameters_before: null.parameters,
        laws_before: null.laws.clone(),
        expected_variances: *expected,
        decided_set: corrected.clone(),
        checked: if held_out.is_some() { "holdout" } else { "measured" }.into(),
        checked_set: held_out.unwrap_or_else(|| set.clone()),
        calibration_set,
        calibration,
        corrections,
    };
    Ok((report, evidence))
}

/// Residual on runs that no fit saw, in noise floors, up to which the laws that were found count as the explanation.
const LARGEST_GAP: f64 = 2.0;

/// The verdict where the laws leave a gap on held-out runs: names that leave most of it are no explanation.
fn bounded_by_gap(verdict: Verdict, ratio_after: f64) -> Verdict {
    if verdict == Verdict::Named && ratio_after > LARGEST_GAP { Verdict::UnexplainedStructure } else { verdict }
}

/// What the runs of one file are that stand in another too.
pub const IN_CALIBRATION: &str = "are calibration runs too, and a run is used once";
const IN_FIT: &str = "were part of the fit, so that they are not held out";

/// What the reader did to a file, and what its readings call into doubt.
///
/// # Errors
/// [`DiagnoseError`] for a file that contradicts itself.
pub fn told_of_file(set: &RunSet, role: &str) -> Result<Vec<Caution>, DiagnoseError> {
    let told = set.cautions.iter().cloned().chain(suspicions(set)?);
    Ok(told.map(|caution| Caution { role: role.into(), ..caution }).collect())
}

/// Whether effects are claimed.
fn is_claimed(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Named | Verdict::Ambiguous)
}

fn finite(calibration: Calibration, set: &RunSet) -> Result<Calibration, DiagnoseError> {
    if calibration.fit.minus_2ll.is_finite() {
        return Ok(calibration);
    }
    Err(DiagnoseError::Calibration { path: set.path.clone(), problem: "the likelihood is not finite".into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_stand_beside_an_open_gap() {
        assert_eq!(bounded_by_gap(Verdict::Named, 1.9), Verdict::Named);
        assert_eq!(bounded_by_gap(Verdict::Named, 2.1), Verdict::UnexplainedStructure);
        for other in [Verdict::None, Verdict::Ambiguous, Verdict::UnexplainedStructure] {
            assert_eq!(bounded_by_gap(other, 9.0), other);
        }
    }
}
