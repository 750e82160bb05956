//! Fits of effects to the table, with their priors, and the evidence for them.
//!
//! Main types: [`Task`] (what is fitted), [`Fitted`].

use fingerpad_diagnose::FittedParameter;
use nalgebra::DMatrix;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::effects::{CONSTANTS, Effect, Parameter, Values};
use super::measured::{Measured, MeasuredTable};
use super::reading::{Elastic, Surface, place_of, read};
use crate::IdentifyError;
use crate::bounded_least_squares::{Model, Solution, Stop, Variable, minimise};
use crate::confidence::linear;

/// Standard deviation of the logarithm of the table's noise over its stated value: without a spread the stated value is
/// an assumption, with one it is an estimate from few repeats.
const NOISE_SCATTER: [f64; 2] = [0.4, 0.15];
/// Rounds in which fit and noise settle.
const NOISE_ROUNDS: usize = 4;

/// A fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fitted {
    /// The effects.
    pub effects: Vec<&'static Effect>,
    /// Values of the effects' own parameters with their 95 % intervals.
    pub parameters: Vec<FittedParameter>,
    /// Numbers that were fitted, the finger's constants included.
    pub freedoms: usize,
    /// Root mean square gap, all numbers of the table, %.
    pub rms_percent: f64,
    /// All values.
    #[serde(skip)]
    pub values: Values,
    /// Readings per slot.
    #[serde(skip)]
    pub readings: Vec<[f64; 3]>,
    /// −2 log evidence: misfit, cost of the priors, and the width of the posterior within them. Smaller is better.
    #[serde(skip)]
    pub cost: f64,
    /// Fitted factor on the stated errors.
    #[serde(skip)]
    pub noise: f64,
    /// Probability of a misfit as large under the stated errors.
    #[serde(skip)]
    pub p_misfit: f64,
}

/// Input of a fit: the measured table, the finger's response, and the starting values.
#[derive(Clone)]
pub struct Task<'a> {
    /// The table.
    pub table: &'a MeasuredTable,
    /// The finger's response.
    pub surface: &'a Surface<'a>,
    /// Added to ln N, ln A, ln F near each of these depths (mm): what the finite elements gave beside the surface.
    pub shift: Vec<(f64, [f64; 3])>,
    /// Numbers that are fitted.
    pub numbers: Vec<Measured>,
    /// Values of the fixed parameters, and starting values of the free ones.
    pub start: Values,
    /// Values about which the priors lie: the finger as it was modelled under the published law.
    pub prior: Values,
}

impl<'a> Task<'a> {
    /// All numbers of the table.
    pub fn all(table: &'a MeasuredTable, surface: &'a Surface<'a>, start: Values, prior: Values) -> Self {
        Self { table, surface, shift: Vec::new(), numbers: table.numbers.clone(), start, prior }
    }

    /// The task in which the response is that of the finite elements at these values.
    pub fn shifted(&self, values: &Values, exact: &[Elastic]) -> Self {
        let shift = |(slot, exact): (usize, &Elastic)| {
            let place = place_of(values, self.table.depths_mm[slot], slot).0;
            let plain = (self.surface)(&place);
            (place.depth_mm, [0, 1, 2].map(|q| (exact[q] / plain[q]).ln()))
        };
        Self { shift: exact.iter().enumerate().map(shift).collect(), ..self.clone() }
    }

    /// Readings of all slots.
    pub fn predict(&self, values: &Values) -> Vec<[f64; 3]> {
        let reading = |(slot, depth_mm): (usize, &f64)| {
            let (place, factors) = place_of(values, *depth_mm, slot);
            let away = |shift: &(f64, [f64; 3])| (shift.0 - place.depth_mm).abs();
            let near = self.shift.iter().min_by(|a, b| away(a).total_cmp(&away(b))).map_or([0.0; 3], |shift| shift.1);
            let plain = (self.surface)(&place);
            read(values, &factors, &[0, 1, 2].map(|q| plain[q] * near[q].exp()))
        };
        self.table.depths_mm.iter().enumerate().map(reading).collect()
    }

    /// Prior standard deviation of a parameter; depths have that of their column.
    fn prior_sd(&self, parameter: Parameter) -> f64 {
        parameter.slot().map_or(parameter.known().prior_sd, |slot| self.table.depth_sd_mm[slot])
    }

