//! Fits of a model's free parameters to the table, with their priors, and the model's evidence.
//!
//! Main types: [`Model`] (the effects that are switched on), [`Fitted`].

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::TableError;
use super::measured::{Measured, MeasuredTable};
use super::parameters::{CONSTANTS, Effect, Parameter, Values};
use super::reading::{Surface, predict};
use crate::IdentifyError;
use crate::bounded_least_squares::{self as least_squares, Stop, Variable};

/// Standard deviation of the logarithm of the table's noise over its stated value: without a spread the stated value is
/// an assumption, with one it is an estimate from few repeats.
const NOISE_SCATTER: [f64; 2] = [0.4, 0.15];
/// Rounds in which fit and noise settle.
const NOISE_ROUNDS: usize = 4;

/// Effects of a model, besides the constants of the finger if these are free.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Model {
    /// The effects.
    pub effects: Vec<Effect>,
    /// Whether stiffness, touch point and strength are free as well.
    pub with_constants: bool,
}

impl Model {
    /// The effects beside the constants of the finger.
    pub fn beside_constants(effects: &[Effect]) -> Self {
        Self { effects: effects.to_vec(), with_constants: true }
    }

    /// The effects alone: all other parameters keep their calibrated values.
    pub fn alone(effects: &[Effect]) -> Self {
        Self { effects: effects.to_vec(), with_constants: false }
    }

    /// Free parameters.
    pub fn free(&self, slots: usize) -> Vec<Parameter> {
        let constants: &[Parameter] = if self.with_constants { &CONSTANTS } else { &[] };
        let mut free = constants.to_vec();
        let own = self.effects.iter().flat_map(|e| e.parameters(slots));
        own.for_each(|p| {
            if !free.contains(&p) {
                free.push(p);
            }
        });
        free
    }

    /// Names of its effects, joined by `+`.
    pub fn name(&self) -> String {
        self.effects.iter().map(|e| e.name()).collect::<Vec<_>>().join("+")
    }
}

/// A fit of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// All values.
    pub values: Values,
    /// Free parameters with their standard deviations.
    pub free: Vec<(Parameter, f64)>,
    /// Readings per slot.
    pub readings: Vec<[f64; 3]>,
    /// Root mean square of the relative differences model over measurement, all numbers of the table, %.
    pub rms_percent: f64,
    /// −2 log evidence: misfit, cost of the priors, and the width of the posterior within them. Smaller is better.
    pub cost: f64,
    /// Fitted factor on the stated errors.
    pub noise: f64,
    /// Probability of a misfit as large under the stated errors.
    pub p_misfit: f64,
}

/// Input of a fit: the measured table, and the starting values of the constants.
pub struct Task<'a> {
    /// The table.
    pub table: &'a MeasuredTable,
    /// Numbers that are fitted.
    pub numbers: Vec<Measured>,
    /// Values of the fixed parameters, and starting values of the free ones.
    pub start: Values,
    /// Values about which the priors lie: the finger as it was modelled under the published law.
    pub prior: Values,
}

impl<'a> Task<'a> {
    /// All numbers of the table.
    pub fn all(table: &'a MeasuredTable, start: Values, prior: Values) -> Self {
        Self { table, numbers: table.numbers(), start, prior }
    }

    /// All numbers but those at one depth.
    pub fn without(&self, slot: usize) -> Self {
        let numbers = self.numbers.iter().copied().filter(|m| m.slot != slot).collect();
        Self { numbers, start: self.start.clone(), prior: self.prior.clone(), ..*self }
    }

