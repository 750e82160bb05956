//! The diagnosis as a whole: calibrate, select laws, decide, predict held-out runs, report.
//!
//! Main function: [`diagnose`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::checks::{check, check_distinct, check_pair};
use crate::data::covariates::CovariateError;
use crate::data::lag::with_lag;
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
use crate::verdict::effects_found::effects;
use crate::verdict::evidence::Evidence;
use crate::verdict::exchanged;
use crate::verdict::preparation::{Prepared, clean, of, prepare};
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

/// Diagnoses a measured set. `open_holdout` is called once, after the verdict stands; `stage` names what begins.
///
/// Errors: [`DiagnoseError`] for sets that cannot carry a diagnosis, and what `open_holdout` returns.
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
    let prepared = prepare(calibration_set, measured, reference)?;
    cautions.extend(prepared.cautions);
    let Prepared { calibration_set, measured, calibration, lag, .. } = prepared;
    eprintln!("LAG {lag:?}");
    let calibration = finite(calibration, &calibration_set)?;
    let corrections = learn_corrections(&measured, &options.errors);
    let mut corrected = measured.clone();
    corrections.iter().for_each(|c| c.apply(&mut corrected));
    stage("comparing laws");
    let decision = decide(&corrected, &calibration_set, reference, &calibration, &corrections, &options.settings);
    let calibration = calibration.drifting(decision.drift);
    let null = &decision.selection.null;
    let full = if is_claimed(&decision) { &decision.selection.fit } else { null };
    let next_experiment = sections::next_experiment(&decision, &corrected, &options.plan, &options.own);

    stage("predicting held-out runs");
    let mut held_out = open_holdout()?;
    let expected = &decision.expected_variances;
    let holdout = match &mut held_out {
        Some(set) => {
            check_pair(&calibration_set, set)?;
            for fitted in [&measured, &calibration_set] {
                check_distinct(set, fitted, IN_FIT)?;
            }
            cautions.extend(told_of_file(set, "holdout")?);
            require(set, &options.own)?;
            *set = clean(&with_lag(set, of(&lag)), "holdout", &calibration, reference, &mut cautions)?;
            corrections.iter().for_each(|c| c.apply(set));
            on_file(set, reference, &calibration, expected, null, full)
        }
        None => by_folds(&corrected, reference, &calibration, expected, null, full),
    }
    .or_refused();

    stage("writing the report");
    let (mut effects, drivers) =
        if is_claimed(&decision) { effects(&decision, &corrected) } else { (Vec::new(), Vec::new()) };
    effects.iter_mut().for_each(|e| e.own = options.own.formula_of(&e.law));
    let mut disagreement = sections::disagreement(&decision, &corrected, &options.own);
    let range = CalibratedRange::of(&calibration_set);
    let mut unexplained = sections::unexplained(&decision);
    range.mark(&corrected, options.settings.laws, &mut disagreement.regions, &mut effects, &mut unexplained);
    cautions.extend(range.cautions(&corrected));
    cautions.extend(sections::scatter_caution(&decision));
    cautions.extend(sections::too_small_cautions(&decision));
    let report = Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        verdict: decision.verdict,
        cautions,
        effects,
        disagreement,
        baseline: sections::baseline(&decision, &calibration, &options.model),
        noise: sections::noise(&calibration),
        tests: sections::tests(&decision),
        unexplained,
        holdout,
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
    let map_of =
        |fit: &Fit| residual_map(&corrected, &options.own, &decision.task.residual_without_random_effects_n(fit));
    let floor_n = noise_floor_n(&decision.task, &null.parameters, &[], expected);
    let mut sets = vec![&calibration_set, &corrected];
    sets.extend(held_out.as_ref());
    let own = with_ranges_of(&options.own, &sets);
    let evidence = Evidence {
        own,
        traces: worst_traces(&decision.task, &corrected, &calibration.fit.parameters, [null, full], &floor_n, 3),
        map_before: map_of(null),
        map_after: map_of(full),
        drivers,
        parameters: full.parameters,
        parameters_without_laws: null.parameters,
        parameters_calibrated: calibration.fit.parameters,
        laws: full.laws.clone(),
        expected_variances: *expected,
        checked: if held_out.is_some() { "holdout" } else { "measured" }.into(),
        checked_set: held_out.unwrap_or_else(|| corrected.clone()),
        calibration_set,
        calibration,
        corrections,
    };
    Ok((report, evidence))
}

/// What the runs of one file are that stand in another too.
pub const IN_CALIBRATION: &str = "are calibration runs too, and a run is used once";
const IN_FIT: &str = "were part of the fit, so that they are not held out";

/// What the reader did to a file, and what its readings call into doubt.
///
/// Errors: [`DiagnoseError`] for a file that contradicts itself.
pub fn told_of_file(set: &RunSet, role: &str) -> Result<Vec<Caution>, DiagnoseError> {
    let told = set.cautions.iter().cloned().chain(suspicions(set)?);
    Ok(told.map(|caution| Caution { role: role.into(), ..caution }).collect())
}

/// Whether effects are claimed.
fn is_claimed(decision: &Decision<'_>) -> bool {
    matches!(decision.verdict, Verdict::Named | Verdict::Ambiguous)
}

fn finite(calibration: Calibration, set: &RunSet) -> Result<Calibration, DiagnoseError> {
    if calibration.fit.minus_2ll.is_finite() {
        return Ok(calibration);
    }
    Err(DiagnoseError::Calibration { path: set.path.clone(), problem: "the likelihood is not finite".into() })
}
