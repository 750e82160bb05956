//! The diagnosis as a whole, and its report in the form `fingerpad-diagnosis/1`.

use serde::{Deserialize, Serialize};

use super::base::{FREEDOM, FREEDOMS, Reference};
use super::calibrate::{Calibration, calibrate};
use super::check::{check, check_pair};
use super::covariates::CovariateError;
use super::design::{NextExperiment, Rivalry, propose};
use super::error::DiagnoseError;
use super::fit::is_log;
use super::heldout::{Gap, Squares, by_folds, floor_n, on_file, worst};
use super::regions::{Region, map, strongest};
use super::runs::RunSet;
use super::select::Settings;
use super::verdict::{Judged, Verdict, corrections, families, judge};
use super::walk::Active;

/// A parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Name, as in the contract.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// A law that may be the missing effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateLaw {
    /// Law.
    pub law: String,
    /// Family.
    pub family: String,
    /// −2 log likelihood above the best law's.
    pub delta_2ll: f64,
    /// Separation from the best law under the present protocol.
    pub lambda_rival: f64,
}

/// A missing effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectFound {
    /// Best candidate.
    pub law: String,
    /// Its family.
    pub family: String,
    /// Parameters, fitted inside the model.
    pub parameters: Vec<FittedParameter>,
    /// 90th percentile of the relative change of force.
    pub size_p90_relative: f64,
    /// Gain in 2 log likelihood.
    pub gain_2ll: f64,
    /// Model-based p over the whole grid of laws and shapes.
    pub p_model: f64,
    /// Sign-flip p over runs and the library.
    pub p_runs: f64,
    /// Whether the evidence lies in the comparison with the calibration; then `p_runs` is no test.
    pub against_calibration: bool,
    /// Expected gain under this protocol.
    pub lambda_detect: f64,
    /// The best law first, then those that cannot be excluded.
    pub candidates: Vec<CandidateLaw>,
}

/// Where baseline and measurement differ before any effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Disagreement {
    /// Root mean square residual of normal, x, y, N.
    pub rms_n: [f64; 3],
    /// What noise and scatter between runs leave of a perfect model.
    pub floor_rms_n: [f64; 3],
    /// Quotient.
    pub ratio: [f64; 3],
    /// Regions that stand out, strongest first.
    pub regions: Vec<Region>,
}

/// A freedom of the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// After the refit on the measured set.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
    /// On the calibration set.
    pub calibrated: f64,
    /// Standard deviation there.
    pub calibrated_sd: f64,
}

/// A change of scale between the calibration and the measured set; never an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rescale {
    /// Factor on the normal force.
    pub stiffness: f64,
    /// Factor on the strength.
    pub strength: f64,
}

/// The baseline after the refit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Model file.
    pub model: String,
    /// Freedoms.
    pub parameters: Vec<BaselineParameter>,
    /// Scales.
    pub rescale: Rescale,
    /// What the baseline leaves of the calibration runs over their noise: normal, x, y; 1 fits to the noise.
    pub calibration_misfit: [f64; 3],
}

/// Noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Row noise, N.
    pub additive_n: f64,
    /// Row noise, share of the force.
    pub multiplicative: f64,
    /// Scatter between runs of the stiffness.
    pub run_gain_normal: f64,
    /// Scatter between runs of the strength.
    pub run_gain_friction: f64,
    /// Scatter between runs of the offsets, N.
    pub run_offset_n: f64,
    /// Scatter between runs of the touch point, mm.
    pub depth_zero_mm: f64,
    /// `calibration`.
    pub source: String,
}

/// The test of one law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawTest {
    /// Law.
    pub law: String,
    /// Family.
    pub family: String,
    /// Gain in 2 log likelihood over the baseline alone.
    pub gain_2ll: f64,
    /// Model-based p over the grid.
    pub p_model: f64,
    /// Sign-flip p over the library.
    pub p_runs: f64,
    /// Whether it would pass as the first law.
    pub significant: bool,
    /// Whether the set can test it.
    pub testable: bool,
    /// Why not.
    pub reason: String,
}

/// What no law explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnexplainedFound {
    /// Whether it counts.
    pub significant: bool,
    /// Column.
    pub column: String,
    /// `normal` or `friction`.
    pub channel: String,
    /// Gain.
    pub gain: f64,
    /// Model-based p over all bases.
    pub p_model: f64,
    /// Sign-flip p over all bases.
    pub p_runs: f64,
    /// Scatter between runs over what the calibration and the declared reading errors explain.
    pub scatter_ratio: ScatterRatio,
    /// Laws that took part of it and are not claimed.
    pub partial: Vec<CandidateLaw>,
}

/// Scatter between runs over that of the calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScatterRatio {
    /// Of the stiffness.
    pub normal: f64,
    /// Of the strength.
    pub friction: f64,
}

