//! Scores of groups of columns, and their test by sign flips over runs.
//!
//! Without an effect a run's contribution to a score is as likely positive as negative, whatever its distribution; flipping
//! the signs of whole runs gives the score's distribution under that hypothesis [Fisher 1935; Winkler et al. 2014].
//!
//! Main types: [`Score`], [`SignFlips`].

use nalgebra::{DMatrix, DVector};
use wide::f64x8;

use crate::statistics::tails::minus_ln_p;

/// Random signs of a seed.
pub struct RandomSigns {
    state: u64,
}

impl RandomSigns {
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
    /// Contribution of the calibration's prior, which belongs to no run.
    pub from_prior: Vec<f64>,
    /// Inverse information, columns times columns.
    pub inverse: DMatrix<f64>,
    /// Inverse of the sum of the contributions' outer products: by it one outlying run does not decide.
    pub empirical: DMatrix<f64>,
    /// −ln p from which on this score, where it is that of effect-free runs, is taken off as an error of the baseline's
    /// form.
    pub taken_off_from: f64,
}

/// −ln p that an error of the baseline's form must reach in the effect-free runs before it counts as one.
const ERROR_OF_FORM: f64 = 3.0;

/// The matrix by which a squared sum of contributions is normalised: the model's information, or the contributions' own
/// spread.
#[derive(Clone, Copy, PartialEq)]
enum Normaliser {
    Information,
    Empirical,
}

impl Score {
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.inverse.nrows()
    }

    /// A score from its contributions and information.
    pub fn new(per_run: Vec<f64>, from_prior: Vec<f64>, inverse: DMatrix<f64>) -> Self {
        let k = inverse.nrows();
        let mut empirical = DMatrix::zeros(k, k);
        for g in per_run.chunks_exact(k) {
            for a in 0..k {
                for b in 0..k {
                    empirical[(a, b)] += g[a] * g[b];
                }
            }
        }
        for a in 0..k {
            empirical[(a, a)] = empirical[(a, a)] * 1.001 + 1e-12;
        }
        let empirical = empirical.cholesky().map_or_else(|| DMatrix::zeros(k, k), |c| c.inverse());
        Self { per_run, from_prior, inverse, empirical, taken_off_from: ERROR_OF_FORM }
    }

    fn statistic(&self, by: Normaliser) -> f64 {
        let k = self.columns();
        let mut sum = [0.0; 4];
        if by == Normaliser::Information {
            sum[..k].copy_from_slice(&self.from_prior);
        }
        for g in self.per_run.chunks_exact(k) {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += g;
            }
        }
        let inverse = if by == Normaliser::Information { &self.inverse } else { &self.empirical };
        let mut q = 0.0;
        for a in 0..k {
            for b in 0..k {
                q += sum[a] * inverse[(a, b)] * sum[b];
            }
        }
        q
    }

    /// Both normalised statistics under eight flips at once; the prior's contribution stays out.
    fn flipped(&self, signs: &[f64x8]) -> [f64x8; 2] {
        let k = self.columns();
        let mut sum = [f64x8::ZERO; 4];
        for (g, s) in self.per_run.chunks_exact(k).zip(signs) {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += *s * *g;
            }
        }
        [&self.inverse, &self.empirical].map(|inverse| {
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
        self.statistic(Normaliser::Information)
    }

    /// The linear estimate and its information.
    pub fn estimate(&self) -> (DVector<f64>, &DMatrix<f64>) {
        let k = self.columns();
        let mut sum = DVector::from_column_slice(&self.from_prior);
        for g in self.per_run.chunks_exact(k) {
            for a in 0..k {
                sum[a] += g[a];
            }
        }
        (&self.inverse * sum, &self.inverse)
    }

    /// The gain that is left if the group is also there in runs that have no effect.
    ///
    /// An error of the baseline's form is the same in both sets. The estimate from the effect-free runs, shrunk by
    /// how far its gain g exceeds what chance gives, is taken off, and its uncertainty added.
    pub fn excess(&self, without_effect: Option<&Score>) -> f64 {
        let gain = self.gain();
        let counts = |o: &&Score| {
            o.columns() == self.columns() && o.minus_ln_p() > o.taken_off_from && o.gain() > o.columns() as f64
        };
        let Some(other) = without_effect.filter(counts) else { return gain };
        let share = 1.0 - other.columns() as f64 / other.gain();
        let ((here, here_inverse), (there, there_inverse)) = (self.estimate(), other.estimate());
        let d = here - there * share;
        (here_inverse + there_inverse * share).cholesky().map_or(gain, |c| d.dot(&c.solve(&d)).min(gain))
    }

    /// The same evidence for an estimate that is `share` of this one; `None` for no share.
    ///
    /// An error of form that is carried over to runs which weigh it by a number of one sign (a drag, by speed) adds up
    /// there: it counts as soon as it exceeds what chance gives.
    pub fn transferred(mut self, share: f64) -> Option<Self> {
        if share.abs() < 1e-6 {
            return None;
        }
        self.per_run.iter_mut().chain(&mut self.from_prior).for_each(|g| *g /= share);
        self.inverse *= share * share;
        self.empirical *= share * share;
        self.taken_off_from = 0.0;
        Some(self)
    }

    /// Share of the gain that comes from the calibration's prior instead of from single runs: there the sign flips,
    /// which leave the prior alone, say little.
    pub fn prior_share(&self) -> f64 {
        let (estimate, _) = self.estimate();
        let from_prior = DVector::from_column_slice(&self.from_prior);
        (from_prior.dot(&estimate) / self.gain().max(1e-12)).clamp(0.0, 1.0)
    }

    /// −ln p of the group's gain by chi-squared.
    pub fn minus_ln_p(&self) -> f64 {
        minus_ln_p(self.gain(), self.columns())
    }
}

