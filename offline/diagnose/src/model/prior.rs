//! Priors of the smooth model's parameters: between fingers before the calibration, and between the calibration and the
//! measured set.
//!
//! Main types: [`Prior`], [`Drift`].
//!
//! A curve over depth differs between fingers, and drifts within one, by a scale, an exponent and something smooth over
//! depth. A polynomial over ln depth with independent coefficients would also move as 1/depth near touch, where an error
//! of the touch point and a pull-off show, and would hide them.

use nalgebra::DMatrix;

use fingerpad_smooth::{MIDDLE_MM, Parameter, ParameterInfo, Parameters, U_RANGE, fit_cubic};

/// Parameters that are the cubics of a curve over u = ln(depth / 0.9 mm), constant first: normal force, strength.
const CURVES: [[Parameter; 4]; 2] = [
    [
        Parameter::NormalScale,
        Parameter::NormalDepthExponent,
        Parameter::NormalDepthCurvature,
        Parameter::NormalDepthCubic,
    ],
    [
        Parameter::StrengthScale,
        Parameter::StrengthDepthExponent,
        Parameter::StrengthDepthCurvature,
        Parameter::StrengthDepthCubic,
    ],
];

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

/// Standard deviations of a change of a curve's shape.
#[derive(Clone, Copy)]
struct ShapeChange {
    /// Exponent.
    exponent: f64,
    /// Slope of the logarithm over depth, 1/mm.
    slope_per_mm: f64,
    /// Half its curvature, 1/mm².
    curvature_per_mm2: f64,
}

impl ShapeChange {
    const fn even(size: f64) -> Self {
        Self { exponent: size, slope_per_mm: size, curvature_per_mm2: size }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            exponent: self.exponent * factor,
            slope_per_mm: self.slope_per_mm * factor,
            curvature_per_mm2: self.curvature_per_mm2 * factor,
        }
    }

    /// Each of the three changes, at its size, as coefficients of a cubic over u.
    fn cubics(self) -> [[f64; 4]; 3] {
        let over_depth = |power: i32, size: f64| {
            let points: Vec<(f64, f64)> = (0..=22)
                .map(|i| U_RANGE[0] + 0.1 * f64::from(i))
                .map(|u| (u, (MIDDLE_MM * u.exp() - MIDDLE_MM).powi(power)))
                .collect();
            fit_cubic(&points).map(|c| c * size)
        };
        [[0.0, self.exponent, 0.0, 0.0], over_depth(1, self.slope_per_mm), over_depth(2, self.curvature_per_mm2)]
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

/// Drift of the tissue's exponent and, 1/mm, of the slope over depth: with both, two per cent.
const ALLOWED: f64 = 0.014;
/// The small drift over the allowed one.
const SMALL: f64 = 0.3;
/// Share of a cubic's own drifts that is independent of each other.
const LOOSE: f64 = 0.2;

/// Covariance of what changes between the calibration and the measured set of one finger, shape (31, 31).
///
/// `load_exponent`: beta of the strength in the load at a fixed contact. What changes the tissue's stiffness over depth
/// changes the strength by beta of that [F ~ N^beta A^(1 - beta), the local law integrated over the contact]; the rest of
/// the strength's drift is the contact's, (1 - beta) of the same size.
pub fn drift_covariance(size: Drift, load_exponent: f64) -> DMatrix<f64> {
    let factor = if size == Drift::Small { SMALL } else { 1.0 };
    let beta = load_exponent.clamp(0.0, 1.0);
    let tissue = ShapeChange::even(ALLOWED * factor);
    let mut out = independent(|info| info.sd_drift, LOOSE * factor);
    add_shape_change(&mut out, tissue, [1.0, beta]);
    add_shape_change(&mut out, tissue.times(1.0 - beta), [0.0, 1.0]);
    out
}

/// Covariance of the parameters between fingers and devices, shape (31, 31).
///
/// The two fingers of other shapes that the finite elements were asked for (B and D, against the shipped E) are fitted as
/// well as with curvatures and cubics of their own that are ten times as free.
pub fn covariance_between_fingers() -> DMatrix<f64> {
    let mut out = independent(|info| info.sd_between_fingers, 0.05);
    for (curve, factors) in CURVES.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
        let size = curve[1].info().sd_between_fingers;
        let shape = ShapeChange { exponent: size, slope_per_mm: size, curvature_per_mm2: 0.1 * size };
        add_shape_change(&mut out, shape, factors);
    }
    out
}

/// Covariance of parameters that change independently; the curves' exponents do not, their curvatures and cubics by the
/// share `loose` of their standard deviations.
fn independent(sd: impl Fn(&ParameterInfo) -> f64, loose: f64) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(Parameter::COUNT, Parameter::COUNT);
    for p in Parameter::all() {
        out[(p.index(), p.index())] = sd(p.info()).powi(2);
    }
    for [_, exponent, curvature, third] in CURVES {
        out[(exponent.index(), exponent.index())] = 0.0;
        for p in [curvature, third] {
            out[(p.index(), p.index())] *= loose * loose;
        }
    }
    out
}

/// Adds a change of the curves' shape, of which normal force and strength take these shares.
fn add_shape_change(out: &mut DMatrix<f64>, shape: ShapeChange, shares: [f64; 2]) {
    for coefficients in shape.cubics() {
        let mut moved = Parameters::ZERO;
        for (curve, share) in CURVES.iter().zip(shares) {
            for (parameter, c) in curve.iter().zip(coefficients) {
                moved[*parameter] += share * c;
            }
        }
        for a in Parameter::all() {
            for b in Parameter::all() {
                out[(a.index(), b.index())] += moved[a] * moved[b];
            }
        }
    }
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
        // Logarithm of the normal force at 1.55 mm over that at 0.45 mm.
        let d = drift_covariance(Drift::Allowed, 0.46);
        let u = [(0.45f64 / MIDDLE_MM).ln(), (1.55f64 / MIDDLE_MM).ln()];
        let at = |k: usize| u[1].powi(k as i32) - u[0].powi(k as i32);
        let variance = |curve: [Parameter; 4]| -> f64 {
            let pairs = (0..4).flat_map(|a| (0..4).map(move |b| (a, b)));
            pairs.map(|(a, b)| at(a) * at(b) * d[(curve[a].index(), curve[b].index())]).sum()
        };
        let per_exponent = |curve: [Parameter; 4]| variance(curve).sqrt() / (u[1] - u[0]);
        assert!((0.015..0.025).contains(&per_exponent(CURVES[0])), "{}", per_exponent(CURVES[0]));
        assert!((0.010..0.018).contains(&per_exponent(CURVES[1])), "{}", per_exponent(CURVES[1]));
    }
}
