//! Calibration of the finger and the joint fit, from settings to outcome.

use super::{
    Compared, Evaluator, FeModel, FingerPoint, IdentifyError, LawPoint, Table, VariedParameter,
    bounded_least_squares::{Model, Solution},
    comparison::compare,
    confidence::linear,
    finger_fit::{Errors, FingerFit, FitPoint},
    outcome::{FingerOutcome, FittedParameter},
};

/// The fit of a stage: `published` fits nothing, `calibration` compares the given parameters, others the slide.
pub fn finger_fit<'a, 'r>(
    stage: &'static str,
    evaluator: &'a Evaluator<'a>,
    fe_model: &'a mut FeModel<'r>,
    table: &'a Table,
    finger: &FingerPoint,
    law: &LawPoint,
    joint: Option<Errors>,
) -> FingerFit<'a, 'r> {
    let settings = evaluator.settings;
    let calibration = &settings.calibration;
    let errors = joint.unwrap_or(Errors {
        normal_force: 0.01 * calibration.normal_force_percent,
        contact_area: 0.01 * calibration.contact_area_percent,
        friction: None,
        depth_mm: None,
    });
    let vary: &[VariedParameter] = if stage == "published" { &[] } else { &calibration.vary };
    let compared = if stage == "calibration" { calibration.compared } else { Compared::Slide };
    FingerFit::new(
        stage,
        evaluator,
        fe_model,
        table,
        vary,
        compared,
        errors,
        finger.clone(),
        *law,
        calibration.max_evaluations,
    )
}

/// Calibrates the finger under a law that is held.
///
/// # Errors
/// [`IdentifyError`] of the fit.
pub fn calibrate(
    evaluator: &Evaluator,
    fe_model: &mut FeModel,
    table: &Table,
    start: &FingerPoint,
    law: &LawPoint,
) -> Result<FingerOutcome, IdentifyError> {
    let mut fit = finger_fit("calibration", evaluator, fe_model, table, start, law, None);
    finger_outcome(&mut fit, evaluator, table)
}

/// Fits finger, law and the error of every depth at once.
///
/// # Errors
/// [`IdentifyError`] of the fit.
pub fn joint(
    evaluator: &Evaluator,
    fe_model: &mut FeModel,
    table: &Table,
    start: &FingerPoint,
    law: &LawPoint,
) -> Result<FingerOutcome, IdentifyError> {
    let settings = evaluator.settings;
    let percent = settings.friction_coefficient_percent.unwrap_or(settings.joint.friction_coefficient_percent);
    let errors = Errors {
        normal_force: 0.01 * settings.calibration.normal_force_percent,
        contact_area: 0.01 * settings.calibration.contact_area_percent,
        friction: Some(0.01 * percent),
        depth_mm: Some(settings.joint.depth_mm),
    };
    let mut fit = finger_fit("joint fit", evaluator, fe_model, table, start, law, Some(errors));
    fit.evaluations = settings.joint.max_evaluations;
    finger_outcome(&mut fit, evaluator, table)
}

fn finger_outcome(fit: &mut FingerFit, evaluator: &Evaluator, table: &Table) -> Result<FingerOutcome, IdentifyError> {
    let before = fit.start_values();
    let rms = |residuals: &[f64]| (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
    let rms_before = rms(&fit.residuals(&before)?);
    let (point, solution): (FitPoint, Solution) = fit.run()?;
    // The stated errors are the weights; their size is taken from the misfit if that is larger.
    let freedom = solution.residuals.len().saturating_sub(solution.values.len());
    let sum: f64 = solution.residuals.iter().map(|r| r * r).sum();
    let variance = if freedom > 0 { (sum / freedom as f64).max(1.0) } else { 1.0 };
    let errors = linear(&solution.jacobian, variance);
    let (names, bounds) = fit.names_and_bounds();
    let fitted = names
        .into_iter()
        .zip(bounds)
        .enumerate()
        .map(|(k, ((name, unit), bounds))| {
            let value = solution.values[k];
            let margin = 0.002 * (bounds[1] - bounds[0]);
            FittedParameter {
                name,
                unit,
                start: before[k],
                value,
                standard_error: Some(errors.standard_errors[k]).filter(|e| e.is_finite()),
                bounds,
                at_bound: value - bounds[0] < margin || bounds[1] - value < margin,
            }
        })
        .collect();
    let states = fit.slides(&point)?;
    Ok(FingerOutcome {
        fitted,
        correlation: errors.correlation,
        comparison: compare(table, &point.law, &evaluator.config.friction, &states),
        depth_shifts_mm: point.shifts_mm.clone(),
        finger: point.finger,
        law: point.law,
        rms: rms(&solution.residuals),
        rms_before,
        evaluations: solution.evaluations,
        ended: solution.ended,
    })
}
