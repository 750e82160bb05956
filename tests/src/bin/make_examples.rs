//! Makes the measured runs of `data/examples`: a simulated finger with a known effect, written as a laboratory would.

use std::path::PathBuf;

use clap::Parser;
use fingerpad_tests::synthetic_truth::effects::Effect;
use fingerpad_tests::synthetic_truth::finger::Finger;
use fingerpad_tests::synthetic_truth::laboratory::Noise;
use fingerpad_tests::synthetic_truth::protocol::{self, Plan};
use fingerpad_tests::synthetic_truth::sets::measure;
use fingerpad_tests::synthetic_truth::{Random, csv};

#[derive(Parser)]
#[command(about = "The measured runs of data/examples", name = "make_examples")]
struct Args {
    /// Folder to write to
    #[arg(long, default_value = "data/examples")]
    out: PathBuf,
    /// Seed of the finger, the laboratory and the strokes
    #[arg(long, default_value_t = 15)]
    seed: u64,
}

/// Rows of a stroke.
const ROWS: usize = 30;

/// The hidden effect of `measured.csv` and `holdout.csv`: friction grows with the skin's moisture up to 55 a.u.
const MOISTURE: Effect = Effect { name: "hydration_bell", amplitude: 0.6, shape: [55.0, 18.0], form: 1.0 };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    let mut random = Random::new(args.seed);
    let finger = Finger::random(&mut random);
    let noise = Noise::random(&mut random);
    let calibration = protocol::calibration(16, &mut random);
    let measured = protocol::measured(16, 0, &mut random);
    let holdout = protocol::measured(8, 0, &mut random);
    let mut write = |name: &str, plans: &[Plan], hidden: &[Effect]| {
        let strokes = protocol::strokes(plans, ROWS);
        let set = measure(&finger, &strokes, hidden, &noise, &mut random, name, None);
        std::fs::write(args.out.join(format!("{name}.csv")), rounded(&csv::text(&set)))
    };
    write("calibration", &calibration, &[])?;
    write("measured", &measured, &[MOISTURE])?;
    write("holdout", &holdout, &[MOISTURE])?;
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
