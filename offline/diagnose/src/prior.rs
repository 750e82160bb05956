//! What is known of the freedoms: before the calibration, and of what changes between it and the measured set.
//!
//! A curve over depth differs between fingers, and drifts within one, by a scale, an exponent and something smooth over
//! depth. A polynomial over ln depth with independent coefficients would also move as 1/depth near touch, where an error
//! of the touch point and a pull-off show, and would hide them.

use nalgebra::DMatrix;

use super::base::{FREEDOM, FREEDOMS, MIDDLE_MM, U, cubic};

/// Freedoms that are the cubics of a curve over u: normal force, strength.
const CURVES: [[usize; 4]; 2] = [[0, 1, 2, 3], [4, 5, 6, 24]];

/// How far a curve's shape may move.
#[derive(Clone, Copy)]
struct Shape {
    /// Exponent.
    exponent: f64,
    /// Slope of the logarithm over depth, 1/mm.
    slope_per_mm: f64,
    /// Half its curvature, 1/mm².
    curvature_per_mm2: f64,
}

impl Shape {
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

    /// The moves as cubics over u, each times its size.
    fn cubics(self) -> [[f64; 4]; 3] {
        let over_depth = |power: i32, size: f64| {
            let points: Vec<(f64, f64)> = (0..=22)
                .map(|i| U[0] + 0.1 * f64::from(i))
                .map(|u| (u, (MIDDLE_MM * u.exp() - MIDDLE_MM).powi(power)))
                .collect();
            cubic(&points).map(|c| c * size)
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

/// Covariance of what changes between the calibration and the measured set of one finger.
///
/// `load_exponent`: beta of the strength in the load at a fixed contact. What changes the tissue's stiffness over depth
/// changes the strength by beta of that [F ~ N^beta A^(1 - beta), the local law integrated over the contact]; the rest of
/// the strength's drift is the contact's, (1 - beta) of the same size.
pub fn drift(size: Drift, load_exponent: f64) -> DMatrix<f64> {
    let factor = if size == Drift::Small { SMALL } else { 1.0 };
    let beta = load_exponent.clamp(0.0, 1.0);
    let tissue = Shape::even(ALLOWED * factor);
    let mut out = own(|k| FREEDOM[k].drift, LOOSE * factor);
    spread(&mut out, tissue, [1.0, beta]);
    spread(&mut out, tissue.times(1.0 - beta), [0.0, 1.0]);
    out
}

/// Covariance of the freedoms between fingers and devices.
///
/// The two fingers of other shapes that the finite elements were asked for (B and D, against the shipped E) are fitted as
/// well as with curvatures and cubics of their own that are ten times as free.
pub fn between() -> DMatrix<f64> {
    let mut out = own(|k| FREEDOM[k].between, 0.05);
    for (curve, factors) in CURVES.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
        let size = FREEDOM[curve[1]].between;
        spread(&mut out, Shape { exponent: size, slope_per_mm: size, curvature_per_mm2: 0.1 * size }, factors);
    }
    out
}

/// Independent freedoms; the curves' exponents have none of their own, their curvatures and cubics a share.
fn own(sd: impl Fn(usize) -> f64, loose: f64) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(FREEDOMS, FREEDOMS);
    for k in 0..FREEDOMS {
        out[(k, k)] = sd(k).powi(2);
    }
    for [_, exponent, curvature, third] in CURVES {
        out[(exponent, exponent)] = 0.0;
        for k in [curvature, third] {
            out[(k, k)] *= loose * loose;
        }
    }
    out
}

/// Adds a move of the curves' shape, of which normal force and strength take these shares.
fn spread(out: &mut DMatrix<f64>, shape: Shape, shares: [f64; 2]) {
    for moved in shape.cubics() {
        let mut v = [0.0; FREEDOMS];
        for (curve, share) in CURVES.iter().zip(shares) {
            for (place, c) in curve.iter().zip(moved) {
                v[*place] += share * c;
            }
        }
        for i in 0..FREEDOMS {
            for j in 0..FREEDOMS {
                out[(i, j)] += v[i] * v[j];
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
            assert!(drift(size, 0.46).cholesky().is_some());
        }
        assert!(between().cholesky().is_some());
        // Logarithm of the normal force at 1.55 mm over that at 0.45 mm.
        let d = drift(Drift::Allowed, 0.46);
        let u = [(0.45f64 / MIDDLE_MM).ln(), (1.55f64 / MIDDLE_MM).ln()];
        let at = |k: usize| u[1].powi(k as i32) - u[0].powi(k as i32);
        let variance = |curve: [usize; 4]| -> f64 {
            (0..4).flat_map(|a| (0..4).map(move |b| (a, b))).map(|(a, b)| at(a) * at(b) * d[(curve[a], curve[b])]).sum()
        };
        let per_exponent = |curve: [usize; 4]| variance(curve).sqrt() / (u[1] - u[0]);
        assert!((0.015..0.025).contains(&per_exponent(CURVES[0])), "{}", per_exponent(CURVES[0]));
        assert!((0.010..0.018).contains(&per_exponent(CURVES[1])), "{}", per_exponent(CURVES[1]));
    }
}
