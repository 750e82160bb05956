//! The Rust steps: format, Clippy, tests, documentation, in one profile and with one compiler, `gate-rustc`, so that every crate is built once.

use std::process::Command;

use anyhow::Result;

use crate::install;
use crate::shell::{command, root, run, sh};

/// Selects what holds tests, in all packages at once, so that their dependencies are built once. Other programs and examples would be
/// compiled for nothing.
const TESTS: &str = "test --no-fail-fast --lib --test * --bin xtask --example grip --example haptic";

/// Cargo in the profile of the gate, for all packages. The compiler of this workspace's packages is Clippy's, whose warnings are errors.
pub fn cargo(line: &str) -> Result<Command> {
    install::component("clippy", "clippy")?;
    let (verb, more) = line.split_once(' ').unwrap_or((line, ""));
    let mut cargo = command(".", &format!("cargo {verb} --profile gate --workspace {more}"));
    // The format in which `cargo clippy` hands lint levels to its compiler.
    let deny = "-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__";
    cargo.env("RUSTC_WORKSPACE_WRAPPER", root().join("xtask/gate-rustc")).env("CLIPPY_ARGS", deny);
    Ok(cargo)
}

/// Ignored tests that take more than minutes.
const WEEKLY: [&str; 5] = [
    "every_tip_has_models_or_a_reason",
    "a_long_search_for_closed_paths_finds_none_that_yields_work",
    "planted_effects_are_named_or_among_the_contenders",
    "no_effect_is_ever_named_wrongly",
    "snakemake_does_a_population_study",
];

/// Formatting in all workspaces.
pub fn format() -> Result<()> {
    install::component("rustfmt", "fmt")?;
    sh(".", "cargo fmt --all --check")?;
    // Without `--all`, which would go through the packages that they use as well.
    for folder in ["firmware-example", "bindings/c", "bindings/web", "bindings/python"] {
        sh(folder, "cargo fmt --check")?;
    }
    // `cargo fmt` does not format the modules that the list of effects declares.
    let files = std::fs::read_dir(root().join("core/src/effects"))?;
    let files = files.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    run(command(".", "rustfmt --edition 2024 --check").args(files))
}

/// Targets and features that the tests do not build.
pub fn clippy() -> Result<()> {
    install::component("clippy", "clippy")?;
    let features = "--features fingerpad/defmt,fingerpad/serde,fingerpad/std,fingerpad-tests/bench";
    sh(".", &format!("cargo clippy --profile gate --workspace --all-targets {features} -- --deny warnings"))
}

pub fn doc() -> Result<()> {
    run(command(".", "cargo doc --profile gate --workspace --no-deps").env("RUSTDOCFLAGS", "-D warnings"))
}

pub fn doctests() -> Result<()> {
    run(&mut cargo("test --doc")?)
}

pub fn tests() -> Result<()> {
    install::peers()?;
    cases(512, TESTS)
}

/// Ignored tests but those of [`WEEKLY`].
pub fn slow_tests() -> Result<()> {
    install::peers()?;
    cases(512, &format!("{TESTS} -- --ignored{}", weekly_skipped()))
}

/// Options that leave out the tests of [`WEEKLY`].
pub fn weekly_skipped() -> String {
    WEEKLY.iter().map(|name| format!(" --skip {name}")).collect()
}

/// The ignored tests of [`WEEKLY`].
pub fn counts() -> Result<()> {
    install::peers()?;
    cases(512, &format!("{TESTS} -- --ignored {}", WEEKLY.join(" ")))
}

pub fn properties() -> Result<()> {
    cases(20_000, &format!("{TESTS} properties::"))
}

/// Runs tests with that many cases for each property.
fn cases(count: u32, line: &str) -> Result<()> {
    run(cargo(line)?.env("PROPTEST_CASES", count.to_string()))
}
