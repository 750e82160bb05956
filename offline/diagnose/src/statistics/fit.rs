//! Fit of the smooth model and of laws together: Gauss–Newton steps, the run as the unit, variances between runs estimated
//! along the way.
//!
//! Main types: [`Fit`] (the optimum), [`FitStart`].

use fingerpad_smooth::{Parameter, Parameters};
use nalgebra::{DMatrix, DVector};

use crate::model::active_law::{ActiveLaw, is_log, largest_step, set_fitted, to_fitted};
use crate::model::random_effects::{MODEL_EFFECTS, PerEffect, RandomEffects};
use crate::statistics::damped_steps::damped_steps;
use crate::statistics::derivatives::Derivatives;
use crate::statistics::precision::{Block, BlockProducts, Precision};
use crate::statistics::products::dot;
use crate::statistics::random_effects::{ObservationColumn, RandomEffectColumns};
use crate::statistics::task::Task;

/// An optimum.
#[derive(Clone)]
pub struct Fit {
    /// Parameters of the smooth model.
    pub parameters: Parameters,
    /// Laws with their parameters.
    pub laws: Vec<ActiveLaw>,
    /// Variances between runs.
    pub variances: PerEffect,
    /// −2 log posterior, up to a constant of the task.
    pub minus_2ll: f64,
    /// Random effects about which the model is linear; empty where all are so small that it is linear from 0.
    pub random_effects: RandomEffects,
    /// Readings less prediction with all random effects 0, N, to first order in them.
    pub residual_n: Vec<f64>,
    /// Covariance of the model's parameters, then of the laws' on their fitted scales; shape (31 + laws', same).
    pub covariance: DMatrix<f64>,
}

/// Where a fit starts.
#[derive(Clone, Debug)]
pub struct FitStart {
    /// Parameters of the smooth model.
    pub parameters: Parameters,
    /// Laws with their parameters.
    pub laws: Vec<ActiveLaw>,
    /// Variances between runs.
    pub variances: PerEffect,
    /// Random effects about which the model is linear.
    pub random_effects: RandomEffects,
}

impl From<&Fit> for FitStart {
    fn from(fit: &Fit) -> Self {
        Self {
            parameters: fit.parameters,
            laws: fit.laws.clone(),
            variances: fit.variances,
            random_effects: fit.random_effects.clone(),
        }
    }
}

/// Random effects beyond which the model is not taken as linear from 0: logarithms of stiffness and strength, depth in mm.
const LINEAR_FROM_ZERO: [f64; MODEL_EFFECTS] = [0.08, 0.08, 0.08];
/// Largest change of a random effect in one iteration.
const LARGEST_SHIFT: [f64; MODEL_EFFECTS] = [0.3, 0.3, 0.1];
/// Largest change of a parameter in one Gauss–Newton step.
const LARGEST_PARAMETER_STEP: f64 = 0.6;

/// Change of −2 log posterior from which on a fit has arrived: what is left moves a parameter by less than a tenth of its
/// standard deviation, whatever the processor's rounding.
const SETTLED_2LL: f64 = 0.005;

/// A point of a fit on its way.
struct Iterate {
    parameters: Parameters,
    laws: Vec<ActiveLaw>,
    variances: PerEffect,
    random_effects: RandomEffects,
    /// Prediction at this point, N.
    prediction_n: Vec<f64>,
}

/// Linear equations of a Gauss–Newton step, and the objective that it is to lower.
struct Linearised<'a> {
    columns: &'a RandomEffectColumns,
    precision: Precision,
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    objective: f64,
}

/// Change of a parameter of the model (most are logarithms), of a law on the scale on which it is fitted, and of a random
/// effect from which on derivatives are computed again. Those of a point nearer than that are wrong by less than a
/// hundredth, and so is what they make of a step.
const FAR: f64 = 0.004;

/// Derivatives with the point at which they were computed.
struct OwnSlopes {
    point: FitStart,
    derivatives: Derivatives,
}

