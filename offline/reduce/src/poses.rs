//! Fit of the poses: how the contact depends on pitch and roll, on a model that is fitted in one pose.
//!
//! Main functions: [`fit_poses`], [`pose_scores`]. Uses runs and `fingerpad`.

use fingerpad::{DataOf, Motion, POSE_ROWS, POSE_TERMS, Pose, PoseTable, Response, StateOf};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, TerminationReason, minimise};
use serde::{Deserialize, Serialize};

use super::{ReduceError, Run, Sample};

/// Least number of runs in other poses from which poses are fitted.
const LEAST_RUNS: usize = 6;
/// Longest motion and largest turn of a step of the replay, mm and degrees.
const STEP_MM: f32 = 0.05;
const STEP_DEG: f32 = 1.0;
/// Errors that count 1: of the normal force and the area over the largest of their run, of friction over the model's limit, of
/// the centre of pressure, mm.
const NORMAL_SHARE: f64 = 0.02;
const AREA_SHARE: f64 = 0.03;
const FRICTION_SHARE: f64 = 0.03;
const CENTRE_MM: f64 = 0.3;
/// Change of a coefficient of each row from none that counts 1: holds what the runs do not determine. Strength and stiffness
/// hardly go beyond what normal force and area imply.
const PRIORS: [f64; POSE_ROWS] = [2.0, 2.0, 2.0, 2.0, 0.05, 0.05, 0.05, 0.2, 10.0, 0.2, 10.0, 0.05];
/// Rolling length at which the fit begins: the contact's diameter.
const ROLLING_LENGTH: f64 = 2.0;
/// Step of the finite differences of the Jacobian.
const DIFFERENCE: f64 = 1e-4;
/// Depth below which rows are not compared, mm: limits are too small to be held against.
const LEAST_DEPTH_MM: f32 = 0.05;

/// Errors in other poses than the fitted one, RMS over rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseScores {
    /// Number of runs.
    pub runs: usize,
    /// Normal force, over the largest of the run.
    pub normal_of_largest: f64,
    /// Contact area, over the largest of the run.
    #[serde(default)]
    pub area_of_largest: f64,
    /// Friction, length of the error over the limit.
    pub friction_of_limit: f64,
    /// Centre of pressure, mm.
    pub centre_mm: f64,
}

/// Whether a run's plane is pitched or rolled, and driven so that the model can follow.
pub fn is_posed(run: &Run) -> bool {
    run.path.turns.pitch.is_some() || run.path.turns.roll.is_some()
}

/// The table of poses that makes a model's replay of runs in other poses least wrong; None if there are too few runs.
///
/// # Errors
/// [`ReduceError::Fit`] if the minimiser finds no minimum.
pub fn fit_poses<const M: usize, const N: usize>(
    data: &DataOf<M, N, f64>,
    runs: &[&Run],
) -> Result<Option<PoseTable<f64>>, ReduceError> {
    if runs.len() < LEAST_RUNS {
        return Ok(None);
    }
    let mut ranged = *data;
    (ranged.pose.pitch_range_deg, ranged.pose.roll_max_deg) = ranges_deg(data.pose.pitch_deg, runs);
    let mut problem = Poses { data: ranged, runs };
    let mut start = vec![0.0; POSE_TERMS * POSE_ROWS + 1];
    start[POSE_TERMS * POSE_ROWS] = ROLLING_LENGTH;
    let minimiser = LevenbergMarquardt::new().with_ftol(1e-6).with_xtol(1e-6).with_patience(100);
    let (found, report) = minimise(&mut problem, &start, &minimiser);
    if !(report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience)) {
        return Err(ReduceError::Fit(format!("poses: {:?}", report.termination)));
    }
    Ok(Some(table(&ranged.pose, &found)))
}

/// Errors of a model along runs in other poses.
pub fn pose_scores<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> PoseScores {
    let (mut sums, mut rows, mut centres) = ([0.0; 4], 0.0, 0.0);
    for run in runs {
        let largest = largest(run);
        for (sample, r) in run.samples.iter().zip(replay_with_pose(data, run)) {
            let Some([normal, area, x, y, centre_x, centre_y]) = errors(sample, &r, largest) else { continue };
            rows += 1.0;
            sums[0] += normal * normal;
            sums[1] += x * x + y * y;
            sums[3] += area * area;
            if f64::from(sample.normal_force_n) > 0.1 * largest[0] {
                sums[2] += centre_x * centre_x + centre_y * centre_y;
                centres += 1.0;
            }
        }
    }
    let rms = |sum: f64, rows: f64| if rows > 0.0 { (sum / rows).sqrt() } else { 0.0 };
    PoseScores {
        runs: runs.len(),
        normal_of_largest: rms(sums[0], rows),
        area_of_largest: rms(sums[3], rows),
        friction_of_limit: rms(sums[1], rows),
        centre_mm: rms(sums[2], centres),
    }
}

