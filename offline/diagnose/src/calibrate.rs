//! Calibration: the baseline's freedoms, the row noise and the run-level scatter from runs without an effect.

use super::base::{FREEDOMS, LOAD_EXPONENT, Reference};
use super::fit::{Fit, Prior, Start, Task};
use super::mixed::PerRun;
use super::prior::{Drift, between, drift};
use super::runs::RunSet;

/// Row noise of a channel: variance = additive² + (multiplicative × force)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowNoise {
    /// N.
    pub additive_n: f64,
    /// Share of the force.
    pub multiplicative: f64,
}

impl RowNoise {
    /// Standard deviation at a force, N.
    pub fn sigma_n(&self, force_n: f64) -> f64 {
        self.additive_n.hypot(self.multiplicative * force_n)
    }
}

/// What the calibration runs tell.
#[derive(Clone)]
pub struct Calibration {
    /// The optimum.
    pub fit: Fit,
    /// Row noise of normal, x, y.
    pub noise: [RowNoise; 3],
    /// Root mean square of what the baseline leaves within runs, over the noise between neighbouring rows; 1 is a
    /// baseline that fits to the noise.
    pub misfit: [f64; 3],
    /// Number of runs.
    pub runs: usize,
    /// How much the shape of the curves has changed since.
    pub drift: Drift,
}

/// Row noise per observation at a prediction, N.
pub fn sigma_of(noise: &[RowNoise; 3], prediction: &[f64]) -> Vec<f64> {
    // A row's force is that of all channels: gain noise of a multi-axis sensor mixes them.
    prediction.iter().enumerate().map(|(i, p)| noise[i % 3].sigma_n(*p)).collect()
}

/// Standard deviations of the run-level scatter to start from: gains 2 %, depth zero 10 um, offsets 2 mN.
const START: PerRun = [4e-4, 4e-4, 1e-4, 4e-6, 4e-6, 4e-6];

/// Fits the freedoms to effect-free runs, alternating with the noise.
pub fn calibrate(set: &RunSet, reference: &Reference) -> Calibration {
    let mut noise = [RowNoise { additive_n: 0.004, multiplicative: 0.03 }; 3];
    let mut theta = super::guess::guess(set, reference);
    let mut variances = START;
    let mut fit = None;
    let mut misfit = [1.0; 3];
    for round in 0..3 {
        let prior = Calibration::before(reference);
        let prediction = if round == 0 {
            set.runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect()
        } else {
            let base = reference.with(&theta);
            super::walk::walk_all(&base, &[], &Vec::new(), super::walk::Nudge::default(), &set.runs)
        };
        let mut task = Task::new(&set.runs, reference, prior, sigma_of(&noise, &prediction), variances);
        task.variances = START;
        task.variance_weight = 2.0;
        let start = Start { theta: theta.clone(), laws: Vec::new(), variances, modes: Vec::new() };
        let result = task.fit(start, None, true, if round == 0 { 25 } else { 8 });
        theta = result.theta.clone();
        variances = result.variances;
        (noise, misfit) = row_noise(&task, &result);
        fit = Some(result);
    }
    Calibration { fit: fit.expect("three rounds"), noise, misfit, runs: set.runs.len(), drift: Drift::Small }
}

impl Calibration {
    /// What is known of the freedoms before the calibration.
    pub fn before(reference: &Reference) -> Prior {
        Prior::new(reference.mean.to_vec(), &between())
    }

    /// What the calibration says of the freedoms of the measured set: its covariance plus drift.
    pub fn prior(&self) -> Prior {
        let covariance = self.fit.covariance.view((0, 0), (FREEDOMS, FREEDOMS)).into_owned();
        let load_exponent = self.fit.theta[LOAD_EXPONENT];
        Prior::new(self.fit.theta.clone(), &(covariance + drift(self.drift, load_exponent)))
    }

    /// The same with another drift of the curves' shape.
    pub fn drifting(&self, drift: Drift) -> Self {
        Self { drift, ..self.clone() }
    }
}

