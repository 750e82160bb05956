//! Fit of the coefficients of the poses.
//!
//! Main function: [`fit_poses`]. First what presses tell, then friction in poses that stay, both together, and what a change of pose
//! does on top. Uses the replay of this room.

use std::ops::Range;

use fingerpad::{DataOf, POSE_COEFFICIENTS, PoseTable};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, TerminationReason, minimise};
use rayon::prelude::*;

use super::{LIGHT_IN_FIT, Largest, errors, replay_with_pose};
use crate::{FitProgress, Kind, ReduceError, Run};

/// Least number of runs in other poses from which poses are fitted.
const LEAST_RUNS: usize = 6;
/// Errors that count 1: of the normal force and the area over the largest of their run, of friction over the model's limit, of
/// the centre of pressure, mm, and of the moment about the normal over the limit times the radius of a circle of the area.
const NORMAL_SHARE: f64 = 0.02;
const AREA_SHARE: f64 = 0.03;
const FRICTION_SHARE: f64 = 0.015;
const CENTRE_MM: f64 = 0.3;
const MOMENT_SHARE: f64 = 0.1;
/// Errors from which on their root counts: where few nodes touch, friction errs by much that no function of the pose can tell.
const LARGE: f64 = 2.0;
/// Change of each coefficient from none that counts 1: half of what the quantity changes by in all over the RMS of the term over the
/// range of poses. Twice and half of it predict runs that are left out no better.
const PRIORS: [f64; POSE_COEFFICIENTS] = [
    1.4, 2.7, 4.6, 7.4, 0.89, 6.0, 1.7, 3.2, 5.5, 8.8, 1.1, 6.0, 2.8, 5.4, 9.2, 15.0, 1.8, 6.0, 2.0, 3.8, 6.4, 10.0,
    3.1, 15.0, 1.5, 0.85, 1.6, 0.54, 0.85, 0.54, 0.28, 0.42, 14.0, 27.0, 9.0, 20.0, 0.33, 0.47, 0.92, 0.33, 0.92, 13.0,
    19.0, 26.0, 40.0, 0.6, 1.6, 4.0, 1.5, 2.0, 6.0, 0.6, 1.6, 4.0, 1.5, 2.0, 6.0,
];
/// Rolling length behind the coefficients, and where its fit begins: the contact's diameter.
const ROLLING: usize = POSE_COEFFICIENTS;
const ROLLING_LENGTH: f64 = 2.0;
/// Coefficients that presses without friction tell: normal force, area, places.
const PRESSED: [Range<usize>; 3] = [0..25, 32..36, 41..45];
/// Those that a change of pose alone tells: slides that turning amounts to, and the rolling length.
const ROLLED: Range<usize> = 45..ROLLING + 1;
/// Bound of the first step of a fit, over the scale of its coefficients.
const STEP_BOUND: f64 = 1.0;
/// Step of the finite differences of the Jacobian.
const DIFFERENCE: f64 = 1e-4;

/// Minimisations of [`fit_poses`].
pub const MINIMISATIONS: usize = 4;

/// The table of poses that makes a model's replay of runs in other poses least wrong; None if there are too few runs.
///
/// # Errors
/// [`ReduceError::Fit`] if the minimiser finds no minimum.
pub fn fit_poses<const M: usize, const N: usize>(
    data: &DataOf<M, N, f64>,
    runs: &[&Run],
    progress: &FitProgress<'_>,
) -> Result<Option<PoseTable<f64>>, ReduceError> {
    if runs.len() < LEAST_RUNS {
        return Ok(None);
    }
    let mut ranged = *data;
    (ranged.pose.pitch_range_deg, ranged.pose.roll_max_deg) = ranges_deg(data.pose.pitch_deg, runs);
    ranged.pose.depth_max_mm =
        runs.iter().flat_map(|run| &run.samples).map(|s| f64::from(s.depth_mm)).fold(0.1, f64::max);
    let (staying, changing): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(|run| !run.kind.changes_pose());
    let mut found = vec![0.0; ROLLING + 1];
    found[ROLLING] = ROLLING_LENGTH;
    let (rolled, others): (Vec<usize>, Vec<usize>) = (0..=ROLLING).partition(|k| ROLLED.contains(k));
    let (pressed, sheared): (Vec<usize>, Vec<usize>) =
        others.iter().partition(|k| PRESSED.iter().any(|range| range.contains(k)));
    let none: fn(Kind) -> bool = |_| false;
    let stays: fn(Kind) -> bool = |kind| !kind.changes_pose();
    let stages: [(Vec<usize>, &[&Run], fn(Kind) -> bool); MINIMISATIONS] = [
        (pressed, runs, none),
        (sheared, &staying, stays),
        (others, runs, stays),
        (rolled, &changing, Kind::changes_pose),
    ];
    for (free, runs, with_friction) in stages {
        if runs.is_empty() {
            continue;
        }
        let start: Vec<f64> = free.iter().map(|&k| found[k]).collect();
        let mut problem = Poses { data: ranged, runs, base: found.clone(), free, with_friction, progress };
        let (moved, report) = minimise(&mut problem, &start, &minimiser());
        if !(report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience)) {
            return Err(ReduceError::Fit(format!("poses: {:?}", report.termination)));
        }
        found = problem.whole(&moved);
        progress.finish_one();
    }
    Ok(Some(table(&ranged.pose, &found)))
}

