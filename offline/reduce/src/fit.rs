//! The fit: the model's numbers that make its replay of the runs least wrong, in the sense of weighted least squares.
//!
//! Main types: [`Settings`], [`fit`]. Every residual comes out of `fingerpad` itself, in its 32-bit arithmetic; the
//! Jacobian is by finite differences. Minimiser: Levenberg–Marquardt after MINPACK (crate `levenberg-marquardt`).
//! Uses initial_guess, parameterisation, replay, slip_length.

use fingerpad::{ParamsOf, Regime};
use fingerpad_least_squares::{
    LevenbergMarquardt, MinimizationReport, Problem, TerminationReason, minimise, objective,
};
use rayon::prelude::*;

use super::initial_guess::initial_guess;
use super::parameterisation::Parameterisation;
use super::replay::replay_data;
use super::slip_length::explained;
use super::{ReduceError, Run};

/// Settings of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Knots of normal force, area, limit and stiffness.
    pub rising_knots: usize,
    /// Knots of the other tables.
    pub gentle_knots: usize,
    /// Error of the normal force that counts 1, share of the largest of its run.
    pub normal_share: f64,
    /// Error of friction that counts 1, share of the limit at the depth.
    pub friction_share: f64,
    /// Error of the stick ratio that counts 1.
    pub stick: f64,
    /// Error of the stick ratio that counts 1 where everything sticks or everything slips.
    pub stick_end: f64,
    /// Error of the area that counts 1, share of the largest of its run.
    pub area_share: f64,
    /// Change of a number of the fit that counts 1: holds what the runs do not determine at its start.
    pub prior: f64,
    /// Largest number of iterations.
    pub iterations: usize,
    /// Fits from beside the best one so far, the best of which is kept: the sum of squares has many minima.
    pub restarts: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rising_knots: 12,
            gentle_knots: 6,
            normal_share: 0.005,
            friction_share: 0.004,
            stick: 0.03,
            stick_end: 0.02,
            area_share: 0.03,
            prior: 2.0,
            iterations: 40,
            restarts: 0,
        }
    }
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct Fitted<const M: usize, const N: usize> {
    /// The parameters; bands are 0.
    pub params: ParamsOf<M, N>,
    /// The parameter vector behind them.
    pub theta: Vec<f64>,
    /// Half the sum of squared residuals at the start and at the end.
    pub cost: [f64; 2],
    /// Evaluations of all runs, those for derivatives not counted.
    pub evaluations: usize,
    /// Why the minimiser stopped, in its words.
    pub ended: String,
}

/// Fits the form with `M` elements and `N` table nodes to those `runs` that are not held out.
///
/// * `pressure_exponent`: beta of the runs' friction law
///
/// # Errors
/// [`ReduceError::Runs`] if the runs do not suffice for a start, [`ReduceError::SlipLengthOfRuns`] or
/// [`ReduceError::Model`] if the core refuses the initial guess, [`ReduceError::Fit`] if the minimiser gave up.
pub fn fit<const M: usize, const N: usize>(
    runs: &[Run],
    pressure_exponent: f64,
    settings: &Settings,
) -> Result<Fitted<M, N>, ReduceError> {
    let runs: Vec<&Run> = runs.iter().filter(|r| !r.held_out).collect();
    let guess = initial_guess(&runs)?;
    let deepest = runs.iter().flat_map(|r| &r.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let parameterisation =
        Parameterisation::new(settings.rising_knots, settings.gentle_knots, deepest, pressure_exponent);
    let origin = parameterisation.start(M, &guess);
    let first = parameterisation.params::<M, N>(&origin).try_build();
    first.map_err(|error| explained(error, &guess, pressure_exponent))?;
    let scales = runs.iter().map(|run| Scales::of(run, settings)).collect();
    let mut problem =
        Replay::<M, N> { runs, scales, limit: guess.limit, parameterisation, settings, origin: origin.clone() };
    let before = problem.residuals_at(&origin).ok_or_else(|| ReduceError::Fit("no residuals".into()))?;
    let best = minimise_with_restarts(&mut problem, &origin)?;
    Ok(Fitted {
        params: problem.parameterisation.params(&best.theta),
        theta: best.theta,
        cost: [objective(&before), best.report.objective_function],
        evaluations: best.evaluations,
        ended: format!("{:?}", best.report.termination),
    })
}

/// The best end of all minimisations.
struct Best {
    theta: Vec<f64>,
    report: MinimizationReport<f64>,
    evaluations: usize,
}

/// Minimises from `origin`, then as often as the settings say from beside the best end so far.
fn minimise_with_restarts<const M: usize, const N: usize>(
    problem: &mut Replay<'_, M, N>,
    origin: &[f64],
) -> Result<Best, ReduceError> {
    let minimiser = LevenbergMarquardt::new()
        .with_ftol(1e-4)
        .with_xtol(1e-6)
        .with_gtol(0.0)
        .with_patience(problem.settings.iterations);
    let useful = |report: &MinimizationReport<f64>| {
        report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience)
    };
    let (theta, report) = minimise(problem, origin, &minimiser);
    if !useful(&report) {
        return Err(ReduceError::Fit(format!("{:?}", report.termination)));
    }
    let mut best = Best { theta, evaluations: report.number_of_evaluations, report };
    let mut noise = Noise(1);
    for _ in 0..problem.settings.restarts {
        let beside: Vec<f64> = best.theta.iter().map(|v| v + RESTART_STEP * noise.number()).collect();
        if problem.parameterisation.params::<M, N>(&beside).try_build().is_err() {
            continue;
        }
        let (theta, report) = minimise(problem, &beside, &minimiser);
        best.evaluations += report.number_of_evaluations;
        if useful(&report) && report.objective_function < best.report.objective_function {
            (best.theta, best.report) = (theta, report);
        }
    }
    Ok(best)
}