/// Where the derivatives of a fit come from.
enum Slopes<'d> {
    /// From a nearby point, for the whole fit.
    Given(&'d Derivatives),
    /// From a point of the fit itself; they are renewed where it has moved away from there.
    Own(&'d mut OwnSlopes),
}

impl Slopes<'_> {
    fn derivatives(&self) -> &Derivatives {
        match self {
            Self::Given(derivatives) => derivatives,
            Self::Own(own) => &own.derivatives,
        }
    }
}

impl Task<'_> {
    /// Fits from a start in at most so many Gauss–Newton steps; the fit, and the derivatives at its end or less than
    /// `FAR` from there.
    pub fn fit(&self, start: FitStart, max_iterations: usize) -> (Fit, Derivatives) {
        let mut at = self.iterate(start);
        let mut own = self.own_slopes(&at);
        let hessian = self.descend(&mut at, Slopes::Own(&mut own), max_iterations);
        (self.finish(at, &own.derivatives, hessian), own.derivatives)
    }

    /// Fits from a start with the derivatives of a nearby point in at most so many Gauss–Newton steps.
    pub fn fit_near(&self, start: FitStart, derivatives: &Derivatives, max_iterations: usize) -> Fit {
        let mut at = self.iterate(start);
        let hessian = self.descend(&mut at, Slopes::Given(derivatives), max_iterations);
        self.finish(at, derivatives, hessian)
    }

    /// Goes down to the optimum; the last Hessian.
    fn descend(&self, at: &mut Iterate, mut slopes: Slopes<'_>, max_iterations: usize) -> DMatrix<f64> {
        let mut last = f64::INFINITY;
        let known = self.prior.root.transpose() * &self.prior.root;
        let mut hessian = DMatrix::zeros(0, 0);
        let mut products: Option<(PerEffect, BlockProducts)> = None;
        for iteration in 0..max_iterations {
            let current = slopes.derivatives();
            let scaled = self.scaled_residual(&at.prediction_n, &at.random_effects, &current.random_effects);
            if iteration % 3 == 0 || matches!(slopes, Slopes::Own(_)) || !at.random_effects.is_empty() {
                self.update_variances(at, current, &scaled, if iteration == 0 { 6 } else { 4 });
            }
            let precision = current.random_effects.precision(&at.variances);
            if products.as_ref().is_none_or(|p| p.0 != at.variances) {
                products = Some((at.variances, current.parameters.weighed(&precision)));
            }
            let (_, of_model) = products.as_ref().expect("just filled");
            let linearised = self.linearise(at, current, precision, of_model, &scaled, &known);
            let moved = self.step_downhill(at, &linearised);
            let shifted = self.follow_random_effects(at, current);
            let done = (!moved || (last - linearised.objective).abs() < SETTLED_2LL) && shifted < 0.02;
            last = linearised.objective;
            hessian = linearised.hessian;
            if let Slopes::Own(own) = &mut slopes
                && is_far(at, &own.point)
            {
                **own = self.own_slopes(at);
                products = None;
            }
            if done {
                break;
            }
        }
        hessian
    }

    fn own_slopes(&self, at: &Iterate) -> OwnSlopes {
        let point = FitStart {
            parameters: at.parameters,
            laws: at.laws.clone(),
            variances: at.variances,
            random_effects: at.random_effects.clone(),
        };
        let derivatives = self.derivatives(&at.parameters, &at.laws, &at.random_effects, &at.prediction_n);
        OwnSlopes { point, derivatives }
    }

    fn iterate(&self, start: FitStart) -> Iterate {
        let FitStart { parameters, laws, variances, random_effects } = start;
        let prediction_n = self.predict_at(&parameters, &laws, &random_effects);
        Iterate { parameters, laws, variances, random_effects, prediction_n }
    }

    /// Estimates the variances between runs by some rounds of expectation maximisation.
    fn update_variances(&self, at: &mut Iterate, current: &Derivatives, scaled: &ObservationColumn, rounds: usize) {
        at.variances = current.random_effects.variances(
            at.variances,
            scaled,
            &self.variances,
            self.variance_weight,
            self.consumed_degrees_of_freedom,
            rounds,
        );
    }

    /// Hessian, gradient and objective at a point, priors included.
    fn linearise<'d>(
        &self,
        at: &Iterate,
        current: &'d Derivatives,
        precision: Precision,
        products: &BlockProducts,
        scaled: &ObservationColumn,
        known: &DMatrix<f64>,
    ) -> Linearised<'d> {
        let columns = &current.random_effects;
        let prior = self.prior_residual(&at.parameters, &at.laws);
        let objective = self.objective(&precision, &at.variances, scaled, &prior);
        let of_laws = self.law_columns(&at.parameters, &at.laws, &at.random_effects, &at.prediction_n);
        let of_laws = Block::new(of_laws.into_iter().map(|c| columns.observed(c)).collect());
        let (plain, gradient) = normal_equations(&current.parameters, products, &of_laws, &precision, scaled);
        let gradient = gradient + self.prior_gradient(&prior, &at.laws);
        let hessian = self.with_prior(plain, known, &at.laws);
        Linearised { columns, precision, hessian, gradient, objective }
    }

    /// Takes the Gauss–Newton step, damped until the objective falls; whether any step lowered it.
    fn step_downhill(&self, at: &mut Iterate, linearised: &Linearised<'_>) -> bool {
        for (_, step) in damped_steps(&linearised.hessian, &linearised.gradient, [0.0, 0.1, 1.0, 10.0, 100.0]) {
            let (parameters, laws) = stepped(at, &step);
            let prediction_n = self.predict_at(&parameters, &laws, &at.random_effects);
            let scaled = self.scaled_residual(&prediction_n, &at.random_effects, linearised.columns);
            let prior = self.prior_residual(&parameters, &laws);
            if self.objective(&linearised.precision, &at.variances, &scaled, &prior) < linearised.objective {
                (at.parameters, at.laws, at.prediction_n) = (parameters, laws, prediction_n);
                return true;
            }
        }
        false
    }

    /// Moves the random effects about which the model is linear to their predicted values; the largest shift, 0 while all
    /// are so small that the model is linear in them from 0.
    ///
    /// A law that is still missing makes the runs differ widely. Linear from 0, the model's curvature there would look
    /// like evidence within the runs [conditional linearisation: Lindstrom & Bates 1990].
    fn follow_random_effects(&self, at: &mut Iterate, current: &Derivatives) -> f64 {
        let scaled = self.scaled_residual(&at.prediction_n, &at.random_effects, &current.random_effects);
        let predicted = current.random_effects.best_predictions(&at.variances, &scaled);
        let far = predicted.iter().any(|u| (0..MODEL_EFFECTS).any(|k| u[k].abs() > LINEAR_FROM_ZERO[k]));
        if at.random_effects.is_empty() {
            if !far {
                return 0.0;
            }
            at.random_effects.resize(predicted.len(), [0.0; MODEL_EFFECTS]);
        }
        let mut largest = 0.0f64;
        for (own, u) in at.random_effects.iter_mut().zip(&predicted) {
            for k in 0..MODEL_EFFECTS {
                let shift = (u[k] - own[k]).clamp(-LARGEST_SHIFT[k], LARGEST_SHIFT[k]);
                let to = (own[k] + shift).clamp(-1.5, 1.5);
                largest = largest.max((to - own[k]).abs());
                own[k] = to;
            }
        }
        if largest > 0.0 {
            at.prediction_n = self.predict_at(&at.parameters, &at.laws, &at.random_effects);
        }
        largest
    }

    /// The fit at the last point.
    fn finish(&self, mut at: Iterate, current: &Derivatives, hessian: DMatrix<f64>) -> Fit {
        let scaled = self.scaled_residual(&at.prediction_n, &at.random_effects, &current.random_effects);
        self.update_variances(&mut at, current, &scaled, 6);
        let precision = current.random_effects.precision(&at.variances);
        let prior = self.prior_residual(&at.parameters, &at.laws);
        let minus_2ll = self.objective(&precision, &at.variances, &scaled, &prior);
        let n = hessian.nrows();
        let covariance = hessian.cholesky().map_or_else(|| DMatrix::identity(n, n) * f64::NAN, |c| c.inverse());
        let residual_n = scaled.values.iter().zip(&self.sigma_n).map(|(r, s)| r * s).collect();
        let Iterate { parameters, laws, variances, random_effects, .. } = at;
        Fit { parameters, laws, variances, minus_2ll, random_effects, residual_n, covariance }
    }

    /// Readings less prediction over row noise, with all random effects 0, to first order in them.
    fn scaled_residual(
        &self,
        prediction_n: &[f64],
        random_effects: &RandomEffects,
        columns: &RandomEffectColumns,
    ) -> ObservationColumn {
        let scaled = |((y, p), s): ((&f64, &f64), &f64)| if y.is_nan() { 0.0 } else { (y - p) / s };
        let mut out: Vec<f64> = self.readings_n.iter().zip(prediction_n).zip(&self.sigma_n).map(scaled).collect();
        columns.add(random_effects, &mut out);
        columns.observed(out)
    }

    /// Distances from the priors' means over standard deviations: of the model's parameters, then of the laws'.
    pub fn prior_residual(&self, parameters: &Parameters, laws: &[ActiveLaw]) -> Vec<f64> {
        let d = Parameter::all().map(|p| self.prior.mean[p] - parameters[p]);
        let mut rows: Vec<f64> =
            (&self.prior.root * DVector::from_iterator(Parameter::COUNT, d)).iter().copied().collect();
        for (place, active) in laws.iter().enumerate() {
            for k in 0..active.values.len() {
                let (mean, sd) = self.law_prior(place, active, k);
                rows.push((mean - to_fitted(active, k)) / sd);
            }
        }
        rows
    }

    /// Squared distance of parameters from the prior's mean, in standard deviations.
    pub fn squared_distance_from_prior(&self, parameters: &Parameters) -> f64 {
        let rows = self.prior_residual(parameters, &[]);
        dot(&rows, &rows)
    }

    /// −2 log posterior of a residual, up to a constant.
    fn objective(
        &self,
        precision: &Precision,
        variances: &PerEffect,
        scaled: &ObservationColumn,
        prior: &[f64],
    ) -> f64 {
        precision.square(scaled) + precision.log_det + dot(prior, prior) + self.variance_2ll(variances)
    }

    fn variance_2ll(&self, variances: &PerEffect) -> f64 {
        if self.variance_weight > 0.0 {
            RandomEffectColumns::prior_2ll(variances, &self.variances, self.variance_weight)
        } else {
            0.0
        }
    }

    /// Standard deviations of the priors of all parameters of laws, on their fitted scales.
    pub fn sds_of_laws<'l>(&'l self, laws: &'l [ActiveLaw]) -> impl Iterator<Item = f64> + 'l {
        let of =
            move |(place, a): (usize, &'l ActiveLaw)| (0..a.values.len()).map(move |k| self.law_prior(place, a, k).1);
        laws.iter().enumerate().flat_map(of)
    }

    /// Adds the priors' part to the Hessian: RᵀR of the model's parameters, and that of each parameter of the laws.
    fn with_prior(&self, mut hessian: DMatrix<f64>, known: &DMatrix<f64>, laws: &[ActiveLaw]) -> DMatrix<f64> {
        let mut of_model = hessian.view_mut((0, 0), (Parameter::COUNT, Parameter::COUNT));
        of_model += known;
        for (i, sd) in self.sds_of_laws(laws).enumerate() {
            hessian[(Parameter::COUNT + i, Parameter::COUNT + i)] += 1.0 / (sd * sd);
        }
        hessian
    }

    /// The priors' part of the gradient.
    fn prior_gradient(&self, prior: &[f64], laws: &[ActiveLaw]) -> DVector<f64> {
        let of_model = self.prior.root.transpose() * DVector::from_column_slice(&prior[..Parameter::COUNT]);
        let of_laws = prior[Parameter::COUNT..].iter().zip(self.sds_of_laws(laws)).map(|(p, sd)| p / sd);
        DVector::from_iterator(prior.len(), of_model.iter().copied().chain(of_laws))
    }
}

