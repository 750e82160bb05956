//! A task of inference: runs, the smooth model's reference curves, and the priors of its parameters and variances.
//!
//! Main type: [`Task`].

use fingerpad_smooth::{Parameters, ReferenceCurves, SimulationInputs, Trajectories};

use crate::data::runs::{Run, RunSet};
use crate::model::active_law::{ActiveLaw, weak_prior};
use crate::model::finger_law::FingerLaw;
use crate::model::prediction::{KnownChanges, Perturbation, changes, predict_runs, strokes_of};
use crate::model::prior::Prior;
use crate::model::random_effects::{PerEffect, RandomEffects};
use crate::model::row_noise::{RowNoise, correlated_sigma_of};
use crate::statistics::fit::Fit;
use crate::statistics::random_effects::Layout;

/// Standard deviation of a reading that is left out, N: so large that it weighs nothing.
pub const NO_READING_N: f64 = 1e12;

/// Runs that the prior on the variances between runs weighs, where they were seen in a calibration.
const CALIBRATION_WEIGHT: f64 = 4.0;

/// A set of runs to be fitted.
pub struct Task<'a> {
    /// The runs.
    pub runs: &'a [Run],
    /// Curves of the model file from which the parameters count.
    pub reference: &'a ReferenceCurves,
    /// Prior of the smooth model's parameters.
    pub prior: Prior,
    /// The finger's own laws, the first ones in every fit.
    pub finger_laws: Vec<FingerLaw>,
    /// Standard deviation of the row noise of every observation, N, with the factors for errors that are alike in neighbouring rows;
    /// `NO_READING_N` where a reading is left out.
    pub sigma_n: Vec<f64>,
    /// Those factors on the variances of normal, x, y.
    pub correlation: [f64; 3],
    /// Prior of the variances between runs.
    pub variances: PerEffect,
    /// How many runs that prior weighs.
    pub variance_weight: f64,
    /// Degrees of freedom that the parameters take from the runs.
    pub consumed_degrees_of_freedom: f64,
    /// Which observations belong to which run.
    pub layout: Layout,
    /// Readings, three per row, N; NaN where one is left out.
    pub readings_n: Vec<f64>,
    trajectories: Trajectories,
    known_changes: KnownChanges,
}

impl<'a> Task<'a> {
    /// A task with known row noise, N, per observation, and no weight on the variances' prior.
    pub fn new(
        runs: &'a [Run],
        reference: &'a ReferenceCurves,
        prior: Prior,
        sigma_n: Vec<f64>,
        variances: PerEffect,
    ) -> Self {
        let readings_n: Vec<f64> = runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect();
        let known = |(sigma, reading): (f64, &f64)| if reading.is_nan() { NO_READING_N } else { sigma };
        let sigma_n = sigma_n.into_iter().zip(&readings_n).map(known).collect();
        Self {
            runs,
            reference,
            prior,
            finger_laws: Vec::new(),
            sigma_n,
            correlation: [1.0; 3],
            variances,
            variance_weight: 0.0,
            consumed_degrees_of_freedom: 3.0,
            layout: Layout::of(runs.iter().map(|r| r.rows.len())),
            readings_n,
            trajectories: Trajectories::new(strokes_of(runs)),
            known_changes: KnownChanges::default(),
        }
    }

    /// The task of a set after a calibration: the row noise is taken at the calibrated finger's prediction, and the
    /// calibration's scatter between runs guides that of the set without binding it.
    pub fn after_calibration(
        set: &'a RunSet,
        reference: &'a ReferenceCurves,
        prior: Prior,
        calibrated: &Fit,
        (noise, correlation): (&[RowNoise; 3], &[f64; 3]),
    ) -> Self {
        let prediction = predict_runs(&reference.model(&calibrated.parameters), &set.runs, &calibrated.laws);
        let sigma_n = correlated_sigma_of(noise, correlation, &prediction);
        let mut task = Self::new(&set.runs, reference, prior, sigma_n, calibrated.variances);
        task.correlation = *correlation;
        task.variance_weight = CALIBRATION_WEIGHT;
        task
    }

    /// Mean and standard deviation of the prior of a parameter of the law at a place in a fit, on its fitted scale.
    pub fn law_prior(&self, place: usize, active: &ActiveLaw, parameter: usize) -> (f64, f64) {
        self.finger_laws.get(place).map_or_else(|| weak_prior(active, parameter), |law| law.prior(parameter))
    }

    /// The finger's own laws as they were calibrated, from which a fit without effects starts.
    pub fn calibrated_laws(&self) -> Vec<ActiveLaw> {
        self.finger_laws.iter().map(|law| law.active.clone()).collect()
    }

    /// Standard deviation of the row noise of one observation by itself, N.
    pub fn row_sigma_n(&self, observation: usize) -> f64 {
        self.sigma_n[observation] / self.correlation[observation % 3].sqrt()
    }

    /// The runs as inputs of the simulation, with laws, random effects and a perturbation.
    pub fn inputs(
        &self,
        laws: &[ActiveLaw],
        random_effects: &RandomEffects,
        perturbation: Perturbation,
    ) -> SimulationInputs {
        let changes = changes(self.runs, laws, random_effects, perturbation, &self.known_changes);
        SimulationInputs::new(&self.trajectories, changes)
    }

    /// Predicted readings with all random effects 0, three per row, N.
    pub fn predict(&self, parameters: &Parameters, laws: &[ActiveLaw]) -> Vec<f64> {
        self.predict_at(parameters, laws, &RandomEffects::new())
    }

    /// Predicted readings with the random effects at given values, three per row, N.
    pub fn predict_at(&self, parameters: &Parameters, laws: &[ActiveLaw], random_effects: &RandomEffects) -> Vec<f64> {
        self.inputs(laws, random_effects, Perturbation::default()).predict_n(&self.reference.model(parameters))
    }

    /// −2 log likelihood of a fit with what the row noise adds, so that tasks whose row noise differs can be compared.
    pub fn minus_2ll_of_readings(&self, fit: &Fit) -> f64 {
        let known = self.readings_n.iter().zip(&self.sigma_n).filter(|(reading, _)| !reading.is_nan());
        fit.minus_2ll + 2.0 * known.map(|(_, sigma)| sigma.ln()).sum::<f64>()
    }

    /// Readings less the prediction of a fit with all random effects 0, N; NaN where a reading is left out.
    pub fn residual_without_random_effects_n(&self, fit: &Fit) -> Vec<f64> {
        let prediction = self.predict(&fit.parameters, &fit.laws);
        self.readings_n.iter().zip(&prediction).map(|(y, p)| y - p).collect()
    }
}
