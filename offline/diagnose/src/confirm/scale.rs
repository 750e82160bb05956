//! Scales by which the finite-element finger becomes another finger: stiffness and strength over depth, strength over
//! direction.
//!
//! Main types: [`FingerScale`], [`Refit`].

use fingerpad_smooth::{MIDDLE_MM, SmoothModel, U_RANGE};
use nalgebra::{DMatrix, DVector};

use crate::laws::Row;

/// Number of coefficients: three of the stiffness, three of the strength over depth, four of the strength over direction.
const COEFFICIENTS: usize = 10;
/// Standard deviations between fingers: ln stiffness over 1, u, u² with u = ln(depth / 0.9 mm), ln strength over the
/// same, strength over cos and sin of twice the direction and of the direction. Those of the reduced baseline for the
/// first six; the finite elements have a direction dependence of their own, so the rest is small.
const BETWEEN_FINGERS: [f64; COEFFICIENTS] = [1.0, 0.5, 0.2, 1.0, 0.4, 0.15, 0.03, 0.03, 0.03, 0.03];

/// Scales of stiffness and strength, 1 for the geometry as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FingerScale {
    /// Coefficients of the logarithms over depth and of the shares over direction, in the order of [`BETWEEN_FINGERS`].
    coefficients: [f64; COEFFICIENTS],
}

fn over_depth(depth_mm: f64) -> [f64; 3] {
    let u = (depth_mm.max(1e-3) / MIDDLE_MM).ln().clamp(U_RANGE[0], U_RANGE[1]);
    [1.0, u, u * u]
}

fn over_direction(row: &Row) -> [f64; 4] {
    [row.double_angle[0], row.double_angle[1], row.along[0], row.along[1]]
}

/// One row of the fit: readings, prediction of the finite elements, and the quantities from which the slopes follow.
#[derive(Clone, Copy, Debug)]
pub struct FittedRow {
    /// The row's state.
    pub row: Row,
    /// Depth with the law's offset, mm.
    pub depth_mm: f64,
    /// Readings, N.
    pub reading_n: [f64; 3],
    /// Prediction of the finite elements, N.
    pub predicted_n: [f64; 3],
    /// Standard deviation of a reading, N.
    pub sigma_n: [f64; 3],
    /// Share of the contact area that slips.
    pub slips: f64,
}

impl FingerScale {
    /// Factor on the tissue's stiffness at a depth.
    pub fn stiffness(&self, depth_mm: f64) -> f64 {
        over_depth(depth_mm).iter().zip(&self.coefficients[..3]).map(|(u, f)| u * f).sum::<f64>().exp()
    }

    /// Factor on tau_crit at a depth and in a direction of motion.
    pub fn strength(&self, depth_mm: f64, row: &Row) -> f64 {
        let deep: f64 = over_depth(depth_mm).iter().zip(&self.coefficients[3..6]).map(|(u, f)| u * f).sum();
        let turn: f64 = over_direction(row).iter().zip(&self.coefficients[6..]).map(|(u, f)| u * f).sum();
        deep.exp() * (1.0 + turn).max(0.1)
    }

    /// One Gauss–Newton step; the largest change of a coefficient over its standard deviation between fingers.
    ///
    /// Slopes are those of the exact scaling for the normal force; friction follows the strength where it slips and the
    /// stiffness where it sticks, `beta` being the exponent of the law of friction.
    pub fn improve(&mut self, rows: &[FittedRow], beta: f64) -> f64 {
        let mut hessian = DMatrix::<f64>::zeros(COEFFICIENTS, COEFFICIENTS);
        let mut gradient = DVector::<f64>::zeros(COEFFICIENTS);
        for k in 0..COEFFICIENTS {
            hessian[(k, k)] = BETWEEN_FINGERS[k].powi(-2);
            gradient[k] = -self.coefficients[k] * BETWEEN_FINGERS[k].powi(-2);
        }
        for s in rows {
            let (deep, turn) = (over_depth(s.depth_mm), over_direction(&s.row));
            for channel in (0..3).filter(|k| s.reading_n[*k].is_finite()) {
                let force = s.predicted_n[channel];
                let of_stiffness = if channel == 0 { force } else { force * (1.0 + (beta - 1.0) * s.slips) };
                let of_strength = if channel == 0 { 0.0 } else { force * s.slips };
                let mut slope = [0.0; COEFFICIENTS];
                for k in 0..3 {
                    slope[k] = of_stiffness * deep[k] / s.sigma_n[channel];
                    slope[3 + k] = of_strength * deep[k] / s.sigma_n[channel];
                }
                for k in 0..4 {
                    slope[6 + k] = of_strength * turn[k] / s.sigma_n[channel];
                }
                let left = (s.reading_n[channel] - force) / s.sigma_n[channel];
                for a in 0..COEFFICIENTS {
                    gradient[a] += slope[a] * left;
                    for b in 0..COEFFICIENTS {
                        hessian[(a, b)] += slope[a] * slope[b];
                    }
                }
            }
        }
        let Some(step) = hessian.cholesky().map(|c| c.solve(&gradient)) else { return 0.0 };
        let mut most = 0.0f64;
        for k in 0..COEFFICIENTS {
            let change = step[k].clamp(-0.7 * BETWEEN_FINGERS[k], 0.7 * BETWEEN_FINGERS[k]);
            self.coefficients[k] += change;
            most = most.max(change.abs() / BETWEEN_FINGERS[k]);
        }
        most
    }
}

/// Change between the calibrated smooth model and the refitted one of the diagnosis, carried over to the finite elements.
pub struct Refit {
    /// The calibrated model.
    pub from: SmoothModel,
    /// The refitted one.
    pub to: SmoothModel,
    /// Exponent of the law of friction.
    pub beta: f64,
}

impl Refit {
    /// Factor on the stiffness at a depth.
    pub fn stiffness(&self, depth_mm: f64) -> f64 {
        let d = depth_mm.max(1e-3);
        self.to.at_depth(d).normal_n / self.from.at_depth(d).normal_n
    }

    /// Factor on tau_crit at a depth and in a direction: strengths grow as strength stiffness^beta.
    pub fn strength(&self, depth_mm: f64, row: &Row) -> f64 {
        let d = depth_mm.max(1e-3);
        let turn = |b: &SmoothModel| 1.0 + b.direction_gain(d, row.double_angle, row.along);
        self.to.at_depth(d).strength_n / self.from.at_depth(d).strength_n * turn(&self.to)
            / turn(&self.from)
            / self.stiffness(d).powf(self.beta)
    }
}
