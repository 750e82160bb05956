//! The diagnosis as a whole: calibrate, judge, predict what no fit saw, tell.

use super::base::{FREEDOM, FREEDOMS, Reference};
use super::calibrate::{Calibration, calibrate};
use super::check::{check, check_pair};
use super::covariates::CovariateError;
use super::design::{NextExperiment, Rivalry, propose};
use super::effects::effects;
use super::error::DiagnoseError;
use super::evidence::Evidence;
use super::heldout::{Squares, by_folds, floor_n, on_file, worst};
use super::regions::{map, strongest};
use super::runs::RunSet;
use super::schema::{
    Baseline, BaselineParameter, CandidateLaw, Diagnosis, Disagreement, LawTest, NoiseFound, Rescale, ScatterRatio,
    UnexplainedFound,
};
use super::select::Settings;
use super::verdict::{Judged, Verdict, corrections, judge};

/// What decides beside the data.
#[derive(Clone, Debug)]
pub struct Options {
    /// Levels and seed.
    pub settings: Settings,
    /// Declared errors of state columns.
    pub errors: Vec<CovariateError>,
    /// Name of the baseline's model file.
    pub model: String,
}

/// Diagnoses a measured set. `open_holdout` is called once, after the verdict stands; `stage` names what begins.
///
/// Errors: [`DiagnoseError`] for sets that cannot carry a diagnosis, and what `open_holdout` returns.
pub fn diagnose<E: From<DiagnoseError>>(
    calibration_set: &RunSet,
    measured: &RunSet,
    reference: &Reference,
    options: &Options,
    open_holdout: impl FnOnce() -> Result<Option<RunSet>, E>,
    stage: &mut dyn FnMut(&str),
) -> Result<(Diagnosis, Evidence), E> {
    check(calibration_set)?;
    check(measured)?;
    check_pair(calibration_set, measured)?;
    stage("calibrating");
    let calibration = calibrate(calibration_set, reference);
    if !calibration.fit.minus_2ll.is_finite() {
        return Err(DiagnoseError::Calibration {
            path: calibration_set.path.clone(),
            problem: "the likelihood is not finite".into(),
        }
        .into());
    }
    let fixes = corrections(measured, &options.errors);
    let mut corrected = measured.clone();
    fixes.iter().for_each(|f| f.apply(&mut corrected));
    stage("comparing laws");
    let judged = judge(&corrected, calibration_set, reference, &calibration, &fixes, &options.settings);
    let calibration = calibration.drifting(judged.drift);
    let claimed = matches!(judged.verdict, Verdict::Named | Verdict::Ambiguous);
    let null = &judged.selection.null;
    let full = if claimed { &judged.selection.fit } else { null };
    let next_experiment = next(&judged, &corrected);

    stage("predicting held-out runs");
    let mut held_out = open_holdout()?;
    let holdout = match &mut held_out {
        Some(set) => {
            check_pair(calibration_set, set)?;
            fixes.iter().for_each(|f| f.apply(set));
            on_file(set, reference, &calibration, &judged.expected, null, full)
        }
        None => by_folds(&corrected, reference, &calibration, &judged.expected, null, full),
    }
    .or_refused();

    stage("writing the report");
    let disagreement = disagreement(&judged, &corrected);
    let map_after = map(&corrected, &judged.task.plain_residual_n(full));
    let (effects, drivers) = if claimed { effects(&judged, &corrected) } else { (Vec::new(), Vec::new()) };
    let partial = if judged.verdict == Verdict::UnexplainedStructure { partial(&judged) } else { Vec::new() };
    let u = &judged.unexplained;
    let report = Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        verdict: judged.verdict,
        effects,
        disagreement,
        baseline: baseline(&judged, &calibration, options),
        noise: noise(&calibration),
        tests: tests(&judged),
        unexplained: UnexplainedFound {
            significant: u.significant,
            column: u.column.clone(),
            channel: u.channel.clone(),
            gain: u.gain,
            p_model: u.p_model.min(u.p_scatter),
            p_runs: u.p_runs,
            scatter_ratio: ScatterRatio { normal: u.scatter_ratio[0], friction: u.scatter_ratio[1] },
            partial,
        },
        holdout,
        fe_confirmation: None,
        next_experiment,
        corrected_model: None,
        corrected_rms_n: None,
        input: Vec::new(),
        seed: options.settings.seed,
        version: env!("CARGO_PKG_VERSION").into(),
        elapsed_s: 0.0,
    };
    let evidence = Evidence {
        map_before: map(&corrected, &judged.task.plain_residual_n(null)),
        map_after,
        drivers,
        theta: full.theta.clone(),
        theta_null: null.theta.clone(),
        theta_calibrated: calibration.fit.theta.clone(),
        laws: full.laws.clone(),
        scatter: judged.expected,
        corrections: fixes.clone(),
        checked: if held_out.is_some() { "holdout" } else { "measured" }.into(),
        checked_set: held_out.unwrap_or_else(|| corrected.clone()),
        calibration_set: calibration_set.clone(),
        calibration: calibration.clone(),
    };
    Ok((report, evidence))
}

