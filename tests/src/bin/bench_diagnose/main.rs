//! Score card of `fingerpad diagnose` on hidden sets from an independent simulator.

mod card;
mod power;
mod whole_score;

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use fingerpad_tests::synthetic_truth::csv;
use fingerpad_tests::synthetic_truth::effects::{LIBRARY, OUTSIDE};
use fingerpad_tests::synthetic_truth::laboratory::Noise;
use fingerpad_tests::synthetic_truth::loggers::Protocol;
use fingerpad_tests::synthetic_truth::oracle::{Separation, separation};
use fingerpad_tests::synthetic_truth::score::{Class, Scored, score, settle};
use fingerpad_tests::synthetic_truth::sets::{Hide, Wanted, make};
use fingerpad_tests::synthetic_truth::simulator::SimulatorKind;

use card::card;
use whole_score::whole_score;

#[derive(Parser)]
#[command(about = "Score card of the diagnosis on hidden sets", name = "cargo xtask bench diagnose")]
struct Args {
    /// Sets per law and cell of single effects
    #[arg(long, default_value_t = 1)]
    repeats: u64,
    /// Added to every seed: another number gives other sets
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only these kinds: single, none, pair, outside, unrecorded
    #[arg(long, value_delimiter = ',')]
    kinds: Vec<String>,
    /// Who makes the readings
    #[arg(long, value_enum, default_value = "first")]
    simulator: Simulators,
    /// The whole score of both simulators in five practices instead; goes on where it stopped
    #[arg(long)]
    score: bool,
    /// Of the score only the single effects that end ambiguous, and what the proposed strokes make of them; the oracle is
    /// asked for these alone
    #[arg(long, requires = "score")]
    ambiguous: bool,
    /// The score's first sets only, in an order that mixes all kinds
    #[arg(long)]
    sets: Option<usize>,
    /// The score's file, a line a set [default: target/diagnose-score-SEED.jsonl, or
    /// target/diagnose-ambiguous-SEED.jsonl]
    #[arg(long)]
    out: Option<PathBuf>,
    /// How the laboratory moves and logs
    #[arg(long, value_enum, default_value = "plane")]
    protocol: Protocol,
    /// Only sizes from this on
    #[arg(long, default_value_t = 0.0)]
    least_size: f64,
    /// Threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Only the sets of these seeds
    #[arg(long, value_delimiter = ',')]
    only: Vec<u64>,
    /// Write the files of every set to this folder
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Simulate so many sets from each calibration instead, and compare the predicted power with the counted one
    #[arg(long, value_name = "SETS")]
    power: Option<usize>,
    /// Only this level of confounding: 0, 1 or 2
    #[arg(long)]
    level: Option<usize>,
    /// Print every set that is not as wanted
    #[arg(long)]
    verbose: bool,
}

/// Who makes the readings.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Simulators {
    /// Bristles on one spring, strength a power of the pressure
    First,
    /// An elastic half-space under an elliptic contact, strength tau_0 + alpha p
    Second,
    /// A brush of bristles that ages, relaxes and has a weak law of speed in all files, those of the calibration too
    Third,
    /// The first and the second, one after the other
    Both,
}

impl Simulators {
    fn kinds(self) -> &'static [SimulatorKind] {
        match self {
            Self::First => &SimulatorKind::ALL[..1],
            Self::Second => &SimulatorKind::ALL[1..],
            Self::Third => &[SimulatorKind::Third],
            Self::Both => &SimulatorKind::ALL,
        }
    }
}

/// A set to be made.
#[derive(Clone, Copy)]
struct Job {
    simulator: SimulatorKind,
    seed: u64,
    kind: &'static str,
    hide: Hide,
    size: f64,
    level: usize,
    runs: usize,
}

struct Done {
    job: Job,
    scored: Scored,
    oracle: Option<Separation>,
    settled: Option<Class>,
    exact_form: bool,
    truth: Vec<String>,
    noise: Noise,
}

