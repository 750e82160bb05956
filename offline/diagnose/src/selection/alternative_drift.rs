//! An alternative prior: the finger's curves over depth drifted since the calibration as far as is allowed. A law that
//! shows against the calibration must explain the runs better than that drift does.
//!
//! Two priors over the same parameters are compared by their marginal likelihoods, in which the wider one pays for the
//! volume of parameters that the data rule out (the Occam factor) [MacKay 1992, "Bayesian interpolation"].
//!
//! Main type: [`AlternativeDrift`].

use fingerpad_smooth::ReferenceCurves;
use nalgebra::DMatrix;

use crate::data::runs::RunSet;
use crate::laws::{Column, Law};
use crate::model::prior::{Drift, Prior};
use crate::statistics::calibration::Calibration;
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::task::Task;

/// A task whose prior has the allowed drift.
pub struct AlternativeDrift<'a> {
    task: Task<'a>,
    /// Occam penalty of its prior over that of the small drift, in 2 log likelihood.
    occam_penalty: f64,
}

/// Logarithm of the factor by which data of information G shrink the volume of a prior of covariance P: ln |I + G P|.
fn ln_volume_ratio(prior: &Prior, information: &DMatrix<f64>) -> f64 {
    let known = prior.root.transpose() * &prior.root;
    let log_det = |m: DMatrix<f64>| {
        m.cholesky().map_or(f64::INFINITY, |c| 2.0 * c.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>())
    };
    log_det(&known + information) - log_det(known)
}

impl<'a> AlternativeDrift<'a> {
    /// Beside a task of the small drift; the penalty is that at its fit without laws, `null`.
    pub fn new(
        set: &'a RunSet,
        reference: &'a ReferenceCurves,
        calibration: &Calibration,
        small: &Task<'_>,
        null: &Fit,
        derivatives: &Derivatives,
    ) -> Self {
        let task = calibration.drifting(Drift::Allowed).task(set, reference);
        let information = small.information(derivatives, &null.variances);
        let occam_penalty = ln_volume_ratio(&task.prior, &information) - ln_volume_ratio(&small.prior, &information);
        Self { task, occam_penalty: occam_penalty.max(0.0) }
    }

    /// Whether a drift of the curves over depth could stand in a law's place.
    pub fn concerns(law: &Law) -> bool {
        law.drivers.contains(&Column::Depth)
    }

    /// −2 log likelihood of the best fit from a start, comparable with those of the small drift.
    pub fn minus_2ll(&self, start: FitStart, derivatives: &Derivatives) -> f64 {
        self.task.fit_near(start, derivatives, 9).minus_2ll + self.occam_penalty
    }
}
