//! Priors of the smooth model's parameters: between fingers before the calibration, and between the calibration and the
//! measured set.
//!
//! Main types: [`Prior`], [`Drift`].
//!
//! A curve over depth differs between fingers, and drifts within one, by a scale, an exponent and something smooth over
//! depth. A polynomial over ln depth would also move as 1/depth near touch, where an error of the touch point and a pull-off
//! show, and would hide them.

use nalgebra::{DMatrix, DVector};

use fingerpad_smooth::{Parameter, ParameterInfo, Parameters};

/// Shape of a curve over depth: exponent, slope, curvature. Of the normal force and of the strength.
const NORMAL: [Parameter; 3] =
    [Parameter::NormalDepthExponent, Parameter::NormalDepthSlope, Parameter::NormalDepthCurvature];
const STRENGTH: [Parameter; 3] =
    [Parameter::StrengthDepthExponent, Parameter::StrengthDepthSlope, Parameter::StrengthDepthCurvature];

/// A normal distribution of the parameters.
#[derive(Clone, Debug)]
pub struct Prior {
    /// Mean.
    pub mean: Parameters,
    /// R with Rᵀ R = covariance⁻¹, shape (31, 31).
    pub root: DMatrix<f64>,
}

impl Prior {
    /// From mean and covariance, shape (31, 31).
    ///
    /// # Panics
    /// Where the covariance is not positive definite.
    pub fn new(mean: Parameters, covariance: &DMatrix<f64>) -> Self {
        let inverse = covariance.clone().cholesky().expect("a covariance with drift is positive definite").inverse();
        let root = inverse.cholesky().expect("an inverse of a covariance is positive definite").l().transpose();
        Self { mean, root }
    }
}

/// How much the shape of a finger's curves over depth changed since the calibration. Which of the two holds, the
/// runs decide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drift {
    /// Hardly: the same finger on the same device.
    Small,
    /// By as much as is allowed for.
    Allowed,
}

/// The small drift of the shapes over the allowed one.
const SMALL: f64 = 0.3;

/// Covariance of what changes between the calibration and the measured set of one finger, shape (31, 31).
///
/// `load_exponent`: beta of the strength in the load at a fixed contact. What changes the tissue's stiffness over depth
/// changes the strength by beta of that [F ~ N^beta A^(1 - beta), the local law integrated over the contact]; the rest of
/// the strength's drift is the contact's, (1 - beta) of the same size.
pub fn drift_covariance(size: Drift, load_exponent: f64) -> DMatrix<f64> {
    let factor = if size == Drift::Small { SMALL } else { 1.0 };
    let beta = load_exponent.clamp(0.0, 1.0);
    let mut out = independent(|info| info.sd_drift);
    for (tissue, strength) in NORMAL.iter().zip(&STRENGTH) {
        let variance = (factor * tissue.info().sd_drift).powi(2);
        let (normal, strength) = (tissue.index(), strength.index());
        out[(normal, normal)] = variance;
        out[(strength, strength)] = variance * (beta.powi(2) + (1.0 - beta).powi(2));
        out[(normal, strength)] = variance * beta;
        out[(strength, normal)] = variance * beta;
    }
    out
}

/// Covariance of the parameters between fingers and devices, shape (31, 31).
pub fn covariance_between_fingers() -> DMatrix<f64> {
    independent(|info| info.sd_between_fingers)
}

/// Covariance of parameters that change independently.
fn independent(sd: impl Fn(&ParameterInfo) -> f64) -> DMatrix<f64> {
    let variances = Parameter::all().map(|p| sd(p.info()).powi(2));
    DMatrix::from_diagonal(&DVector::from_iterator(Parameter::COUNT, variances))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drifts_are_covariances_and_the_allowed_one_is_two_per_cent_in_the_exponent() {
        for size in [Drift::Small, Drift::Allowed] {
            assert!(drift_covariance(size, 0.46).cholesky().is_some());
        }
        assert!(covariance_between_fingers().cholesky().is_some());
        // Logarithm of the curve at 1.55 mm over that at 0.45 mm.
        let d = drift_covariance(Drift::Allowed, 0.46);
        let moves = [(1.55f64 / 0.45).ln(), 1.55 - 0.45, 0.65f64.powi(2) - 0.45f64.powi(2)];
        let per_exponent = |curve: [Parameter; 3]| {
            let variance: f64 = curve.iter().zip(moves).map(|(p, by)| by * by * d[(p.index(), p.index())]).sum();
            variance.sqrt() / moves[0]
        };
        assert!((0.015..0.025).contains(&per_exponent(NORMAL)), "{}", per_exponent(NORMAL));
        assert!((0.010..0.018).contains(&per_exponent(STRENGTH)), "{}", per_exponent(STRENGTH));
    }
}
