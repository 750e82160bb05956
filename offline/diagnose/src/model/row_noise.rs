//! Noise of single rows.
//!
//! Main type: [`RowNoise`].

/// Row noise of a channel: variance = additive² + (multiplicative × force)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowNoise {
    /// Part that does not depend on the force, N.
    pub additive_n: f64,
    /// Share of the force.
    pub multiplicative: f64,
}

/// Root mean square force below which a channel carries none, N.
const LEAST_FORCE_N: f64 = 1e-3;

impl RowNoise {
    /// Standard deviation at a force, N.
    pub fn sigma_n(&self, force_n: f64) -> f64 {
        self.additive_n.hypot(self.multiplicative * force_n)
    }

    /// Both terms from pairs of squared force and squared residual, by maximum likelihood: updates that stay positive and
    /// never lower it [Févotte & Idier 2011, with the divergence of Itakura & Saito].
    ///
    /// * `factor`: on both variances, for degrees of freedom that the residuals have lost
    pub fn fit(points: &[(f64, f64)], factor: f64) -> Self {
        let sum = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>().max(1e-300);
        let total = sum(|p| p.1);
        // Without a force the second term cannot be estimated; it then stays at the least one.
        let (force, count) = (sum(|p| p.0), points.len().max(1) as f64);
        let has_force = force > LEAST_FORCE_N.powi(2) * count;
        let (mut a, mut m) = (0.5 * total / count, if has_force { 0.5 * total / force } else { 0.0 });
        for _ in 0..200 {
            let mut s = [1e-300; 4];
            for &(x, y) in points {
                let over = (a + m * x).max(1e-12).recip();
                let z = y * over * over;
                s[0] += z;
                s[1] += over;
                s[2] += x * z;
                s[3] += x * over;
            }
            let by = [(s[0] / s[1]).sqrt(), (s[2] / s[3]).sqrt()];
            (a, m) = (a * by[0], m * by[1]);
            if by.iter().all(|b| (b - 1.0).abs() < 1e-6) {
                break;
            }
        }
        Self { additive_n: (a * factor).sqrt().max(2e-4), multiplicative: (m * factor).sqrt().max(1e-3) }
    }
}

/// Standard deviation of every observation at a prediction, N; `prediction_n` has three entries a row.
pub fn sigma_of(noise: &[RowNoise; 3], prediction_n: &[f64]) -> Vec<f64> {
    prediction_n.iter().enumerate().map(|(i, p)| noise[i % 3].sigma_n(*p)).collect()
}

/// The same for errors that are alike in neighbouring rows: as much larger as many of them together are, so that rows that lie closer do not
/// weigh more.
///
/// * `correlation`: factors on the variances of normal, x and y
pub fn correlated_sigma_of(noise: &[RowNoise; 3], correlation: &[f64; 3], prediction_n: &[f64]) -> Vec<f64> {
    let roots = correlation.map(f64::sqrt);
    sigma_of(noise, prediction_n).into_iter().enumerate().map(|(i, sigma)| sigma * roots[i % 3]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_without_force_has_the_noise_of_its_readings() {
        let points: Vec<(f64, f64)> = (0..300).map(|i| (0.0, if i % 2 == 0 { 1e-5 } else { 2e-5 })).collect();
        let found = RowNoise::fit(&points, 1.0);
        assert!(found.sigma_n(0.5) < 0.05 && found.additive_n > 2e-3 && found.additive_n < 5e-3, "{found:?}");
    }

    #[test]
    fn both_terms_of_the_row_noise_are_found() {
        for seed in 0..40u64 {
            let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mut unit = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            // Forces on a line through 0, as along a stroke, and many in air; Box & Muller 1958.
            let points: Vec<(f64, f64)> = (0..900)
                .map(|i| {
                    let force = if i % 3 == 0 { 0.0 } else { unit() };
                    let gauss = (-2.0 * (1.0 - unit()).ln()).sqrt() * (std::f64::consts::TAU * unit()).cos();
                    let sigma = RowNoise { additive_n: 0.004, multiplicative: 0.025 }.sigma_n(force);
                    (force * force, (sigma * gauss).powi(2))
                })
                .collect();
            let found = RowNoise::fit(&points, 1.0);
            assert!((found.additive_n / 0.004 - 1.0).abs() < 0.15, "seed {seed}: {found:?}");
            assert!((found.multiplicative / 0.025 - 1.0).abs() < 0.15, "seed {seed}: {found:?}");
        }
    }
}
