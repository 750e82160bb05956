//! The lag of the forces behind the positions, estimated from runs: by how much earlier motions explain the readings better.
//!
//! A delay and a low-pass do nearly the same to slow strokes. Either is tried alone, the better one is kept, and the other one joins it only
//! where the runs ask for both.
//!
//! Main type: [`LagEstimate`]; main function: [`estimate`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::lag::{Lag, lagged};
use crate::data::runs::RunSet;
use crate::model::prior::Prior;
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::projection::Projection;
use crate::statistics::tails::LEAST_GAIN;
use crate::statistics::task::Task;

/// A lag that explains the readings better than none, or than a given one.
#[derive(Clone, Copy, Debug)]
pub struct LagEstimate {
    /// The lag.
    pub lag: Lag,
    /// Standard deviation of its mean delay, with the finger model's error of form, s.
    pub sd_s: f64,
    /// How much it gains in 2 log likelihood.
    pub gain_2ll: f64,
}

/// Statistical standard deviations from zero from which on a lag is looked for.
const SIGNIFICANT: f64 = 5.0;
/// Standard deviations with the error of form from which on a lag counts.
pub const BEYOND_FORM: f64 = 4.0;
/// Error of the position at which the finger model has a force, mm: as a lag it is that over the speed.
const FORM_ERROR_MM: f64 = 1.5e-3;
/// Error of a long lag, as a share of it: forces change fast within it, where the finger model is least exact.
const FORM_ERROR: f64 = 0.04;
/// Longest lag that is looked for, s, and the motion in one step towards it, mm.
const LONGEST_S: f64 = 0.2;
const STEP_MM: f64 = 0.25;
/// Difference of two lags by which derivatives are taken, as a motion at the largest speed, mm.
const DIFFERENCE_MM: f64 = 2e-3;
/// Steps of the search, and the share of a standard deviation at which it ends.
const STEPS: usize = 10;
const CLOSE: f64 = 0.1;
/// Gauss–Newton steps of the parameters at a lag.
const ROUNDS: usize = 6;

/// One of the two parts of a lag.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Delay,
    TimeConstant,
}

impl Part {
    fn of(self, lag: Lag) -> f64 {
        if self == Self::Delay { lag.delay_s } else { lag.time_constant_s }
    }

    /// A lag with a change of this part.
    ///
    /// * `of_runs_s`: time constant that the runs have already, s
    fn moved(self, mut lag: Lag, by_s: f64, of_runs_s: f64) -> Lag {
        match self {
            Self::Delay => lag.delay_s = (lag.delay_s + by_s).clamp(-LONGEST_S, LONGEST_S),
            Self::TimeConstant => {
                lag.time_constant_s = (lag.time_constant_s + by_s).clamp(-of_runs_s, LONGEST_S);
            }
        }
        lag
    }

    fn other(self) -> Self {
        if self == Self::Delay { Self::TimeConstant } else { Self::Delay }
    }
}

/// The fit at a lag, and the slope of its likelihood along one part of the lag.
struct Point {
    lag: Lag,
    fit: Fit,
    minus_2ll: f64,
    /// Score, 1/s, and information, 1/s².
    slope: f64,
    information: f64,
    /// Sum of the squares of the runs' scores after the step that the score gives.
    scatter: f64,
}

impl Point {
    fn step_s(&self) -> f64 {
        if self.information > 0.0 { self.slope / self.information } else { 0.0 }
    }

    /// From the information, or from the scatter of the runs' scores where that is larger.
    fn sd_s(&self) -> f64 {
        let variance = self.information.recip().max(self.scatter / self.information.powi(2));
        if self.information > 0.0 { variance.sqrt() } else { f64::INFINITY }
    }
}

/// The search for a lag in one set.
struct Search<'s> {
    set: &'s RunSet,
    calibration: &'s Calibration,
    reference: &'s ReferenceCurves,
    prior: &'s Prior,
    speed_mm_s: f64,
    of_runs_s: f64,
}

