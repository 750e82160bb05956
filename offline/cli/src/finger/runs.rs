//! The runs of a design of experiments, or of one share of it.

use std::{
    collections::BTreeMap,
    fs,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{self, Finger, LoadPathError, PathEnd, Problem, Progress, RunOptions, Trajectory};
use fingerpad_formats::{atomic_write, in_threads};
use fingerpad_identify::population::Share;
use fingerpad_reduce::{self as reduce, Batch, DesignSettings, Experiment, Run, Sample};

use crate::progress::counter;
use crate::{Bars, Failure, LARGER_PADS, bar, go_on, keeping, make_finger, show};

/// Lists the paths of a share that have no file; fails if there are any.
pub fn check(config: &Config, settings: &DesignSettings, folder: &Path, share: Share) -> Result<(), Failure> {
    let design = reduce::design(settings)?;
    let place = Place { folder, hash: reduce::settings_hash(config)? };
    let own = reduce::share(&reduce::batches(&design), share.index, share.of);
    let all: Vec<&Experiment> = own.iter().flat_map(|batch| &batch.experiments).copied().collect();
    let mut missing: Vec<&str> = Vec::new();
    let (mut early, mut bytes, mut cpu_s) = (0, 0, 0.0);
    for experiment in &all {
        let file = place.file(experiment);
        let Ok(contents) = fs::read(&file) else {
            missing.push(&experiment.name);
            continue;
        };
        let run = Run::from_bytes(&contents, &file)?;
        early += usize::from(run.ended_early.is_some());
        bytes += contents.len();
        cpu_s += run.cpu_s;
    }
    println!(
        "{} of {} paths are there, {early} ended early; {bytes} bytes, {cpu_s:.0} s CPU where none shares its beginning; \
         settings {}, folder {}",
        all.len() - missing.len(),
        all.len(),
        place.hash,
        folder.display()
    );
    if missing.is_empty() {
        return Ok(());
    }
    Err(Failure::Input(anyhow!("{}: {} paths are missing: {}", folder.display(), missing.len(), missing.join(", "))))
}

/// Runs the paths of a share that have no file yet, a thread per path or per batch of paths with a common first part.
pub fn run(
    config: &Config,
    settings: &DesignSettings,
    folder: &Path,
    share: Share,
    jobs: Option<usize>,
) -> Result<(), Failure> {
    let design = reduce::design(settings)?;
    let place = Place { folder, hash: reduce::settings_hash(config)? };
    fs::create_dir_all(folder).with_context(|| folder.display().to_string()).map_err(Failure::Input)?;
    let mut queue = reduce::share(&reduce::batches(&design), share.index, share.of);
    let all: usize = queue.iter().map(|batch| batch.experiments.len()).sum();
    let missing: usize = queue.iter().map(|batch| place.missing(batch).len()).sum();
    queue.retain(|batch| !place.missing(batch).is_empty());
    println!(
        "{} of {all} paths are there; settings {}, folder {}{}",
        all - missing,
        place.hash,
        folder.display(),
        if share == Share::ALL { String::new() } else { format!(", share {} of {}", share.index, share.of) }
    );
    if missing == 0 {
        return Ok(());
    }
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = jobs.unwrap_or_else(cores).clamp(1, queue.len());
    let _keeping = keeping();
    let bars = Bars::default();
    let total = bars.add(counter("design", missing, "paths"));
    let run = |batch: &Batch| run_batch(config, batch, &place, &bars, &|| total.count());
    // The paths of the initial guess first: without them there is no fit.
    let (first, rest): (Vec<_>, Vec<_>) =
        queue.into_iter().partition(|batch| batch.experiments.iter().any(|e| e.is_for_initial_guess()));
    for part in [first, rest] {
        in_threads(in_turn(part), threads, |batch| if go_on().is_break() { Ok(()) } else { run(&batch) })?;
        if go_on().is_break() {
            return Err(Failure::Interrupted(format!("finished paths are kept in {}", folder.display())));
        }
    }
    total.finish_and_clear();
    Ok(())
}

/// CPU time of a path by itself, s, from its file or by following it, without a file.
pub(super) fn time_of(config: &Config, experiment: &Experiment, folder: &Path) -> Result<f64, Failure> {
    let place = Place { folder, hash: reduce::settings_hash(config)? };
    let file = place.file(experiment);
    if let Some(known) = fs::read(&file).ok().and_then(|bytes| Run::from_bytes(&bytes, &file).ok()) {
        return Ok(known.cpu_s);
    }
    let (finger, _) = config.finger_for(&[&experiment.path])?;
    let batch = &reduce::batches(std::slice::from_ref(experiment))[0];
    Ok(run_one(&problem(config, &finger, batch), experiment, None, &place.hash, &Bars::default())?.run.cpu_s)
}

/// Refuses a design with a path that this finger cannot follow.
pub(super) fn check_paths(config: &Config, design: &[Experiment]) -> Result<(), Failure> {
    let (mut finger, _) = make_finger(config)?;
    for experiment in design {
        let of_path = |e| {
            let hint = "leave out the depths of [design], which then follow from the tip";
            Failure::Input(anyhow::Error::new(e).context(format!("[design] ({hint}): path {}", experiment.name)))
        };
        let config = with_body(config, experiment);
        finger.rigid_body = config.rigid_body.read()?;
        config.check_path(&experiment.path, &finger).map_err(of_path)?;
    }
    Ok(())
}

/// The settings with the body of an experiment.
fn with_body(config: &Config, experiment: &Experiment) -> Config {
    Config { rigid_body: experiment.body.clone(), ..config.clone() }
}

/// Batches with all kinds in turn, so that an interrupted design is a small one.
fn in_turn(batches: Vec<Batch>) -> Vec<Batch> {
    let mut of_kind = BTreeMap::new();
    let mut turns: Vec<(usize, Batch)> = Vec::new();
    for batch in batches {
        let number = of_kind.entry(batch.experiments[0].kind).or_insert(0);
        turns.push((*number, batch));
        *number += 1;
    }
    turns.sort_by_key(|(number, _)| *number);
    turns.into_iter().map(|(_, batch)| batch).collect()
}

/// Iterations after which a path ends early. The longest path of a tip that can be followed took 3000.
const MOST_ITERATIONS: u32 = 4000;

/// State of the runs.
struct Place<'a> {
    folder: &'a Path,
    hash: String,
}

