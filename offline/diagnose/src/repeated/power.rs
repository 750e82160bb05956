//! Power of a protocol: how often these runs would raise a false alarm, and how often they would detect and name an effect.
//!
//! Readings are simulated at the rows of the measured runs from the calibrated model and decided like the measured ones; the
//! calibration is kept. The finger of each set is drawn from what the calibration and its drift leave open, so that the
//! error of the calibration is in every set; noise of the rows, scatter between runs (its variance drawn from what so few
//! calibration runs leave open) and errors of state columns are drawn as well. The finger's own laws are as
//! calibrated. What is not in it is an error of the model's form.
//!
//! Main types: [`PowerSettings`]; main function: [`power`].

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::Instant;

use fingerpad_formats::in_threads;
use fingerpad_smooth::{Parameter, Parameters};
use nalgebra::DVector;

use crate::data::runs::RunSet;
use crate::laws::{Law, Reported};
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::{MODEL_EFFECTS, PerEffect, RandomEffects};
use crate::repeated::redecision::{Outcome, Redecision};
use crate::schema::{NotSimulated, Power, PowerCell, Rate, Verdict};
use crate::selection::scan::{start_of, why_untestable};
use crate::statistics::sign_flips::RandomSigns;
use crate::statistics::task::Task;
use crate::verdict::basis::Basis;
use crate::verdict::sizes::size_p90;

/// Choices of a simulation of power.
#[derive(Clone, Debug)]
pub struct PowerSettings {
    /// Wall time, s; sets that are being decided when it ends are counted.
    pub seconds: f64,
    /// Sizes of the effects: 90th percentile of the relative change of a force.
    pub sizes: Vec<f64>,
    /// Only these laws; empty for all.
    pub laws: Vec<&'static str>,
    /// Threads.
    pub threads: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for PowerSettings {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { seconds: 120.0, sizes: vec![0.03, 0.1, 0.3], laws: Vec::new(), threads, seed: 1 }
    }
}

/// What is simulated again and again: no effect, or one law at one size.
#[derive(Clone, Copy)]
struct Cell {
    effect: Option<(&'static Law, f64)>,
}

/// Outcomes of a cell.
#[derive(Clone, Copy, Default)]
struct Counts {
    sets: usize,
    detected: usize,
    named: usize,
    misnamed: usize,
}

impl Counts {
    fn add(&mut self, outcome: &Outcome, family: Option<&str>) {
        self.sets += 1;
        self.detected += usize::from(outcome.verdict != Verdict::None);
        if outcome.verdict == Verdict::Named {
            let is_right = family.is_some_and(|family| outcome.families() == [family]);
            let is_wrong = outcome.families().iter().all(|named| Some(*named) != family);
            self.named += usize::from(is_right);
            self.misnamed += usize::from(is_wrong);
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            sets: self.sets + other.sets,
            detected: self.detected + other.detected,
            named: self.named + other.named,
            misnamed: self.misnamed + other.misnamed,
        }
    }

