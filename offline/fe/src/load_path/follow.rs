//! Runs along a path: the functions for other crates.

use super::path_end::{PathEnd, RunOptions, follow};
use super::settings::{LoadPathError, OnProgress, Problem};
use super::{Checkpoint, Drive, Path, PressLimit, Trajectory, Waypoint};
use crate::contact::RubberFriction;

/// Follows `path` and records a response at every increment and a snapshot at the rows listed in `snapshots`.
///
/// `progress` is called after every increment and many times within one, and may break.
///
/// # Errors
/// [`LoadPathError`], with the rows up to there.
pub fn follow_path(
    problem: &Problem,
    path: &Path,
    snapshots: &[usize],
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    follow(problem, path, RunOptions { snapshots, ..RunOptions::default() }, progress).map(PathEnd::into_trajectory)
}

/// Presses without friction to each of `depths_mm` (rising) and integrates `law` over the pressure found.
///
/// # Errors
/// [`LoadPathError`], as [`follow`].
pub fn press_limits(
    problem: &Problem,
    law: &RubberFriction,
    depths_mm: &[f64],
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Vec<PressLimit>, LoadPathError> {
    let frictionless = Problem { friction: None, ..problem.clone() };
    let corner = |(k, &depth): (usize, &f64)| Waypoint { t_s: k as f64, normal: depth, x: 0.0, y: 0.0 };
    let waypoints = [0.0].iter().chain(depths_mm).enumerate().map(corner).collect();
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let options = RunOptions { checkpoint, limit_law: Some(law), ..RunOptions::default() };
    follow(&frictionless, &path, options, progress).map(PathEnd::into_limits)
}
