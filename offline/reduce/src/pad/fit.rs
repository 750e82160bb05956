//! Fit of the few numbers of a pad that follow from nonlinear runs.

use fingerpad::pad::Law;
use fingerpad_fe::contact::Outline;
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};
use rayon::prelude::*;

use super::score::{errors, largest};
use super::{FittedNumbers, PadModel, replay};
use crate::Run;

/// Limits of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitLimits {
    /// Evaluations of the minimiser for each parameter.
    pub patience: usize,
    /// Whether a prior keeps the numbers near their start, which is necessary with few runs.
    pub hold: bool,
}

/// Step of the finite differences; the parameters are logarithms.
const DIFFERENCE: f64 = 1e-2;
/// Weights of residuals: normal force, friction, stick ratio, centre (1/mm), moment, area.
const WEIGHTS: [f64; 6] = [1.5, 1.0, 0.1, 0.05, 0.3, 0.2];

/// Number of positive parameters, which the minimiser varies as logarithms.
const NUMBERS: usize = 16;
/// Number of parameters of either sign.
const SIGNED: usize = 28;

fn to_numbers(fitted: &FittedNumbers) -> Vec<f64> {
    let FittedNumbers { law, local, spread, sheared, weight } = fitted;
    let logs = [
        law.softness[0],
        law.softness[1],
        law.stiffening[0],
        law.stiffening[1],
        local[0],
        local[1],
        law.flattening_mpa[0],
        law.flattening_mpa[1],
        *spread,
        law.area[0],
        law.area[1],
        law.area[2],
        law.friction[0],
        law.friction[1],
        law.onset,
        *sheared,
    ];
    let signed = law.lift.iter().flatten().copied().chain([law.turn]).chain(*weight);
    logs.into_iter().map(f64::ln).chain(signed).collect()
}

fn to_fitted(numbers: &[f64]) -> FittedNumbers {
    let n: Vec<f64> = numbers[..NUMBERS].iter().map(|x| x.clamp(-14.0, 6.0).exp()).collect();
    let signed = &numbers[NUMBERS..NUMBERS + SIGNED];
    let law = Law {
        softness: [n[0], n[1]],
        stiffening: [n[2], n[3]],
        flattening_mpa: [n[6], n[7]],
        area: [n[9], n[10], n[11]],
        friction: [n[12], n[13].min(1.0)],
        onset: n[14],
        lift: [0, 12].map(|first| std::array::from_fn(|k| signed[first + k])),
        turn: signed[24],
    };
    FittedNumbers {
        law,
        local: [n[4], n[5]],
        spread: n[8],
        sheared: n[15],
        weight: [signed[25], signed[26], signed[27]],
    }
}

/// Weight of the prior: the error along a run that is equivalent to a change by [`HELD_LOG`] of a logarithm, or by [`HELD_SIGNED`] of
/// another parameter.
const HELD_ERROR: f64 = 0.02;
const HELD_LOG: f64 = 0.3;
const HELD_SIGNED: f64 = 0.1;

struct OfRuns<'a> {
    at_rest: &'a PadModel,
    /// Centre of the prior, if there is one.
    near: Option<&'a [f64]>,
    runs: &'a [&'a Run],
    outline: &'a Outline,
}

impl OfRuns<'_> {
    fn of(&self, numbers: &[f64]) -> Vec<f64> {
        let model = self.at_rest.fitted(&to_fitted(numbers));
        let of_run = |run: &&Run| {
            let [normal, friction, area] = largest(run);
            let weight = 1.0 / (run.samples.len() as f64).sqrt();
            let mut out = Vec::with_capacity(8 * run.samples.len());
            for (s, a) in run.samples.iter().zip(replay(&model, run, self.outline)) {
                let e = errors(s, &a);
                let [n, f, stick, centre, moment, contact] = WEIGHTS.map(|w| w * weight);
                let is_loaded = if f64::from(s.normal_force_n) > 0.1 * normal { 1.0 } else { 0.0 };
                out.extend([
                    n * e[0] / normal,
                    f * e[1] / friction,
                    f * e[2] / friction,
                    stick * e[3],
                    centre * e[4] * is_loaded,
                    centre * e[5] * is_loaded,
                    moment * e[6] / (3.0 * friction),
                    contact * e[7] / area,
                ]);
            }
            out
        };
        let mut out = self.runs.par_iter().map(of_run).collect::<Vec<_>>().concat();
        for (k, (number, start)) in numbers.iter().zip(self.near.unwrap_or_default()).enumerate() {
            out.push(HELD_ERROR * (number - start) / if k < NUMBERS { HELD_LOG } else { HELD_SIGNED });
        }
        out
    }
}

impl Problem for OfRuns<'_> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        Some(self.of(at))
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        let base = self.of(at);
        let column = |k: usize| {
            let mut moved = at.to_vec();
            moved[k] += DIFFERENCE;
            self.of(&moved).iter().zip(&base).map(|(a, b)| (a - b) / DIFFERENCE).collect()
        };
        Some((0..at.len()).map(column).collect())
    }
}

/// Least-squares fit of the parameters to `runs`, from `start`.
///
/// * `at_rest`: the pad that [`super::pad`] returns
pub fn fit(
    at_rest: &PadModel,
    start: &FittedNumbers,
    runs: &[&Run],
    outline: &Outline,
    limits: FitLimits,
) -> FittedNumbers {
    let origin = to_numbers(start);
    let near = limits.hold.then_some(origin.as_slice());
    let mut problem = OfRuns { at_rest, near, runs, outline };
    let minimiser =
        LevenbergMarquardt::new().with_patience(limits.patience).with_ftol(1e-5).with_xtol(1e-4).with_stepbound(0.5);
    let (end, _) = minimise(&mut problem, &origin, &minimiser);
    to_fitted(&end)
}