/// A lag on top of the one that the set has, which explains it significantly better.
///
/// * `calibration`, `prior`: the noise of its task, and the prior of the finger's parameters
/// * `start`: where its fit starts
pub fn estimate(
    set: &RunSet,
    calibration: &Calibration,
    reference: &ReferenceCurves,
    prior: &Prior,
    start: FitStart,
) -> Option<LagEstimate> {
    let speed_mm_s = set.runs.iter().flat_map(|r| &r.rows).map(|r| r.speed_mm_s).fold(0.0, f64::max);
    if !(speed_mm_s > 0.0) {
        return None;
    }
    let of_runs_s = set.runs.iter().map(|r| r.time_constant_s).fold(f64::INFINITY, f64::min);
    let search = Search { set, calibration, reference, prior, speed_mm_s, of_runs_s };
    let at = search.point(Lag::default(), Part::Delay, start)?;
    if !(at.slope.powi(2) > SIGNIFICANT.powi(2) * at.information) {
        return None;
    }
    let without = at.minus_2ll;
    let delay = search.descend(at, Part::Delay);
    let same = Part::TimeConstant.moved(Lag::default(), delay.lag.delay_s, of_runs_s);
    let low_pass = search.point(same, Part::TimeConstant, FitStart::from(&delay.fit));
    let low_pass = low_pass.map(|p| search.descend(p, Part::TimeConstant));
    let (mut part, mut best) = match low_pass {
        Some(other) if other.minus_2ll < delay.minus_2ll => (Part::TimeConstant, other),
        _ => (Part::Delay, delay),
    };
    for _ in 0..4 {
        part = part.other();
        let at = search.point(best.lag, part, FitStart::from(&best.fit))?;
        if !(at.step_s().abs() > SIGNIFICANT * at.sd_s()) {
            break;
        }
        let both = search.descend(at, part);
        if !(both.minus_2ll < best.minus_2ll - LEAST_GAIN) {
            break;
        }
        best = both;
    }
    let gain_2ll = without - best.minus_2ll;
    let lag_s = best.lag.total_s();
    let sd_s = best.sd_s().hypot(form_sd_s(set)).hypot(FORM_ERROR * lag_s);
    let is_found = gain_2ll > LEAST_GAIN && lag_s.abs() > BEYOND_FORM * sd_s;
    is_found.then_some(LagEstimate { lag: best.lag, sd_s, gain_2ll })
}

/// Standard deviation that the finger model's error of form gives a short lag of a set, s: by the speed at which a lag shows, that of the
/// rows that slide, weighed by its square as the information on a lag is.
pub fn form_sd_s(set: &RunSet) -> f64 {
    let speeds = || set.runs.iter().flat_map(|r| &r.rows).map(|r| r.speed_mm_s);
    FORM_ERROR_MM * speeds().map(|v| v * v).sum::<f64>().max(1e-12) / speeds().map(|v| v.powi(3)).sum::<f64>()
}

impl Search<'_> {
    /// Steps along one part of the lag until they are small against its standard deviation.
    fn descend(&self, mut at: Point, part: Part) -> Point {
        let mut most_s = STEP_MM / self.speed_mm_s;
        for _ in 0..STEPS {
            let step_s = at.step_s().clamp(-most_s, most_s);
            let lag = part.moved(at.lag, step_s, self.of_runs_s);
            if (part.of(lag) - part.of(at.lag)).abs() < CLOSE * at.sd_s() {
                break;
            }
            match self.point(lag, part, FitStart::from(&at.fit)) {
                Some(next) if next.minus_2ll < at.minus_2ll => at = next,
                _ => most_s = 0.3 * step_s.abs(),
            }
        }
        at
    }

    /// The fit at a lag. `None` where its likelihood is not finite.
    fn point(&self, lag: Lag, part: Part, start: FitStart) -> Option<Point> {
        let (set, places) = self.lagged(lag);
        let task = self.task(&set);
        let (fit, derivatives) = task.fit(start, ROUNDS);
        let minus_2ll = task.minus_2ll_of_readings(&fit);
        if !minus_2ll.is_finite() {
            return None;
        }
        let by_s = DIFFERENCE_MM / self.speed_mm_s;
        let (moved, moved_places) = self.lagged(part.moved(lag, by_s, self.of_runs_s));
        let of_model = |task: &Task<'_>| task.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
        let (before, after) = (of_model(&task), of_model(&self.task(&moved)));
        let mut column = vec![0.0; before.len()];
        for (a, b) in places.iter().zip(&moved_places) {
            for k in 0..3 {
                column[3 * a + k] = (after[3 * b + k] - before[3 * a + k]) / (by_s * task.sigma_n[3 * a + k]);
            }
        }
        let projection = Projection::at(&task, &fit, &derivatives);
        let column = projection.project(&column);
        let (slope, information) = (projection.residual_product(&column), Projection::size(&column));
        let by_run = projection.scores_by_run(&column);
        let scatter = by_run.iter().map(|(g, i)| (g - i * slope / information.max(1e-300)).powi(2)).sum();
        Some(Point { lag, minus_2ll, slope, information, scatter, fit })
    }

    fn task<'r>(&'r self, set: &'r RunSet) -> Task<'r> {
        let mut task = self.calibration.task(set, self.reference);
        task.prior = self.prior.clone();
        task
    }

    /// The set with a lag, and the places of the rows of all runs in it, counted over the set.
    fn lagged(&self, lag: Lag) -> (RunSet, Vec<usize>) {
        let (mut first, mut places) = (0, Vec::new());
        let mut runs = Vec::with_capacity(self.set.runs.len());
        for run in &self.set.runs {
            let (moved, own) = lagged(run, lag);
            places.extend(own.iter().map(|place| first + place));
            first += moved.rows.len();
            runs.push(moved);
        }
        (RunSet { runs, ..self.set.clone() }, places)
    }
}
