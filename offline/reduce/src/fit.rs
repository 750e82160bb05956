//! The fit: the model's numbers that make its replay of the runs least wrong, in the sense of weighted least squares.
//!
//! Main types: [`Settings`], [`fit`]. Every residual comes out of `fingerpad` itself, in 64-bit numbers; the Jacobian is
//! by finite differences. Minimiser: Levenberg–Marquardt after MINPACK (crate `levenberg-marquardt`).
//! Uses initial_guess, parameterisation, replay.

use std::ops::Range;

use fingerpad::{ParamsOf, Regime, Response};
use fingerpad_least_squares::{
    LevenbergMarquardt, MinimizationReport, Problem, TerminationReason, minimise, objective,
};
use rayon::prelude::*;

use super::initial_guess::initial_guess;
use super::parameterisation::Parameterisation;
use super::replay::{pressure_centre, replay_coarsely, spin_moment};
use super::{ReduceError, Run, Sample};

/// Settings of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Knots of normal force and area.
    pub rising_knots: usize,
    /// Knots of the other tables.
    pub gentle_knots: usize,
    /// Error of the normal force that counts 1, share of the largest of its run.
    pub normal_share: f64,
    /// Error of friction and of the spin moment over the springs' mean arm that counts 1, share of the limit at the depth.
    pub friction_share: f64,
    /// Error of the stick ratio that counts 1.
    pub stick: f64,
    /// Error of the stick ratio that counts 1 where everything sticks or everything slips.
    pub stick_end: f64,
    /// Error of the area that counts 1, share of the largest of its run.
    pub area_share: f64,
    /// Error of the centre of pressure that counts 1, mm.
    pub centre_mm: f64,
    /// Change of a number of the fit that counts 1: holds what the runs do not determine at its start.
    pub prior: f64,
    /// The same for the bends of the yield slides.
    pub bend_prior: f64,
    /// Largest number of iterations.
    pub iterations: usize,
    /// Iterations of each start before the best one goes on.
    pub start_iterations: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rising_knots: 12,
            gentle_knots: 4,
            normal_share: 0.005,
            friction_share: 0.01,
            stick: 0.03,
            stick_end: 0.02,
            area_share: 0.03,
            centre_mm: 0.1,
            prior: 2.0,
            bend_prior: 0.3,
            iterations: 40,
            start_iterations: 12,
        }
    }
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct Fitted<const M: usize, const N: usize> {
    /// The parameters; bands are 0.
    pub params: ParamsOf<M, N, f64>,
    /// The parameter vector behind them.
    pub theta: Vec<f64>,
    /// Half the sum of squared residuals of the forces at the start and at the end.
    pub cost: [f64; 2],
    /// Why the minimiser stopped, in its words.
    pub ended: String,
}

/// What is compared between model and runs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Compared {
    /// Normal force and friction.
    Forces,
    /// Stick ratio, area, centre of pressure.
    Contact,
    /// Friction and moment under spin.
    Spin,
}

pub fn fit_from<const M: usize, const N: usize>(
    runs: &[Run],
    touch_mm: [f64; M],
    pressure_exponent: f64,
    settings: &Settings,
) -> Result<Fitted<M, N>, ReduceError> {
    let runs: Vec<&Run> = runs.iter().filter(|r| !r.held_out).collect();
    let guess = initial_guess(&runs)?;
    let deepest = runs.iter().flat_map(|r| &r.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let parameterisation =
        Parameterisation::new(settings.rising_knots, settings.gentle_knots, deepest, pressure_exponent);
    let mut theta = parameterisation.start(&touch_mm, &guess);
    let planar: Vec<&Run> = runs.iter().copied().filter(|r| !r.spins()).collect();
    let spinning: Vec<&Run> = runs.iter().copied().filter(|r| r.spins()).collect();
    let mut cost = [0.0; 2];
    let mut ended = String::new();
    for (compared, range, runs) in [
        (Compared::Forces, parameterisation.of_forces(M), &planar),
        (Compared::Contact, parameterisation.of_contact(M), &planar),
        (Compared::Spin, parameterisation.of_spin(M), &spinning),
    ]
    .into_iter()
    .take(std::env::var("STAGES").map_or(3, |s| s.parse().unwrap()))
    {
        let mut problem = Replay::<M, N> {
            runs,
            limit: guess.limit,
            parameterisation: &parameterisation,
            settings,
            compared,
            range: range.clone(),
            theta: theta.clone(),
        };
        let origin = theta[range.clone()].to_vec();
        let before = problem.residuals(&origin).ok_or_else(|| ReduceError::Fit("no residuals".into()))?;
        let (found, report) = minimised(&mut problem, &origin, settings.iterations)?;
        if compared == Compared::Forces {
            cost = [objective(&before), report.objective_function];
            ended = format!("{:?} {}", report.termination, report.number_of_evaluations);
        }
        theta[range].copy_from_slice(&found);
    }
    Ok(Fitted { params: parameterisation.params(&theta), theta, cost, ended })
}

fn minimised(
    problem: &mut dyn Problem,
    origin: &[f64],
    iterations: usize,
) -> Result<(Vec<f64>, MinimizationReport<f64>), ReduceError> {
    let minimiser = LevenbergMarquardt::new()
        .with_ftol(1e-5)
        .with_xtol(1e-6)
        .with_gtol(0.0)
        .with_stepbound(1.0)
        .with_patience(iterations);
    let (theta, report) = minimise(problem, origin, &minimiser);
    let useful = report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience);
    if useful { Ok((theta, report)) } else { Err(ReduceError::Fit(format!("{:?}", report.termination))) }
}

