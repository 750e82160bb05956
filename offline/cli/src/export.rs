//! `fingerpad export`: a model as source text or as a co-simulation unit.

use std::path::PathBuf;

use clap::ValueEnum;
use fingerpad_fmu as fmu;
use fingerpad_reduce as reduce;

use super::{Failure, Mark, Outputs, model, outputs};

/// Write a model as a Rust constant, a C array, JSON or an FMI 3.0 co-simulation unit (FMU)
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad export --model model.fpm --format rust --out src/model.rs   `MODEL.model()?` steps it
  fingerpad export --model model.fpm --format c --out model.h           for the C library
  fingerpad export --model model.fpm --format json --out model.json     all numbers with their names
  fingerpad export --model model.fpm --format fmu --out finger.fmu      for Modelica, FMPy")]
pub struct Args {
    /// Model file; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    format: Format,
    /// File to write; - for standard output
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace a file at --out that this command did not write
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// A `static` of the package `fingerpad`
    Rust,
    /// The file's bytes as an aligned array
    C,
    /// Numbers, tables, provenance, effects
    Json,
    /// An FMI 3.0 co-simulation unit with its sources, for this kind of machine
    Fmu,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (file, name) = model::load(args.model.as_deref())?;
    let marks = vec![match args.format {
        Format::Rust => Mark::beginning("// A fingerpad model; made by `fingerpad export`."),
        Format::C => Mark::beginning("/* A fingerpad model; made by `fingerpad export`."),
        Format::Json => Mark::beginning("{\n  \"depth_mm\": ["),
        Format::Fmu => Mark::holding("PK", "resources/model.fpm"),
    }];
    let inputs = [("--model", args.model.as_deref())];
    Outputs::beside(inputs).stream("--out", &args.out, marks).force(args.force).prepare()?;
    let text = |format| Ok(reduce::export(&file, format).into_bytes());
    let bytes = match args.format {
        Format::Rust => text(reduce::Format::Rust),
        Format::C => text(reduce::Format::C),
        Format::Json => text(reduce::Format::Json),
        Format::Fmu => fmu::pack(&file, &name).map_err(|e| Failure::Input(e.into())),
    }?;
    outputs::write(&args.out, |w| w.write_all(&bytes))?;
    outputs::say(&args.out, &format!("{}: {} bytes", args.out.display(), bytes.len()));
    Ok(())
}
