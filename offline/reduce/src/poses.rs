//! Fit of the poses: how the contact depends on pitch and roll, on a model that is fitted in one pose.
//!
//! Main functions: [`fit_poses`], [`pose_scores`]. Uses runs and `fingerpad`.

use fingerpad::{DataOf, Motion, POSE_ROWS, POSE_TERMS, Pose, PoseTable, Response, StateOf};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, TerminationReason, minimise};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Kind, ReduceError, Run, Sample};

/// Least number of runs in other poses from which poses are fitted.
const LEAST_RUNS: usize = 6;
/// Longest motion and largest turn of a step of the replay, mm and degrees.
const STEP_MM: f32 = 0.1;
const STEP_DEG: f32 = 2.0;
/// Errors that count 1: of the normal force and the area over the largest of their run, of friction over the model's limit, of
/// the centre of pressure, mm, and of the moment about the normal over the limit times the radius of a circle of the area.
const NORMAL_SHARE: f64 = 0.02;
const AREA_SHARE: f64 = 0.03;
const FRICTION_SHARE: f64 = 0.03;
const CENTRE_MM: f64 = 0.3;
const MOMENT_SHARE: f64 = 0.1;
/// Change of a coefficient of each row from none that counts 1: holds what the runs do not determine.
const PRIORS: [f64; POSE_ROWS] =
    [2.0, 2.0, 0.5, 2.0, 2.0, 0.5, 0.1, 0.5, 0.2, 0.5, 0.1, 0.2, 0.1, 10.0, 0.5, 1.0, 0.2, 0.05, 10.0, 0.5, 1.0];
/// The same for the terms of a row, share of its prior: rows of a run err together, and higher orders swing beyond the outermost
/// runs.
const ORDERS: [f64; POSE_TERMS] = [0.25, 0.18, 0.08, 0.25, 0.12, 0.12];
/// Rolling length at which the fit begins: the contact's diameter.
const ROLLING_LENGTH: f64 = 2.0;
/// Rows that presses without friction tell: normal force, area, depth of touch, place of the pressure.
const PRESSED: [usize; 9] = [0, 1, 2, 3, 4, 5, TOUCH_ROW, 13, 18];
/// Rows that a change of pose alone tells: slides that the pose amounts to, and the rolling length behind the last row.
const ROLLED: [usize; 3] = [15, 20, POSE_ROWS];
/// Bound of the first step of a fit, over the scale of its coefficients.
const STEP_BOUND: f64 = 1.0;
/// Row of the depth at which the contact begins, and where the fit begins: some 0.1 mm in far poses, none in near ones.
const TOUCH_ROW: usize = 7;
const TOUCH: [f64; POSE_TERMS] = [-0.05, 0.0, 0.6, 0.0, 0.0, 0.4];
/// Step of the finite differences of the Jacobian.
const DIFFERENCE: f64 = 1e-4;
/// Depth below which rows are not compared, mm: limits are too small to be held against.
const LEAST_DEPTH_MM: f32 = 0.05;
/// Share of the rows whose errors a band holds.
const COVERED: f64 = 0.955;
/// Least limit that friction is held against, share of the largest of a run.
const LIGHT: f64 = 0.05;

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
    ranged.pose.depth_max_mm =
        runs.iter().flat_map(|run| &run.samples).map(|s| f64::from(s.depth_mm)).fold(0.1, f64::max);
    let mut found = vec![0.0; POSE_TERMS * POSE_ROWS + 1];
    found[POSE_TERMS * POSE_ROWS] = ROLLING_LENGTH;
    found[POSE_TERMS * TOUCH_ROW..][..POSE_TERMS].copy_from_slice(&TOUCH);
    // What presses tell, then friction in poses that stay, then what a change of pose does on top.
    let (staying, changing): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(|run| !run.kind.changes_pose());
    let is_of = |rows: &'static [usize]| move |k: &usize| rows.contains(&(k / POSE_TERMS));
    let (rolled, others): (Vec<usize>, Vec<usize>) = (0..found.len()).partition(is_of(&ROLLED));
    let (pressed, sheared): (Vec<usize>, Vec<usize>) = others.into_iter().partition(is_of(&PRESSED));
    let both = pressed.iter().chain(&sheared).copied().collect();
    let none: fn(Kind) -> bool = |_| false;
    let stays: fn(Kind) -> bool = |kind| !kind.changes_pose();
    let stages: [(Vec<usize>, &[&Run], fn(Kind) -> bool); 4] = [
        (pressed, runs, none),
        (sheared, &staying, stays),
        (both, runs, stays),
        (rolled, &changing, Kind::changes_pose),
    ];
    for (free, runs, with_friction) in stages {
        if runs.is_empty() {
            continue;
        }
        let start: Vec<f64> = free.iter().map(|&k| found[k]).collect();
        let mut problem = Poses { data: ranged, runs, base: found.clone(), free, with_friction };
        let minimiser =
            LevenbergMarquardt::new().with_ftol(1e-5).with_xtol(1e-5).with_patience(30).with_stepbound(STEP_BOUND);
        let (moved, report) = minimise(&mut problem, &start, &minimiser);
        if !(report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience)) {
            return Err(ReduceError::Fit(format!("poses: {:?}", report.termination)));
        }
        found = problem.whole(&moved);
    }
    Ok(Some(table(&ranged.pose, &found)))
}