impl Place<'_> {
    fn file(&self, experiment: &Experiment) -> PathBuf {
        self.folder.join(Run::file_name(experiment, &self.hash))
    }

    fn missing<'a>(&self, batch: &Batch<'a>) -> Vec<&'a Experiment> {
        batch.experiments.iter().copied().filter(|experiment| !self.file(experiment).exists()).collect()
    }
}

/// Runs the missing paths of a batch. If more than one is missing, their common first part runs once.
fn run_batch(
    config: &Config,
    batch: &Batch,
    place: &Place,
    bars: &Bars,
    count: &(impl Fn() + Sync),
) -> Result<(), Failure> {
    // The pad is that of the whole batch, so that a run does not depend on what was there before.
    let paths: Vec<_> = batch.experiments.iter().map(|e| &e.path).collect();
    let config = &with_body(config, batch.experiments[0]);
    for (trial, reach) in std::iter::once(1.0).chain(LARGER_PADS).enumerate() {
        let missing = place.missing(batch);
        if missing.is_empty() {
            break;
        }
        let (finger, _) = config.finger_reaching(&paths, reach)?;
        let problem = problem(config, &finger, batch);
        let beginning = if missing.len() > 1 { follow_beginning(&problem, batch, bars)? } else { None };
        for experiment in missing {
            let run = run_one(&problem, experiment, beginning.as_ref(), &place.hash, bars)?;
            if run.left_pad && trial < LARGER_PADS.len() {
                continue;
            }
            let bytes = run.run.to_bytes();
            atomic_write(&place.file(experiment), |w| w.write_all(&bytes))?;
            count();
        }
    }
    Ok(())
}

/// A run, and whether it ended because skin beside the pad reached the plane; then a larger pad may help.
struct Followed {
    run: Run,
    left_pad: bool,
}

/// The finger, halved if the paths of the batch keep its symmetry: their common first part is then symmetric too.
fn problem<'a>(config: &Config, finger: &'a Finger, batch: &Batch) -> Problem<'a> {
    let mut problem = config.problem(finger);
    problem.half = problem.half.filter(|_| batch.experiments.iter().all(|e| e.path.is_symmetric()));
    problem
}