/// Row noise from what is left after freedoms and random effects, and its ratio to that between neighbouring rows.
fn row_noise(task: &Task<'_>, fit: &Fit) -> ([RowNoise; 3], [f64; 3]) {
    let prediction = task.predict(&fit.theta, &fit.laws);
    let left = within_runs(task, fit);
    let mut noise = [RowNoise { additive_n: 0.003, multiplicative: 0.02 }; 3];
    let mut misfit = [1.0; 3];
    for channel in 0..3 {
        let (mut points, mut neighbours) = (Vec::new(), Vec::new());
        for run in 0..task.layout.runs() {
            let range = task.layout.range(run);
            let at: Vec<usize> = range.filter(|i| i % 3 == channel).collect();
            for &i in &at {
                points.push((prediction[i].powi(2), left[i].powi(2)));
            }
            for w in at.windows(3) {
                let d = left[w[1]] - 0.5 * (left[w[0]] + left[w[2]]);
                neighbours.push((prediction[w[1]].powi(2), d * d / 1.5));
            }
        }
        // Six random effects of each run took their share of its rows.
        let rows = points.len() as f64;
        let lost = 2.0 * task.layout.runs() as f64 + 4.0;
        noise[channel] = two_terms(&points, rows / (rows - lost).max(0.5 * rows));
        let pure = two_terms(&neighbours, 1.0);
        let mean = |n: &RowNoise| points.iter().map(|p| n.sigma_n(p.0.sqrt()).powi(2)).sum::<f64>();
        misfit[channel] = (mean(&noise[channel]) / mean(&pure)).sqrt();
    }
    (noise, misfit)
}

/// Residual less the run's own random effects, N.
fn within_runs(task: &Task<'_>, fit: &Fit) -> Vec<f64> {
    let prediction = task.predict_at(&fit.theta, &fit.laws, &fit.modes);
    let scatter = task.run_columns(&fit.theta, &fit.laws, &fit.modes, &prediction);
    let scaled = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
    let residual = scatter.seen(scaled);
    let draws = scatter.draws(&fit.variances, &residual).iter().map(|u| u.map(|u| -u)).collect::<Vec<_>>();
    let mut left = residual.values;
    scatter.add(&draws, &mut left);
    left.iter().zip(&task.sigma_n).map(|(l, s)| l * s).collect()
}

/// Variance = a² + m² x of (x, squared residual), both >= 0, by maximum likelihood: updates that stay positive and never
/// lower it [Févotte & Idier 2011, with the divergence of Itakura & Saito].
fn two_terms(points: &[(f64, f64)], factor: f64) -> RowNoise {
    let sum = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>().max(1e-300);
    let total = sum(|p| p.1);
    let (mut a, mut m) = (0.5 * total / points.len().max(1) as f64, 0.5 * total / sum(|p| p.0));
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
    RowNoise { additive_n: (a * factor).sqrt().max(2e-4), multiplicative: (m * factor).sqrt().max(1e-3) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Signs;

    #[test]
    fn both_terms_of_the_row_noise_are_found() {
        for seed in 0..40 {
            let mut bits = Signs::new(seed);
            let mut unit = || (bits.bits() >> 11) as f64 / (1u64 << 53) as f64;
            // Forces on a line through 0, as along a stroke, and many in air; Box & Muller 1958.
            let points: Vec<(f64, f64)> = (0..900)
                .map(|i| {
                    let force = if i % 3 == 0 { 0.0 } else { unit() };
                    let gauss = (-2.0 * (1.0 - unit()).ln()).sqrt() * (std::f64::consts::TAU * unit()).cos();
                    let sigma = RowNoise { additive_n: 0.004, multiplicative: 0.025 }.sigma_n(force);
                    (force * force, (sigma * gauss).powi(2))
                })
                .collect();
            let found = two_terms(&points, 1.0);
            assert!((found.additive_n / 0.004 - 1.0).abs() < 0.15, "seed {seed}: {found:?}");
            assert!((found.multiplicative / 0.025 - 1.0).abs() < 0.15, "seed {seed}: {found:?}");
        }
    }
}
