//! Tail probabilities of chi-squared and F, and the least evidence that is not left to chance alone.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Least gain in 2 log likelihood of what is named by what differs from run to run, or counts as structure: six standard
/// deviations. The p of a test allows for chance, not for an error of the baseline's form or a scatter of the runs that happens to lie
/// along a driver.
pub const LEAST_GAIN: f64 = 36.0;

/// −ln of the upper tail of chi-squared with `k` degrees of freedom (Wilson–Hilferty beyond 3).
pub fn minus_ln_p(x: f64, k: usize) -> f64 {
    if !(x > 0.0) {
        return 0.0;
    }
    match k {
        1 => -ln_erfc((0.5 * x).sqrt()),
        2 => 0.5 * x,
        3 => {
            -(ln_erfc((0.5 * x).sqrt())
                + ((2.0 * x / std::f64::consts::PI).sqrt() * (-0.5 * x - ln_erfc((0.5 * x).sqrt())).exp()).ln_1p())
        }
        _ => {
            let k = k as f64;
            let z = ((x / k).cbrt() - 1.0 + 2.0 / (9.0 * k)) / (2.0 / (9.0 * k)).sqrt();
            if z > 0.0 {
                std::f64::consts::LN_2 - ln_erfc(z / std::f64::consts::SQRT_2)
            } else {
                0.5 * (1.0 - z / 2.0).max(0.0)
            }
        }
    }
}

/// ln erfc(x) for x >= 0, relative error of erfc below 2e-7 (Numerical Recipes' rational form by Chebyshev).
fn ln_erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.5 * x);
    let c = [
        -1.26551223,
        1.00002368,
        0.37409196,
        0.09678418,
        -0.18628806,
        0.27886807,
        -1.13520398,
        1.48851587,
        -0.82215223,
        0.17087277,
    ];
    let poly = c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    t.ln() - x * x + poly
}

/// Upper tail of the F distribution with n1 and n2 degrees of freedom, both > 0.
pub fn f_tail(f: f64, n1: f64, n2: f64) -> f64 {
    if !(f > 0.0) {
        return 1.0;
    }
    FisherSnedecor::new(n1, n2).map_or(1.0, |distribution| distribution.sf(f))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_with_tables() {
        for (x, k, p) in [
            (3.841459, 1, 0.05),
            (5.991465, 2, 0.05),
            (7.814728, 3, 0.05),
            (9.487729, 4, 0.05),
            (10.827566, 1, 0.001),
            (16.266236, 3, 0.001),
        ] {
            let found = (-minus_ln_p(x, k)).exp();
            assert!((found / p - 1.0).abs() < 0.02, "{x} {k}: {found}");
        }
        // Tables of the F distribution: 4.35124 and 3.49283 leave 5 % at (1, 20) and (2, 20) degrees of freedom.
        assert!((f_tail(4.35124, 1.0, 20.0) - 0.05).abs() < 1e-5, "{}", f_tail(4.35124, 1.0, 20.0));
        assert!((f_tail(3.49283, 2.0, 20.0) - 0.05).abs() < 1e-5, "{}", f_tail(3.49283, 2.0, 20.0));
    }
}