    fn cell(self, law: &str, family: &str, size_p90_relative: f64) -> PowerCell {
        let [detected, named, misnamed] =
            [self.detected, self.named, self.misnamed].map(|count| Rate::of(count, self.sets));
        PowerCell { law: law.into(), family: family.into(), size_p90_relative, detected, named, misnamed }
    }
}

/// Simulates and decides sets until the time is over or `progress` breaks. The cells take turns, so that they have nearly as
/// many sets each whenever it ends; sets without an effect come as often as those of one law.
///
/// * `progress`: gets the number of sets and the share of the time, after each set
pub fn power(
    again: &Redecision<'_>,
    settings: &PowerSettings,
    progress: &(dyn Fn(usize, f64) -> ControlFlow<()> + Sync),
) -> Power {
    let started = Instant::now();
    let source = Source::new(again);
    let (cells, not_simulated) = cells(&source, settings);
    let counts = Mutex::new(vec![Counts::default(); cells.len()]);
    let elapsed = || started.elapsed().as_secs_f64();
    let until = (0_u64..).take_while(|_| elapsed() < settings.seconds);
    let simulated = in_threads(until, settings.threads.max(1), |index| {
        let place = index as usize % cells.len();
        let cell = cells[place];
        let set = source.simulated(cell, settings.seed, index);
        let outcome = set.map(|set| again.outcome(&set));
        let mut counts = counts.lock().expect("no thread panics with it");
        if let Some(outcome) = &outcome {
            counts[place].add(outcome, cell.effect.map(|(law, _)| law.family));
        }
        let sets = counts.iter().map(|c| c.sets).sum();
        drop(counts);
        match progress(sets, (elapsed() / settings.seconds).min(1.0)) {
            ControlFlow::Break(()) => Err(()),
            ControlFlow::Continue(()) => Ok(()),
        }
    });
    let counts = counts.into_inner().expect("all threads are done");
    let of = |pick: &dyn Fn(&Cell) -> bool| {
        cells.iter().zip(&counts).filter(|(cell, _)| pick(cell)).fold(Counts::default(), |sum, (_, c)| sum.plus(*c))
    };
    let none = of(&|cell| cell.effect.is_none());
    let with_size = |size: f64| of(&|cell| cell.effect.is_some_and(|(_, of_cell)| of_cell == size));
    let cell =
        |(cell, counts): (&Cell, &Counts)| cell.effect.map(|(law, size)| counts.cell(law.name, law.family, size));
    Power {
        false_alarm: Rate::of(none.detected, none.sets),
        by_size: settings.sizes.iter().map(|size| with_size(*size).cell("all", "all", *size)).collect(),
        cells: cells.iter().zip(&counts).filter_map(cell).collect(),
        not_simulated,
        sets: counts.iter().map(|c| c.sets).sum(),
        elapsed_s: elapsed(),
        interrupted: simulated.is_err(),
        seed: settings.seed,
    }
}

/// The cells in the order of their turns, and what is not simulated.
fn cells(source: &Source<'_>, settings: &PowerSettings) -> (Vec<Cell>, Vec<NotSimulated>) {
    let mut not_simulated = Vec::new();
    let mut leave = |law: &Law, size_p90_relative: f64, reason: String| {
        not_simulated.push(NotSimulated { law: law.name.into(), size_p90_relative, reason });
    };
    let mut out: Vec<Cell> = settings.sizes.iter().map(|_| Cell { effect: None }).collect();
    if out.is_empty() {
        out.push(Cell { effect: None });
    }
    for law in source.again.basis.settings.laws.iter().copied() {
        if !settings.laws.is_empty() && !settings.laws.contains(&law.name) {
            continue;
        }
        if let Some(reason) = why_untestable(law, source.again.set) {
            leave(law, 0.0, reason);
            continue;
        }
        for &size in &settings.sizes {
            if source.effect(law, size, &mut Draw::new(settings.seed)).is_some() {
                out.push(Cell { effect: Some((law, size)) });
            } else {
                leave(law, size, "no size of the law within its range changes a force by so much".into());
            }
        }
    }
    (out, not_simulated)
}

/// Random numbers of one set.
struct Draw(RandomSigns);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(RandomSigns::new(seed))
    }

    /// Uniform in 0 to 1, neither of them reached.
    fn unit(&mut self) -> f64 {
        ((self.0.bits() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Standard normal [Box & Muller 1958].
    fn normal(&mut self) -> f64 {
        let (a, b) = (self.unit(), self.unit());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Where simulated sets come from.
struct Source<'a> {
    again: &'a Redecision<'a>,
    task: Task<'a>,
    /// Prediction of the calibrated finger without an effect, N.
    plain_n: Vec<f64>,
}

/// Draws of a law's shape until one reaches the wanted size.
const DRAWS: usize = 20;
/// Relative error of the size that is reached.
const SIZE_ERROR: f64 = 0.05;

impl<'a> Source<'a> {
    fn new(again: &'a Redecision<'a>) -> Self {
        let task = again.basis.calibration.task(again.set, again.basis.reference);
        let plain_n = task.predict(&again.basis.calibration.fit.parameters, &again.basis.calibration.fit.laws);
        Self { again, task, plain_n }
    }

    /// A set of a cell; `None` where its effect cannot be drawn.
    fn simulated(&self, cell: Cell, seed: u64, index: u64) -> Option<RunSet> {
        let mut draw = Draw::new(seed.wrapping_mul(0x1_0000_0001).wrapping_add(index));
        let laws: Vec<ActiveLaw> = match cell.effect {
            None => Vec::new(),
            Some((law, size)) => vec![self.effect(law, size, &mut draw)?],
        };
        Some(self.read(&laws, &mut draw))
    }

    /// A law of this size with a drawn shape and sign.
    fn effect(&self, law: &'static Law, size: f64, draw: &mut Draw) -> Option<ActiveLaw> {
        let calibrated = &self.again.basis.calibration.fit;
        for _ in 0..DRAWS {
            let unit = drawn(law, draw);
            let mut factor = 1.0;
            for _ in 0..8 {
                let active = scaled(&unit, factor);
                let laws = [calibrated.laws.as_slice(), std::slice::from_ref(&active)].concat();
                let with_n = self.task.predict(&calibrated.parameters, &laws);
                let found = size_p90(self.again.set, &self.plain_n, &with_n);
                if (found / size - 1.0).abs() < SIZE_ERROR {
                    return Some(active);
                }
                factor *= (size / found.max(1e-6)).clamp(0.1, 10.0);
            }
        }
        None
    }

    /// Readings of a drawn finger under laws, at the rows of the measured runs that have readings.
    fn read(&self, laws: &[ActiveLaw], draw: &mut Draw) -> RunSet {
        let Basis { calibration, corrections, reference, .. } = &self.again.basis;
        // True state columns around their best guesses.
        let mut truth = self.again.set.clone();
        for correction in *corrections {
            correction.scatter(&mut truth, &mut || draw.normal());
        }
        let parameters = self.finger(draw);
        let variances = self.variances(draw);
        let effects: Vec<PerEffect> =
            truth.runs.iter().map(|_| variances.map(|variance| variance.sqrt() * draw.normal())).collect();
        let inside: RandomEffects = effects.iter().map(|e| std::array::from_fn(|k| e[k])).collect();
        let task = calibration.task(&truth, reference);
        let laws = [calibration.fit.laws.as_slice(), laws].concat();
        let prediction_n = task.predict_at(&parameters, &laws, &inside);
        // Errors that are alike in neighbouring rows: a first-order process with the same sum.
        let follows = calibration.correlation.map(|factor| (factor - 1.0) / (factor + 1.0));
        let mut out = self.again.set.clone();
        let mut at = 0;
        for (run, effects) in out.runs.iter_mut().zip(&effects) {
            let mut before: [Option<f64>; 3] = [None; 3];
            for force_n in &mut run.force_n {
                for k in 0..3 {
                    if force_n[k].is_finite() {
                        let own = draw.normal();
                        let error = before[k].map_or(own, |b| follows[k] * b + (1.0 - follows[k].powi(2)).sqrt() * own);
                        before[k] = Some(error);
                        let exact_n = prediction_n[at + k] + effects[MODEL_EFFECTS + k];
                        force_n[k] = exact_n + calibration.noise[k].sigma_n(exact_n) * error;
                    }
                }
                at += 3;
            }
        }
        out
    }

    /// Parameters of the smooth model as they may be in the measured set, given the calibration.
    fn finger(&self, draw: &mut Draw) -> Parameters {
        let prior = self.again.basis.calibration.prior();
        let normals = DVector::from_fn(Parameter::COUNT, |_, _| draw.normal());
        let change = prior.root.solve_upper_triangular(&normals).expect("a prior has a regular root");
        let mut out = prior.mean;
        for p in Parameter::all() {
            out[p] += change[p.index()];
        }
        out
    }

    /// Variances between runs as they may be, given those that so many calibration runs have.
    fn variances(&self, draw: &mut Draw) -> PerEffect {
        let calibration = &self.again.basis.calibration;
        let degrees = calibration.runs.saturating_sub(3).max(2);
        calibration.fit.variances.map(|variance| {
            let chi_squared: f64 = (0..degrees).map(|_| draw.normal().powi(2)).sum();
            variance * degrees as f64 / chi_squared
        })
    }
}

/// A law of its typical size with a sign and a shape within those that are searched.
fn drawn(law: &'static Law, draw: &mut Draw) -> ActiveLaw {
    let [a, b] = [0, 1].map(|_| law.shapes[(draw.unit() * law.shapes.len() as f64) as usize]);
    let mut active = start_of(law, a);
    for (k, b) in b.iter().enumerate() {
        let at = law.linear + k;
        let (a, share) = (active.values[at], draw.unit());
        active.values[at] =
            if law.parameters[at].positive { a.powf(1.0 - share) * b.powf(share) } else { a + share * (b - a) };
    }
    let mut direction: Vec<f64> = (0..law.linear).map(|_| draw.normal()).collect();
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    direction.iter_mut().for_each(|d| *d /= length);
    for (k, d) in direction.into_iter().enumerate() {
        let p = &law.parameters[k];
        active.values[k] = if p.low < 0.0 { d * p.typical } else { (d * p.typical).abs() };
    }
    active
}

/// The law with its linear parameters multiplied, within their bounds.
fn scaled(active: &ActiveLaw, factor: f64) -> ActiveLaw {
    let mut out = active.clone();
    for k in 0..out.law.linear {
        let bounds = match out.law.reported {
            Reported::AsFitted => &out.law.parameters[k],
            Reported::AmplitudeAndAxis => &out.law.parameters[0],
        };
        out.values[k] = (factor * out.values[k]).clamp(bounds.low, bounds.high);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scaled_law_has_a_multiple_of_its_strength_within_its_bounds() {
        let law = fingerpad::effects::find("speed_log").unwrap();
        let of = |first: f64| {
            let mut active = start_of(law, law.shapes[0]);
            active.values[0] = first;
            active
        };
        let (parameter, shape) = (&law.parameters[0], of(1.0).values[law.linear..].to_vec());
        for (first, factor, want) in
            [(0.05, 3.0, 0.15), (0.05, 0.0, 0.0), (0.1, 1e9, parameter.high), (0.1, -1e9, parameter.low)]
        {
            let scaled = scaled(&of(first), factor);
            assert!((scaled.values[0] - want).abs() < 1e-12, "{first} {factor}: {:?}", scaled.values);
            assert_eq!(scaled.values[scaled.law.linear..], shape);
        }
    }
}
