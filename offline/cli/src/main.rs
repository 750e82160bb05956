//! The program; all of it is in the library, which the Python package runs as well.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(fingerpad_cli::run(std::env::args_os()))
}