/// Largest −ln p over all groups under each sign flip of the runs, by both normalisations, sorted.
pub struct SignFlips {
    information: Vec<f64>,
    empirical: Vec<f64>,
}

impl SignFlips {
    /// Flips the signs of the runs in all scores together.
    pub fn of(scores: &[Score], runs: usize, seed: u64) -> Self {
        let mut signs = RandomSigns::new(seed);
        let (mut information, mut empirical) = (Vec::with_capacity(FLIPS), Vec::with_capacity(FLIPS));
        for first in (0..FLIPS).step_by(8) {
            let lanes: [Vec<f64>; 8] = std::array::from_fn(|_| signs.flip(runs));
            let lanes: Vec<f64x8> = (0..runs).map(|run| f64x8::new(std::array::from_fn(|l| lanes[l][run]))).collect();
            // −ln p rises with the statistic: the tail is evaluated for the largest one of each size only.
            let mut top = [[f64x8::ZERO; 5]; 2];
            for score in scores {
                for (top, q) in top.iter_mut().zip(score.flipped(&lanes)) {
                    top[score.columns()] = top[score.columns()].max(q);
                }
            }
            for (list, top) in [&mut information, &mut empirical].into_iter().zip(top) {
                let tops = top.map(|t| t.to_array());
                let most = |l: usize| (1..5).map(|k| minus_ln_p(tops[k][l], k)).fold(0.0, f64::max);
                list.extend((0..(FLIPS - first).min(8)).map(most));
            }
        }
        information.sort_by(f64::total_cmp);
        empirical.sort_by(f64::total_cmp);
        Self { information, empirical }
    }

    /// Share of flips in which some group reaches this one's −ln p: the smaller by both normalisations.
    pub fn p(&self, score: &Score) -> f64 {
        let share = |list: &[f64], by| {
            let minus_ln_p = minus_ln_p(score.statistic(by), score.columns());
            (1 + list.len() - list.partition_point(|m| *m < minus_ln_p)) as f64 / (1 + list.len()) as f64
        };
        share(&self.information, Normaliser::Information).min(share(&self.empirical, Normaliser::Empirical))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The flip that changes no sign gives the statistics themselves, and one that changes all of them does too.
    #[test]
    fn a_flip_of_all_signs_changes_no_statistic() {
        let inverse = DMatrix::from_row_slice(2, 2, &[2.0, -0.3, -0.3, 0.7]);
        let score = Score::new(vec![0.5, -1.0, 2.0, 0.1, -0.3, 0.8], vec![0.0; 2], inverse);
        let signs = |first: f64| [f64x8::from([first; 8]), f64x8::from([first; 8]), f64x8::from([first; 8])];
        let by = [Normaliser::Information, Normaliser::Empirical].map(|by| score.statistic(by));
        for sign in [1.0, -1.0] {
            for (flipped, whole) in score.flipped(&signs(sign)).into_iter().zip(by) {
                assert!(flipped.to_array().iter().all(|q| (q - whole).abs() < 1e-12 * whole), "{flipped:?} {whole}");
            }
        }
        let mut one = signs(1.0);
        one[1] = -one[1];
        assert!((score.flipped(&one)[0].to_array()[0] - by[0]).abs() > 1e-3);
    }
}