    /// Prior standard deviation of a parameter; depths have that of their column.
    fn prior_sd(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::DepthError(slot) => self.table.depth_sd_mm[slot],
            other => other.prior().sd,
        }
    }

    /// Fits a model on a surface, from several starts.
    ///
    /// # Errors
    /// [`TableError::Fe`] if the minimiser fails.
    pub fn fit(&self, surface: &dyn Surface, model: &Model) -> Result<Fitted, TableError> {
        let free = model.free(self.table.depths_mm.len());
        let mut best: Option<(f64, Values)> = None;
        for start in self.starts(&free) {
            let mut fit = LeastSquares { task: self, surface, free: &free, values: start, noise: 1.0 };
            fit.minimise()?;
            let sum = fit.sum_of_squares();
            if best.as_ref().is_none_or(|(least, _)| sum < *least) {
                best = Some((sum, fit.values));
            }
        }
        self.fit_from(surface, model, best.expect("at least one start").1)
    }

    /// The start as it is, and with each free effect at its prior's width to either side.
    fn starts(&self, free: &[Parameter]) -> Vec<Values> {
        let mut starts = vec![self.start.clone()];
        for &parameter in
            free.iter().filter(|p| !CONSTANTS.contains(p)).filter(|p| !matches!(p, Parameter::DepthError(_)))
        {
            let (value, [low, high]) = (self.start.get(parameter), parameter.prior().bounds);
            for side in [-1.0, 1.0] {
                let moved = value + side * self.prior_sd(parameter);
                if moved > low && moved < high {
                    starts.push(self.start.clone().with(parameter, moved));
                }
            }
        }
        starts
    }

    /// Fits a model from one start; fit and noise settle in turns.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn fit_from(&self, surface: &dyn Surface, model: &Model, start: Values) -> Result<Fitted, TableError> {
        let scatter = NOISE_SCATTER[usize::from(self.table.has_spread())];
        let free = model.free(self.table.depths_mm.len());
        let mut fit = LeastSquares { task: self, surface, free: &free, values: start, noise: 1.0 };
        for _ in 0..NOISE_ROUNDS {
            fit.minimise()?;
            let sum = fit.data_residuals(&fit.values).iter().map(|r| r * r).sum::<f64>() * fit.noise * fit.noise;
            fit.noise = noise(sum, self.numbers.len(), scatter);
        }
        Ok(fit.finished(model, scatter))
    }
}

/// Factor k on the stated errors: least of sum/k² + 2 n ln k + (ln k / scatter)².
fn noise(sum: f64, count: usize, scatter: f64) -> f64 {
    let n = count as f64;
    let slope = |ln_k: f64| -2.0 * sum * (-2.0 * ln_k).exp() + 2.0 * n + 2.0 * ln_k / (scatter * scatter);
    let (mut low, mut high) = (-4.0, 4.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 { high = middle } else { low = middle }
    }
    f64::exp(0.5 * (low + high))
}

/// Weighted residuals over the free parameters.
struct LeastSquares<'a, 't> {
    task: &'a Task<'t>,
    surface: &'a dyn Surface,
    free: &'a [Parameter],
    /// Values of the fixed parameters.
    values: Values,
    /// Factor on the stated errors.
    noise: f64,
}

impl LeastSquares<'_, '_> {
    /// Moves the values to the least sum of squares near them.
    fn minimise(&mut self) -> Result<(), TableError> {
        if self.free.is_empty() {
            return Ok(());
        }
        let bounded = |p: &Parameter| Variable { value: self.values.get(*p), bounds: p.prior().bounds };
        let from: Vec<Variable> = self.free.iter().map(bounded).collect();
        let stop = Stop { tolerance: 1e-7, evaluations: 30 * (self.free.len() + 1) };
        let solution = least_squares::minimise("table", self, &from, stop)?;
        self.values = self.at(&solution.values);
        Ok(())
    }

    fn sum_of_squares(&self) -> f64 {
        let residuals = self.data_residuals(&self.values).into_iter().chain(self.prior_residuals(&self.values));
        residuals.map(|r| r * r).sum()
    }

    fn at(&self, x: &[f64]) -> Values {
        self.free.iter().zip(x).fold(self.values.clone(), |values, (p, v)| values.with(*p, *v))
    }

