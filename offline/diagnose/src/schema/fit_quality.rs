//! How near the model comes to measured and held-out runs, in the report.

use serde::{Deserialize, Serialize};

/// A part of a column in which the residual is not zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Column.
    pub column: String,
    /// Its unit.
    pub unit: String,
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// `normal`, `friction` (along the motion) or `across`.
    pub channel: String,
    /// Mean over runs of the residual over the prediction.
    pub mean_relative: f64,
    /// Mean over its standard error, over runs.
    pub z: f64,
    /// Runs with rows in there.
    pub runs: usize,
    /// Whether the calibration has no runs there.
    pub outside_calibration: bool,
}

/// How near runs are predicted that no fit saw: root mean square residuals of normal, x and y, N.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CrossValidationError {
    /// `file`, or `k-fold by run`.
    pub method: String,
    /// Runs that were predicted.
    pub runs: usize,
    /// As calibrated: nothing refitted to the measured runs.
    pub rms_calibrated_n: [f64; 3],
    /// Refitted, before any effect.
    pub rms_before_n: [f64; 3],
    /// With the claimed effects.
    pub rms_after_n: [f64; 3],
    /// Residual that a perfect model would leave: row noise and scatter between runs.
    pub floor_rms_n: [f64; 3],
    /// As calibrated over floor, worst channel.
    pub ratio_calibrated: f64,
    /// Before over floor, worst channel.
    pub ratio_before: f64,
    /// After over floor, worst channel.
    pub ratio_after: f64,
    /// Residual with the correction, N, where it did not bring these runs closer: then it is not made, and
    /// after equals before.
    pub refused_after_n: Option<[f64; 3]>,
}

impl CrossValidationError {
    /// The same where the runs before the effects were predicted by themselves: with another lag, say.
    pub fn instead_of(mut self, before: Option<Self>) -> Self {
        if let Some(before) = before {
            (self.rms_calibrated_n, self.ratio_calibrated) = (before.rms_calibrated_n, before.ratio_calibrated);
            (self.rms_before_n, self.ratio_before) = (before.rms_before_n, before.ratio_before);
        }
        self
    }

    /// The same where no correction is made.
    pub fn without_correction(mut self) -> Self {
        (self.rms_after_n, self.ratio_after) = (self.rms_before_n, self.ratio_before);
        self.refused_after_n = None;
        self
    }

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
