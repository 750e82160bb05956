//! History of a contact under disturbance: noise and cycles of depth, constant forces, nested paths, first slip, rest.
//!
//! Each row has a value, a required mark and a desired mark. The rows against the finite elements need stored runs.
//! Ends with 1 if a row misses its required mark.

mod disturbed;
mod driven;
mod held;
mod pictures;
mod row;
mod slip;
mod vibration;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use fingerpad::build::{Data, Params};
use fingerpad::host::ModelFile;
use row::Row;

#[derive(Parser)]
#[command(about = "History of a contact under disturbance, against marks", name = "cargo xtask bench memory")]
struct Args {
    /// Model file
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/models/fingertip.fpm"))]
    model: PathBuf,
    /// The hand-made example instead of a model file
    #[arg(long, conflicts_with = "model")]
    example: bool,
    /// Folder of stored runs; those of the kinds `vibration` and `straight` are read
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/runs"))]
    runs: PathBuf,
    /// Steps of the rows that go on for long
    #[arg(long, default_value_t = 1_000_000)]
    steps: u32,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw held load under vibration, first slip through noise, limit surface and changes of pose into this folder in place
    /// of the table
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
}

fn main() -> ExitCode {
    match table(&Args::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(missed) => {
            println!("{missed} rows miss the mark");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// The numbers of a model file.
fn read(file: &Path) -> Result<Data, String> {
    let with_file = |error: String| format!("{}: {error}", file.display());
    let bytes = std::fs::read(file).map_err(|e| with_file(e.to_string()))?;
    Ok(*ModelFile::new(&bytes).map_err(|e| with_file(e.to_string()))?.file().model.data())
}

/// Prints the table; the number of rows that miss their mark.
fn table(args: &Args) -> Result<usize, String> {
    let data =
        if args.example { Params::example().try_build().map_err(|e| e.to_string())? } else { read(&args.model)? };
    let model = data.model().map_err(|e| e.to_string())?;
    if let Some(folder) = &args.pictures {
        return pictures::draw(&model, &args.runs, args.seed, folder).map(|()| 0);
    }
    println!("seed {}, {} steps", args.seed, args.steps);
    println!("{:<78} {:>10} {:>10} {:>10}  ", "", "value", "pass", "reach");
    let mut missed = 0;
    let mut show = |rows: Vec<Row>| {
        for row in rows {
            missed += usize::from(!row.passes());
            println!("{row}");
        }
    };
    show(vibration::rows(&model, &args.runs)?);
    show(vec![pictures::limit_row(&model, &args.runs)?]);
    show(held::cycles(&model, args.steps));
    show(held::noise(&model, args.steps, args.seed));
    show(driven::rows(&model, args.steps, args.seed));
    show(held::nested(&model));
    show(slip::first_slip(&model, args.seed));
    show(slip::growth(&model));
    show(driven::rest_in_a_loop(&model));
    show(disturbed::rows(&model, args.steps, args.seed));
    Ok(missed)
}
