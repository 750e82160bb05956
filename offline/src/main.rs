//! `fingerpad`: fingertip friction from the finite-element model to the reduced one.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
