//! Runs of a pad to which a bed of springs is fitted.
//!
//! Main functions: [`runs_for_bed`], [`runs_in_pose`]. Uses path, replay and design.

use fingerpad::Relaxation;
use fingerpad::pad::{Body, Pad};
use fingerpad_fe::experiment::RigidBodySettings;
use fingerpad_fe::load_path::{Drive, Turn, Turns};

use super::{PadModel, replay_on_plane, simulate_path_on_pad};
use crate::{DesignSettings, ReduceError, Run, Sample, design, is_representable};

/// Nodes of the ratios to the finite elements: depths over the largest depth.
const NODES: [f64; 9] = [0.008, 0.02, 0.04, 0.08, 0.16, 0.32, 0.48, 0.72, 1.0];
/// Rows below this depth are not used, mm.
const LEAST_DEPTH_MM: f64 = 0.01;
/// Largest stick ratio of full slip: of the finite elements, and of a pad.
const SLIPS: [f64; 2] = [0.03, 0.05];
/// Weight of the smoothing between neighbouring nodes over the mean weight of the rows of a node. It determines nodes without rows.
const SMOOTH: f64 = 0.03;
/// One path in so many is followed, the slides along the axes apart.
const EVERY: usize = 3;
/// Largest factor on the spin moment. A light contact of a pad is about one patch and has little moment, whatever its ratio of friction.
const MOMENT_MOST: f64 = 1.1;

/// Largest distance of the logarithm of a ratio of coefficients from their median: beyond it one of the two does not slip.
const UNLIKE: f64 = 0.5;

/// Ratios of the finite elements to a pad over depth: factors on its normal force and on its friction over normal force.
struct Ratios {
    deepest_mm: f64,
    /// Logarithms at [`NODES`].
    normal: [f64; NODES.len()],
    coefficient: [f64; NODES.len()],
}

impl Ratios {
    /// Ratios from the rows of runs on a plane in the neutral pose.
    fn of(model: &PadModel, runs: &[&Run], deepest_mm: f64) -> Self {
        let (mut normal, mut coefficient) = (Vec::new(), Vec::new());
        let length = |f: [f64; 2]| f[0].hypot(f[1]);
        for run in runs {
            for (s, r) in run.samples.iter().zip(replay_on_plane(model, run)) {
                let depth = f64::from(s.depth_mm);
                if depth < LEAST_DEPTH_MM {
                    continue;
                }
                let normals = [f64::from(s.normal_force_n), r.normal_force_n];
                if !normals.iter().all(|n| *n > 0.0) {
                    continue;
                }
                normal.push((depth, (normals[0] / normals[1]).ln(), normals[0].sqrt()));
                let frictions = [length(s.friction_n.map(f64::from)), length(r.friction_n)];
                let both_slip = f64::from(s.stick_ratio) < SLIPS[0] && r.stick_ratio < SLIPS[1];
                if both_slip && frictions.iter().all(|f| *f > 0.0) {
                    coefficient.push((depth, (frictions[0] / normals[0] * normals[1] / frictions[1]).ln(), 1.0));
                }
            }
        }
        // A contact at first touch has no friction yet.
        let mut sorted: Vec<f64> = coefficient.iter().map(|(_, ratio, _)| *ratio).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        coefficient.retain(|(_, ratio, _)| (ratio - median).abs() < UNLIKE);
        let fitted = |rows: &[(f64, f64, f64)]| over_depth(rows, deepest_mm);
        Self { deepest_mm, normal: fitted(&normal), coefficient: fitted(&coefficient) }
    }

    /// Multiplies the loads of a sample of the pad by the ratios at its depth.
    fn apply(&self, sample: &mut Sample) {
        let depth = f64::from(sample.depth_mm);
        let [normal, coefficient] = [&self.normal, &self.coefficient].map(|logs| {
            let weights = weights(depth, self.deepest_mm);
            weights.iter().zip(logs).map(|(w, log)| w * log).sum::<f64>().exp()
        });
        let friction = normal * coefficient;
        sample.normal_force_n *= normal as f32;
        sample.friction_n = sample.friction_n.map(|f| f * friction as f32);
        if let Some(turned) = &mut sample.turned {
            let [x, y, z] = turned.moment_n_mm;
            turned.moment_n_mm = [x * normal as f32, y * normal as f32, z * friction.min(MOMENT_MOST) as f32];
        }
    }
}

/// Weights of the nodes at a depth: linear between them over the logarithm of the depth.
fn weights(depth_mm: f64, deepest_mm: f64) -> [f64; NODES.len()] {
    let x = (depth_mm / deepest_mm).clamp(NODES[0], 1.0).ln();
    let at = |k: usize| NODES[k].ln();
    let cell = (1..NODES.len() - 1).rev().find(|k| x >= at(*k)).unwrap_or(0);
    let t = (x - at(cell)) / (at(cell + 1) - at(cell));
    let mut weights = [0.0; NODES.len()];
    (weights[cell], weights[cell + 1]) = (1.0 - t, t);
    weights
}