/// Whether a fit has moved away from a point by [`FAR`].
fn is_far(at: &Iterate, point: &FitStart) -> bool {
    let of_model = Parameter::all().any(|p| (at.parameters[p] - point.parameters[p]).abs() > FAR);
    let of_law = |(a, b): (&ActiveLaw, &ActiveLaw)| {
        (0..a.values.len()).any(|k| {
            let scale = match &a.law.parameters[k] {
                p if k < a.law.linear => p.typical.abs(),
                _ if is_log(a, k) => 1.0,
                p => p.high - p.low,
            };
            (to_fitted(a, k) - to_fitted(b, k)).abs() > FAR * scale
        })
    };
    let of_run = |run: usize| {
        let before = point.random_effects.get(run).copied().unwrap_or_default();
        (0..MODEL_EFFECTS).any(|k| (at.random_effects[run][k] - before[k]).abs() > FAR)
    };
    of_model || at.laws.iter().zip(&point.laws).any(of_law) || (0..at.random_effects.len()).any(of_run)
}

/// Parameters and laws after a step, each parameter's part held within its bound.
fn stepped(at: &Iterate, step: &DVector<f64>) -> (Parameters, Vec<ActiveLaw>) {
    let (mut parameters, mut laws) = (at.parameters, at.laws.clone());
    for p in Parameter::all() {
        parameters[p] += step[p.index()].clamp(-LARGEST_PARAMETER_STEP, LARGEST_PARAMETER_STEP);
    }
    let mut place = Parameter::COUNT;
    for active in &mut laws {
        for k in 0..active.values.len() {
            let (q, reach) = (to_fitted(active, k), largest_step(active, k));
            set_fitted(active, k, q + step[place].clamp(-reach, reach));
            place += 1;
        }
    }
    (parameters, laws)
}