fn minimiser() -> LevenbergMarquardt<f64> {
    LevenbergMarquardt::new().with_ftol(1e-4).with_xtol(1e-4).with_patience(30).with_stepbound(STEP_BOUND)
}

/// A table from the vector of the fit. All coefficients of 0 would mean a model of one pose.
fn table(of: &PoseTable<f64>, vector: &[f64]) -> PoseTable<f64> {
    let mut coefficients = [0.0; POSE_COEFFICIENTS];
    coefficients.copy_from_slice(&vector[..POSE_COEFFICIENTS]);
    if coefficients.iter().all(|x| *x == 0.0) {
        coefficients[0] = f64::from(f32::MIN_POSITIVE);
    }
    PoseTable { coefficients, rolling_length: vector[ROLLING].max(0.1), ..*of }
}

/// Range of the pitch and largest roll to either side in the runs, degrees; the fitted pitch is part of it.
fn ranges_deg(fitted_pitch: f64, runs: &[&Run]) -> ([f64; 2], f64) {
    let poses = || runs.iter().flat_map(|run| &run.samples).filter_map(|sample| sample.turned);
    let pitches = || poses().map(|turned| f64::from(turned.pitch_deg));
    let [least, most] = [pitches().fold(fitted_pitch, f64::min), pitches().fold(fitted_pitch, f64::max)];
    (
        [least.max(10.0), most.min(70.0)],
        poses().map(|turned| f64::from(turned.roll_deg.abs())).fold(0.0, f64::max).min(30.0),
    )
}

/// The fit as a least-squares problem over the coefficients.
struct Poses<'a, const M: usize, const N: usize> {
    data: DataOf<M, N, f64>,
    runs: &'a [&'a Run],
    /// All coefficients, and which of them move.
    base: Vec<f64>,
    free: Vec<usize>,
    /// In which kinds of runs errors of friction count.
    with_friction: fn(Kind) -> bool,
    progress: &'a FitProgress<'a>,
}

impl<const M: usize, const N: usize> Poses<'_, M, N> {
    /// All coefficients where those that move have these values.
    fn whole(&self, moved: &[f64]) -> Vec<f64> {
        let mut whole = self.base.clone();
        for (k, x) in self.free.iter().zip(moved) {
            whole[*k] = *x;
        }
        whole
    }

    fn residuals_at(&self, moved: &[f64]) -> Vec<f64> {
        let vector = &self.whole(moved);
        let mut data = self.data;
        data.pose = table(&self.data.pose, vector);
        let mut out = Vec::new();
        for run in self.runs {
            let largest = Largest::of(&self.data, run, LIGHT_IN_FIT);
            let has_friction = (self.with_friction)(run.kind);
            for (sample, r) in run.samples.iter().zip(replay_with_pose(&data, run)) {
                let [normal, area, x, y, centre_x, centre_y, moment] = errors(sample, &r, &largest).unwrap_or_default();
                let weight = f64::from(sample.normal_force_n) / (largest.normal_n * CENTRE_MM);
                let of_friction = [x / FRICTION_SHARE, y / FRICTION_SHARE, moment / MOMENT_SHARE];
                out.extend([normal / NORMAL_SHARE, area / AREA_SHARE].map(held));
                out.extend(of_friction.map(|error| if has_friction { held(error) } else { 0.0 }));
                out.extend([centre_x * weight, centre_y * weight].map(held));
            }
        }
        out.extend(vector.iter().zip(&PRIORS).map(|(x, prior)| x / prior));
        out.iter_mut().for_each(|r| *r = if r.is_finite() { *r } else { 1e3 });
        out
    }
}

/// An error whose root counts where it is large.
fn held(error: f64) -> f64 {
    error / (1.0 + (error / LARGE).powi(2)).powf(0.25)
}

/// The vector with its k-th number moved by the step of the differences, and a column of the Jacobian from the residuals there.
fn moved(vector: &[f64], k: usize) -> Vec<f64> {
    let mut moved = vector.to_vec();
    moved[k] += DIFFERENCE;
    moved
}

fn column(here: &[f64], there: &[f64]) -> Vec<f64> {
    there.iter().zip(here).map(|(m, h)| (m - h) / DIFFERENCE).collect()
}

impl<const M: usize, const N: usize> Problem for Poses<'_, M, N> {
    fn residuals(&mut self, vector: &[f64]) -> Option<Vec<f64>> {
        Some(self.residuals_at(vector))
    }

    fn jacobian(&mut self, vector: &[f64]) -> Option<Vec<Vec<f64>>> {
        self.progress.iterate();
        let here = self.residuals_at(vector);
        let column = |k: usize| column(&here, &self.residuals_at(&moved(vector, k)));
        Some((0..vector.len()).into_par_iter().map(column).collect())
    }
}
