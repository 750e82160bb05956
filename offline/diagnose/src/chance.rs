//! Tail probabilities, and sign flips over runs.

use nalgebra::{DMatrix, DVector};
use wide::f64x8;

/// −ln of the upper tail of chi-squared with `k` degrees of freedom (Wilson–Hilferty beyond 3).
pub fn surprise(x: f64, k: usize) -> f64 {
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

/// Upper tail of the F distribution by its normal approximation (Paulson 1942).
pub fn f_tail(f: f64, n1: f64, n2: f64) -> f64 {
    if !(f > 0.0) {
        return 1.0;
    }
    let (a, b) = (2.0 / (9.0 * n1), 2.0 / (9.0 * n2));
    let w = f.cbrt();
    let z = ((1.0 - b) * w - (1.0 - a)) / (b * w * w + a).sqrt();
    if z > 0.0 {
        0.5 * ln_erfc(z / std::f64::consts::SQRT_2).exp()
    } else {
        1.0 - 0.5 * ln_erfc(-z / std::f64::consts::SQRT_2).exp()
    }
}

/// Random signs of a seed.
pub struct Signs {
    state: u64,
}

impl Signs {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03 }
    }

    /// 64 random bits (splitmix64, Steele et al. 2014).
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// One flip of all runs.
    pub fn flip(&mut self, runs: usize) -> Vec<f64> {
        let mut bits = 0;
        (0..runs)
            .map(|i| {
                if i % 64 == 0 {
                    bits = self.bits();
                }
                let sign = if bits & 1 == 1 { 1.0 } else { -1.0 };
                bits >>= 1;
                sign
            })
            .collect()
    }
}

/// Number of sign flips; the least p is one over it.
pub const FLIPS: usize = 499;

/// The score of a group of columns: one contribution per run, and the group's inverse information.
#[derive(Clone, Debug)]
pub struct Score {
    /// Contributions, `runs` times the number of columns, run by run.
    pub per_run: Vec<f64>,
    /// What no run contributes: the prior's share.
    pub fixed: Vec<f64>,
    /// Inverse information, columns times columns.
    pub inverse: DMatrix<f64>,
    /// Inverse of the contributions' own products: the yardstick that one wild run does not bend.
    pub own: DMatrix<f64>,
    /// How surprising it must be in effect-free runs to be taken off there.
    pub taken_off_from: f64,
}

/// How surprising an error of the baseline's form is in the effect-free runs before it counts as one.
const ERROR_OF_FORM: f64 = 3.0;

/// By what a sum of contributions is measured.
#[derive(Clone, Copy, PartialEq)]
enum Yardstick {
    Information,
    Own,
}

impl Score {
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.inverse.nrows()
    }

    /// A score from its contributions and information.
    pub fn new(per_run: Vec<f64>, fixed: Vec<f64>, inverse: DMatrix<f64>) -> Self {
        let k = inverse.nrows();
        let mut own = DMatrix::zeros(k, k);
        for g in per_run.chunks_exact(k) {
            for a in 0..k {
                for b in 0..k {
                    own[(a, b)] += g[a] * g[b];
                }
            }
        }
        for a in 0..k {
            own[(a, a)] = own[(a, a)] * 1.001 + 1e-12;
        }
        let own = own.cholesky().map_or_else(|| DMatrix::zeros(k, k), |c| c.inverse());
        Self { per_run, fixed, inverse, own, taken_off_from: ERROR_OF_FORM }
    }

    fn statistic(&self, by: Yardstick) -> f64 {
        let k = self.columns();
        let mut sum = [0.0; 4];
        if by == Yardstick::Information {
            sum[..k].copy_from_slice(&self.fixed);
        }
        for g in self.per_run.chunks_exact(k) {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += g;
            }
        }
        let inverse = if by == Yardstick::Information { &self.inverse } else { &self.own };
        let mut q = 0.0;
        for a in 0..k {
            for b in 0..k {
                q += sum[a] * inverse[(a, b)] * sum[b];
            }
        }
        q
    }

    /// By both yardsticks, under eight flips at once; the prior's share stays out.
    fn flipped(&self, signs: &[f64x8]) -> [f64x8; 2] {
        let k = self.columns();
        let mut sum = [f64x8::ZERO; 4];
        for (g, s) in self.per_run.chunks_exact(k).zip(signs) {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += *s * *g;
            }
        }
        [&self.inverse, &self.own].map(|inverse| {
            let mut q = f64x8::ZERO;
            for a in 0..k {
                for b in 0..k {
                    q += sum[a] * inverse[(a, b)] * sum[b];
                }
            }
            q
        })
    }

    /// Gain in 2 log likelihood of the group, linearised.
    pub fn gain(&self) -> f64 {
        self.statistic(Yardstick::Information)
    }

    /// The linear estimate and its information.
    pub fn estimate(&self) -> (DVector<f64>, &DMatrix<f64>) {
        let k = self.columns();
        let mut sum = DVector::from_column_slice(&self.fixed);
        for g in self.per_run.chunks_exact(k) {
            for a in 0..k {
                sum[a] += g[a];
            }
        }
        (&self.inverse * sum, &self.inverse)
    }

    /// The gain that is left if the group is also there in runs that have no effect.
    ///
    /// What the baseline's form gets wrong is the same in both sets. The estimate from the effect-free runs, shrunk by
    /// how far its gain g exceeds what chance gives, is taken off, and its uncertainty added.
    pub fn excess(&self, without_effect: Option<&Score>) -> f64 {
        let gain = self.gain();
        let counts = |o: &&Score| {
            o.columns() == self.columns() && o.surprise() > o.taken_off_from && o.gain() > o.columns() as f64
        };
        let Some(other) = without_effect.filter(counts) else { return gain };
        let share = 1.0 - other.columns() as f64 / other.gain();
        let ((here, here_inverse), (there, there_inverse)) = (self.estimate(), other.estimate());
        let d = here - there * share;
        (here_inverse + there_inverse * share).cholesky().map_or(gain, |c| d.dot(&c.solve(&d)).min(gain))
    }

    /// The same evidence for an estimate that is `share` of this one; `None` for no share.
    ///
    /// What is carried to runs that weigh it by a number of one sign (a drag, by speed) adds up there: it counts as soon
    /// as it exceeds what chance gives.
    pub fn carried(mut self, share: f64) -> Option<Self> {
        if share.abs() < 1e-6 {
            return None;
        }
        self.per_run.iter_mut().chain(&mut self.fixed).for_each(|g| *g /= share);
        self.inverse *= share * share;
        self.own *= share * share;
        self.taken_off_from = 0.0;
        Some(self)
    }

    /// Share of the gain that comes from the calibration's prior instead of from single runs: there the sign flips,
    /// which leave the prior alone, say little.
    pub fn prior_share(&self) -> f64 {
        let (estimate, _) = self.estimate();
        let fixed = DVector::from_column_slice(&self.fixed);
        (fixed.dot(&estimate) / self.gain().max(1e-12)).clamp(0.0, 1.0)
    }

    /// Surprise of the group.
    pub fn surprise(&self) -> f64 {
        surprise(self.gain(), self.columns())
    }
}

