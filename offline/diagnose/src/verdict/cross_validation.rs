//! Error on runs that no fit saw: root mean square of the residual before and after the effects, beside the noise floor.

use fingerpad_smooth::{Parameters, ReferenceCurves};
use nalgebra::{Matrix2, Vector2};

use crate::data::runs::RunSet;
use crate::laws::Law;
use crate::model::active_law::ActiveLaw;
use crate::model::prediction::Perturbation;
use crate::model::random_effects::PerEffect;
use crate::model::residual_sums::ResidualSums;
use crate::schema::CrossValidationError;
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::task::Task;

/// Standard deviation that row noise and variances between runs give each observation of a task, N; NaN where a reading is
/// left out.
pub fn noise_floor_n(task: &Task<'_>, parameters: &Parameters, laws: &[ActiveLaw], variances: &PerEffect) -> Vec<f64> {
    let prediction = task.predict(parameters, laws);
    let spread = task.random_effect_columns(parameters, laws, &Vec::new(), &prediction).spread(variances);
    let floor = |(i, (spread, reading)): (usize, (&f64, &f64))| {
        let of_runs = (spread - 1.0).max(0.0) * task.sigma_n[i].powi(2);
        if reading.is_nan() { f64::NAN } else { (of_runs + task.row_sigma_n(i).powi(2)).sqrt() }
    };
    spread.iter().zip(&task.readings_n).enumerate().map(floor).collect()
}

/// Largest ratio of two triples.
pub fn worst(a: &[f64; 3], floor: &[f64; 3]) -> f64 {
    (0..3).map(|k| a[k] / floor[k].max(1e-12)).fold(0.0, f64::max)
}

fn error_of(
    method: &str,
    runs: usize,
    [calibrated, before, after]: [ResidualSums; 3],
    floor: ResidualSums,
) -> CrossValidationError {
    let [rms_calibrated_n, rms_before_n, rms_after_n] = [calibrated, before, after].map(|sums| sums.rms());
    let floor_rms_n = floor.rms();
    CrossValidationError {
        method: method.to_owned(),
        runs,
        ratio_calibrated: worst(&rms_calibrated_n, &floor_rms_n),
        ratio_before: worst(&rms_before_n, &floor_rms_n),
        ratio_after: worst(&rms_after_n, &floor_rms_n),
        rms_calibrated_n,
        rms_before_n,
        rms_after_n,
        floor_rms_n,
        refused_after_n: None,
    }
}

fn squares(task: &Task<'_>, prediction: &[f64]) -> ResidualSums {
    let mut s = ResidualSums::default();
    s.add(task.readings_n.iter().zip(prediction).map(|(y, p)| y - p));
    s
}

/// The error on a held-out file.
///
/// `variances`: those between runs of the calibration, with what the errors of state columns add
pub fn on_file(
    set: &RunSet,
    reference: &ReferenceCurves,
    calibration: &Calibration,
    variances: &PerEffect,
    null: &Fit,
    full: &Fit,
) -> CrossValidationError {
    let task = calibration.task(set, reference);
    let mut floor = ResidualSums::default();
    floor.add(noise_floor_n(&task, &full.parameters, &full.laws, variances).into_iter());
    let calibrated = squares(&task, &task.predict(&calibration.fit.parameters, &calibration.fit.laws));
    let before = squares(&task, &task.predict(&null.parameters, &null.laws));
    let after = squares(&task, &task.predict(&full.parameters, &full.laws));
    error_of("file", set.runs.len(), [calibrated, before, after], floor)
}

