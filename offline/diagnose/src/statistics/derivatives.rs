//! Derivatives of the predicted readings at a point, by differences of two predictions: with respect to the smooth model's
//! parameters, the random effects, and the laws' parameters. Each is a column, one entry an observation, over the row noise.
//!
//! Main type: [`Derivatives`], reused between fits that start nearby.

use std::convert::Infallible;

use nalgebra::DMatrix;

use fingerpad_formats::in_threads;
use fingerpad_smooth::{Parameter, Parameters};

use crate::laws::Place;
use crate::model::active_law::{ActiveLaw, is_log, set_fitted, to_fitted};
use crate::model::prediction::Perturbation;
use crate::model::random_effects::{PerEffect, RandomEffects};
use crate::statistics::fit::Fit;
use crate::statistics::precision::Block;
use crate::statistics::random_effects::RandomEffectColumns;
use crate::statistics::task::Task;

/// Observations from which on columns are computed side by side.
const MANY: usize = 30_000;
/// Step by which a parameter is perturbed.
const PARAMETER_STEP: f64 = 2e-4;

/// Columns of the smooth model's parameters and of the random effects.
#[derive(Clone)]
pub struct Derivatives {
    /// One column per parameter, in their order.
    pub parameters: Block,
    /// One column per random effect.
    pub random_effects: RandomEffectColumns,
}

impl Task<'_> {
    /// Difference of two predictions over row noise and step.
    pub fn difference_column(&self, after: &[f64], before: &[f64], step: f64) -> Vec<f64> {
        after.iter().zip(before).zip(&self.sigma_n).map(|((a, b), s)| (a - b) / (s * step)).collect()
    }

    /// Columns at a fit.
    pub fn derivatives_of(&self, fit: &Fit) -> Derivatives {
        let prediction = self.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
        self.derivatives(&fit.parameters, &fit.laws, &fit.random_effects, &prediction)
    }

    /// Columns at a point; `prediction` is that of the point.
    pub fn derivatives(
        &self,
        parameters: &Parameters,
        laws: &[ActiveLaw],
        random_effects: &RandomEffects,
        prediction: &[f64],
    ) -> Derivatives {
        let inputs = self.inputs(laws, random_effects, Perturbation::default());
        let history = inputs.element_history(&self.reference.model(parameters));
        let of_parameters = self.columns(Parameter::all().collect(), |p| {
            let mut moved = *parameters;
            moved[p] += PARAMETER_STEP;
            let model = self.reference.model(&moved);
            let after = if inputs.history_depends_on(p) {
                inputs.predict_n(&model)
            } else {
                inputs.readings_n(&model, &history)
            };
            self.difference_column(&after, prediction, PARAMETER_STEP)
        });
        // Last, as they move the depths, for which a trajectory is computed.
        let random_effects = self.random_effect_columns(parameters, laws, random_effects, prediction);
        let of_parameters = of_parameters.into_iter().map(|c| random_effects.observed(c)).collect();
        Derivatives { parameters: Block::new(of_parameters), random_effects }
    }

    /// Columns of the random effects at a point.
    pub fn random_effect_columns(
        &self,
        parameters: &Parameters,
        laws: &[ActiveLaw],
        random_effects: &RandomEffects,
        prediction: &[f64],
    ) -> RandomEffectColumns {
        let model = self.reference.model(parameters);
        let perturbed = |perturbation: Perturbation, step: f64| {
            let after = self.inputs(laws, random_effects, perturbation).predict_n(&model);
            self.difference_column(&after, prediction, step)
        };
        let mut columns = vec![
            perturbed(Perturbation { stiffness: 1.001, ..Perturbation::default() }, 1e-3),
            perturbed(Perturbation { strength: 1.001, ..Perturbation::default() }, 1e-3),
            perturbed(Perturbation { depth_mm: 2e-4, ..Perturbation::default() }, 2e-4),
        ];
        for channel in 0..3 {
            columns.push(
                self.sigma_n.iter().enumerate().map(|(i, s)| if i % 3 == channel { 1.0 / s } else { 0.0 }).collect(),
            );
        }
        RandomEffectColumns::new(self.layout.clone(), columns)
    }

    /// Fisher information of the runs on the smooth model's parameters, shape (31, 31).
    pub fn information(&self, derivatives: &Derivatives, variances: &PerEffect) -> DMatrix<f64> {
        derivatives.parameters.weighed(&derivatives.random_effects.precision(variances)).gram
    }

    /// Columns of the laws' parameters at a fit.
    pub fn law_columns_of(&self, fit: &Fit) -> Vec<Vec<f64>> {
        let prediction = self.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
        self.law_columns(&fit.parameters, &fit.laws, &fit.random_effects, &prediction)
    }

    /// Columns of the laws' parameters at a point.
    pub fn law_columns(
        &self,
        parameters: &Parameters,
        laws: &[ActiveLaw],
        random_effects: &RandomEffects,
        prediction: &[f64],
    ) -> Vec<Vec<f64>> {
        let model = self.reference.model(parameters);
        let of_readings = |active: &ActiveLaw| matches!(active.law.place, Place::Reading | Place::Drag | Place::Rim);
        // What acts on the readings alone leaves the elements as they are.
        let history = laws
            .iter()
            .any(of_readings)
            .then(|| self.inputs(laws, random_effects, Perturbation::default()).element_history(&model));
        let places = laws.iter().enumerate().flat_map(|(i, active)| (0..active.values.len()).map(move |k| (i, k)));
        self.columns(places.collect(), |(i, k)| {
            let active = &laws[i];
            let q = to_fitted(active, k);
            let mut step = if k < active.law.linear { 2e-3 * active.law.parameters[k].typical.abs() } else { 2e-3 };
            if !is_log(active, k) && k >= active.law.linear {
                let p = &active.law.parameters[k];
                step = 2.5e-4 * (p.high - p.low);
            }
            let mut moved = laws.to_vec();
            set_fitted(&mut moved[i], k, q + step);
            if to_fitted(&moved[i], k) == q {
                step = -step;
                set_fitted(&mut moved[i], k, q + step);
            }
            let inputs = self.inputs(&moved, random_effects, Perturbation::default());
            let after = match &history {
                Some(history) if of_readings(active) => inputs.readings_n(&model, history),
                _ => inputs.predict_n(&model),
            };
            self.difference_column(&after, prediction, step)
        })
    }

    /// A column for each of a list, on several threads where there are many observations.
    fn columns<T: Send>(&self, of: Vec<T>, column: impl Fn(T) -> Vec<f64> + Sync) -> Vec<Vec<f64>> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if self.sigma_n.len() < MANY { 1 } else { cores.min(of.len()) };
        let columns = in_threads(of, threads, |one| Ok::<_, Infallible>(column(one)));
        columns.unwrap_or_else(|never| match never {})
    }
}