    /// Differences of the logarithms over the errors.
    fn data_residuals(&self, values: &Values) -> Vec<f64> {
        let readings = predict(self.surface, values, &self.task.table.depths_mm);
        let residual = |m: &Measured| (readings[m.slot][m.quantity] / m.value).ln() / (m.relative_sd * self.noise);
        self.task.numbers.iter().map(residual).collect()
    }

    /// Distances from the values without an effect over the prior's width.
    fn prior_residuals(&self, values: &Values) -> Vec<f64> {
        let distance = |p: &Parameter| (values.get(*p) - self.task.prior.get(*p)) / self.task.prior_sd(*p);
        self.free.iter().map(distance).collect()
    }

    fn step(parameter: Parameter) -> f64 {
        1e-4 * parameter.prior().sd
    }

    /// Derivatives of the data's residuals, a column for each free parameter.
    fn columns(&self, values: &Values) -> Vec<Vec<f64>> {
        let side = |p: Parameter, sign: f64| {
            self.data_residuals(&values.clone().with(p, values.get(p) + sign * Self::step(p)))
        };
        let slope = |p: &Parameter| {
            side(*p, 1.0).iter().zip(side(*p, -1.0)).map(|(a, b)| (a - b) / (2.0 * Self::step(*p))).collect()
        };
        self.free.iter().map(slope).collect()
    }

    /// The end of the fit with its evidence: Laplace's approximation about the best values.
    fn finished(self, model: &Model, scatter: f64) -> Fitted {
        let values = self.values.clone();
        let (data, prior) = (self.data_residuals(&values), self.prior_residuals(&values));
        let square = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
        let (n, p) = (self.task.numbers.len(), self.free.len());
        let columns = self.columns(&values);
        // In units of the priors' widths the posterior's precision is 1 + J'J.
        let widths: Vec<f64> = self.free.iter().map(|p| self.task.prior_sd(*p)).collect();
        let jacobian = DMatrix::from_fn(n, p, |i, j| columns[j][i] * widths[j]);
        let precision = jacobian.tr_mul(&jacobian) + DMatrix::identity(p, p);
        let (volume, spread) = match precision.cholesky() {
            Some(factor) if p > 0 => (factor.ln_determinant(), factor.inverse().diagonal()),
            _ => (0.0, DVector::from_element(p, 1.0)),
        };
        let ln_k = self.noise.ln();
        let cost = square(&data) + 2.0 * n as f64 * ln_k + (ln_k / scatter).powi(2) + square(&prior) + volume;
        let readings = predict(self.surface, &values, &self.task.table.depths_mm);
        let freedom = (n as f64 - p as f64).max(1.0);
        let stated = square(&data) * self.noise * self.noise;
        let p_misfit = ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(stated));
        Fitted {
            model: model.clone(),
            free: self.free.iter().zip(&widths).enumerate().map(|(j, (p, w))| (*p, w * spread[j].sqrt())).collect(),
            rms_percent: rms_percent(&self.task.numbers, &readings),
            readings,
            cost,
            noise: self.noise,
            p_misfit,
            values,
        }
    }
}

impl least_squares::Model for LeastSquares<'_, '_> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        let values = self.at(x);
        let mut out = self.data_residuals(&values);
        out.extend(self.prior_residuals(&values));
        Ok(out)
    }

    fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
        let mut columns = self.columns(&self.at(x));
        for (j, column) in columns.iter_mut().enumerate() {
            let own = 1.0 / self.task.prior_sd(self.free[j]);
            column.extend((0..self.free.len()).map(|i| if i == j { own } else { 0.0 }));
        }
        Ok(columns)
    }
}

/// Root mean square of the relative differences of readings from numbers, %.
pub fn rms_percent(numbers: &[Measured], readings: &[[f64; 3]]) -> f64 {
    let square = |m: &Measured| (readings[m.slot][m.quantity] / m.value - 1.0).powi(2);
    100.0 * (numbers.iter().map(square).sum::<f64>() / numbers.len() as f64).sqrt()
}