    /// Free parameters of a fit: those of the effects, and the constants of the finger if these are free.
    fn free(&self, effects: &[&'static Effect], with_constants: bool) -> Vec<Parameter> {
        let constants = if with_constants { &CONSTANTS[..] } else { &[] };
        let own = effects.iter().flat_map(|e| e.parameters(self.table.depths_mm.len()));
        constants.iter().copied().chain(own.filter(|p| !constants.contains(p))).collect()
    }

    /// Fits effects beside the constants of the finger, from several starts.
    pub fn fit(&self, effects: &[&'static Effect]) -> Result<Fitted, IdentifyError> {
        let free = self.free(effects, true);
        let mut best: Option<(f64, Values)> = None;
        for start in self.starts(&free) {
            let fit = Weighted { task: self, free: &free, values: start, noise: 1.0 };
            let (values, solution) = fit.minimise()?;
            let sum = square(&solution.residuals);
            if best.as_ref().is_none_or(|(least, _)| sum < *least) {
                best = Some((sum, values));
            }
        }
        self.fit_from(effects, true, best.expect("at least one start").1)
    }

    /// The start as it is, and with each free effect at its prior's width to either side.
    fn starts(&self, free: &[Parameter]) -> Vec<Values> {
        let mut starts = vec![self.start.clone()];
        for &parameter in free.iter().filter(|p| !CONSTANTS.contains(p) && p.slot().is_none()) {
            let [low, high] = parameter.known().bounds;
            let moved = [-1.0, 1.0].map(|side| self.start[parameter] + side * self.prior_sd(parameter));
            let inside = moved.into_iter().filter(|value| *value > low && *value < high);
            starts.extend(inside.map(|value| self.start.clone().with(parameter, value)));
        }
        starts
    }

    /// Fits effects from one start; fit and noise settle in turns.
    pub fn fit_from(
        &self,
        effects: &[&'static Effect],
        with_constants: bool,
        start: Values,
    ) -> Result<Fitted, IdentifyError> {
        let (free, n) = (self.free(effects, with_constants), self.numbers.len());
        let scatter = NOISE_SCATTER[usize::from(self.table.has_spread())];
        let mut fit = Weighted { task: self, free: &free, values: start, noise: 1.0 };
        let mut stated = 0.0;
        for _ in 0..NOISE_ROUNDS {
            let (values, solution) = fit.minimise()?;
            stated = square(&solution.residuals[..n]) * fit.noise * fit.noise;
            fit = Weighted { values, noise: noise(stated, n, scatter), ..fit };
        }
        // Laplace's approximation: in units of the priors' widths the posterior's precision is 1 + J'J.
        let jacobian = fit.columns(&fit.values);
        let widths: Vec<f64> = free.iter().map(|p| self.prior_sd(*p)).collect();
        let scaled = DMatrix::from_fn(n + free.len(), free.len(), |i, j| jacobian[j][i] * widths[j]);
        let volume = scaled.tr_mul(&scaled).cholesky().map_or(0.0, |factor| factor.ln_determinant());
        let ln_k = fit.noise.ln();
        let misfit = square(&fit.residuals(&fit.values)) + 2.0 * n as f64 * ln_k + (ln_k / scatter).powi(2);
        let sds = linear(&jacobian, 1.0).standard_errors;
        let own = free.iter().zip(sds).filter(|(p, _)| !CONSTANTS.contains(p));
        let interval = |(p, sd): (&Parameter, f64)| {
            let value = fit.values[*p];
            let ci95 = [value - 1.96 * sd, value + 1.96 * sd];
            FittedParameter { name: p.name(), value, unit: p.known().unit.into(), ci95 }
        };
        let readings = self.predict(&fit.values);
        let chi = ChiSquared::new((n as f64 - free.len() as f64).max(1.0));
        Ok(Fitted {
            effects: effects.to_vec(),
            parameters: own.map(interval).collect(),
            freedoms: free.len(),
            rms_percent: rms_percent(&self.numbers, &readings),
            readings,
            cost: misfit + volume,
            noise: fit.noise,
            p_misfit: chi.map_or(1.0, |chi| chi.sf(stated)),
            values: fit.values,
        })
    }
}

fn square(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Factor k on the stated errors: least of sum/k² + 2 n ln k + (ln k / scatter)².
fn noise(sum: f64, count: usize, scatter: f64) -> f64 {
    let slope = |ln_k: f64| -sum * (-2.0 * ln_k).exp() + count as f64 + ln_k / (scatter * scatter);
    let (mut low, mut high) = (-4.0, 4.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 { high = middle } else { low = middle }
    }
    f64::exp(0.5 * (low + high))
}

/// Differences of the logarithms over the errors, then distances from the priors over their widths.
#[derive(Clone)]
struct Weighted<'a, 't> {
    task: &'a Task<'t>,
    free: &'a [Parameter],
    /// Values of the fixed parameters, and where the fit starts.
    values: Values,
    /// Factor on the stated errors.
    noise: f64,
}

impl Weighted<'_, '_> {
    /// The least sum of squares near the values.
    fn minimise(&self) -> Result<(Values, Solution), IdentifyError> {
        let variable = |p: &Parameter| Variable { value: self.values[*p], bounds: p.known().bounds };
        let from: Vec<Variable> = self.free.iter().map(variable).collect();
        let stop = Stop { tolerance: 1e-7, evaluations: 30 * (self.free.len() + 1) };
        let solution = minimise("table", &mut self.clone(), &from, stop)?;
        Ok((self.at(&solution.values), solution))
    }

    fn at(&self, x: &[f64]) -> Values {
        self.free.iter().zip(x).fold(self.values.clone(), |values, (p, v)| values.with(*p, *v))
    }

    fn residuals(&self, values: &Values) -> Vec<f64> {
        let Self { task, free, noise, .. } = self;
        let readings = task.predict(values);
        let data = |m: &Measured| (readings[m.slot][m.quantity] / m.value).ln() / (m.relative_sd * noise);
        let prior = |p: &Parameter| (values[*p] - task.prior[*p]) / task.prior_sd(*p);
        task.numbers.iter().map(data).chain(free.iter().map(prior)).collect()
    }

    /// Their derivatives, a column for each free parameter.
    fn columns(&self, values: &Values) -> Vec<Vec<f64>> {
        let slope = |p: &Parameter| {
            let step = 1e-4 * p.known().prior_sd;
            let side = |sign: f64| self.residuals(&values.clone().with(*p, values[*p] + sign * step));
            side(1.0).iter().zip(side(-1.0)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
        };
        self.free.iter().map(slope).collect()
    }
}

impl Model for Weighted<'_, '_> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        Ok(Weighted::residuals(self, &self.at(x)))
    }

    fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
        Ok(self.columns(&self.at(x)))
    }
}

/// Root mean square of the relative differences of readings from numbers, %.
pub fn rms_percent(numbers: &[Measured], readings: &[[f64; 3]]) -> f64 {
    let square = |m: &Measured| (readings[m.slot][m.quantity] / m.value - 1.0).powi(2);
    100.0 * (numbers.iter().map(square).sum::<f64>() / numbers.len() as f64).sqrt()
}
