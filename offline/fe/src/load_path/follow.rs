//! Runs along a path: the functions for other crates.

use super::checkpoint::Checkpoint;
use super::run::Run;
use super::settings::{LoadPathError, OnProgress, Problem};
use super::{Drive, Path, PressLimit, Trajectory, Waypoint};
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
    Ok(Run::new(problem, path, snapshots, progress)?.follow()?.0)
}

/// As [`follow_path`], with a `checkpoint` that saves the state of the run and from which the run resumes.
///
/// # Errors
/// As [`follow_path`]; [`LoadPathError::Checkpoint`] if the state cannot be saved.
pub fn follow_path_from(
    problem: &Problem,
    path: &Path,
    snapshots: &[usize],
    checkpoint: Checkpoint,
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    let mut run = Run::new(problem, path, snapshots, progress)?;
    run.keep(checkpoint)?;
    Ok(run.follow()?.0)
}

/// Follows `path` with a friction law that changes along it: `law_at` gives that of a time, s. Friction acts from first
/// contact on.
///
/// # Errors
/// As [`follow_path`].
pub fn follow_path_with_law(
    problem: &Problem,
    path: &Path,
    law_at: &dyn Fn(f64) -> RubberFriction,
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    let mut run = Run::new(problem, path, &[], progress)?;
    run.law_at = Some(law_at);
    Ok(run.follow()?.0)
}

/// Presses without friction to each of `depths_mm` (rising) and integrates `law` over the pressure found.
///
/// # Errors
/// [`LoadPathError`], as [`follow_path_from`].
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
    let mut run = Run::new(&frictionless, &path, &[], progress)?;
    run.limit_law = Some(law);
    if let Some(checkpoint) = checkpoint {
        run.keep(checkpoint)?;
    }
    Ok(run.follow()?.1)
}