/// The end of the batch's common first part. None if the batch has none, or if that part ends early: each path then
/// reports its own reason.
fn follow_beginning(problem: &Problem, batch: &Batch, bars: &Bars) -> Result<Option<PathEnd>, Failure> {
    let Some(path) = batch.beginning() else { return Ok(None) };
    let bar = bars.add(bar(format!("{} and more", batch.experiments[0].name)));
    let end = load_path::follow(problem, &path, RunOptions::default(), &mut |progress| {
        show(&bar, &progress);
        go_on()
    });
    bar.finish_and_clear();
    match end {
        Err(LoadPathError::Interrupted { .. }) => Err(interrupted()),
        end => Ok(end.ok()),
    }
}

fn interrupted() -> Failure {
    Failure::Interrupted("finished paths are kept".to_owned())
}

/// What the finite elements found along a path.
pub(super) struct Found {
    /// The rows that were reached.
    pub trajectory: Trajectory,
    /// Why the path ended early.
    pub ended_early: Option<String>,
    /// Whether it ended because skin beside the pad reached the plane; then a larger pad may help.
    left_pad: bool,
}

/// Follows a path until its end, or until it ends early.
///
/// * `snapshots`: rows whose fields are kept
/// * `beginning`: end of a first part that was run before
/// * `most`: iterations after which it ends early
///
/// # Errors
/// [`Failure::Input`] for a path that is refused, [`Failure::Interrupted`].
pub(super) fn follow(
    problem: &Problem,
    (name, path): (&str, &load_path::Path),
    snapshots: &[usize],
    beginning: Option<&PathEnd>,
    bars: &Bars,
    most: u32,
) -> Result<Found, Failure> {
    let bar = bars.add(bar(name.to_owned()));
    let mut is_hopeless = false;
    let mut progress = |progress: Progress| {
        show(&bar, &progress);
        is_hopeless = progress.cost.iterations > most;
        if is_hopeless { ControlFlow::Break(()) } else { go_on() }
    };
    let options = RunOptions { snapshots, from: beginning, ..RunOptions::default() };
    let result = load_path::follow(problem, path, options, &mut progress).map(PathEnd::into_trajectory);
    bar.finish_and_clear();
    let left_pad = matches!(result, Err(LoadPathError::BesidePad { .. }));
    let (trajectory, ended_early) = match result {
        Ok(trajectory) => (trajectory, None),
        // A path without equilibrium is kept up to the last row and marked.
        Err(LoadPathError::NoEquilibrium { reached, cause, t_s, .. }) => {
            (*reached, Some(format!("t = {t_s:.4} s: {cause}")))
        }
        Err(mut error @ LoadPathError::Interrupted { .. }) if is_hopeless => {
            (error.take_reached(), Some(format!("still on its way after {most} iterations")))
        }
        Err(LoadPathError::Interrupted { .. }) => return Err(interrupted()),
        Err(error @ (LoadPathError::Path(_) | LoadPathError::Checkpoint(_))) => {
            return Err(Failure::Input(anyhow::Error::new(error).context(name.to_owned())));
        }
        Err(
            mut error @ (LoadPathError::BeyondFriction { .. }
            | LoadPathError::BeyondFrictionMoment { .. }
            | LoadPathError::NotClear { .. }
            | LoadPathError::InsideOut { .. }
            | LoadPathError::BesidePad { .. }),
        ) => (error.take_reached(), Some(error.to_string())),
    };
    if let Some(problem) = &ended_early {
        bars.line(&format!("{name}: ended early, {problem}"));
    }
    Ok(Found { trajectory, ended_early, left_pad })
}

fn run_one(
    problem: &Problem,
    experiment: &Experiment,
    beginning: Option<&PathEnd>,
    hash: &str,
    bars: &Bars,
) -> Result<Followed, Failure> {
    let path = (&*experiment.name, &experiment.path);
    let Found { trajectory, ended_early, left_pad } = follow(problem, path, &[], beginning, bars, MOST_ITERATIONS)?;
    let run = Run {
        name: experiment.name.clone(),
        kind: experiment.kind,
        held_out: experiment.held_out,
        settings_hash: hash.to_owned(),
        body: experiment.body.clone(),
        path: experiment.path.clone(),
        samples: trajectory.responses.iter().map(Sample::from).collect(),
        ended_early,
        cpu_s: trajectory.cost.cpu_s,
    };
    Ok(Followed { run, left_pad })
}
