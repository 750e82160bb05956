//! The bed of springs of a finger: stored runs, the fit, its file.

use std::{fs, path::Path};

use anyhow::Context;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_formats::atomic_write;
use fingerpad_reduce::{self as reduce, FitProgress, FitStage, Kind, ReduceError, Reduced, Run, Scores, Settings};

use crate::Failure;
use crate::progress::counter;

impl From<ReduceError> for Failure {
    fn from(error: ReduceError) -> Self {
        match error {
            ReduceError::Fit(_) | ReduceError::Model(_) => Self::Numerics(error.into()),
            ReduceError::Run { .. }
            | ReduceError::Runs(_)
            | ReduceError::Design { .. }
            | ReduceError::Pose { .. }
            | ReduceError::Retune(_) => Self::Input(error.into()),
        }
    }
}

/// The runs of motions that a bed of springs represents: the neutral pose, on a plane. Prints the kinds that the fit
/// leaves out.
pub(super) fn representable(runs: Vec<Run>) -> Vec<Run> {
    let (known, left): (Vec<Run>, Vec<Run>) = runs.into_iter().partition(|run| run.is_representable());
    let of_kind = |kind: Kind| left.iter().filter(|run| run.kind == kind).count();
    let kinds: Vec<String> = (Kind::ALL.iter())
        .filter(|&&kind| of_kind(kind) > 0)
        .map(|&kind| format!("{} {}", kind.as_str(), of_kind(kind)))
        .collect();
    if !left.is_empty() {
        println!(
            "left out of the fit: {} runs of motions that the spring bed is not made for ({})",
            left.len(),
            kinds.join(", ")
        );
    }
    known
}

/// Fits a bed of springs.
///
/// * `beside`: runs of a pad of the same finger, which enter the fit too
pub(super) fn fit(
    runs: &[Run],
    beside: &[Run],
    friction: &RubberFriction,
    settings: &Settings,
) -> Result<Reduced, Failure> {
    let early = runs.iter().filter(|r| r.ended_early.is_some()).count();
    let hash = runs.first().map_or("", |r| &r.settings_hash);
    println!("{} runs of settings {hash}, {early} ended early", runs.len());
    if !beside.is_empty() {
        println!("beside them {} runs of the pad", beside.len());
    }
    let bar = counter("fit", 1, "minimisations");
    let reduced = reduce::reduce(
        runs,
        beside,
        friction,
        settings,
        &FitProgress::new(&|at: FitStage| {
            bar.set(at.done, at.all, format!("iteration {}", at.iteration));
        }),
    );
    bar.finish_and_clear();
    Ok(reduced?)
}

/// Writes the model file of a bed and prints its errors.
pub(super) fn write(reduced: &Reduced, runs: &[Run], out: &Path) -> Result<(), Failure> {
    let bytes = reduced.file(&[])?;
    atomic_write(out, |w| w.write_all(&bytes))?;
    print_summary(reduced);
    println!("{}: {} bytes", out.display(), bytes.len());
    // Runs of a pad have no finite elements to compare with.
    if runs.iter().any(|run| run.cpu_s > 0.0) {
        print_speed(runs, reduced)?;
    }
    Ok(())
}

/// The runs that ship with the program: names and contents.
const SHIPPED: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/shipped_runs.rs"));

/// All runs of a folder; without one, those that ship with the program.
pub(super) fn read_runs(folder: Option<&Path>) -> Result<Vec<Run>, Failure> {
    let Some(folder) = folder else {
        return Ok(SHIPPED
            .iter()
            .map(|(name, bytes)| Run::from_bytes(bytes, Path::new(name)))
            .collect::<Result<_, _>>()?);
    };
    let place = || folder.display().to_string();
    let entries = fs::read_dir(folder).with_context(place).map_err(Failure::Input)?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.with_context(place).map_err(Failure::Input)?.path();
        if path.extension().is_some_and(|e| e == "fprun") {
            files.push(path);
        }
    }
    files.sort();
    let mut runs = Vec::with_capacity(files.len());
    for path in &files {
        let bytes = fs::read(path).with_context(|| path.display().to_string()).map_err(Failure::Input)?;
        runs.push(Run::from_bytes(&bytes, path)?);
    }
    if runs.is_empty() {
        return Err(Failure::Input(anyhow::anyhow!(
            "{}: no runs (*.fprun); make them with `fingerpad finger --design full`",
            place()
        )));
    }
    Ok(runs)
}

/// Prints the time of the same paths in both models.
fn print_speed(runs: &[Run], reduced: &Reduced) -> Result<(), Failure> {
    let model = reduced.data.model().map_err(ReduceError::from)?;
    println!(
        "                         finite elements, s a path   reduced, us a path   steps   ns a step        ratio"
    );
    for kind in Kind::ALL {
        let of_kind: Vec<&Run> = runs.iter().filter(|r| r.kind == kind && r.is_representable()).collect();
        let count = of_kind.len() as f64;
        if of_kind.is_empty() {
            continue;
        }
        let steps: usize = of_kind.iter().map(|run| reduce::replay_steps(run)).sum();
        // The best of a few: other work on the machine only adds time.
        let once = || {
            let start = std::time::Instant::now();
            for run in &of_kind {
                std::hint::black_box(reduce::replay(&model, run));
            }
            start.elapsed().as_secs_f64()
        };
        let taken_s = (0..9).map(|_| once()).fold(f64::INFINITY, f64::min);
        let cpu_s: f64 = of_kind.iter().map(|r| r.cpu_s).sum();
        println!(
            "  {:20} {:>27.2} {:>20.1} {:>7.0} {:>11.1} {:>12.2e}",
            kind.as_str(),
            cpu_s / count,
            1e6 * taken_s / count,
            steps as f64 / count,
            1e9 * taken_s / steps as f64,
            cpu_s / taken_s
        );
    }
    Ok(())
}

fn print_summary(reduced: &Reduced) {
    println!("cost {:.4e} -> {:.4e}; {}", reduced.cost[0], reduced.cost[1], reduced.ended);
    println!("                         N, of range   F, of limit   stick straight   turned   regime right   paths");
    let line = |name: &str, s: &Scores| {
        println!(
            "{name:22} {:>12.2} % {:>11.2} % {:>16.3} {:>8.3} {:>12.1} % {:>7}",
            100.0 * s.normal_of_range,
            100.0 * s.friction_of_limit,
            s.stick_straight,
            s.stick_turned,
            100.0 * s.regime_right,
            s.paths
        );
    };
    line("fit", &Scores::of(&reduced.scores, |s| !s.held_out));
    line("held out", &reduced.meta.held_out);
    for kind in Kind::ALL {
        let of_kind = Scores::of(&reduced.scores, |s| s.held_out && s.kind == kind);
        if of_kind.paths > 0 {
            line(&format!("  {}", kind.as_str()), &of_kind);
        }
    }
    for (name, c) in ["all", "stick", "partial slip", "slip"].iter().zip(&reduced.meta.coverage) {
        let (normal, friction) = (100.0 * c.normal, 100.0 * c.friction);
        println!("band of 95 %, {name}: normal force {normal:.1} %, friction {friction:.1} % of {} rows", c.rows);
    }
    let (share, name) = &reduced.meta.held_out.worst_friction;
    println!("worst path held out: {name}, friction {:.1} % of the limit", 100.0 * share);
}
