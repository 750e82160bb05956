//! Runs that no fit saw: root mean square of the residual before and after the effects, beside the noise floor.

use super::base::Reference;
use super::calibrate::Calibration;
use super::fit::{Fit, Start, Task};
use super::mixed::PerRun;
use super::runs::RunSet;
use super::verdict::task_of;
use super::walk::Active;

/// Residuals of normal, x and y, N.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gap {
    /// `file`, or `k-fold by run`.
    pub method: String,
    /// Runs that were predicted.
    pub runs: usize,
    /// Before any effect.
    pub rms_before_n: [f64; 3],
    /// With the claimed effects.
    pub rms_after_n: [f64; 3],
    /// What row noise and scatter between runs leave of a perfect model.
    pub floor_rms_n: [f64; 3],
    /// Before over floor, worst channel.
    pub ratio_before: f64,
    /// After over floor, worst channel.
    pub ratio_after: f64,
    /// What the correction would have given, N, where it did not bring these runs closer: then it is not made, and
    /// after equals before.
    pub refused_after_n: Option<[f64; 3]>,
}

impl Gap {
    /// Takes the correction back if it does not bring the runs closer; a name may stand where its correction, fitted to
    /// few or noisy runs, does not predict better than none.
    pub fn or_refused(mut self) -> Self {
        if self.ratio_after > self.ratio_before {
            self.refused_after_n = Some(self.rms_after_n);
            (self.rms_after_n, self.ratio_after) = (self.rms_before_n, self.ratio_before);
        }
        self
    }
}

/// Sums of squares per channel.
#[derive(Clone, Copy, Default)]
pub struct Squares {
    sum: [f64; 3],
    rows: f64,
}

impl Squares {
    /// Adds observations, three per row.
    pub fn add(&mut self, values: impl Iterator<Item = f64>) {
        for (i, v) in values.enumerate() {
            self.sum[i % 3] += v * v;
            self.rows += 1.0 / 3.0;
        }
    }

    /// Root mean squares.
    pub fn rms(&self) -> [f64; 3] {
        self.sum.map(|s| (s / self.rows.max(1.0)).sqrt())
    }
}

/// Standard deviation that row noise and run scatter give each observation of a task, N.
pub fn floor_n(task: &Task<'_>, theta: &[f64], laws: &[Active], scatter: &PerRun) -> Vec<f64> {
    let prediction = task.predict(theta, laws);
    let spread = task.run_columns(theta, laws, &Vec::new(), &prediction).spread(scatter);
    spread.iter().zip(&task.sigma_n).map(|(s, sigma)| s.sqrt() * sigma).collect()
}

/// Largest ratio of two triples.
pub fn worst(a: &[f64; 3], floor: &[f64; 3]) -> f64 {
    (0..3).map(|k| a[k] / floor[k].max(1e-12)).fold(0.0, f64::max)
}

fn gap(method: &str, runs: usize, before: Squares, after: Squares, floor: Squares) -> Gap {
    let (rms_before_n, rms_after_n, floor_rms_n) = (before.rms(), after.rms(), floor.rms());
    Gap {
        method: method.to_owned(),
        runs,
        ratio_before: worst(&rms_before_n, &floor_rms_n),
        ratio_after: worst(&rms_after_n, &floor_rms_n),
        rms_before_n,
        rms_after_n,
        floor_rms_n,
        refused_after_n: None,
    }
}

fn squares(task: &Task<'_>, prediction: &[f64]) -> Squares {
    let mut s = Squares::default();
    s.add(task.readings_n.iter().zip(prediction).map(|(y, p)| y - p));
    s
}

/// The gap on a held-out file.
///
/// `scatter`: variances between runs of the calibration, and what the errors of state columns add.
pub fn on_file(
    set: &RunSet,
    reference: &Reference,
    calibration: &Calibration,
    scatter: &PerRun,
    null: &Fit,
    full: &Fit,
) -> Gap {
    let task = task_of(set, reference, calibration);
    let mut floor = Squares::default();
    floor.add(floor_n(&task, &full.theta, &full.laws, scatter).into_iter());
    let before = squares(&task, &task.predict(&null.theta, &null.laws));
    let after = squares(&task, &task.predict(&full.theta, &full.laws));
    gap("file", set.runs.len(), before, after, floor)
}

/// The gap by leaving out every fifth run in turn; each fold is fitted without the runs that it predicts.
pub fn by_folds(
    set: &RunSet,
    reference: &Reference,
    calibration: &Calibration,
    scatter: &PerRun,
    null: &Fit,
    full: &Fit,
) -> Gap {
    const FOLDS: usize = 5;
    let (mut before, mut after, mut floor) = (Squares::default(), Squares::default(), Squares::default());
    for fold in 0..FOLDS {
        let train = set.subset(|i| i % FOLDS != fold);
        let test = set.subset(|i| i % FOLDS == fold);
        if test.runs.is_empty() {
            continue;
        }
        let task = task_of(&train, reference, calibration);
        let fitted = |from: &Fit| {
            let kept = |i: &usize| i % FOLDS != fold;
            let modes = (0..from.modes.len()).filter(kept).map(|i| from.modes[i]).collect();
            task.fit(Start { modes, ..Start::from(from) }, None, false, 3)
        };
        let plain = fitted(null);
        let with = if full.laws.is_empty() { plain.clone() } else { fitted(full) };
        let other = task_of(&test, reference, calibration);
        let add = |sum: &mut Squares, fit: &Fit| {
            let prediction = other.predict(&fit.theta, &fit.laws);
            sum.add(other.readings_n.iter().zip(&prediction).map(|(y, p)| y - p));
        };
        add(&mut before, &plain);
        add(&mut after, &with);
        floor.add(floor_n(&other, &with.theta, &with.laws, scatter).into_iter());
    }
    gap("k-fold by run", set.runs.len(), before, after, floor)
}
