//! The diagnosis as a whole, each value made once: [`Checked`], [`Calibrated`] (both files cleaned), [`Selected`], [`Concluded`], and the
//! report.
//!
//! Main function: [`diagnose`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::lag::Lag;
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::report::calibrated_range::CalibratedRange;
use crate::report::driver_plot::DriverPlot;
use crate::report::effects_found::{calibrated_laws, effects};
use crate::report::evidence::Evidence;
use crate::report::exchanged;
use crate::report::next_step::next_step;
use crate::report::regions::Maps;
use crate::report::sections;
use crate::report::witness::witness;
use crate::schema::{Caution, Confidence, Diagnosis, NextExperiment, Witness};
use crate::selection::lack_of_fit::force_n;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::checked::Checked;
use crate::verdict::concluded::Concluded;
use crate::verdict::instrument;
use crate::verdict::options::Options;
use crate::verdict::selected::Selected;

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
    let checked = Checked::new(calibration_set, measured, &options.own)?;
    stage("calibrating");
    let mut cautions = checked.cautions.clone();
    cautions.extend(exchanged::look(&checked, reference, options)?);
    let mut calibrated = Calibrated::new(&checked, reference, options)?;
    cautions.append(&mut calibrated.cautions);
    stage("comparing laws");
    calibrated.basis(reference, &options.settings).select(&calibrated.measured, |selected| {
        let next_experiment = sections::next_experiment(selected.decision, &options.plan, &options.own);
        stage("predicting held-out runs");
        let held_out = open_holdout()?;
        if let Some(held) = &held_out {
            cautions.extend(checked.held_out(held, &options.own)?);
        }
        let concluded = Concluded::new(held_out, &calibrated, selected, reference, &mut cautions)?;
        stage("writing the report");
        let maps = Maps::of(selected, concluded.verdict, &options.own);
        let (report, drivers) =
            report(&calibrated, selected, &concluded, reference, options, (cautions, next_experiment), &maps);
        let evidence = Evidence::new(&calibrated, selected, concluded, &options.own, (drivers, maps));
        Ok((report, evidence))
    })
}

/// The report, and a plot for each effect.
fn report(
    calibrated: &Calibrated,
    selected: &Selected<'_, '_>,
    concluded: &Concluded,
    reference: &ReferenceCurves,
    options: &Options,
    (mut cautions, next_experiment): (Vec<Caution>, Option<NextExperiment>),
    maps: &Maps,
) -> (Diagnosis, Vec<DriverPlot>) {
    let Selected { decision, before, lagging, .. } = *selected;
    let Concluded { verdict, calibration, holdout, .. } = concluded;
    let Calibrated { calibration_set, lag, .. } = calibrated;
    let (mut effects, drivers) = if verdict.is_claim() { effects(decision) } else { (Vec::new(), Vec::new()) };
    if let Some(lag) = selected.lag().filter(|_| verdict.is_claim()) {
        effects.push(lag);
        effects.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
    }
    effects.iter_mut().for_each(|e| e.own = options.own.formula_of(&e.law));
    let mut disagreement = sections::disagreement(before, maps);
    let mut unexplained = sections::unexplained(decision, *verdict);
    if concluded.taken_back {
        let force_n = ["normal", "friction"].map(|channel| force_n(&decision.task, channel));
        unexplained.locate(holdout, selected.lag().as_ref(), force_n);
    }
    unexplained.place(&maps.after);
    let range = CalibratedRange::of(calibration_set);
    range.mark(decision.set, options.settings.laws, &mut disagreement.regions, &mut effects, &mut unexplained);
    cautions.extend(range.cautions(decision.set));
    cautions.extend(sections::scatter_caution(decision));
    cautions.extend(sections::too_small_cautions(decision));
    let noise = sections::noise(calibration);
    cautions.extend(sections::implausible_cautions(&noise, &effects, holdout));
    let of_calibration = lag.map(|found| instrument::found("calibration", &found, Lag::default()));
    let of_measured = lagging.map(|differing| instrument::found("measured", &differing.lag, calibrated.lag()));
    let mut report = Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        title: String::new(),
        verdict: *verdict,
        confidence: Confidence::default(),
        witness: Witness::default(),
        cautions,
        effects,
        disagreement,
        baseline: sections::baseline(decision, calibration, &options.model),
        noise,
        instrument: of_calibration.into_iter().chain(of_measured).collect(),
        finger_laws: calibrated_laws(calibration, reference.ln_area_sd),
        tests: sections::tests(decision),
        unexplained,
        holdout: holdout.clone(),
        power: None,
        stability: None,
        fe_confirmation: None,
        next_step: String::new(),
        next_experiment,
        corrected_model: None,
        corrected_rms_n: None,
        corrected_tables: Vec::new(),
        input: Vec::new(),
        seed: options.settings.seed,
        version: env!("CARGO_PKG_VERSION").into(),
        elapsed_s: 0.0,
    };
    let claims = if verdict.is_claim() { decision.selection.accepted() } else { &[] };
    (report.witness, report.confidence) =
        witness([calibration_set, decision.set], claims, &report, options.settings.laws);
    report.next_step = next_step(&report);
    (report, drivers)
}
