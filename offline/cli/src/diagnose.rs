//! `fingerpad diagnose`: which effect is missing from the model, by measured runs, traces of force, tables or several fingers.

mod arguments;
mod check;
mod group;
mod input_files;
mod repeated;
mod result_files;
mod runs;
mod table;
mod trace;

use std::path::Path;

use anyhow::anyhow;
use fingerpad_diagnose::{DiagnoseError, laws::run_columns::template};
use fingerpad_formats as formats;

use super::Failure;
use arguments::Command;
pub use arguments::{Args, with_subcommand};
pub use input_files::read_mapped;

impl From<DiagnoseError> for Failure {
    fn from(error: DiagnoseError) -> Self {
        Self::Input(error.into())
    }
}

/// Writes a table with all columns, to be filled in.
fn write_template(path: &Path) -> Result<(), Failure> {
    let place = path.display();
    if path.exists() {
        return Err(Failure::Input(anyhow!("{place}: is there already and is not overwritten")));
    }
    formats::atomic_write(path, |w| w.write_all(template().as_bytes()))?;
    println!("{place}: all columns, and two rows as an example; docs/first-diagnosis.md says what they are");
    Ok(())
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.command {
        Command::Check(args) => check::run(args),
        Command::Runs(args) => runs::run(args),
        Command::Trace(args) => trace::run(args),
        Command::Table(args) => table::run(args),
        Command::Group(args) => group::run(args),
        Command::Template { file } => write_template(file),
    }
}
