//! Runs `ccx` on a deck in a folder of its own and measures its time.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nalgebra::Vector3;

use super::deck::{Deck, PAD_NODES, PLANE_NODES};
use super::{Error, dat};
use fingerpad_formats::atomic_write;

/// Debian and Ubuntu package that has `ccx`.
pub const PACKAGE: &str = "calculix-ccx";

/// How to run CalculiX: one thread, in a temporary folder.
#[derive(Clone, Debug)]
pub struct Runner {
    /// Program, looked for on PATH.
    pub program: String,
    /// Killed after this much wall time.
    pub timeout: Duration,
    /// Where to work instead of a temporary folder, to keep deck, log and results.
    pub folder: Option<PathBuf>,
}

impl Default for Runner {
    fn default() -> Self {
        Self { program: "ccx".into(), timeout: Duration::from_secs(1800), folder: None }
    }
}

/// State at one requested travel.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Index of the step.
    pub step: usize,
    /// Travel since the step's start, mm.
    pub travel_mm: f64,
    /// The plane's slide along x and y and its depth, mm.
    pub plane_mm: Vector3<f64>,
    /// Force that the plane exerts on the finger, N: friction along x and y, normal force (positive when it presses).
    pub force_n: Vector3<f64>,
    /// Displacement of the pad's nodes in the order of [`Deck::pad_nodes`], mm.
    pub pad_displacement_mm: Vec<Vector3<f64>>,
}

impl Point {
    /// Plain mean of the pad nodes' displacements, mm.
    pub fn mean_pad_displacement_mm(&self) -> Vector3<f64> {
        self.pad_displacement_mm.iter().sum::<Vector3<f64>>() / self.pad_displacement_mm.len().max(1) as f64
    }
}

/// CalculiX's results and their cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Outputs in the order of the steps; values have seven digits.
    pub points: Vec<Point>,
    /// Increments that converged.
    pub increments: u32,
    /// Attempts that did not, and were cut.
    pub failed_attempts: u32,
    /// Iterations of all attempts that ended.
    pub iterations: u32,
    /// CPU time of the process, user and system, s.
    pub cpu_s: f64,
    /// Time by the clock, s.
    pub wall_s: f64,
}

/// Output of the process.
pub(super) struct Raw {
    pub dat: String,
    pub sta: String,
    pub log: String,
    pub cpu_s: f64,
    pub wall_s: f64,
    pub timed_out: bool,
    pub success: bool,
}

impl Runner {
    /// Runs the deck to its end.
    ///
    /// # Errors
    /// [`Error::NotInstalled`]; [`Error::Stopped`], with all output up to there, when CalculiX failed or reached the
    /// time limit; [`Error::Deck`], [`Error::System`], [`Error::Output`].
    pub fn run(&self, deck: &Deck) -> Result<Run, Error> {
        let raw = self.run_text(&deck.to_text()?)?;
        let counted = dat::parse_sta(&raw.sta);
        let run = Run {
            points: points(deck, &dat::parse("job.dat", &raw.dat)?)?,
            increments: counted.increments,
            failed_attempts: counted.failed,
            iterations: counted.iterations,
            cpu_s: raw.cpu_s,
            wall_s: raw.wall_s,
        };
        let expected = deck.outputs();
        if !raw.timed_out && raw.success && run.points.len() == expected {
            return Ok(run);
        }
        let reason = match raw.timed_out {
            true => format!("time limit of {} s", self.timeout.as_secs_f64()),
            false => reason_to_stop(&raw.log),
        };
        Err(Error::Stopped { reason, expected, partial: Box::new(run) })
    }

    /// Version of the program, as it prints it.
    pub fn version(&self) -> Result<String, Error> {
        let output = Command::new(&self.program).arg("-v").output().map_err(|e| self.cannot_start(e))?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        Ok(text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("unknown version").to_owned())
    }

    /// Runs any deck text and returns the files it left, whether or not it converged.
    pub(super) fn run_text(&self, text: &str) -> Result<Raw, Error> {
        let temporary;
        let folder = match &self.folder {
            Some(folder) => folder.as_path(),
            None => {
                temporary = tempfile::tempdir().map_err(system("temporary folder"))?;
                temporary.path()
            }
        };
        for stale in ["job.dat", "job.sta"] {
            let _ = fs::remove_file(folder.join(stale));
        }
        let deck = folder.join("job.inp");
        atomic_write(&deck, |w| w.write_all(text.as_bytes())).map_err(|e| Error::Deck(e.to_string()))?;
        let log = folder.join("job.log");
        let out = File::create(&log).map_err(system(log.display().to_string()))?;
        let errors = out.try_clone().map_err(system(log.display().to_string()))?;
        let start = Instant::now();
        let child = Command::new(&self.program)
            .arg("job")
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .env("CCX_NPROC_EQUATION_SOLVER", "1")
            .env("CCX_NPROC_RESULTS", "1")
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(errors)
            .spawn()
            .map_err(|e| self.cannot_start(e))?;
        let Ended { cpu_s, timed_out, success } =
            wait(child, start + self.timeout).map_err(system("waiting for CalculiX"))?;
        Ok(Raw {
            dat: read(&folder.join("job.dat")),
            sta: read(&folder.join("job.sta")),
            log: read(&log),
            cpu_s,
            wall_s: start.elapsed().as_secs_f64(),
            timed_out,
            success,
        })
    }