const PAIRS: [(usize, usize); 16] = [
    (0, 13),
    (1, 11),
    (4, 13),
    (5, 8),
    (7, 12),
    (3, 14),
    (16, 9),
    (15, 4),
    (2, 6),
    (0, 5),
    (8, 12),
    (1, 7),
    (10, 0),
    (14, 4),
    (16, 5),
    (6, 13),
];

fn jobs(args: &Args) -> Vec<Job> {
    args.simulator.kinds().iter().flat_map(|simulator| jobs_of(*simulator, args)).collect()
}

fn jobs_of(simulator: SimulatorKind, args: &Args) -> Vec<Job> {
    let mut out = Vec::new();
    let mut seed = 40_000 + 100_000 * args.seed;
    let mut add = |kind, hide, size, level, runs| {
        seed += 1;
        out.push(Job { simulator, seed, kind, hide, size, level, runs });
    };
    for _ in 0..args.repeats {
        for size in [0.03, 0.10, 0.30] {
            for level in 0..3 {
                for law in 0..LIBRARY.len() {
                    add("single", Hide::Law(law), size, level, 60);
                }
            }
        }
        for level in 0..3 {
            for k in 0..16 {
                add("none", Hide::Nothing, 0.0, level, [40, 60, 100, 60][k % 4]);
            }
        }
        for size in [0.10, 0.30] {
            for (i, j) in PAIRS {
                add("pair", Hide::Pair(i, j), size, 0, 60);
            }
            for k in 0..OUTSIDE.len() {
                add("outside", Hide::Outside(k), size, 0, 60);
                add("outside", Hide::Outside(k), size, 0, 60);
            }
            for law in [0, 6, 8, 14, 16] {
                add("unrecorded", Hide::Unrecorded(law), size, 0, 60);
                add("unrecorded", Hide::Unrecorded(law), size, 1, 60);
            }
        }
    }
    if !args.only.is_empty() {
        out.retain(|j| args.only.contains(&j.seed));
    }
    out.retain(|j| args.level.is_none_or(|level| j.level == level));
    out.retain(|j| j.kind == "none" || j.size >= args.least_size);
    if !args.kinds.is_empty() {
        out.retain(|j| args.kinds.iter().any(|k| k == j.kind));
    }
    out
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    if args.score && args.simulator == Simulators::Third {
        return Err("--score has sets of --simulator first, second or both; third has none".into());
    }
    if args.score {
        return whole_score(&args);
    }
    let jobs = jobs(&args);
    if let Some(sets) = args.power {
        power::compare(&jobs, &args, sets);
        return Ok(());
    }
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Done)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(i).copied() else { break };
                    let exact_form = job.seed % 2 == 0;
                    let Job { simulator, seed, hide, size, level, runs, .. } = job;
                    let protocol = args.protocol;
                    let made = make(Wanted { simulator, protocol, seed, hide, size, level, runs, exact_form });
                    if let Some(folder) = &args.dump {
                        for (set, role) in [(&made.calibration, "c"), (&made.measured, "m"), (&made.holdout, "h")] {
                            let path = folder.join(format!("{}_{role}.csv", job.seed));
                            std::fs::write(path, csv::text(set)).expect("the folder can be written to");
                        }
                    }
                    let oracle = (job.kind == "single").then(|| separation(&made));
                    let scored = score(&made);
                    let settled =
                        settle(&made, &scored.report).filter(|_| job.kind == "single").map(|again| again.class);
                    let mut list = done.lock().expect("no thread panics with it");
                    let truth =
                        made.truth.iter().map(|e| format!("{} {:.4} {:.2?}", e.name, e.amplitude, e.shape)).collect();
                    list.push((i, Done { job, scored, oracle, settled, exact_form, truth, noise: made.noise }));
                    if list.len().is_multiple_of(20) {
                        eprintln!("{} of {}", list.len(), jobs.len());
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().expect("all threads are done");
    done.sort_by_key(|d| d.0);
    let done: Vec<Done> = done.into_iter().map(|d| d.1).collect();
    card(&done, &args);
    Ok(())
}
