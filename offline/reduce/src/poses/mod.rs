//! How the contact depends on pitch and roll, on a model that is fitted in one pose: replay, errors, and in the modules below fit and
//! band.
//!
//! Main functions: [`fit_poses`], [`pose_scores`], [`pose_band`]. Uses runs and `fingerpad`.

mod band;
mod fit;

use fingerpad::{DataOf, ModelOf, Motion, Pose, Response, Scaled, StateOf};
use serde::{Deserialize, Serialize};

use super::{Coverage, Run, Sample};
pub use band::{crossed_coverage, pose_band};
pub use fit::{MINIMISATIONS, fit_poses};

/// Longest motion and largest turn of a step of the replay, mm and degrees.
const STEP_MM: f32 = 0.1;
const STEP_DEG: f32 = 2.0;
/// Depth below which rows are not compared, mm: limits are too small to be held against.
const LEAST_DEPTH_MM: f32 = 0.05;
/// Least limit that friction is held against, share of the largest of a run: in scores, and in the fit, where what a light touch
/// tells is as much the mesh as the finger.
const LIGHT: f64 = 0.05;
const LIGHT_IN_FIT: f64 = 0.3;

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
    /// Friction, length of the error over the largest limit of the run.
    #[serde(default)]
    pub friction_of_largest: f64,
    /// Centre of pressure, mm.
    pub centre_mm: f64,
    /// Shares of rows within the band, over all and in stick, partial slip, slip; each half of the runs against a band from the
    /// other half.
    #[serde(default)]
    pub coverage: [Coverage; 4],
}

/// Whether a run's plane is pitched or rolled, and driven so that the model can follow.
pub fn is_posed(run: &Run) -> bool {
    run.kind.is_for_springs() && (run.path.turns.pitch.is_some() || run.path.turns.roll.is_some())
}

/// Errors of a model along runs in other poses.
pub fn pose_scores<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> PoseScores {
    let (mut sums, mut rows, mut centres) = ([0.0; 5], 0.0, 0.0);
    for run in runs {
        let largest = Largest::of(data, run, LIGHT);
        for (sample, r) in run.samples.iter().zip(replay_with_pose(data, run)) {
            let Some([normal, area, x, y, centre_x, centre_y, _]) = errors(sample, &r, &largest) else { continue };
            rows += 1.0;
            sums[0] += normal * normal;
            sums[1] += x * x + y * y;
            sums[3] += area * area;
            sums[4] += (x * x + y * y) * (largest.limit_n(sample) / largest.limit_n).powi(2);
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
        friction_of_largest: rms(sums[4], rows),
        centre_mm: rms(sums[2], centres),
        coverage: Default::default(),
    }
}

/// What errors of a run are held against.
struct Largest {
    normal_n: f64,
    area_mm2: f64,
    /// Largest friction that normal force and area of a row stand for, N.
    limit_n: f64,
    /// Friction in full slip over N^beta A^(1 − beta), and beta.
    law: [f64; 2],
    /// Least limit that friction is held against, over `limit_n`.
    light: f64,
}

impl Largest {
    fn of<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, run: &Run, light: f64) -> Self {
        let most = |of: fn(&Sample) -> f32| f64::from(run.samples.iter().map(of).fold(1e-3f32, f32::max));
        let middle = &data.rows[N / 2];
        let beta = data.pressure_exponent;
        let law = middle.limit.value / (middle.normal.value.powf(beta) * middle.area.value.powf(1.0 - beta));
        let largest = Self {
            normal_n: most(|s| s.normal_force_n),
            area_mm2: most(|s| s.contact_area_mm2),
            limit_n: 0.0,
            law: [law, beta],
            light,
        };
        let limit_n = run.samples.iter().map(|s| largest.limit_n(s)).fold(1e-3, f64::max);
        Self { limit_n, ..largest }
    }

    /// Friction in full slip by the finite elements' normal force and area, N; a light touch counts as a twentieth of the largest.
    fn limit_n(&self, sample: &Sample) -> f64 {
        let [law, beta] = self.law;
        let [normal, area] = [sample.normal_force_n, sample.contact_area_mm2].map(|x| f64::from(x.max(0.0)));
        (law * normal.powf(beta) * area.powf(1.0 - beta)).max(self.light * self.limit_n)
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
    let mut last: Option<(Pose, ModelOf<'_, M, N, Scaled<f64, true>, f64>)> = None;
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
            if last.is_none_or(|(before, _)| before != pose) {
                // Every pose within the range is known to the table of the fit.
                last = model.posed(pose).ok().map(|posed| (pose, posed));
            }
            if let Some((_, posed)) = &last {
                response = posed.step(&mut state, motion);
            }
        }
        responses.push(response);
        before = Some(sample);
    }
    responses
}
