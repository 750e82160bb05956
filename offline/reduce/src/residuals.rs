//! Residuals of the fit: differences between the model's replay and the finite elements.
//!
//! Main type: [`Replay`]. All responses are computed by `fingerpad` itself in double precision; the Jacobian is by finite
//! differences. Uses parameterisation, replay.

use std::ops::Range;

use fingerpad::build::DataOf;
use fingerpad::{Error, Regime, Response};
use fingerpad_least_squares::Problem;
use rayon::prelude::*;

use super::parameterisation::Parameterisation;
use super::replay::{pressure_centre, replay_coarsely, spin_moment};
use super::{FitProgress, Run, Sample, Settings};

/// Quantities that a stage of the fit compares between model and runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compared {
    /// Normal force and friction.
    Forces,
    /// Stick ratio and area.
    Contact,
    /// Normal force, friction, moment and centre of pressure under spin.
    Spin,
}

impl Compared {
    /// The part of the parameter vector that the fit varies for this comparison.
    pub fn range(self, layout: &Parameterisation, springs: usize) -> Range<usize> {
        match self {
            Self::Forces => layout.of_forces(springs),
            Self::Contact => layout.of_contact(springs),
            Self::Spin => layout.of_spin(springs),
        }
    }

    /// Residuals of a row.
    fn count(self) -> usize {
        match self {
            Self::Forces => 3,
            Self::Contact => 2,
            Self::Spin => 6,
        }
    }
}

/// Replays of the runs, compared with the finite elements.
pub struct Replay<'a, const M: usize, const N: usize> {
    /// The runs, each with the weight of its rows.
    pub runs: &'a [(&'a Run, f64)],
    /// Power law of the limit by which errors of friction are divided. It is constant, so that the weights do not change in a fit.
    pub limit: [f64; 2],
    /// Layout of the parameter vector.
    pub layout: &'a Parameterisation,
    /// Weights.
    pub settings: &'a Settings,
    /// Compared quantities.
    pub compared: Compared,
    /// The whole vector at the start, which is the centre of the prior. The prior determines parameters that the runs do not.
    pub theta: Vec<f64>,
    /// Counter of iterations.
    pub progress: &'a FitProgress<'a>,
}

/// Length of the steps of a fit's replays over that of others.
const COARSE: f32 = 3.0;
/// Arm that converts a moment to a force, mm.
const ARM_MM: f64 = 3.0;
/// Step of the finite differences; the vector's numbers are of order 1.
const DIFFERENCE: f64 = 1e-4;
/// Largest residual, also that of parameters without a valid model: the minimiser then takes a shorter step.
const NO_MODEL: f64 = 1e3;

impl<const M: usize, const N: usize> Replay<'_, M, N> {
    /// Residuals of one row; `most` are the largest normal force and area of the run.
    fn of_row(&self, sample: &Sample, r: &Response<f64>, most: [f64; 2], out: &mut Vec<f64>) {
        let s = self.settings;
        let limit = self.limit[0] * f64::from(sample.depth_mm).max(0.05).powf(self.limit[1]);
        let friction = s.friction_share * limit;
        let of = |a: f64, b: f32, scale: f64| (a - f64::from(b)) / scale;
        let of_friction = [0, 1].map(|k| of(r.friction_n[k], sample.friction_n[k], friction));
        let of_normal = of(r.normal_force_n, sample.normal_force_n, s.normal_share * most[0]);
        match self.compared {
            Compared::Forces => {
                out.push(of_normal);
                out.extend(of_friction);
            }
            Compared::Contact => {
                // Full stick and full slip are regimes and have a weight of their own.
                let end = matches!(sample.regime, Regime::Stick | Regime::Slip);
                out.push(of(r.stick_ratio, sample.stick_ratio, if end { s.stick_end } else { s.stick }));
                out.push(of(r.contact_area_mm2, sample.contact_area_mm2, s.area_share * most[1]));
            }
            Compared::Spin => {
                out.push(of_normal);
                out.extend(of_friction);
                let moment = spin_moment(sample).unwrap_or(r.spin_moment_n_mm);
                out.push((r.spin_moment_n_mm - moment) / (friction * ARM_MM));
                let centre = pressure_centre(sample).unwrap_or(r.pressure_centre_mm);
                let weight = f64::from(sample.normal_force_n) / (most[0] * s.centre_mm);
                out.extend([0, 1].map(|k| (r.pressure_centre_mm[k] - centre[k]) * weight));
            }
        }
    }

    /// Residuals of all runs, then those of the prior, then the penalty of numbers that the core refuses.
    fn residuals_at(&self, varied: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        let range = self.compared.range(self.layout, M);
        theta[range.clone()].copy_from_slice(varied);
        let data = self.layout.params::<M, N>(&theta).build_unchecked();
        let model = data.model_unchecked();
        let mut out = Vec::new();
        for (run, weight) in self.runs {
            let before = out.len();
            let most = |of: fn(&Sample) -> f32| f64::from(run.samples.iter().map(of).fold(0.0f32, f32::max));
            let most = [most(|s| s.normal_force_n).max(1e-3), most(|s| s.contact_area_mm2).max(1.0)];
            for (sample, r) in run.samples.iter().zip(&replay_coarsely(&model, run, COARSE)) {
                if sample.normal_force_n > 0.0 || r.normal_force_n > 0.0 {
                    self.of_row(sample, r, most, &mut out);
                } else {
                    out.extend(vec![0.0; self.compared.count()]);
                }
            }
            let root = weight.sqrt();
            out[before..].iter_mut().for_each(|residual| *residual *= root);
        }
        let bends = self.layout.of_bends(M);
        let prior = |k: usize| {
            let is_bend = bends.iter().any(|r| r.contains(&k));
            if is_bend { self.settings.bend_prior } else { self.settings.prior }
        };
        out.extend(range.zip(varied).map(|(k, t)| (t - self.theta[k]) / prior(k)));
        out.push(refusal(&data));
        // Also replaces infinite values and NaN by the largest residual.
        out.iter().map(|r| if r.abs() < NO_MODEL { *r } else { NO_MODEL }).collect()
    }
}

/// Penalty: 0 for numbers that the core accepts; for a model that is not passive it grows with the excess.
fn refusal<const M: usize, const N: usize>(data: &DataOf<M, N, f64>) -> f64 {
    match data.check() {
        Ok(()) => 0.0,
        Err(Error::NotPassive { value, limit, .. }) => {
            let excess = f64::from(value - limit) / f64::from(limit.abs()).max(1e-9);
            // The penalty grows far from passive numbers too, so that the minimiser can return.
            (0.1 + 0.9 * excess / (1.0 + excess)) * NO_MODEL
        }
        Err(_) => NO_MODEL,
    }
}

impl<const M: usize, const N: usize> Problem for Replay<'_, M, N> {
    fn residuals(&mut self, theta: &[f64]) -> Option<Vec<f64>> {
        Some(self.residuals_at(theta))
    }

    fn jacobian(&mut self, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        self.progress.iterate();
        let here = self.residuals_at(theta);
        let column = |k: usize| {
            let mut to = theta.to_vec();
            to[k] += DIFFERENCE;
            self.residuals_at(&to).iter().zip(&here).map(|(u, h)| (u - h) / DIFFERENCE).collect()
        };
        Some((0..theta.len()).into_par_iter().map(column).collect())
    }
}
