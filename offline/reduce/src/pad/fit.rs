//! Fit of the few numbers of a pad that follow from nonlinear runs.

use fingerpad::pad::Law;
use fingerpad_fe::contact::{Outline, RubberFriction};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};
use rayon::prelude::*;

use super::score::{errors, full_slip, is_free, largest};
use super::{FittedNumbers, PadModel, PadSettings, replay, replay_on_plane};
use crate::Run;
use crate::retune::lift_units;

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
/// Places of the friction law among them.
const FRICTION: [usize; 2] = [12, 13];
/// Number of parameters of either sign.
const SIGNED: usize = 28;

/// Units of the parameters of either sign for a tip of this size.
fn units(length: f64) -> Vec<f64> {
    (0..2).flat_map(|_| lift_units(length)).chain([1.0; 4]).collect()
}

fn to_numbers(fitted: &FittedNumbers, units: &[f64]) -> Vec<f64> {
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
    logs.into_iter().map(f64::ln).chain(signed.zip(units).map(|(x, unit)| x / unit)).collect()
}

fn to_fitted(numbers: &[f64], units: &[f64]) -> FittedNumbers {
    let n: Vec<f64> = numbers[..NUMBERS].iter().map(|x| x.clamp(-14.0, 6.0).exp()).collect();
    let signed: Vec<f64> = numbers[NUMBERS..NUMBERS + SIGNED].iter().zip(units).map(|(x, unit)| x * unit).collect();
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
    /// See [`units`].
    units: Vec<f64>,
    /// The parameters at the start.
    origin: Vec<f64>,
    /// Places of the parameters that vary.
    varied: Vec<usize>,
    /// Whether a prior keeps the parameters near the start.
    hold: bool,
    friction: &'a RubberFriction,
    runs: &'a [&'a Run],
    outline: &'a Outline,
}

/// Friction in full slip over that of the finite elements, a logarithm, that has the same residual as an error of friction of that share of
/// the largest of the run.
const BOUND: f64 = 3.0;

impl OfRuns<'_> {
    fn fitted(&self, varied: &[f64]) -> FittedNumbers {
        let mut numbers = self.origin.clone();
        self.varied.iter().zip(varied).for_each(|(k, x)| numbers[*k] = *x);
        to_fitted(&numbers, &self.units)
    }

    fn of(&self, varied: &[f64]) -> Vec<f64> {
        let model = self.at_rest.fitted(&self.fitted(varied));
        let binds = is_free(self.friction);
        let of_run = |run: &&Run| {
            let [normal, friction, area] = largest(run, [self.friction.lambda, self.friction.beta]);
            let weight = 1.0 / (run.samples.len() as f64).sqrt();
            let mut out = Vec::with_capacity(9 * run.samples.len());
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
                if binds {
                    out.push(BOUND * weight * full_slip(s, &a, self.friction).unwrap_or(0.0));
                }
            }
            out
        };
        let mut out = self.runs.par_iter().map(of_run).collect::<Vec<_>>().concat();
        for (k, number) in self.varied.iter().zip(varied).filter(|_| self.hold) {
            out.push(HELD_ERROR * (number - self.origin[*k]) / if *k < NUMBERS { HELD_LOG } else { HELD_SIGNED });
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

/// Least-squares fit of the parameters to `runs`.
///
/// * `at_rest`: the pad that [`super::pad`] returns
pub fn fit(at_rest: &PadModel, runs: &[&Run], outline: &Outline, settings: &PadSettings) -> FittedNumbers {
    let PadSettings { limits, tip, friction, .. } = settings;
    let mut start = FittedNumbers::of_tip(tip, friction);
    let units = units(tip.length);
    let is_free = is_free(friction);
    if !is_free {
        start.law.friction = [friction.lambda, friction.beta];
    }
    let origin = to_numbers(&start, &units);
    let varied = (0..NUMBERS + SIGNED).filter(|k| is_free || !FRICTION.contains(k)).collect();
    let mut problem = OfRuns { at_rest, units, origin, varied, hold: limits.hold, runs, friction, outline };
    let first: Vec<f64> = problem.varied.iter().map(|k| problem.origin[*k]).collect();
    let minimiser =
        LevenbergMarquardt::new().with_patience(limits.patience).with_ftol(1e-5).with_xtol(1e-4).with_stepbound(0.5);
    let (end, _) = minimise(&mut problem, &first, &minimiser);
    let mut found = problem.fitted(&end);
    if is_free {
        found.law.friction[0] *= scale_of_friction(&at_rest.fitted(&found), runs, friction);
    }
    found
}

/// Factor on lambda that gives the pad the friction of the finite elements in full slip in the neutral pose, in the mean over all rows.
fn scale_of_friction(model: &PadModel, runs: &[&Run], friction: &RubberFriction) -> f64 {
    let neutral = model.numbers.neutral_pitch_deg;
    let own = runs.iter().filter(|run| run.body.is_plane() && run.is_neutral(neutral));
    let rows = own.flat_map(|run| run.samples.iter().zip(replay_on_plane(model, run)));
    let (mut sum, mut count) = (0.0, 0.0);
    for log in rows.filter_map(|(s, a)| full_slip(s, &a, friction)) {
        sum += log;
        count += 1.0;
    }
    f64::exp(-sum / f64::max(count, 1.0))
}