/// Values at the nodes by smoothed least squares over rows of depth, value and weight; 0 without rows.
fn over_depth(rows: &[(f64, f64, f64)], deepest_mm: f64) -> [f64; NODES.len()] {
    const N: usize = NODES.len();
    if rows.is_empty() {
        return [0.0; N];
    }
    let mut matrix = nalgebra::SMatrix::<f64, N, N>::zeros();
    let mut right = nalgebra::SVector::<f64, N>::zeros();
    for (depth, value, weight) in rows {
        let of_nodes = nalgebra::SVector::<f64, N>::from(weights(*depth, deepest_mm));
        matrix += of_nodes * of_nodes.transpose() * *weight;
        right += of_nodes * (*weight * value);
    }
    let smooth = SMOOTH * rows.iter().map(|(_, _, weight)| weight).sum::<f64>() / N as f64;
    for k in 1..N {
        for (i, j, sign) in [(k, k, 1.0), (k - 1, k - 1, 1.0), (k, k - 1, -1.0), (k - 1, k, -1.0)] {
            matrix[(i, j)] += sign * smooth;
        }
    }
    matrix.lu().solve(&right).map_or([0.0; N], Into::into)
}

/// Runs of a pad in the neutral pose along the paths of a design to which a bed of springs is fitted. Their loads are corrected at each
/// depth by the ratios of the finite elements to the pad along `runs`. None is held out.
///
/// * `runs`: finite-element runs of the same finger; held-out ones are not used
/// * `settings`: ranges and numbers of paths
///
/// # Errors
/// [`ReduceError::Design`] for invalid settings, [`ReduceError::Runs`] for a path that a pad cannot follow.
pub fn runs_for_bed(
    pad: &Pad<'_>,
    runs: &[Run],
    settings: &DesignSettings,
    settings_hash: &str,
) -> Result<Vec<Run>, ReduceError> {
    let model = PadModel::of(pad);
    let neutral = f64::from(pad.numbers.neutral_pitch_deg);
    let of_ratios: Vec<&Run> =
        runs.iter().filter(|run| !run.held_out && run.body.is_plane() && run.is_neutral(neutral)).collect();
    let ratios = Ratios::of(&model, &of_ratios, settings.depth_mm[1]);
    let axis_slides = 4 * settings.axis_depths_mm.len();
    let all = followed(pad, None, settings, settings_hash)?.into_iter().enumerate();
    let mut made: Vec<Run> = all.filter(|(k, _)| *k < axis_slides || k % EVERY == 0).map(|(_, run)| run).collect();
    for run in &mut made {
        run.held_out = false;
        run.samples.iter_mut().for_each(|sample| ratios.apply(sample));
    }
    Ok(made)
}

/// Runs of a pad along the paths of a design for a bed of springs in one pose, including held-out ones, without a correction.
///
/// * `pose_deg`: pitch and roll of the finger, degrees
///
/// # Errors
/// As [`runs_for_bed`], and [`ReduceError::Pose`] for a pose outside the pad's range.
pub fn runs_in_pose(
    pad: &Pad<'_>,
    pose_deg: [f64; 2],
    settings: &DesignSettings,
    settings_hash: &str,
) -> Result<Vec<Run>, ReduceError> {
    let numbers = pad.numbers;
    let roll = f64::from(numbers.roll_max_deg);
    let ranges = [("pitch", numbers.pitch_range_deg.map(f64::from)), ("roll", [-roll, roll])];
    for ((axis, range), value) in ranges.into_iter().zip(pose_deg) {
        if !(value >= range[0] && value <= range[1]) {
            return Err(ReduceError::Pose { axis, value, range });
        }
    }
    followed(pad, Some(pose_deg), settings, settings_hash)
}

/// Runs of a pad, with relaxed tissue, along the paths of a design that a bed of springs represents, in a pose or in the neutral one.
fn followed(
    pad: &Pad<'_>,
    pose_deg: Option<[f64; 2]>,
    settings: &DesignSettings,
    settings_hash: &str,
) -> Result<Vec<Run>, ReduceError> {
    let pad = &pad.with_relaxation(Relaxation::none());
    let mut made = Vec::new();
    for experiment in design(settings)? {
        let path = experiment.path;
        if !(experiment.kind.is_for_springs() && is_representable(&path)) {
            continue;
        }
        let mut posed = path.clone();
        if let Some(pose_deg) = pose_deg {
            let [pitch, roll] =
                pose_deg.map(|deg| Some(Turn { drive: Drive::Displacement, values: vec![deg; path.waypoints.len()] }));
            posed.turns = Turns { pitch, roll, ..posed.turns };
        }
        let rows = simulate_path_on_pad(pad, &Body::Plane, &posed)
            .map_err(|error| ReduceError::Runs(format!("path {}: {error}", experiment.name)))?;
        made.push(Run {
            name: format!("pad-{}", experiment.name),
            kind: experiment.kind,
            held_out: experiment.held_out,
            settings_hash: settings_hash.to_owned(),
            body: RigidBodySettings::default(),
            // A bed of springs has no path in another pose than its own.
            path,
            samples: rows.iter().map(|row| Sample::from(&row.response)).collect(),
            ended_early: None,
            cpu_s: 0.0,
        });
    }
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_found_where_there_are_rows_and_smooth_elsewhere() {
        let rows: Vec<(f64, f64, f64)> =
            (1..=200).map(|k| (0.01 * f64::from(k), 0.2 - 0.1 * f64::from(k) / 200.0, 1.0)).collect();
        let found = over_depth(&rows, 2.5);
        for (node, value) in NODES.iter().zip(found) {
            let depth = 2.5 * node;
            let wanted = 0.2 - 0.05 * depth.min(2.0);
            assert!((value - wanted).abs() < 0.02, "{depth}: {value} {wanted}");
        }
        for depth in [0.0, 0.005, 0.3, 2.5, 7.0] {
            assert!((weights(depth, 2.5).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!(over_depth(&[], 2.5), [0.0; NODES.len()]);
    }
}
