//! A run along a path, and its end, for others to go on from: a press is made once for all slides that follow it.

use super::run::{Run, RunState};
use super::settings::LoadPathError;
use super::{Checkpoint, Cost, OnProgress, Path, PressLimit, Problem, Response, Trajectory};
use crate::contact::RubberFriction;
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

    /// All records of the run.
    pub fn into_trajectory(self) -> Trajectory {
        self.run.trajectory
    }

    /// The integrals of [`RunOptions::limit_law`].
    pub fn into_limits(self) -> Vec<PressLimit> {
        self.run.limits
    }

    /// Body and contact there; those of the half if the run was of the half of a symmetric finger.
    pub fn state(&self) -> &State {
        &self.run.state
    }
}

/// What a run does besides following its path.
#[derive(Clone, Copy, Default)]
pub struct RunOptions<'a> {
    /// Rows at which the field is kept; from the last row of `from` on.
    pub snapshots: &'a [usize],
    /// End of an earlier run in the same problem, whose path is the beginning of this one: the run goes on from there.
    pub from: Option<&'a PathEnd>,
    /// Saves the state of the run, which resumes from it.
    pub checkpoint: Option<Checkpoint<'a>>,
    /// Friction law of a time, s, if it changes along the path; friction then acts from first contact on.
    pub law_at: Option<&'a dyn Fn(f64) -> RubberFriction>,
    /// A law whose integral over the pressure is taken at every row.
    pub limit_law: Option<&'a RubberFriction>,
}

/// Follows `path` to its end.
///
/// `progress` is called after every increment and many times within one, and may break.
///
/// # Errors
/// [`LoadPathError`], with the rows up to there; [`LoadPathError::Path`] if the path of `options.from` is not its beginning;
/// [`LoadPathError::Checkpoint`] if the state cannot be saved.
pub fn follow(
    problem: &Problem,
    path: &Path,
    options: RunOptions,
    progress: OnProgress,
) -> Result<PathEnd, LoadPathError> {
    let mut run = Run::new(problem, path, &options, progress)?;
    if let Some(checkpoint) = options.checkpoint {
        run.keep(checkpoint)?;
    }
    if let Some(from) = options.from.filter(|_| run.is_at_start()) {
        check(&run, from)?;
        let mut start = from.run.clone();
        start.trajectory.snapshots.clear();
        match run.resume(start, &from.factor) {
            Ok(()) => run.end_row(),
            Err(SolveError::Interrupted) => {
                return Err(LoadPathError::Interrupted { reached: Box::new(from.run.trajectory.clone()) });
            }
            Err(error) => {
                return Err(LoadPathError::Path(format!("the run to go on from is of another finger: {error}")));
            }
        }
    }
    let is_half = run.model.half.is_some();
    let (mut run, factor) = run.follow()?;
    run.row -= 1;
    Ok(PathEnd { path: path.clone(), is_half, run, factor })
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
