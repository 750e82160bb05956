//! Calibration: the smooth model's parameters, the row noise and the variances between runs, from runs without an effect.
//!
//! Main type: [`Calibration`].

use fingerpad_smooth::{Parameter, ReferenceCurves};

use crate::data::runs::RunSet;
use crate::model::active_law::ActiveLaw;
use crate::model::finger_law::FingerLaw;
use crate::model::prediction::predict_runs;
use crate::model::prior::{Drift, Prior, covariance_between_fingers, drift_covariance};
use crate::model::random_effects::PerEffect;
use crate::model::row_noise::{RowNoise, correlated_sigma_of};
use crate::model::starting_point::starting_point;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::task::Task;

/// Parameters, noise and variances of the calibration runs.
#[derive(Clone)]
pub struct Calibration {
    /// The optimum; its laws are the finger's own.
    pub fit: Fit,
    /// Gain of each of these laws in 2 log likelihood.
    pub law_gains_2ll: Vec<f64>,
    /// Row noise of normal, x, y.
    pub noise: [RowNoise; 3],
    /// By what factor the errors of many rows of a channel add up to more than those of independent rows: the finger model's error of form is
    /// alike in neighbouring rows, so that closer rows say nothing new about it. At least 1.
    pub correlation: [f64; 3],
    /// Root mean square residual within runs over the noise between neighbouring rows, of normal, x, y; 1 is a baseline
    /// that fits to the noise.
    pub misfit: [f64; 3],
    /// Number of runs.
    pub runs: usize,
    /// How much the shape of the curves has changed since.
    pub drift: Drift,
}

/// Variances between runs to start from: stiffness and strength 2 % each, touch point 10 um, offsets 2 mN.
const STARTING_VARIANCES: PerEffect = [4e-4, 4e-4, 1e-4, 4e-6, 4e-6, 4e-6];

/// Fits the parameters to effect-free runs, alternating with the noise.
///
/// * `laws`: where the finger's own laws start
pub fn calibrate(set: &RunSet, reference: &ReferenceCurves, laws: &[ActiveLaw]) -> Calibration {
    let mut noise = [RowNoise { additive_n: 0.004, multiplicative: 0.03 }; 3];
    let mut parameters = starting_point(set, reference);
    let mut variances = STARTING_VARIANCES;
    let mut laws = laws.to_vec();
    let mut fit = None;
    let (mut misfit, mut correlation) = ([1.0; 3], [1.0; 3]);
    for round in 0..3 {
        let prior = Calibration::before(reference);
        let prediction = if round == 0 {
            set.runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect()
        } else {
            predict_runs(&reference.model(&parameters), &set.runs, &laws)
        };
        let mut task =
            Task::new(&set.runs, reference, prior, correlated_sigma_of(&noise, &correlation, &prediction), variances);
        task.correlation = correlation;
        task.variances = STARTING_VARIANCES;
        task.variance_weight = 2.0;
        let start = FitStart { parameters, laws, variances, random_effects: Vec::new() };
        let (result, _) = task.fit(start, if round == 0 { 25 } else { 8 });
        parameters = result.parameters;
        laws = result.laws.clone();
        variances = result.variances;
        (noise, misfit, correlation) = row_noise(&task, &result);
        fit = Some(result);
    }
    Calibration {
        fit: fit.expect("three rounds"),
        law_gains_2ll: Vec::new(),
        noise,
        correlation,
        misfit,
        runs: set.runs.len(),
        drift: Drift::Small,
    }
}

impl Calibration {
    /// Prior of the parameters before the calibration.
    pub fn before(reference: &ReferenceCurves) -> Prior {
        Prior::new(reference.mean, &covariance_between_fingers())
    }

    /// Prior of the parameters for a set measured after the calibration: its covariance plus drift.
    pub fn prior(&self) -> Prior {
        let covariance = self.fit.covariance.view((0, 0), (Parameter::COUNT, Parameter::COUNT)).into_owned();
        let load_exponent = self.fit.parameters[Parameter::LoadExponent];
        Prior::new(self.fit.parameters, &(covariance + drift_covariance(self.drift, load_exponent)))
    }