/// Hessian and gradient under the precision: products of all columns, those of the smooth model's parameters first, with
/// each other and with the residual.
fn normal_equations(
    of_model: &Block,
    products: &BlockProducts,
    of_laws: &Block,
    precision: &Precision,
    residual: &ObservationColumn,
) -> (DMatrix<f64>, DVector<f64>) {
    let (n, m) = (of_model.columns.len(), of_laws.columns.len());
    let right: Vec<&ObservationColumn> = std::iter::once(residual).chain(&of_laws.columns).collect();
    let across = of_model.times(products, precision, &right);
    let (mut hessian, mut gradient) = (DMatrix::zeros(n + m, n + m), DVector::zeros(n + m));
    hessian.view_mut((0, 0), (n, n)).copy_from(&products.gram);
    gradient.rows_mut(0, n).copy_from(&across.column(0));
    if m > 0 {
        let own = of_laws.weighed(precision);
        gradient.rows_mut(n, m).copy_from(&of_laws.times(&own, precision, &[residual]).column(0));
        hessian.view_mut((0, n), (n, m)).copy_from(&across.columns(1, m));
        hessian.view_mut((n, 0), (m, n)).copy_from(&across.columns(1, m).transpose());
        hessian.view_mut((n, n), (m, m)).copy_from(&own.gram);
    }
    (hessian, gradient)
}