/// Largest change of a number of the vector at a restart; they are of order 1.
const RESTART_STEP: f64 = 0.1;

/// Knuth's MMIX linear congruential generator: restarts are the same in every run.
struct Noise(u64);

impl Noise {
    /// Uniform in −1 to 1.
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Errors of a run's normal force and contact area that count 1.
struct Scales {
    normal_n: f64,
    area_mm2: f64,
}

impl Scales {
    fn of(run: &Run, settings: &Settings) -> Self {
        let most = |of: fn(&super::Sample) -> f32| run.samples.iter().map(of).fold(0.0f32, f32::max);
        let normal = f64::from(most(|s| s.normal_force_n)).max(1e-3);
        let area = f64::from(most(|s| s.contact_area_mm2)).max(1.0);
        Self { normal_n: normal * settings.normal_share, area_mm2: area * settings.area_share }
    }
}

/// The fit's problem: replay all runs through the core and compare with the finite elements.
struct Replay<'a, const M: usize, const N: usize> {
    runs: Vec<&'a Run>,
    scales: Vec<Scales>,
    /// Power law of the limit that friction errors are weighed with, fixed so that the weights do not move.
    limit: [f64; 2],
    parameterisation: Parameterisation,
    settings: &'a Settings,
    /// Initial guess, near which the prior holds what the runs do not determine.
    origin: Vec<f64>,
}

impl<const M: usize, const N: usize> Replay<'_, M, N> {
    /// Residuals of all runs at `theta`, then those of the prior.
    fn residuals_at(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let data = self.parameterisation.params::<M, N>(theta).try_build().ok()?;
        let parts: Option<Vec<Vec<f64>>> = self
            .runs
            .iter()
            .zip(&self.scales)
            .map(|(run, scales)| {
                let responses = replay_data(&data, run)?;
                let mut out = Vec::with_capacity(5 * responses.len());
                for (sample, r) in run.samples.iter().zip(&responses) {
                    if sample.normal_force_n <= 0.0 && r.normal_force_n <= 0.0 {
                        out.extend([0.0; 5]);
                        continue;
                    }
                    let limit = self.limit[0] * f64::from(sample.depth_mm).max(0.05).powf(self.limit[1]);
                    let friction = self.settings.friction_share * limit;
                    let of = |a: f32, b: f32, scale: f64| f64::from(a - b) / scale;
                    out.push(of(r.normal_force_n, sample.normal_force_n, scales.normal_n));
                    out.push(of(r.friction_n[0], sample.friction_n[0], friction));
                    out.push(of(r.friction_n[1], sample.friction_n[1], friction));
                    // The ends of the stick ratio are regimes of their own.
                    let end = matches!(sample.regime, Regime::Stick | Regime::Slip);
                    let stick = if end { self.settings.stick_end } else { self.settings.stick };
                    out.push(of(r.stick_ratio, sample.stick_ratio, stick));
                    out.push(of(r.contact_area_mm2, sample.contact_area_mm2, scales.area_mm2));
                }
                Some(out)
            })
            .collect();
        let mut all: Vec<f64> = parts?.concat();
        all.extend(theta.iter().zip(self.origin.iter()).map(|(t, o)| (t - o) / self.settings.prior));
        Some(all)
    }
}

/// Residual of everything where there is no model.
const NO_MODEL: f64 = 1e3;
/// Step of the finite differences; the vector's numbers are of order 1 and the replay is good to some 1e-7.
const DIFFERENCE: f64 = 2e-3;

impl<const M: usize, const N: usize> Problem for Replay<'_, M, N> {
    fn residuals(&mut self, theta: &[f64]) -> Option<Vec<f64>> {
        // What is no model is merely bad, so that the minimiser steps back instead of giving up.
        let rows = 5 * self.runs.iter().map(|r| r.samples.len()).sum::<usize>() + theta.len();
        Some(self.residuals_at(theta).unwrap_or_else(|| vec![NO_MODEL; rows]))
    }

    fn jacobian(&mut self, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        (0..theta.len())
            .into_par_iter()
            .map(|k| {
                let shifted = |by: f64| {
                    let mut theta = theta.to_vec();
                    theta[k] += by;
                    self.residuals_at(&theta)
                };
                // At the edge of what is a model the derivative is that of the side within.
                let (up, down) = (shifted(DIFFERENCE), shifted(-DIFFERENCE));
                let here = || self.residuals_at(theta);
                let (up, down) = match (up, down) {
                    (Some(up), Some(down)) => (up, down),
                    (Some(up), None) => (up.clone(), up.iter().zip(here()?).map(|(u, h)| 2.0 * h - u).collect()),
                    (None, Some(down)) => (down.iter().zip(here()?).map(|(d, h)| 2.0 * h - d).collect(), down),
                    (None, None) => return None,
                };
                Some(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * DIFFERENCE)).collect())
            })
            .collect()
    }
}
