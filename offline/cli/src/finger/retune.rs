//! `fingerpad finger retune`: the model file of another finger by a change of units.

use std::path::PathBuf;

use anyhow::anyhow;
use fingerpad::Tuning;
use fingerpad_formats::atomic_write;
use fingerpad_reduce::{ReduceError, retuned_bed, retuned_pad};

use crate::model::{self, Loaded};
use crate::{Failure, Outputs};

/// Write a model for another finger: its size, its stiffness and its friction over those of the finger that was fitted
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad finger retune --size 1.1 --stiffness 1.2 --out larger.fpm            a bed, from the shipped one
  fingerpad finger retune --model pad.fpm --lambda 1.3 --out drier.fpm           a pad with more friction

Lengths grow with --size, pressures with --stiffness, local friction with --lambda: N ~ stiffness size², and the strength
of friction ~ lambda stiffness^beta size². This is exact for fingers that are geometrically similar. Forces of the
written file are those of the same factors in the core, in C and in Python. The new file states its factors in its
provenance; its errors are those of the finger that was fitted. Retuning a file again multiplies the factors.

A bed is refused where more friction on a softer finger would make it give back more energy than it took. A pad has no such
limit: retune the pad and make a bed from it with `fingerpad finger bed`.")]
pub struct Args {
    /// Model file of a bed or a pad; without it the bed that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// Factor on all lengths, 0.5 to 2
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = |text: &str| factor(text, [0.5, 2.0]))]
    size: f32,
    /// Factor on the tissue's stiffness, 0.2 to 5
    #[arg(long, value_name = "E", default_value_t = 1.0, value_parser = |text: &str| factor(text, [0.2, 5.0]))]
    stiffness: f32,
    /// Factor on lambda of the friction law, 0.1 to 10
    #[arg(long, value_name = "L", default_value_t = 1.0, value_parser = |text: &str| factor(text, [0.1, 10.0]))]
    lambda: f32,
    /// Model file to write
    #[arg(long, value_name = "MODEL.fpm")]
    out: PathBuf,
    /// Replace a file at --out, also a model
    #[arg(long)]
    force: bool,
}

/// A factor within a range.
fn factor(text: &str, [least, most]: [f32; 2]) -> Result<f32, String> {
    match text.parse() {
        Ok(factor) if factor >= least && factor <= most => Ok(factor),
        _ => Err(format!("must be a number from {least} to {most}")),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (file, name) = model::load_any(args.model.as_deref())?;
    Outputs::beside([("--model", args.model.as_deref())])
        .file("--out", Some(args.out.as_path()), Vec::new())
        .force(args.force)
        .prepare()?;
    let Args { size, stiffness, lambda, .. } = *args;
    let bytes = match &file {
        Loaded::Bed(bed) => retuned_bed(bed, &Tuning { size, stiffness, lambda }),
        Loaded::Pad(pad) => retuned_pad(pad, &Tuning { size, stiffness, lambda }),
    };
    let bytes = bytes.map_err(|error| match error {
        ReduceError::Model(problem) => Failure::Input(anyhow!("{name}: {problem}")),
        other => Failure::Input(anyhow!("{name}: {other}")),
    })?;
    atomic_write(&args.out, |w| w.write_all(&bytes))?;
    println!(
        "{}: {} bytes, {name} with size {size}, stiffness {stiffness}, lambda {lambda}",
        args.out.display(),
        bytes.len()
    );
    Ok(())
}