/// Errors of a model along runs in other poses.
pub fn pose_scores<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> PoseScores {
    let (mut sums, mut rows, mut centres) = ([0.0; 4], 0.0, 0.0);
    for run in runs {
        let largest = Largest::of(data, run);
        for (sample, r) in run.samples.iter().zip(replay_with_pose(data, run)) {
            let Some([normal, area, x, y, centre_x, centre_y, _]) = errors(sample, &r, &largest) else { continue };
            rows += 1.0;
            sums[0] += normal * normal;
            sums[1] += x * x + y * y;
            sums[3] += area * area;
            if f64::from(sample.normal_force_n) > 0.1 * largest.normal_n {
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

/// What a pose has to add to the bands so that they hold the errors of 95.5 % of the rows: shares of the normal force and
/// of the friction limit.
pub fn pose_band<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> [f64; 2] {
    let mut without = *data;
    without.pose.band = [0.0; 2];
    let mut shares: [Vec<f64>; 2] = [vec![], vec![]];
    for run in runs {
        for (sample, r) in run.samples.iter().zip(replay_with_pose(&without, run)) {
            if sample.depth_mm > LEAST_DEPTH_MM && r.normal_force_n > 0.0 {
                let normal = (r.normal_force_n - f64::from(sample.normal_force_n)).abs() - r.band_normal_n;
                shares[0].push(normal / r.normal_force_n);
                shares[1].extend((0..2).map(|k| {
                    let error = (r.friction_n[k] - f64::from(sample.friction_n[k])).abs();
                    (error - r.band_friction_n) / r.friction_limit_n.max(1e-6)
                }));
            }
        }
    }
    shares.map(|mut shares| {
        shares.sort_by(f64::total_cmp);
        let index = (COVERED * shares.len() as f64) as usize;
        shares.get(index).map_or(0.0, |share| share.clamp(0.0, 10.0))
    })
}

/// A table from the vector of the fit. All coefficients of 0 would mean a model of one pose.
fn table(of: &PoseTable<f64>, vector: &[f64]) -> PoseTable<f64> {
    let mut rows = [[0.0; POSE_TERMS]; POSE_ROWS];
    for (row, numbers) in rows.iter_mut().zip(vector.chunks_exact(POSE_TERMS)) {
        row.copy_from_slice(numbers);
    }
    // The contact in the fitted pose begins at depth 0.
    rows[TOUCH_ROW][0] = rows[TOUCH_ROW][0].min(0.0);
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

/// What errors of a run are held against.
struct Largest {
    normal_n: f64,
    area_mm2: f64,
    /// Largest friction that normal force and area of a row stand for, N.
    limit_n: f64,
    /// Friction in full slip over N^beta A^(1 − beta), and beta.
    law: [f64; 2],
}

impl Largest {
    fn of<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, run: &Run) -> Self {
        let most = |of: fn(&Sample) -> f32| f64::from(run.samples.iter().map(of).fold(1e-3f32, f32::max));
        let middle = &data.rows[N / 2];
        let beta = data.pressure_exponent;
        let law = middle.limit.value / (middle.normal.value.powf(beta) * middle.area.value.powf(1.0 - beta));
        let largest = Self {
            normal_n: most(|s| s.normal_force_n),
            area_mm2: most(|s| s.contact_area_mm2),
            limit_n: 0.0,
            law: [law, beta],
        };
        let limit_n = run.samples.iter().map(|s| largest.limit_n(s)).fold(1e-3, f64::max);
        Self { limit_n, ..largest }
    }

    /// Friction in full slip by the finite elements' normal force and area, N; a light touch counts as a twentieth of the largest.
    fn limit_n(&self, sample: &Sample) -> f64 {
        let [law, beta] = self.law;
        let [normal, area] = [sample.normal_force_n, sample.contact_area_mm2].map(|x| f64::from(x.max(0.0)));
        (law * normal.powf(beta) * area.powf(1.0 - beta)).max(LIGHT * self.limit_n)
    }
}

/// Errors of a row: normal force and area over the largest, friction over the limit, centre of pressure in mm, moment about the
/// normal over the limit times a radius. None out of contact.
fn errors(sample: &Sample, r: &Response<f64>, largest: &Largest) -> Option<[f64; 7]> {
    let turned = sample.turned.filter(|_| sample.depth_mm > LEAST_DEPTH_MM)?;
    let normal = f64::from(sample.normal_force_n);
    let limit = largest.limit_n(sample);
    let [mx, my, mz] = turned.moment_n_mm.map(f64::from);
    let centre = if normal > 0.0 { [-my / normal, mx / normal] } else { r.pressure_centre_mm };
    let radius = (largest.area_mm2 / std::f64::consts::PI).sqrt();
    Some([
        (r.normal_force_n - normal) / largest.normal_n,
        (r.contact_area_mm2 - f64::from(sample.contact_area_mm2)) / largest.area_mm2,
        (r.friction_n[0] - f64::from(sample.friction_n[0])) / limit,
        (r.friction_n[1] - f64::from(sample.friction_n[1])) / limit,
        r.pressure_centre_mm[0] - centre[0],
        r.pressure_centre_mm[1] - centre[1],
        (r.spin_moment_n_mm - mz) / (limit * radius),
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
    /// All coefficients, and which of them move.
    base: Vec<f64>,
    free: Vec<usize>,
    /// In which kinds of runs errors of friction count.
    with_friction: fn(Kind) -> bool,
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
            let largest = Largest::of(&self.data, run);
            let has_friction = (self.with_friction)(run.kind);
            for (sample, r) in run.samples.iter().zip(replay_with_pose(&data, run)) {
                let [normal, area, x, y, centre_x, centre_y, moment] = errors(sample, &r, &largest).unwrap_or_default();
                let weight = f64::from(sample.normal_force_n) / (largest.normal_n * CENTRE_MM);
                let of_friction = [x / FRICTION_SHARE, y / FRICTION_SHARE, moment / MOMENT_SHARE];
                out.extend([normal / NORMAL_SHARE, area / AREA_SHARE]);
                out.extend(of_friction.map(|error| if has_friction { error } else { 0.0 }));
                out.extend([centre_x * weight, centre_y * weight]);
            }
        }
        let rows = &vector[..POSE_TERMS * POSE_ROWS];
        out.extend(rows.iter().enumerate().map(|(k, x)| x / (PRIORS[k / POSE_TERMS] * ORDERS[k % POSE_TERMS])));
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
        Some((0..vector.len()).into_par_iter().map(column).collect())
    }
}