    fn cannot_start(&self, source: std::io::Error) -> Error {
        match source.kind() {
            std::io::ErrorKind::NotFound => Error::NotInstalled { program: self.program.clone() },
            _ => Error::System { what: format!("starting `{}`", self.program), source },
        }
    }
}

fn system(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> Error {
    let what = what.into();
    move |source| Error::System { what, source }
}

/// A file that is missing (CalculiX stopped before it wrote any) is empty.
fn read(file: &Path) -> String {
    fs::read(file).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

struct Ended {
    cpu_s: f64,
    timed_out: bool,
    success: bool,
}

/// Waits for this one child and takes its own resource usage, which `std` does not report.
fn wait(mut child: Child, deadline: Instant) -> std::io::Result<Ended> {
    let id = child.id() as libc::pid_t;
    let mut timed_out = false;
    loop {
        let mut status = 0;
        // SAFETY: plain C data, for which all zeros is a value.
        let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
        let flags = if timed_out { 0 } else { libc::WNOHANG };
        // SAFETY: `id` is our child, not waited for before (this function owns it and returns once it is); both
        // pointers are to live locals.
        let ended = unsafe { libc::wait4(id, &mut status, flags, &mut usage) };
        if ended == id {
            let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
            let success = libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == 0;
            return Ok(Ended { cpu_s: seconds(usage.ru_utime) + seconds(usage.ru_stime), timed_out, success });
        }
        if ended < 0 {
            let error = std::io::Error::last_os_error();
            if error.kind() != std::io::ErrorKind::Interrupted {
                return Err(error);
            }
            continue;
        }
        if Instant::now() >= deadline {
            child.kill()?;
            timed_out = true;
        } else {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// CalculiX's own error lines, or the end of its log.
fn reason_to_stop(log: &str) -> String {
    let lines: Vec<&str> = log.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    match lines.iter().position(|line| line.contains("*ERROR")) {
        Some(at) => lines[at..].iter().take(3).copied().collect::<Vec<_>>().join(" "),
        None => lines[lines.len().saturating_sub(2)..].join(" "),
    }
}

/// Sorts printed tables into points: totals of the plane and values of the pad, time by time.
fn points(deck: &Deck, blocks: &[dat::Block]) -> Result<Vec<Point>, Error> {
    let order = deck.pad_nodes();
    let mut wanted = Vec::new();
    let mut begin = 0.0;
    for (step, motion) in deck.steps.iter().enumerate() {
        wanted.extend(motion.output_at_mm.iter().map(|travel| (step, *travel, begin + travel)));
        begin += motion.length_mm();
    }
    let mut points = Vec::new();
    for (step, travel_mm, time) in wanted {
        let find = |quantity: &str, set: &str| {
            let near = |b: &&dat::Block| (b.time - time).abs() <= 2e-6 * time.max(1.0);
            blocks.iter().filter(|b| b.quantity.starts_with(quantity) && b.set == set).find(near)
        };
        let (Some(force), Some(pad)) = (find("total force", PLANE_NODES), find("displacements", PAD_NODES)) else {
            // The run ended here; later points cannot be there either.
            break;
        };
        let mut values = std::collections::HashMap::new();
        values.extend(pad.rows.iter().map(|(node, value)| (node - 1, *value)));
        let pad_displacement_mm: Option<Vec<_>> = order.iter().map(|node| values.get(node).copied()).collect();
        let (Some(pad_displacement_mm), Some((_, force_n))) = (pad_displacement_mm, force.rows.first().copied()) else {
            // Killed while it printed this one.
            break;
        };
        let from = if step == 0 { Vector3::zeros() } else { deck.steps[step - 1].end_mm };
        let part = travel_mm / deck.steps[step].length_mm();
        let plane_mm = from + part * (deck.steps[step].end_mm - from);
        points.push(Point { step, travel_mm, plane_mm, force_n, pad_displacement_mm });
    }
    Ok(points)
}