    /// The task of a set that was measured after the calibration.
    pub fn task<'a>(&self, set: &'a RunSet, reference: &'a ReferenceCurves) -> Task<'a> {
        let known = (&self.noise, &self.correlation);
        let mut task = Task::after_calibration(set, reference, self.prior(), &self.fit, known);
        task.finger_laws = self.finger_laws();
        task
    }

    /// The calibration runs as a task, at the optimum of which is `fit`.
    pub fn own_task<'a>(&self, set: &'a RunSet, reference: &'a ReferenceCurves) -> Task<'a> {
        let mut task = self.task(set, reference);
        task.prior = Self::before(reference);
        task.finger_laws.clear();
        task
    }

    /// The laws that the calibration runs follow, as the finger has them in later files.
    fn finger_laws(&self) -> Vec<FingerLaw> {
        let mut place = Parameter::COUNT;
        let of = |active: &ActiveLaw| {
            let law = FingerLaw::new(active, &self.fit.covariance, place);
            place += active.values.len();
            law
        };
        self.fit.laws.iter().map(of).collect()
    }

    /// The same with another drift of the curves' shape.
    pub fn drifting(&self, drift: Drift) -> Self {
        Self { drift, ..self.clone() }
    }
}

/// Share of the other tangential channel's force below which a channel has no force of its own by which to estimate its noise.
const LEAST_FORCE: f64 = 0.25;

/// Squared forces and residuals of a channel, N², of all rows and of rows against their neighbours.
#[derive(Clone, Default)]
struct ChannelResiduals {
    rows: Vec<(f64, f64)>,
    neighbours: Vec<(f64, f64)>,
    /// Residuals over the row noise, run by run.
    scaled: Vec<Vec<f64>>,
}

impl ChannelResiduals {
    fn force(&self) -> f64 {
        (self.rows.iter().map(|p| p.0).sum::<f64>() / self.rows.len().max(1) as f64).sqrt()
    }

    fn and(&self, other: &Self) -> Self {
        let join = |a: &[(f64, f64)], b: &[(f64, f64)]| a.iter().chain(b).copied().collect();
        Self {
            rows: join(&self.rows, &other.rows),
            neighbours: join(&self.neighbours, &other.neighbours),
            scaled: self.scaled.iter().chain(&other.scaled).cloned().collect(),
        }
    }
}

/// Row noise from what is left after parameters and random effects, and its ratio to that between neighbouring rows.
///
/// Where the calibration slides along one axis only, nothing shows how the noise of the other tangential channel grows
/// with its force: both belong to one sensor, and the channel without force gets the noise of both.
fn row_noise(task: &Task<'_>, fit: &Fit) -> ([RowNoise; 3], [f64; 3], [f64; 3]) {
    let own = channel_residuals(task, fit);
    let shared = |channel: usize| {
        let other = 3 - channel;
        let lacks = channel > 0 && own[channel].force() < LEAST_FORCE * own[other].force();
        if lacks { own[channel].and(&own[other]) } else { own[channel].clone() }
    };
    let mut noise = [RowNoise { additive_n: 0.003, multiplicative: 0.02 }; 3];
    let (mut misfit, mut correlation) = ([1.0; 3], [1.0; 3]);
    for channel in 0..3 {
        let ChannelResiduals { rows, neighbours, scaled } = shared(channel);
        correlation[channel] = correlation_factor(&scaled);
        // The six random effects of each run consumed degrees of freedom, about two a channel.
        let count = rows.len() as f64;
        let consumed = (2.0 * task.layout.runs() as f64 + 4.0) * count / own[channel].rows.len().max(1) as f64;
        noise[channel] = RowNoise::fit(&rows, count / (count - consumed).max(0.5 * count));
        let pure = RowNoise::fit(&neighbours, 1.0);
        let mean = |n: &RowNoise| rows.iter().map(|p| n.sigma_n(p.0.sqrt()).powi(2)).sum::<f64>();
        misfit[channel] = (mean(&noise[channel]) / mean(&pure)).sqrt();
    }
    (noise, misfit, correlation)
}

