//! `fingerpad export`: a model as source text.

use std::path::PathBuf;

use clap::ValueEnum;
use fingerpad_formats::atomic_write;
use fingerpad_reduce as reduce;

use super::{Failure, Outputs, model};

/// Write a model as a Rust constant, a C array or JSON
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad export --model model.fpm --format rust --out src/model.rs   `MODEL.model()?` steps it
  fingerpad export --model model.fpm --format c --out model.h           for the C library
  fingerpad export --model model.fpm --format json --out model.json     all numbers with their names")]
pub struct Args {
    /// Model file; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    format: Format,
    /// File to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// A `static` of the package `fingerpad`
    Rust,
    /// The file's bytes as an aligned array
    C,
    /// Numbers, tables, provenance, effects
    Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (file, _) = model::load(args.model.as_deref())?;
    Outputs::beside([("--model", args.model.as_deref())]).file("--out", Some(&args.out)).prepare()?;
    let format = match args.format {
        Format::Rust => reduce::Format::Rust,
        Format::C => reduce::Format::C,
        Format::Json => reduce::Format::Json,
    };
    let text = reduce::export(&file, format);
    atomic_write(&args.out, |w| w.write_all(text.as_bytes()))?;
    println!("{}: {} bytes", args.out.display(), text.len());
    Ok(())
}