/// The finite-element model with the effect in its law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeConfirmation {
    /// Mesh preset.
    pub mesh: String,
    /// Before, N.
    pub rms_before_n: [f64; 3],
    /// After, N.
    pub rms_after_n: [f64; 3],
    /// Floor, N.
    pub floor_rms_n: [f64; 3],
}

/// A file that went in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFile {
    /// `calibration`, `measured` or `holdout`.
    pub role: String,
    /// Its name without folders.
    pub file: String,
    /// SHA-256.
    pub sha256: String,
    /// Rows in the file.
    pub rows: usize,
    /// Runs in the file.
    pub runs: usize,
    /// Remarks of the reader.
    pub notes: Vec<String>,
}

/// The report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// `fingerpad-diagnosis/1`.
    pub schema: String,
    /// The answer.
    pub verdict: Verdict,
    /// One entry per missing effect, strongest first.
    pub effects: Vec<EffectFound>,
    /// Before any effect.
    pub disagreement: Disagreement,
    /// The baseline.
    pub baseline: Baseline,
    /// The noise.
    pub noise: NoiseFound,
    /// Every law.
    pub tests: Vec<LawTest>,
    /// After the accepted effects.
    pub unexplained: UnexplainedFound,
    /// Runs that no fit saw.
    pub holdout: Gap,
    /// The finite-element model with the effect.
    pub fe_confirmation: Option<FeConfirmation>,
    /// What to measure next.
    pub next_experiment: Option<NextExperiment>,
    /// The model file with the effect.
    pub corrected_model: Option<String>,
    /// What went in.
    pub input: Vec<InputFile>,
    /// Seed.
    pub seed: u64,
    /// Version of the program.
    pub version: String,
    /// Wall time, s.
    pub elapsed_s: f64,
}

/// What the figures need beyond the report.
pub struct Evidence {
    /// Residual map before any effect.
    pub map_before: Vec<Region>,
    /// With the claimed effects.
    pub map_after: Vec<Region>,
    /// For each effect: driver column, unit, and per run its value, the factor that the run's rows ask for without
    /// this effect, and the factor of the fitted law.
    pub drivers: Vec<DriverPlot>,
    /// The fitted freedoms and laws.
    pub theta: Vec<f64>,
    /// Calibrated freedoms.
    pub theta_calibrated: Vec<f64>,
    /// Claimed laws.
    pub laws: Vec<Active>,
}

