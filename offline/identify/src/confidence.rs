//! Confidence of fitted constants: linearised standard errors and correlations, profile likelihood, region.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::{
    IdentifyError, LawPoint,
    bounded_least_squares::Stop,
    friction_fit::{Target, fit},
    surrogate::FrictionModel,
};

/// Growth of the sum of squares above its least value that a confidence region allows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// For one constant (interval), the others at their best.
    pub one: f64,
    /// For two constants together (region).
    pub two: f64,
    /// Variance of the weighted residuals.
    pub variance: f64,
}

impl Growth {
    /// Growth from the least sum of squares of `rows` residuals and `constants`; none without degrees of freedom unless
    /// the errors are known.
    pub fn of(least: f64, rows: usize, constants: usize, known: bool, confidence: f64) -> Option<Self> {
        if known {
            let chi = |n: f64| ChiSquared::new(n).expect("a positive number").inverse_cdf(confidence);
            return Some(Self { one: chi(1.0), two: chi(2.0), variance: 1.0 });
        }
        let freedom = rows.checked_sub(constants).filter(|&f| f > 0)? as f64;
        let variance = least / freedom;
        let f = |n: f64| n * FisherSnedecor::new(n, freedom).expect("positive numbers").inverse_cdf(confidence);
        Some(Self { one: variance * f(1.0), two: variance * f(2.0), variance })
    }
}

/// Standard errors and correlations of a linearised fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Linear {
    /// Standard error of every variable; infinite along a flat direction.
    pub standard_errors: Vec<f64>,
    /// Correlation, shape (variables, variables).
    pub correlation: Vec<Vec<f64>>,
    /// Smallest over largest singular value of the Jacobian, columns scaled to their errors' order.
    pub conditioning: f64,
}

/// Linearised errors from the columns of a Jacobian of weighted residuals.
pub fn linear(jacobian: &[Vec<f64>], variance: f64) -> Linear {
    let (n, m) = (jacobian.len(), jacobian.first().map_or(0, Vec::len));
    let norms: Vec<f64> = jacobian.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    let scaled = DMatrix::from_fn(m, n, |i, k| if norms[k] > 0.0 { jacobian[k][i] / norms[k] } else { 0.0 });
    let svd = scaled.svd(false, true);
    let largest = svd.singular_values.max();
    let conditioning = if m < n { 0.0 } else { svd.singular_values.min() / largest };
    let rows = svd.v_t.expect("requested");
    // Flat directions enter the correlation as nearly infinite; errors are those along the others.
    let mut covariance = DMatrix::zeros(n, n);
    let mut variances = vec![0.0f64; n];
    let mut is_flat = vec![m < n; n];
    for (k, &s) in svd.singular_values.iter().enumerate() {
        let v = rows.row(k);
        covariance += v.transpose() * v / (s * s).max(1e-24 * largest * largest);
        for i in 0..n {
            if s < 1e-10 * largest {
                // A variable that the flat direction does not touch keeps its error.
                is_flat[i] |= v[i].abs() > 1e-6;
            } else {
                variances[i] += v[i] * v[i] / (s * s);
            }
        }
    }
    let error = |k: usize| {
        if norms[k] > 0.0 && !is_flat[k] { (variance * variances[k]).sqrt() / norms[k] } else { f64::INFINITY }
    };
    let correlation = (0..n)
        .map(|i| (0..n).map(|j| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()).collect())
        .collect();
    Linear { standard_errors: (0..n).map(error).collect(), correlation, conditioning }
}

/// A constant's interval by profile likelihood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end; the search region's bound if the table does not bound it.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Whether the table bounds it from below and above inside the search region.
    pub bounded: [bool; 2],
}

impl Interval {
    /// Whether the table leaves the constant undetermined: neither side is bounded.
    pub fn is_flat(&self) -> bool {
        self.bounded == [false, false]
    }
}

