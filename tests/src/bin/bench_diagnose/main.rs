//! Score card of `fingerpad diagnose` on hidden sets from an independent simulator.

mod power;

use std::path::PathBuf;

use clap::Parser;
use fingerpad_tests::synthetic_truth::csv;
use fingerpad_tests::synthetic_truth::loggers::Protocol;
use fingerpad_tests::synthetic_truth::score_sets::{self, Kind, ScoreSet, judge_all};
use fingerpad_tests::synthetic_truth::score_table::{settling, table};
use fingerpad_tests::synthetic_truth::sets::make;
use fingerpad_tests::synthetic_truth::simulator::SimulatorKind;

#[derive(Parser)]
#[command(about = "Score card of the diagnosis on hidden sets", name = "cargo xtask bench diagnose")]
struct Args {
    /// Sets per law and cell of single effects
    #[arg(long, default_value_t = 1)]
    repeats: u64,
    /// Added to every seed: another number gives other sets
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only these kinds
    #[arg(long, value_enum, value_delimiter = ',')]
    kinds: Vec<Kind>,
    /// Who makes the readings
    #[arg(long, value_enum, default_value = "first")]
    simulator: Simulators,
    /// The whole score of both simulators in five practices instead
    #[arg(long)]
    score: bool,
    /// Of the score only the single effects that end ambiguous, and what the proposed strokes make of them; the oracle is
    /// asked for these alone
    #[arg(long, requires = "score")]
    ambiguous: bool,
    /// The first sets only; those of the score are in an order that mixes all kinds
    #[arg(long)]
    sets: Option<usize>,
    /// Keep the outcomes in this file, a line a set, and go on where it stopped [default with --score:
    /// target/diagnose-score-SEED.jsonl, or target/diagnose-ambiguous-SEED.jsonl]
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
    /// Print the predicted power law by law
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
    /// A grid of cells with coupled pressures on a tissue that relaxes in all files; `--protocol instrument` goes with it
    Fourth,
    /// The first and the second, one after the other
    Both,
}

impl Simulators {
    fn kinds(self) -> &'static [SimulatorKind] {
        match self {
            Self::First => &SimulatorKind::ALL[..1],
            Self::Second => &SimulatorKind::ALL[1..],
            Self::Third => &[SimulatorKind::Third],
            Self::Fourth => &[SimulatorKind::Fourth],
            Self::Both => &SimulatorKind::ALL,
        }
    }
}

/// The sets that are asked for, in their order.
fn wanted(args: &Args) -> Vec<ScoreSet> {
    let simulators = args.simulator.kinds();
    let mut out = if args.score {
        score_sets::sets(args.seed, simulators)
    } else {
        let of = |simulator: &SimulatorKind| score_sets::card(args.seed, *simulator, args.protocol, args.repeats);
        simulators.iter().flat_map(of).collect()
    };
    out.retain(|set| args.only.is_empty() || args.only.contains(&set.of.seed));
    out.retain(|set| !args.ambiguous || set.kind() == Kind::Single);
    out.retain(|set| args.kinds.is_empty() || args.kinds.contains(&set.kind()));
    out.retain(|set| args.level.is_none_or(|level| set.of.level == level));
    out.retain(|set| set.kind() == Kind::Nothing || set.of.size >= args.least_size);
    out.truncate(args.sets.unwrap_or(usize::MAX));
    out
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    if args.score && matches!(args.simulator, Simulators::Third | Simulators::Fourth) {
        return Err("--score has sets of --simulator first, second or both; third and fourth have none".into());
    }
    let wanted = wanted(&args);
    if let Some(sets) = args.power {
        power::compare(&wanted, &args, sets);
        return Ok(());
    }
    if let Some(folder) = &args.dump {
        for set in &wanted {
            let made = make(set.of);
            for (set, role) in [(&made.calibration, "c"), (&made.measured, "m"), (&made.holdout, "h")] {
                std::fs::write(folder.join(format!("{}_{role}.csv", made.seed)), csv::text(set))?;
            }
        }
    }
    let name = if args.ambiguous { "ambiguous" } else { "score" };
    let default = args.score.then(|| PathBuf::from(format!("target/diagnose-{name}-{}.jsonl", args.seed)));
    let file = args.out.clone().or(default);
    let done = judge_all(&wanted, file.as_deref(), args.threads, args.ambiguous)?;
    println!("seed {}, {}", args.seed, if args.ambiguous { settling(&done) } else { table(&done) });
    Ok(())
}