/// Standard deviations from which on an autocorrelation is one.
const CORRELATED: f64 = 3.0;

/// Variance of a sum of residuals over that of independent ones: 1 and twice the autocorrelations, in pairs of lags up to the first pair
/// that is no more than chance [initial positive sequence: Geyer 1992].
///
/// * `scaled`: residuals over the row noise, run by run
fn correlation_factor(scaled: &[Vec<f64>]) -> f64 {
    let square: f64 = scaled.iter().flatten().map(|r| r * r).sum();
    let count: usize = scaled.iter().map(Vec::len).sum();
    let longest = scaled.iter().map(Vec::len).max().unwrap_or(0);
    let at = |lag: usize| {
        let product = |run: &Vec<f64>| run.iter().zip(run.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        scaled.iter().map(product).sum::<f64>() / square.max(1e-300)
    };
    let chance = CORRELATED * (2.0 / count.max(1) as f64).sqrt();
    let mut factor = 1.0;
    for pair in 0..longest / 4 {
        let both = at(2 * pair + 1) + at(2 * pair + 2);
        if both <= chance {
            break;
        }
        factor += 2.0 * both;
    }
    factor
}

fn channel_residuals(task: &Task<'_>, fit: &Fit) -> [ChannelResiduals; 3] {
    let prediction = task.predict(&fit.parameters, &fit.laws);
    let left = within_runs(task, fit);
    let mut out: [ChannelResiduals; 3] = Default::default();
    for (channel, residuals) in out.iter_mut().enumerate() {
        for run in 0..task.layout.runs() {
            let at: Vec<usize> =
                task.layout.range(run).filter(|i| i % 3 == channel && !task.readings_n[*i].is_nan()).collect();
            residuals.rows.extend(at.iter().map(|i| (prediction[*i].powi(2), left[*i].powi(2))));
            residuals.scaled.push(at.iter().map(|i| left[*i] / task.row_sigma_n(*i)).collect());
            residuals.neighbours.extend(at.windows(3).map(|w| {
                let d = left[w[1]] - 0.5 * (left[w[0]] + left[w[2]]);
                (prediction[w[1]].powi(2), d * d / 1.5)
            }));
        }
    }
    out
}

/// Residual less the run's own random effects, N.
fn within_runs(task: &Task<'_>, fit: &Fit) -> Vec<f64> {
    let prediction = task.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
    let columns = task.random_effect_columns(&fit.parameters, &fit.laws, &fit.random_effects, &prediction);
    let scaled = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
    let residual = columns.observed(scaled);
    let predicted = columns.best_predictions(&fit.variances, &residual);
    let taken_off: Vec<PerEffect> = predicted.iter().map(|u| u.map(|u| -u)).collect();
    let mut left = residual.values;
    columns.add(&taken_off, &mut left);
    left.iter().zip(&task.sigma_n).map(|(l, s)| l * s).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::sign_flips::RandomSigns;

    /// Independent signs have the factor 1; each sign repeated k times has k, as the mean of n / k independent ones shows.
    #[test]
    fn rows_that_repeat_their_neighbours_count_once() {
        let mut random = RandomSigns::new(7);
        let runs: Vec<Vec<f64>> = (0..30).map(|_| random.flip(240)).collect();
        assert_eq!(correlation_factor(&runs), 1.0);
        for k in [2, 4, 8] {
            let repeated: Vec<Vec<f64>> =
                runs.iter().map(|run| run.iter().flat_map(|sign| std::iter::repeat_n(*sign, k)).collect()).collect();
            let factor = correlation_factor(&repeated);
            assert!((factor / k as f64 - 1.0).abs() < 0.15, "{k}: {factor}");
        }
        assert_eq!(correlation_factor(&[]), 1.0);
    }
}