/// A table from the vector of the fit. All coefficients of 0 would mean a model of one pose.
fn table(of: &PoseTable<f64>, vector: &[f64]) -> PoseTable<f64> {
    let mut rows = [[0.0; POSE_TERMS]; POSE_ROWS];
    for (row, numbers) in rows.iter_mut().zip(vector.chunks_exact(POSE_TERMS)) {
        row.copy_from_slice(numbers);
    }
    if rows.iter().flatten().all(|x| *x == 0.0) {
        rows[0][0] = f64::from(f32::MIN_POSITIVE);
    }
    PoseTable { rows, rolling_length: vector[POSE_TERMS * POSE_ROWS].max(0.1), ..*of }
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

/// Largest normal force, N, and contact area, mm², of a run.
fn largest(run: &Run) -> [f64; 2] {
    let most = |of: fn(&Sample) -> f32| f64::from(run.samples.iter().map(of).fold(1e-3f32, f32::max));
    [most(|s| s.normal_force_n), most(|s| s.contact_area_mm2)]
}

/// Errors of a row: normal force and area over the largest, friction over the limit, centre of pressure in mm. None out of
/// contact.
fn errors(sample: &Sample, r: &Response<f64>, largest: [f64; 2]) -> Option<[f64; 6]> {
    let turned = sample.turned.filter(|_| sample.depth_mm > LEAST_DEPTH_MM)?;
    let normal = f64::from(sample.normal_force_n);
    let limit = r.friction_limit_n.max(1e-3);
    let [mx, my, _] = turned.moment_n_mm.map(f64::from);
    let centre = if normal > 0.0 { [-my / normal, mx / normal] } else { r.pressure_centre_mm };
    Some([
        (r.normal_force_n - normal) / largest[0],
        (r.contact_area_mm2 - f64::from(sample.contact_area_mm2)) / largest[1],
        (r.friction_n[0] - f64::from(sample.friction_n[0])) / limit,
        (r.friction_n[1] - f64::from(sample.friction_n[1])) / limit,
        r.pressure_centre_mm[0] - centre[0],
        r.pressure_centre_mm[1] - centre[1],
    ])
}

/// The model's response at every sample of a run, with spin and in the pose of each step.
pub fn replay_with_pose<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, run: &Run) -> Vec<Response<f64>> {
    let model = data.model_unchecked();
    let mut state = StateOf::<M, 2, f64>::default();
    let pose_of = |s: &Sample| s.turned.map_or([0.0, 0.0, 0.0], |t| [t.pitch_deg, t.roll_deg, t.spin_deg]);
    let mut before = None;
    let mut responses = Vec::with_capacity(run.samples.len());
    for sample in &run.samples {
        let from = before.unwrap_or(sample);
        let (a, b) = (pose_of(from), pose_of(sample));
        let way = (0..2).map(|k| sample.slide_mm[k] - from.slide_mm[k]).fold(0.0, f32::hypot);
        let way = way.max((sample.depth_mm - from.depth_mm).abs()) / STEP_MM;
        let turn = (0..3).map(|k| (b[k] - a[k]).abs()).fold(0.0, f32::max) / STEP_DEG;
        let steps = way.max(turn).ceil().max(1.0) as u32;
        let share = 1.0 / f64::from(steps);
        let mut response = Response::default();
        for k in 1..=steps {
            let done = f64::from(k) * share;
            let between = |from: f32, to: f32| f64::from(from) + done * f64::from(to - from);
            let pose = Pose {
                pitch_deg: between(a[0], b[0]).clamp(10.0, 70.0) as f32,
                roll_deg: between(a[1], b[1]).clamp(-30.0, 30.0) as f32,
            };
            let motion = Motion {
                depth_mm: between(from.depth_mm, sample.depth_mm),
                slide_increment_mm: [0, 1].map(|i| share * f64::from(sample.slide_mm[i] - from.slide_mm[i])),
                spin_increment_rad: share * f64::from((b[2] - a[2]).to_radians()),
                dt_s: 1e-3,
            };
            // Every pose within the range is known to the table of the fit.
            if let Ok(posed) = model.posed(pose) {
                response = posed.step(&mut state, motion);
            }
        }
        responses.push(response);
        before = Some(sample);
    }
    responses
}

/// The fit as a least-squares problem over the coefficients.
struct Poses<'a, const M: usize, const N: usize> {
    data: DataOf<M, N, f64>,
    runs: &'a [&'a Run],
}

impl<const M: usize, const N: usize> Poses<'_, M, N> {
    fn residuals_at(&self, vector: &[f64]) -> Vec<f64> {
        let mut data = self.data;
        data.pose = table(&self.data.pose, vector);
        let mut out = Vec::new();
        for run in self.runs {
            let largest = largest(run);
            for (sample, r) in run.samples.iter().zip(replay_with_pose(&data, run)) {
                let [normal, area, x, y, centre_x, centre_y] = errors(sample, &r, largest).unwrap_or_default();
                let weight = f64::from(sample.normal_force_n) / (largest[0] * CENTRE_MM);
                out.extend([normal / NORMAL_SHARE, area / AREA_SHARE, x / FRICTION_SHARE, y / FRICTION_SHARE]);
                out.extend([centre_x * weight, centre_y * weight]);
            }
        }
        let rows = &vector[..POSE_TERMS * POSE_ROWS];
        out.extend(rows.iter().enumerate().map(|(k, x)| x / PRIORS[k / POSE_TERMS]));
        out.iter_mut().for_each(|r| *r = if r.is_finite() { *r } else { 1e3 });
        out
    }
}

impl<const M: usize, const N: usize> Problem for Poses<'_, M, N> {
    fn residuals(&mut self, vector: &[f64]) -> Option<Vec<f64>> {
        Some(self.residuals_at(vector))
    }

    fn jacobian(&mut self, vector: &[f64]) -> Option<Vec<Vec<f64>>> {
        let here = self.residuals_at(vector);
        let column = |k: usize| {
            let mut moved = vector.to_vec();
            moved[k] += DIFFERENCE;
            self.residuals_at(&moved).iter().zip(&here).map(|(m, h)| (m - h) / DIFFERENCE).collect()
        };
        Some((0..vector.len()).map(column).collect())
    }
}