/// Profile-likelihood interval of coordinate `k` around a fit, and the coordinates at its ends.
///
/// # Errors
/// [`IdentifyError`] of a fit with the coordinate pinned.
pub fn profile(
    friction: &mut dyn FrictionModel,
    target: &Target,
    best: &LawPoint,
    k: usize,
    step: f64,
    growth: f64,
) -> Result<(Interval, [LawPoint; 2]), IdentifyError> {
    let x = best.coordinates(target.free_tau0);
    let [low, high] = target.bounds()[k];
    let least = target.sum_of_squares(&friction.coefficients(best)?);
    let mut ends = [0.0; 2];
    let mut bounded = [true; 2];
    let mut laws = [*best; 2];
    for (side, bound) in [low, high].into_iter().enumerate() {
        let direction = if side == 0 { -1.0 } else { 1.0 };
        let mut from = *best;
        let mut excess = |value: f64, from: &LawPoint| -> Result<(f64, LawPoint), IdentifyError> {
            let mut pinned = vec![None; x.len()];
            pinned[k] = Some(value);
            let stop = Stop { tolerance: 1e-9, evaluations: 120 };
            let (law, solution) = fit("profile", friction, target, from, &pinned, stop)?;
            Ok((solution.residuals.iter().map(|r| r * r).sum::<f64>() - least - growth, law))
        };
        let mut inside = x[k];
        let mut stride = step.min(0.25 * (high - low)).max(1e-6);
        let outside = loop {
            let value = (inside + direction * stride).clamp(low, high);
            let (over, law) = excess(value, &from)?;
            if over > 0.0 {
                break Some(value);
            }
            (inside, from) = (value, law);
            if value == bound {
                break None;
            }
            stride *= 1.5;
        };
        match outside {
            None => (ends[side], bounded[side], laws[side]) = (bound, false, from),
            Some(mut outside) => {
                for _ in 0..30 {
                    let middle = 0.5 * (inside + outside);
                    let (over, law) = excess(middle, &from)?;
                    if over > 0.0 {
                        outside = middle;
                    } else {
                        (inside, from) = (middle, law);
                    }
                }
                (ends[side], laws[side]) = (inside, from);
            }
        }
    }
    Ok((Interval { low: ends[0], high: ends[1], bounded }, laws))
}

/// The likelihood over strength and exponent, other constants at their best.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// Strength at 5 kPa, kPa, rising.
    pub tau_ref_kpa: Vec<f64>,
    /// Exponent, rising.
    pub beta: Vec<f64>,
    /// Growth of the sum of squares over the region's bound, shape (beta, tau_ref): the region is where <= 1.
    pub growth: Vec<Vec<f64>>,
}

/// Evaluates the likelihood on a grid over `tau_ref_kpa` and `beta` (first and last values).
///
/// # Errors
/// [`IdentifyError`] of a fit.
pub fn map(
    friction: &mut dyn FrictionModel,
    target: &Target,
    best: &LawPoint,
    growth: f64,
    tau_ref_kpa: [f64; 2],
    beta: [f64; 2],
    count: usize,
) -> Result<Map, IdentifyError> {
    let along =
        |[a, b]: [f64; 2]| -> Vec<f64> { (0..count).map(|i| a + (b - a) * i as f64 / (count - 1) as f64).collect() };
    let (taus, betas) = (along(tau_ref_kpa), along(beta));
    let least = target.sum_of_squares(&friction.coefficients(best)?);
    let mut rows = Vec::new();
    for &b in &betas {
        let mut row = Vec::new();
        let mut from = *best;
        for &tau in &taus {
            let pinned = [Some(tau.ln()), Some(b), None];
            let stop = Stop { tolerance: 1e-6, evaluations: 40 };
            let (law, solution) = fit("map", friction, target, &from, &pinned, stop)?;
            from = law;
            row.push((solution.residuals.iter().map(|r| r * r).sum::<f64>() - least) / growth);
        }
        rows.push(row);
    }
    Ok(Map { tau_ref_kpa: taus, beta: betas, growth: rows })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_that_of_the_tables() {
        let known = Growth::of(1.0, 4, 2, true, 0.95).unwrap();
        assert!((known.one - 3.8415).abs() < 1e-3 && (known.two - 5.9915).abs() < 1e-3);
        // F(2, 2) at 95 % is 19, F(1, 2) is 18.513.
        let estimated = Growth::of(0.5, 4, 2, false, 0.95).unwrap();
        assert!((estimated.two - 0.25 * 38.0).abs() < 1e-2 && (estimated.one - 0.25 * 18.513).abs() < 1e-2);
        assert_eq!(Growth::of(0.0, 2, 2, false, 0.95), None);
    }

    #[test]
    fn linear_errors_of_a_straight_line() {
        // y = a + b t at t = 0, 1, 2, 3: var(b) = s²/5, var(a) = 0.7 s², correlation -3/sqrt(14).
        let fit = linear(&[vec![1.0; 4], vec![0.0, 1.0, 2.0, 3.0]], 0.04);
        assert!((fit.standard_errors[0] - (0.7f64 * 0.04).sqrt()).abs() < 1e-12);
        assert!((fit.standard_errors[1] - (0.04f64 / 5.0).sqrt()).abs() < 1e-12);
        assert!((fit.correlation[0][1] + 3.0 / 14f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_flat_direction_has_no_error_and_the_others_keep_theirs() {
        let fit = linear(&[vec![1.0, 1.0, 1.0], vec![2.0, 2.0, 2.0], vec![1.0, 0.0, -1.0]], 1.0);
        assert!(fit.standard_errors[0].is_infinite() && fit.standard_errors[1].is_infinite(), "{fit:?}");
        assert!((fit.standard_errors[2] - 0.5f64.sqrt()).abs() < 1e-9, "{fit:?}");
        let fit = linear(&[vec![1.0, 2.0], vec![0.0, 0.0]], 1.0);
        assert!(fit.standard_errors[1].is_infinite() && fit.standard_errors[0].is_finite());
    }
}
