//! The same runs if the finger's curves over depth had drifted as far as is allowed: what a law that shows against the
//! calibration must beat, and what its rivals may use.
//!
//! Main type: [`Wider`]. Marginal likelihoods of two priors over the same freedoms differ by the volume that each gives
//! up to the data; by it the two drifts are compared [MacKay 1992, "Bayesian interpolation"].

use nalgebra::DMatrix;

use super::base::Reference;
use super::calibrate::Calibration;
use super::fit::{Fit, Prior, Start, Task};
use super::laws::{Column, Law};
use super::prior::Drift;
use super::runs::RunSet;
use super::tangents::Tangents;
use super::verdict::task_of;

/// The alternative with the allowed drift.
pub struct Wider<'a> {
    task: Task<'a>,
    /// What its volume costs in 2 log likelihood over that of the small drift.
    price: f64,
}

/// ln |I + G P|, by the roots of P⁻¹.
fn volume(prior: &Prior, information: &DMatrix<f64>) -> f64 {
    let known = prior.root.transpose() * &prior.root;
    let log_det = |m: DMatrix<f64>| {
        m.cholesky().map_or(f64::INFINITY, |c| 2.0 * c.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>())
    };
    log_det(&known + information) - log_det(known)
}

impl<'a> Wider<'a> {
    /// Beside a task of the small drift, priced at its fit without laws.
    pub fn new(
        set: &'a RunSet,
        reference: &'a Reference,
        calibration: &Calibration,
        small: &Task<'_>,
        null: &Fit,
        tangents: &Tangents,
    ) -> Self {
        let task = task_of(set, reference, &calibration.drifting(Drift::Allowed));
        let information = small.information(tangents, &null.variances);
        let price = volume(&task.prior, &information) - volume(&small.prior, &information);
        Self { task, price: price.max(0.0) }
    }

    /// Whether the curves over depth could stand in a law's place.
    pub fn concerns(law: &Law) -> bool {
        law.drivers.contains(&Column::Depth)
    }

    /// −2 log likelihood of the best fit from a start, comparable with those of the small drift.
    pub fn minus_2ll(&self, start: Start, tangents: &Tangents) -> f64 {
        self.task.fit(start, Some(tangents), false, 9).minus_2ll + self.price
    }
}