/// Maxima of the surprise over all groups under sign flips of the runs, by both yardsticks, sorted.
pub struct Flips {
    information: Vec<f64>,
    own: Vec<f64>,
}

impl Flips {
    /// Flips the runs of all scores together.
    pub fn of(scores: &[Score], runs: usize, seed: u64) -> Self {
        let mut signs = Signs::new(seed);
        let (mut information, mut own) = (Vec::with_capacity(FLIPS), Vec::with_capacity(FLIPS));
        for first in (0..FLIPS).step_by(8) {
            let lanes: [Vec<f64>; 8] = std::array::from_fn(|_| signs.flip(runs));
            let lanes: Vec<f64x8> = (0..runs).map(|run| f64x8::new(std::array::from_fn(|l| lanes[l][run]))).collect();
            // Surprise rises with the statistic: the tail is evaluated for the largest one of each size only.
            let mut top = [[f64x8::ZERO; 5]; 2];
            for score in scores {
                for (top, q) in top.iter_mut().zip(score.flipped(&lanes)) {
                    top[score.columns()] = top[score.columns()].max(q);
                }
            }
            for (list, top) in [&mut information, &mut own].into_iter().zip(top) {
                let tops = top.map(|t| t.to_array());
                let most = |l: usize| (1..5).map(|k| surprise(tops[k][l], k)).fold(0.0, f64::max);
                list.extend((0..(FLIPS - first).min(8)).map(most));
            }
        }
        information.sort_by(f64::total_cmp);
        own.sort_by(f64::total_cmp);
        Self { information, own }
    }

    /// Share of flips in which some group reaches this one: the smaller of both yardsticks.
    pub fn p(&self, score: &Score) -> f64 {
        let share = |list: &[f64], by| {
            let surprise = surprise(score.statistic(by), score.columns());
            (1 + list.len() - list.partition_point(|m| *m < surprise)) as f64 / (1 + list.len()) as f64
        };
        share(&self.information, Yardstick::Information).min(share(&self.own, Yardstick::Own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_chi_squared() {
        for (x, k, p) in [
            (3.841459, 1, 0.05),
            (5.991465, 2, 0.05),
            (7.814728, 3, 0.05),
            (9.487729, 4, 0.05),
            (10.827566, 1, 0.001),
            (16.266236, 3, 0.001),
        ] {
            let found = (-surprise(x, k)).exp();
            assert!((found / p - 1.0).abs() < 0.02, "{x} {k}: {found}");
        }
        assert!((f_tail(2.0, 57.0, 27.0) / 0.0264 - 1.0).abs() < 0.05, "{}", f_tail(2.0, 57.0, 27.0));
    }
}
