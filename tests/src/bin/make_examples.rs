//! Makes the measured runs of `data/examples`: fingers with a known effect, written as a laboratory would.

use std::path::PathBuf;

use clap::Parser;
use fingerpad_diagnose::RunSet;
use fingerpad_tests::synthetic_truth::effects::Effect;
use fingerpad_tests::synthetic_truth::fe_sets::config;
use fingerpad_tests::synthetic_truth::finger::Finger;
use fingerpad_tests::synthetic_truth::laboratory::Noise;
use fingerpad_tests::synthetic_truth::protocol::{self, Plan, Stroke};
use fingerpad_tests::synthetic_truth::sets::{measure, record};
use fingerpad_tests::synthetic_truth::{Random, csv, fe};

#[derive(Parser)]
#[command(about = "The measured runs of data/examples", name = "make_examples")]
struct Args {
    /// Folder to write to
    #[arg(long, default_value = "data/examples")]
    out: PathBuf,
    /// Seed of the finger, the laboratory and the strokes
    #[arg(long, default_value_t = 15)]
    seed: u64,
    /// Who is measured
    #[arg(long, value_enum, default_value = "bristles")]
    finger: Who,
    /// Shape of the finger of the finite elements
    #[arg(long, default_value = "b")]
    shape: String,
}

/// Who is measured.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Who {
    /// The bristles of the first simulator
    Bristles,
    /// Finite elements on the coarse mesh
    FiniteElements,
}

/// Rows of a stroke.
const ROWS: usize = 30;

/// The hidden effect of `measured.csv` and `holdout.csv`: friction grows with the skin's moisture up to 55 a.u.
const MOISTURE: Effect = Effect { name: "hydration_bell", amplitude: 0.6, shape: [55.0, 18.0], form: 1.0 };

/// Runs of the calibration, the measured and the held-out file.
const RUNS: [usize; 3] = [16, 16, 8];
const NAMES: [&str; 3] = ["calibration", "measured", "holdout"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    let mut random = Random::new(args.seed);
    let finger = Finger::random(&mut random);
    let noise = Noise::random(&mut random);
    let mut plans = |k: usize| {
        if k == 0 { protocol::calibration(RUNS[k], &mut random) } else { protocol::measured(RUNS[k], 0, &mut random) }
    };
    let plans: [Vec<Plan>; 3] = [plans(0), plans(1), plans(2)];
    let strokes = plans.map(|plans| protocol::strokes(&plans, ROWS));
    let hidden = |k: usize| if k == 0 { Vec::new() } else { vec![MOISTURE] };
    let write =
        |k: usize, set: &RunSet| std::fs::write(args.out.join(format!("{}.csv", NAMES[k])), rounded(&csv::text(set)));
    if args.finger == Who::Bristles {
        for (k, strokes) in strokes.iter().enumerate() {
            write(k, &measure(&finger, strokes, &hidden(k), &noise, &mut random, NAMES[k], None))?;
        }
        return Ok(());
    }
    let config = config(&args.shape);
    let (finger, _) = config.finger()?;
    let problem = config.problem(&finger);
    let set = |k: usize, strokes: &[Stroke]| {
        let mut random = Random::new(args.seed + 1 + k as u64);
        record(strokes, &noise, &mut random, NAMES[k], None, &mut |stroke, scatter| {
            eprintln!("{}: a stroke of {:.2} mm", NAMES[k], stroke.plan.depth_mm);
            fe::readings(&problem, stroke, &hidden(k), scatter).expect("the finger slides")
        })
    };
    std::thread::scope(|scope| {
        let sets: Vec<_> =
            strokes.iter().enumerate().map(|(k, strokes)| scope.spawn(move || write(k, &set(k, strokes)))).collect();
        sets.into_iter().try_for_each(|set| set.join().expect("the finger slides"))
    })?;
    Ok(())
}

/// The file with four decimals at most, as an instrument would write it.
fn rounded(text: &str) -> String {
    let cell = |cell: &str| match cell.parse::<f64>() {
        Ok(value) => ((value * 1e4).round() / 1e4 + 0.0).to_string(),
        Err(_) => cell.to_owned(),
    };
    text.lines().map(|line| line.split(',').map(cell).collect::<Vec<_>>().join(",") + "\n").collect()
}