/// Replays of the runs, compared with the finite elements.
struct Replay<'a, const M: usize, const N: usize> {
    runs: &'a [&'a Run],
    /// Power law of the limit that friction errors are weighed with, fixed so that the weights do not move.
    limit: [f64; 2],
    parameterisation: &'a Parameterisation,
    settings: &'a Settings,
    compared: Compared,
    /// Which numbers are varied.
    range: Range<usize>,
    /// The whole vector at the start; a prior near it holds what the runs do not determine.
    theta: Vec<f64>,
}

impl<const M: usize, const N: usize> Replay<'_, M, N> {
    fn of_row(&self, sample: &Sample, r: &Response<f64>, most: [f64; 2], arm: f64, out: &mut Vec<f64>) {
        let s = self.settings;
        let normal = f64::from(sample.normal_force_n);
        let limit = self.limit[0] * f64::from(sample.depth_mm).max(0.05).powf(self.limit[1]);
        let friction = s.friction_share * limit;
        let of = |a: f64, b: f32, scale: f64| (a - f64::from(b)) / scale;
        match self.compared {
            Compared::Forces => {
                out.push(of(r.normal_force_n, sample.normal_force_n, s.normal_share * most[0]));
                out.extend([0, 1].map(|k| of(r.friction_n[k], sample.friction_n[k], friction)));
            }
            Compared::Contact => {
                // The ends of the stick ratio are regimes of their own.
                let end = matches!(sample.regime, Regime::Stick | Regime::Slip);
                out.push(of(r.stick_ratio, sample.stick_ratio, if end { s.stick_end } else { s.stick }));
                out.push(of(r.contact_area_mm2, sample.contact_area_mm2, s.area_share * most[1]));
            }
            Compared::Spin => {
                out.extend([0, 1].map(|k| of(r.friction_n[k], sample.friction_n[k], friction)));
                let moment = spin_moment(sample).unwrap_or(r.spin_moment_n_mm);
                out.push((r.spin_moment_n_mm - moment) / (friction * arm));
                let centre = pressure_centre(sample).unwrap_or(r.pressure_centre_mm);
                out.push((r.pressure_centre_mm - centre) * normal / (most[0] * s.centre_mm));
            }
        }
    }
    fn residuals_at(&self, varied: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        theta[self.range.clone()].copy_from_slice(varied);
        let data = self.parameterisation.params::<M, N>(&theta).build_unchecked();
        let model = data.model_unchecked();
        let mut out = Vec::new();
        for run in self.runs {
            let most = |of: fn(&Sample) -> f32| f64::from(run.samples.iter().map(of).fold(0.0f32, f32::max));
            let most = [most(|s| s.normal_force_n).max(1e-3), most(|s| s.contact_area_mm2).max(1.0)];
            for (sample, r) in run.samples.iter().zip(&replay_coarsely(&model, run, COARSE)) {
                if sample.normal_force_n > 0.0 || r.normal_force_n > 0.0 {
                    self.of_row(sample, r, most, ARM_MM, &mut out);
                } else {
                    out.extend(vec![
                        0.0;
                        match self.compared {
                            Compared::Forces => 3,
                            Compared::Contact => 2,
                            Compared::Spin => 4,
                        }
                    ]);
                }
            }
        }
        let of_bends = self.parameterisation.of_bends(M);
        let prior = |k: usize| {
            if of_bends.iter().any(|r| r.contains(&k)) { self.settings.bend_prior } else { self.settings.prior }
        };
        out.extend(self.range.clone().zip(varied).map(|(k, t)| (t - self.theta[k]) / prior(k)));
        out
    }
}

/// Steps of a fit's replays over those of others: the error of friction is 0.1 % of the limit.
const COARSE: f32 = 3.0;
/// Length that makes a moment a force, mm.
const ARM_MM: f64 = 3.0;
/// Step of the finite differences; the vector's numbers are of order 1.
const DIFFERENCE: f64 = 1e-5;

impl<const M: usize, const N: usize> Problem for Replay<'_, M, N> {
    fn residuals(&mut self, theta: &[f64]) -> Option<Vec<f64>> {
        Some(self.residuals_at(theta).into_iter().map(|r| if r.is_finite() { r } else { 1e3 }).collect())
    }

    fn jacobian(&mut self, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        let here = self.residuals_at(theta);
        Some(
            (0..theta.len())
                .into_par_iter()
                .map(|k| {
                    let mut to = theta.to_vec();
                    to[k] += DIFFERENCE;
                    self.residuals_at(&to).iter().zip(&here).map(|(u, h)| (u - h) / DIFFERENCE).collect()
                })
                .collect(),
        )
    }
}
