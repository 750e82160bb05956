//! Steps that take hours: verification at full effort, score counts, fuzzing, mutants.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::shell::{command, output, root, run, sh, succeeds};
use crate::{install, rust};

/// Seconds for each target of the fuzzer.
pub const FUZZ_SECONDS: u32 = 600;
/// Version of cargo-mutants.
const MUTANTS: &str = "27.1.0";
/// What mutants are planted in, and how many.
const MUTATED: [&str; 3] = ["core/src/**", "offline/fe/src/contact/**", "offline/diagnose/src/**"];
const SAMPLE: usize = 30;

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
    run(program("experiments").arg("--fit"))
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

/// Faults planted by cargo-mutants in a sample of [`SAMPLE`], evenly spread over the list of all: by the tests of the package, those that
/// pass by all Rust tests of the gate, and those that pass again by the nightly ones. Each is the next pass of the same list, so that an
/// interrupted run goes on. Each pass first runs its tests without a fault: one that fails there would catch every mutant.
pub fn mutants() -> Result<()> {
    install::peers()?;
    let program = install::crate_program("cargo-mutants", MUTANTS, "")?.display().to_string();
    let files: Vec<&str> =
        std::iter::once("--workspace").chain(MUTATED.iter().flat_map(|files| ["-f", files])).collect();
    let all = output(command(".", &program).args(["mutants", "--list"]).args(&files))?;
    // This version plants every deleted field, whichever names are chosen, unless it was caught before.
    let (fields, all): (Vec<&str>, Vec<&str>) = all.lines().partition(|name| name.contains("delete field"));
    // The middles of equal shares.
    let sample = (0..SAMPLE).filter_map(|k| all.get((2 * k + 1) * all.len() / (2 * SAMPLE)));
    let names: Vec<String> = sample.map(|name| format!("--re=^{}$", escaped(name))).collect();
    println!("{} of {} mutants", names.len(), all.len());
    let out = root().join("target/mutants");
    let caught = out.join("mutants.out/previously_caught.txt");
    if !caught.exists() {
        fs::create_dir_all(out.join("mutants.out"))?;
        fs::write(caught, fields.join("\n") + "\n")?;
    }
    let nightly = format!("-- -- --ignored{}", rust::weekly_skipped());
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::iter::once(root().join("target/gmsh/bin")).chain(std::env::split_paths(&path));
    let path = std::env::join_paths(path)?;
    for (what, scope, tests) in [
        ("the package's own tests", "--test-workspace=false", ""),
        ("the gate", "--test-workspace=true", ""),
        ("nightly", "--test-workspace=true", nightly.as_str()),
    ] {
        let mut mutants = command(".", &program);
        mutants.args(["mutants", "--iterate", "--profile=gate", scope]).args(&files);
        mutants.arg("--output").arg(&out).args(&names).args(tests.split_whitespace());
        // As in the gate, but a lint is no failure. The copy that is mutated has no folder `target` with Gmsh.
        mutants.env("RUSTC_WORKSPACE_WRAPPER", root().join("xtask/gate-rustc")).env("PATH", &path);
        let status = mutants.status()?;
        let missed = fs::read_to_string(out.join("mutants.out/missed.txt")).unwrap_or_default();
        println!("{what}: {} missed\n{missed}", missed.lines().count());
        // 2 and 3: some were missed or took too long.
        ensure!(matches!(status.code(), Some(0 | 2 | 3)), "cargo mutants ended with {status}");
    }
    Ok(())
}

/// A text as a pattern that matches it alone.
fn escaped(text: &str) -> String {
    // With a backslash, `<` and `>` are ends of words.
    text.chars().flat_map(|c| r"\.+*?()|[]{}^$".contains(c).then_some('\\').into_iter().chain([c])).collect()
}