fn next(judged: &Judged<'_>, set: &RunSet) -> Option<NextExperiment> {
    if judged.verdict != Verdict::Ambiguous {
        return None;
    }
    let mut rivalries = Vec::new();
    for (index, contest) in judged.contests.iter().enumerate() {
        let own = contest.candidates[0].active.law.family;
        let mut seen = vec![own];
        for rival in &contest.candidates[1..] {
            if !seen.contains(&rival.active.law.family) {
                seen.push(rival.active.law.family);
                rivalries.push(Rivalry { index, rival: &rival.active });
            }
        }
    }
    propose(&judged.task, set, &judged.selection.fit, &rivalries)
}

fn disagreement(judged: &Judged<'_>, set: &RunSet) -> Disagreement {
    let null = &judged.selection.null;
    let (mut rms, mut floor) = (Squares::default(), Squares::default());
    let residual_n = judged.task.plain_residual_n(null);
    rms.add(residual_n.iter().copied());
    floor.add(floor_n(&judged.task, &null.theta, &[], &judged.expected).into_iter());
    let (rms_n, floor_rms_n) = (rms.rms(), floor.rms());
    Disagreement {
        ratio: std::array::from_fn(|k| worst(&[rms_n[k]; 3], &[floor_rms_n[k]; 3])),
        regions: strongest(&map(set, &residual_n), 12),
        rms_n,
        floor_rms_n,
    }
}

fn baseline(judged: &Judged<'_>, calibration: &Calibration, options: &Options) -> Baseline {
    let null = &judged.selection.null;
    let sd = |c: &nalgebra::DMatrix<f64>, k: usize| c[(k, k)].max(0.0).sqrt();
    Baseline {
        model: options.model.clone(),
        parameters: (0..FREEDOMS)
            .map(|k| BaselineParameter {
                name: FREEDOM[k].name.into(),
                unit: FREEDOM[k].unit.into(),
                value: null.theta[k],
                sd: sd(&null.covariance, k),
                calibrated: calibration.fit.theta[k],
                calibrated_sd: sd(&calibration.fit.covariance, k),
            })
            .collect(),
        rescale: Rescale {
            stiffness: (null.theta[0] - calibration.fit.theta[0]).exp(),
            strength: (null.theta[4] - calibration.fit.theta[4]).exp(),
        },
        calibration_misfit: calibration.misfit,
    }
}

fn noise(calibration: &Calibration) -> NoiseFound {
    let mean = |of: &dyn Fn(usize) -> f64| ((0..3).map(|k| of(k).powi(2)).sum::<f64>() / 3.0).sqrt();
    let v = calibration.fit.variances;
    NoiseFound {
        additive_n: mean(&|k| calibration.noise[k].additive_n),
        multiplicative: mean(&|k| calibration.noise[k].multiplicative),
        run_gain_normal: v[0].sqrt(),
        run_gain_friction: v[1].sqrt(),
        run_offset_n: ((v[3] + v[4] + v[5]) / 3.0).sqrt(),
        depth_zero_mm: v[2].sqrt(),
        source: "calibration".into(),
    }
}

fn tests(judged: &Judged<'_>) -> Vec<LawTest> {
    judged
        .selection
        .tests
        .iter()
        .map(|t| LawTest {
            law: t.law.name.into(),
            family: t.law.family.into(),
            gain_2ll: t.gain_2ll,
            p_model: t.p_model,
            p_runs: t.p_runs.p,
            significant: t.obstacle.is_none() && t.significant,
            testable: t.obstacle.is_none(),
            reason: t.obstacle.clone().unwrap_or_default(),
        })
        .collect()
}

fn partial(judged: &Judged<'_>) -> Vec<CandidateLaw> {
    judged
        .contests
        .iter()
        .map(|c| CandidateLaw {
            law: c.candidates[0].active.law.name.into(),
            family: c.candidates[0].active.law.family.into(),
            delta_2ll: -c.gain_2ll,
            lambda_rival: 0.0,
        })
        .collect()
}