/// The residual on a held-out file over the noise floor, worst channel, where level and drift of its strength are fitted to it in place of the
/// laws of a family: what these laws made of the strength in another session is not known.
///
/// * `variances`: as in [`on_file`]
/// * `drift`: the law of a drift that is even in time
pub fn ratio_with_free_strength(
    set: &RunSet,
    reference: &ReferenceCurves,
    calibration: &Calibration,
    variances: &PerEffect,
    full: &Fit,
    drift: &'static Law,
) -> f64 {
    /// Gauss–Newton steps, and the changes of level and drift by which derivatives are taken.
    const STEPS: usize = 6;
    const CHANGES: [f64; 2] = [1e-3, 1e-3];
    let task = calibration.task(set, reference);
    let model = reference.model(&full.parameters);
    let others: Vec<ActiveLaw> = full.laws.iter().filter(|active| active.law.family != drift.family).cloned().collect();
    let at = |[level, per_hour]: [f64; 2]| {
        let mut laws = others.clone();
        laws.push(ActiveLaw { law: drift, values: vec![per_hour] });
        let perturbation = Perturbation { strength: level.exp(), ..Perturbation::default() };
        task.inputs(&laws, &Vec::new(), perturbation).predict_n(&model)
    };
    let mut point = [0.0; 2];
    for _ in 0..STEPS {
        let now = at(point);
        let moved = |k: usize| {
            let mut to = point;
            to[k] += CHANGES[k];
            task.difference_column(&at(to), &now, CHANGES[k])
        };
        let columns = [moved(0), moved(1)];
        let (mut gradient, mut information) = (Vector2::zeros(), Matrix2::identity() * 1e-12);
        for (i, reading) in task.readings_n.iter().enumerate().filter(|(_, reading)| !reading.is_nan()) {
            let slope = Vector2::new(columns[0][i], columns[1][i]);
            gradient += slope * ((reading - now[i]) / task.sigma_n[i]);
            information += slope * slope.transpose();
        }
        let step = information.try_inverse().map_or_else(Vector2::zeros, |inverse| inverse * gradient);
        point = [point[0] + step[0].clamp(-0.5, 0.5), point[1] + step[1].clamp(-1.0, 1.0)];
    }
    let mut floor = ResidualSums::default();
    floor.add(noise_floor_n(&task, &full.parameters, &others, variances).into_iter());
    worst(&squares(&task, &at(point)).rms(), &floor.rms())
}

/// The error by leaving out every fifth run in turn; each fold is fitted without the runs that it predicts.
pub fn by_folds(
    set: &RunSet,
    reference: &ReferenceCurves,
    calibration: &Calibration,
    variances: &PerEffect,
    null: &Fit,
    full: &Fit,
) -> CrossValidationError {
    const FOLDS: usize = 5;
    let [mut calibrated, mut before, mut after, mut floor] = [ResidualSums::default(); 4];
    for fold in 0..FOLDS {
        let train = set.subset(|i| i % FOLDS != fold);
        let test = set.subset(|i| i % FOLDS == fold);
        if test.runs.is_empty() {
            continue;
        }
        let task = calibration.task(&train, reference);
        let fitted = |from: &Fit| {
            let kept = |i: &usize| i % FOLDS != fold;
            let random_effects = (0..from.random_effects.len()).filter(kept).map(|i| from.random_effects[i]).collect();
            task.fit(FitStart { random_effects, ..FitStart::from(from) }, 3).0
        };
        let plain = fitted(null);
        let with = if full.laws.len() == null.laws.len() { plain.clone() } else { fitted(full) };
        let other = calibration.task(&test, reference);
        let add = |sum: &mut ResidualSums, parameters: &Parameters, laws: &[ActiveLaw]| {
            let prediction = other.predict(parameters, laws);
            sum.add(other.readings_n.iter().zip(&prediction).map(|(y, p)| y - p));
        };
        add(&mut calibrated, &calibration.fit.parameters, &calibration.fit.laws);
        add(&mut before, &plain.parameters, &plain.laws);
        add(&mut after, &with.parameters, &with.laws);
        floor.add(noise_floor_n(&other, &with.parameters, &with.laws, variances).into_iter());
    }
    error_of("k-fold by run", set.runs.len(), [calibrated, before, after], floor)
}