/// Residual against a driver.
pub struct DriverPlot {
    /// The law.
    pub law: String,
    /// Column and unit.
    pub column: String,
    /// Channel of the residual.
    pub channel: String,
    /// Driver, relative residual without the effect, the law's relative change there.
    pub points: Vec<[f64; 3]>,
}

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
    let claimed = matches!(judged.verdict, Verdict::Named | Verdict::Ambiguous);
    let null = &judged.selection.null;
    let full = if claimed { &judged.selection.fit } else { null };
    let next_experiment = next(&judged, &corrected);

    stage("predicting held-out runs");
    let holdout = match open_holdout()? {
        Some(mut set) => {
            check_pair(calibration_set, &set)?;
            fixes.iter().for_each(|f| f.apply(&mut set));
            on_file(&set, reference, &calibration, &judged.expected, null, full)
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
        theta_calibrated: calibration.fit.theta.clone(),
        laws: full.laws.clone(),
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

fn effects(judged: &Judged<'_>, set: &RunSet) -> (Vec<EffectFound>, Vec<DriverPlot>) {
    let fit = &judged.selection.fit;
    let with = judged.task.predict(&fit.theta, &fit.laws);
    let mut at = FREEDOMS;
    let mut out: Vec<(EffectFound, DriverPlot)> = Vec::new();
    for (index, contest) in judged.contests.iter().enumerate() {
        let active = &fit.laws[index];
        let mut others = fit.laws.clone();
        others.remove(index);
        let without = judged.task.predict(&fit.theta, &others);
        let e = &judged.selection.evidence[index];
        let effect = EffectFound {
            law: active.law.name.into(),
            family: active.law.family.into(),
            parameters: parameters(active, &fit.covariance, at),
            size_p90_relative: size_p90(set, &without, &with),
            gain_2ll: e.gain_2ll,
            p_model: e.p_model,
            p_runs: e.p_runs.p,
            against_calibration: e.p_runs.by_calibration,
            lambda_detect: contest.lambda_detect,
            candidates: contest
                .candidates
                .iter()
                .map(|c| CandidateLaw {
                    law: c.active.law.name.into(),
                    family: c.active.law.family.into(),
                    delta_2ll: c.delta_2ll,
                    lambda_rival: c.lambda_rival,
                })
                .collect(),
        };
        debug_assert_eq!(families(contest)[0], active.law.family);
        at += active.values.len();
        out.push((effect, driver_plot(set, active, &without, &with, &judged.task.readings_n)));
    }
    out.sort_by(|a, b| b.0.gain_2ll.total_cmp(&a.0.gain_2ll));
    out.into_iter().unzip()
}

/// Error of a parameter, as a share of it, that the baseline's form leaves beside the noise: about what other fingers
/// of known truth showed.
const FORM_ERROR: f64 = 0.025;

/// Values as they are reported with 95 % intervals; `at` is the place of the law's first parameter in the covariance.
fn parameters(active: &Active, covariance: &nalgebra::DMatrix<f64>, at: usize) -> Vec<FittedParameter> {
    let n = active.values.len();
    let reported = (active.law.report)(&active.values);
    (0..n)
        .map(|k| {
            let p = &active.law.parameters[k];
            let sd_own =
                covariance[(at + k, at + k)].max(0.0).sqrt().hypot(if is_log(active, k) { FORM_ERROR } else { 0.0 });
            let ci95 = if is_log(active, k) {
                [reported[k] * (-1.96 * sd_own).exp(), reported[k] * (1.96 * sd_own).exp()]
            } else {
                // By the derivative of the reported value in the fitted ones.
                let mut variance = 0.0;
                let slope: Vec<f64> = (0..n)
                    .map(|j| {
                        let mut moved = active.values.clone();
                        let h = 1e-5 * moved[j].abs().max(1e-3);
                        moved[j] += h;
                        let mut d = (active.law.report)(&moved)[k] - reported[k];
                        if p.unit == "degree" {
                            d = (d + 90.0).rem_euclid(180.0) - 90.0;
                        }
                        let scale = if is_log(active, j) { active.values[j] } else { 1.0 };
                        d / h * scale
                    })
                    .collect();
                for i in 0..n {
                    for j in 0..n {
                        variance += slope[i] * covariance[(at + i, at + j)] * slope[j];
                    }
                }
                let half = 1.96 * variance.max(0.0).sqrt().hypot(FORM_ERROR * reported[k]);
                [reported[k] - half, reported[k] + half]
            };
            FittedParameter { name: p.name.into(), value: reported[k], unit: p.unit.into(), ci95 }
        })
        .collect()
}

/// The larger of the 90th percentiles of |ΔN|/N and |ΔF|/F over contact rows whose force stands above the noise.
fn size_p90(set: &RunSet, without: &[f64], with: &[f64]) -> f64 {
    let (mut normal, mut friction) = (Vec::new(), Vec::new());
    let mut at = 0;
    for run in &set.runs {
        for row in &run.rows {
            let (a, b) = (&without[at..at + 3], &with[at..at + 3]);
            at += 3;
            if !(row.depth_mm > 0.0) {
                continue;
            }
            if a[0] > 0.01 {
                normal.push((b[0] - a[0]).abs() / a[0]);
            }
            let f = a[1].hypot(a[2]);
            if f > 0.02 {
                friction.push((b[1] - a[1]).hypot(b[2] - a[2]) / f);
            }
        }
    }
    let p90 = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v.get((0.9 * v.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0)
    };
    p90(normal).max(p90(friction))
}

/// Residual without the effect, and the effect, along the law's first driver.
fn driver_plot(set: &RunSet, active: &Active, without: &[f64], with: &[f64], readings: &[f64]) -> DriverPlot {
    use super::laws::{Column, Place};
    let column = active.law.drivers.first().copied().unwrap_or(Column::Depth);
    let in_stroke = matches!(column, Column::Slide | Column::ContactTime | Column::Depth);
    let normal = matches!(active.law.place, Place::Stiffness | Place::Depth | Place::Rim);
    let mut points = Vec::new();
    let mut at = 0;
    for run in &set.runs {
        let (mut sum, mut n) = ([0.0; 2], 0.0);
        for row in &run.rows {
            let i = at;
            at += 3;
            let measure = |v: &[f64]| {
                if normal { v[i] } else { v[i + 1] * row.along[0] + v[i + 2] * row.along[1] }
            };
            let base = measure(without);
            let usable = row.depth_mm > 0.0 && base > 0.02 && (normal || row.path_mm > 0.0);
            if !usable {
                continue;
            }
            let pair = [(measure(readings) - base) / base, (measure(with) - base) / base];
            if in_stroke {
                let x = match column {
                    Column::Slide => row.path_mm,
                    Column::ContactTime => row.contact_time_s,
                    _ => row.depth_mm,
                };
                points.push([x, pair[0], pair[1]]);
            } else if normal || row.path_mm > 1.0 {
                sum = [sum[0] + pair[0], sum[1] + pair[1]];
                n += 1.0;
            }
        }
        if n > 0.0 {
            points.push([run.value(column), sum[0] / n, sum[1] / n]);
        }
    }
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    DriverPlot {
        law: active.law.name.into(),
        column: column.name().into(),
        channel: if normal { "normal force" } else { "friction along the motion" }.into(),
        points,
    }
}
