//! A law that the effect-free runs follow: it belongs to the finger, and to the model of every file.
//!
//! Main type: [`FingerLaw`].

use nalgebra::DMatrix;

use crate::model::active_law::{ActiveLaw, to_fitted};

/// A law of the finger itself, with a normal prior for files measured after the calibration.
#[derive(Clone, Debug)]
pub struct FingerLaw {
    /// The law with its calibrated parameters.
    pub active: ActiveLaw,
    /// Standard deviation of each parameter on the scale on which it is fitted.
    pub sd: Vec<f64>,
}

/// Drift of a size between the calibration and a later file, as a share of it, and of a shape parameter on its fitted
/// scale (a logarithm): a finger relaxes today as it did yesterday, within a fifth.
const DRIFT: f64 = 0.2;

impl FingerLaw {
    /// From a law of the calibration's fit.
    ///
    /// * `covariance`: of the fit; `place`: of the law's first parameter in it
    pub fn new(active: &ActiveLaw, covariance: &DMatrix<f64>, place: usize) -> Self {
        let sd = |k: usize| {
            let drift = if k < active.law.linear { DRIFT * active.values[k].abs() } else { DRIFT };
            covariance[(place + k, place + k)].max(0.0).sqrt().hypot(drift)
        };
        Self { active: active.clone(), sd: (0..active.values.len()).map(sd).collect() }
    }

    /// Mean and standard deviation of a parameter's prior, on the scale on which it is fitted.
    pub fn prior(&self, index: usize) -> (f64, f64) {
        (to_fitted(&self.active, index), self.sd[index])
    }
}
