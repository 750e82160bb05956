//! The end of a run, for others to go on from: a press is made once for all slides that follow it.

use super::run::{Run, RunState};
use super::settings::LoadPathError;
use super::{Checkpoint, Cost, OnProgress, Path, Problem, Response, Trajectory};
use crate::solve::{FactorRecord, SolveError, State};

/// State of a run at the end of its path, with all its records.
///
/// A run that continues from it gives the same numbers, bit for bit, as one along the whole path; its trajectory begins
/// with the rows, work and cost of the earlier run.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub struct PathEnd {
    path: Path,
    is_half: bool,
    /// The last row is not yet ended: the next run determines its records.
    run: RunState,
    factor: FactorRecord,
}

impl PathEnd {
    /// The cost up to here.
    pub fn cost(&self) -> Cost {
        self.run.trajectory.cost
    }

    /// The rows up to there.
    pub fn responses(&self) -> &[Response] {
        &self.run.trajectory.responses
    }

    /// Body and contact there; those of the half if the run was of the half of a symmetric finger.
    pub fn state(&self) -> &State {
        &self.run.state
    }
}

/// Follows `path` to its end, on from `from` if its path is the beginning of this one.
///
/// # Errors
/// As [`super::follow_path_from`]; [`LoadPathError::Path`] if this path does not begin as that of `from`.
pub fn follow_to_end(
    problem: &Problem,
    path: &Path,
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<PathEnd, LoadPathError> {
    let run = begin(problem, path, &[], from, checkpoint, progress)?;
    let is_half = run.model.half.is_some();
    let (mut run, factor) = run.follow_to_end()?;
    run.row -= 1;
    Ok(PathEnd { path: path.clone(), is_half, run, factor })
}

/// Follows `path` on from `from`, whose path is the beginning of this one, in the same problem. Snapshots as in
/// [`super::follow_path`], from the row at which `from` ends.
///
/// # Errors
/// As [`follow_to_end`].
pub fn follow_path_on(
    problem: &Problem,
    path: &Path,
    snapshots: &[usize],
    from: &PathEnd,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    Ok(begin(problem, path, snapshots, Some(from), checkpoint, progress)?.follow()?.0)
}

/// A run at the state of its checkpoint, else at `from`, else at the start of the path.
fn begin<'a, 'p>(
    problem: &'a Problem<'a>,
    path: &'a Path,
    snapshots: &'a [usize],
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint<'a>>,
    progress: OnProgress<'p>,
) -> Result<Run<'a, 'p>, LoadPathError> {
    let mut run = Run::new(problem, path, snapshots, progress)?;
    if let Some(checkpoint) = checkpoint {
        run.keep(checkpoint)?;
    }
    if let Some(from) = from.filter(|_| run.is_at_start()) {
        check(&run, from)?;
        match run.resume(from.run.clone(), &from.factor) {
            Ok(()) => run.end_row(),
            Err(SolveError::Interrupted) => {
                return Err(LoadPathError::Interrupted { reached: Box::new(from.run.trajectory.clone()) });
            }
            Err(error) => {
                return Err(LoadPathError::Path(format!("the run to go on from is of another finger: {error}")));
            }
        }
    }
    Ok(run)
}

fn check(run: &Run, from: &PathEnd) -> Result<(), LoadPathError> {
    let refuse = |problem: &str| Err(LoadPathError::Path(format!("the run to go on from {problem}")));
    let (path, start) = (run.path, &from.path);
    // Turns too: a press in another pose is another press.
    let turns_alike = || (0..start.waypoints.len()).all(|k| path.coordinates(k, 0.0) == start.coordinates(k, 0.0));
    let drives_alike = path.coordinate_drives() == start.coordinate_drives();
    if !drives_alike || !path.waypoints.starts_with(&start.waypoints) || !turns_alike() {
        return refuse("is not the beginning of this path");
    }
    if run.snapshots.iter().any(|&row| row + 1 < start.waypoints.len()) {
        return refuse("has passed rows whose field is requested");
    }
    if run.model.half.is_some() != from.is_half {
        return refuse("and this one differ in the use of symmetry");
    }
    if from.run.state.configuration.x.len() != run.model.body.undeformed().x.len() {
        return refuse("has another mesh");
    }
    Ok(())
}
