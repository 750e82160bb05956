//! Steps that take hours: verification at full effort, score counts, fuzzing, mutants.

use std::process::Command;

use anyhow::{Context, Result};

use crate::install;
use crate::shell::{command, run, sh, succeeds};

/// Seconds for each target of the fuzzer.
pub const FUZZ_SECONDS: u32 = 600;
/// Version of cargo-mutants.
const MUTANTS: &str = "27.1.0";
/// What mutants are planted in.
const MUTATED: &str = "-f core/src/** -f offline/fe/src/contact/** -f offline/diagnose/src/**";

/// A program of the package of tests, in the ordinary release profile.
pub fn program(name: &str) -> Command {
    command(".", &format!("cargo run --release --package fingerpad-tests --bin {name} --"))
}

pub fn verify() -> Result<()> {
    run(&mut program("verify"))
}

pub fn calculix() -> Result<()> {
    install::programs(&["ccx"])?;
    run(program("calculix").arg("verify"))
}

pub fn score() -> Result<()> {
    run(&mut program("bench_diagnose"))
}

pub fn confirm() -> Result<()> {
    run(&mut program("bench_confirm"))
}

pub fn experiments() -> Result<()> {
    run(&mut program("experiments"))
}

pub fn reference() -> Result<()> {
    run(&mut program("fast_against_finite_elements"))
}

pub fn fuzz() -> Result<()> {
    fuzz_for(FUZZ_SECONDS)
}

/// Runs the fuzz targets of the core; a find ends it with its input.
pub fn fuzz_for(seconds: u32) -> Result<()> {
    if !succeeds(&mut command(".", "cargo +nightly fuzz --version")) {
        sh(".", "cargo install --locked cargo-fuzz")
            .context("cargo-fuzz could not be installed; `rustup toolchain install nightly` may help")?;
    }
    let run_target = |target| sh("core", &format!("cargo +nightly fuzz run {target} -- -max_total_time={seconds}"));
    ["file", "step", "calibration"].into_iter().try_for_each(run_target)
}

/// Faults planted by cargo-mutants, one after the other; an interrupted run leaves out those that were caught before.
pub fn mutants() -> Result<()> {
    let program = install::crate_program("cargo-mutants", MUTANTS, "")?;
    run(command(".", &program.display().to_string()).args(["mutants", "--iterate"]).args(MUTATED.split(' ')))
}
