//! What a change must pass: named steps, the cheap ones first, and the time that each took.
//!
//! Main type: [`Step`]. Uses `package` for the published crates, `thumb` for the firmware, `web`, `wheel`, `mujoco`, `c_test` and
//! `fmu_test` for the bindings and `install` for what is missing.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::ValueEnum;

use crate::{c_test, cargo, fmu_test, install, mujoco, package, root, run, thumb, web, wheel};

/// Options of `cargo xtask test`.
#[derive(clap::Args)]
pub struct Args {
    /// Only these steps, in the order given (comma-separated or repeated); all, in the order of this list, without it
    #[arg(long, value_enum, value_name = "STEP", value_delimiter = ',')]
    only: Vec<Step>,
}

/// A step of `cargo xtask test`.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Step {
    /// rustfmt, in this workspace, the firmware's and those of the bindings
    Format,
    /// Clippy without warnings: the workspace with all targets, the core with all features
    Clippy,
    /// rustdoc without warnings
    Doc,
    /// The published crates: their files, all of them compiled from what is packed, and the core's own tests from there
    Package,
    /// Unit tests of the workspace, some against CalculiX
    Unit,
    /// Examples in the documentation
    Doctest,
    /// No package uses one that it must not use
    Layout,
    /// Clippy without warnings: the firmware and the C library
    ThumbClippy,
    /// Host and target give the documented digest of a million steps
    ThumbGolden,
    /// Neither panics nor doubles in the firmware, bounds on code size and stack; other processors
    ThumbCheck,
    /// Instructions per call within their bounds
    ThumbCount,
    /// The C library's release folder: a CMake project outside the repository builds on it as C99 and C++17, gives the bits of
    /// the core and answers misuse by codes
    C,
    /// The co-simulation unit (FMI 3.0): valid and bit for bit the core's by FMPy, also when built from the sources inside
    Fmu,
    /// The C library on the target gives the documented vectors
    ThumbC,
    /// The firmware's example programs under QEMU
    ThumbRun,
    /// The page: built, below its size, and tested in headless Chromium against the core on the host
    Web,
    /// The MuJoCo plugin, built against pip's MuJoCo: motion, memory, energy, misuse, a held object beside MuJoCo's contact
    Mujoco,
    /// The Python package without the program: wheel in a fresh environment, bits of the core, type stubs
    Python,
    /// Integration tests and quick verification cases, some against CalculiX, some with Gmsh
    Integration,
}

impl Step {
    fn run(self) -> Result<()> {
        match self {
            Self::Format => format(),
            Self::Clippy => clippy(),
            Self::Doc => {
                let mut doc = Command::new(env!("CARGO"));
                doc.current_dir(root()).env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--workspace", "--no-deps"]);
                run(&mut doc)
            }
            Self::Package => package::test(),
            // All packages at once in each of these four, so that their dependencies are built once.
            Self::Unit => {
                install::calculix()?;
                cargo(&["test", "--release", "--workspace", "--lib", "--bins", "--examples"], &[])
            }
            Self::Doctest => cargo(&["test", "--release", "--workspace", "--doc"], &[]),
            Self::Layout => cargo(&["test", "--release", "--workspace", "--test", "layout"], &[]),
            Self::Integration => {
                install::calculix()?;
                install::gmsh()?;
                cargo(&["test", "--release", "--workspace", "--test", "*"], &[])
            }
            Self::Mujoco => mujoco::test(),
            Self::Python => wheel::test(wheel::Part::Fingers),
            Self::ThumbClippy => thumb::step(&thumb::Action::Clippy),
            Self::ThumbGolden => thumb::step(&thumb::Action::Golden),
            Self::ThumbCheck => thumb::step(&thumb::Action::Check),
            Self::ThumbCount => thumb::step(&thumb::COUNT),
            Self::C => c_test::test(),
            Self::Fmu => fmu_test::test(),
            Self::ThumbC => thumb::step(&thumb::Action::C),
            Self::ThumbRun => thumb::step(&thumb::Action::Programs),
            Self::Web => web::test(),
        }
    }
}

/// Runs the steps until one fails; prints what each took in any case.
pub fn main(args: &Args) -> Result<()> {
    let steps = if args.only.is_empty() { Step::value_variants() } else { &args.only };
    let mut table = Vec::new();
    let mut outcome = Ok(());
    for &step in steps {
        let name = step.to_possible_value().context("a step without name")?.get_name().to_owned();
        println!("== {name}");
        let start = Instant::now();
        outcome = step.run().with_context(|| format!("the step {name} failed: cargo xtask test --only {name}"));
        table.push((name, start.elapsed()));
        if outcome.is_err() {
            break;
        }
    }
    print_times(&table, outcome.is_ok());
    outcome
}

fn print_times(table: &[(String, Duration)], passed: bool) {
    println!("\n{:<14} {:>8}", "step", "seconds");
    for (i, (name, time)) in table.iter().enumerate() {
        let mark = if i + 1 == table.len() && !passed { "  failed" } else { "" };
        println!("{name:<14} {:>8.1}{mark}", time.as_secs_f64());
    }
    let all: Duration = table.iter().map(|row| row.1).sum();
    println!("{:<14} {:>8.1}", "all", all.as_secs_f64());
}

fn format() -> Result<()> {
    install::component("rustfmt", "fmt")?;
    for folder in [".", "firmware-example", "bindings/c", "bindings/web", "bindings/python"] {
        run(Command::new(env!("CARGO")).current_dir(root().join(folder)).args(["fmt", "--all", "--check"]))?;
    }
    // `cargo fmt` does not see the modules that the list of effects declares.
    let files = std::fs::read_dir(root().join("core/src/effects"))?;
    let files = files.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    run(Command::new("rustfmt").args(["--edition", "2024", "--check"]).args(files))
}

fn clippy() -> Result<()> {
    install::component("clippy", "clippy")?;
    let deny = ["--", "--deny", "warnings"];
    cargo(&[&["clippy", "--package", "fingerpad", "--all-targets", "--all-features"], &deny[..]].concat(), &[])?;
    cargo(&[&["clippy", "--workspace", "--all-targets"], &deny[..]].concat(), &[])
}
