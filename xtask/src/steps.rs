//! What a change must pass: named steps in three tiers, run in two lanes, and what each costs.
//!
//! | tier | command | for |
//! |---|---|---|
//! | gate | `cargo xtask test` | every change; CI runs it |
//! | nightly | `cargo xtask nightly` | once before an issue is closed: all that is not in the gate |
//! | weekly | `cargo xtask weekly` | long searches and counts; resumes after an interruption |
//!
//! Main type: [`Step`]. A step runs as a process of its own, whose output is kept in `target/steps/NAME.log`. Uses all other modules for
//! the content of the steps.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use crate::shell::{command, output, root};
use crate::{binding, book, c, fmu, package, regenerate, rust, thumb, web, weekly};

/// Options of the three tiers.
#[derive(clap::Args)]
pub struct Args {
    /// Only these steps of any tier (comma-separated or repeated)
    #[arg(long, value_name = "STEP", value_delimiter = ',')]
    only: Vec<String>,
    /// List the steps of all tiers
    #[arg(long)]
    list: bool,
}

/// How often a step runs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Tier {
    Gate,
    Nightly,
    Weekly,
}

/// A sequence of steps. Two lanes run side by side: steps that build in the same folder wait for each other anyway, and while
/// one lane downloads, links or emulates, a processor core is free for the other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lane {
    /// Builds in the workspace's own target folder.
    Workspace,
    /// Builds elsewhere: firmware and bindings.
    Others,
}

struct Step(&'static str, Tier, Lane, fn() -> Result<()>, &'static str);

use Lane::{Others, Workspace};
use Tier::{Gate, Nightly, Weekly};

/// All steps, in the order in which a lane runs them.
#[rustfmt::skip]
const STEPS: [Step; 36] = [
    Step("format", Gate, Workspace, rust::format, "rustfmt in every workspace"),
    Step("tests", Gate, Workspace, rust::tests, "Clippy, unit and integration tests, some against CalculiX and Gmsh; 512 cases for each property of the core"),
    Step("doctest", Gate, Workspace, rust::doctests, "examples in the documentation of the code"),
    Step("firmware", Gate, Others, thumb::gate, "the firmware without panics and doubles, its bounds on instructions, code and stack"),
    Step("c", Gate, Others, c::gate, "the C library in C99: vectors, every answer of a story with the core's bits, misuse"),
    Step("web", Gate, Others, web::gate, "the module for browsers in Node: bits of the core, size, nothing imported"),
    Step("python", Gate, Others, binding::python_gate, "the Python package: bits of the core"),
    Step("mujoco", Gate, Others, binding::mujoco_gate, "the MuJoCo plugin: scenes of seconds, memory, passivity"),
    Step("warp", Gate, Others, binding::warp_gate, "the Warp package on the CPU against the core: bed bit for bit, pad within 1e-4"),
    Step("golden", Gate, Others, thumb::golden, "host and target: the documented digest of a million steps"),
    Step("clippy", Nightly, Workspace, rust::clippy, "Clippy: targets and features that the tests do not build"),
    Step("doc", Nightly, Workspace, rust::doc, "rustdoc without warnings"),
    Step("slow-tests", Nightly, Workspace, rust::slow_tests, "tests marked as nightly: every command of pages and help, long verification"),
    Step("properties", Nightly, Workspace, rust::properties, "20 000 cases for each property of the core"),
    Step("package", Nightly, Workspace, package::test, "the crates: files in place, compiled from their packed archives"),
    Step("thumb-clippy", Nightly, Others, thumb::clippy, "Clippy of the firmware and of the C library"),
    Step("programs", Nightly, Others, thumb::programs, "the firmware's example programs under QEMU"),
    Step("processors", Nightly, Others, thumb::processors, "the core and the C library for Cortex-M0+, M3, M33 and RISC-V; C under QEMU"),
    Step("c-all", Nightly, Others, c::nightly, "C++17, C++20, sanitizers, CMake, pkg-config, the page's programs"),
    Step("fmu", Nightly, Others, fmu::test, "the co-simulation unit by FMPy, also rebuilt from its sources; limit surfaces"),
    Step("chromium", Nightly, Others, web::nightly, "the page in Chromium against the core on the host; a module that panics is refused"),
    Step("book", Nightly, Others, book::test, "the book: complete, links, 1200 and 400 px wide in Chromium"),
    Step("python-all", Nightly, Others, binding::python_nightly, "the Python package with the program: commands on frames, notebooks, types"),
    Step("mujoco-all", Nightly, Others, binding::mujoco_nightly, "the MuJoCo plugin: scenes of minutes"),
    Step("warp-all", Nightly, Others, binding::warp_nightly, "the Warp package: gradients, thousands of worlds of MuJoCo Warp, Newton; on a GPU where there is one"),
    Step("verify", Weekly, Workspace, weekly::verify, "verification cases at full effort"),
    Step("counts", Weekly, Workspace, rust::counts, "tests marked as weekly: planted tables, effects over many seeds"),
    Step("calculix", Weekly, Workspace, weekly::calculix, "verification against CalculiX"),
    Step("score", Weekly, Workspace, weekly::score, "score card of the diagnosis on hidden sets"),
    Step("confirm", Weekly, Workspace, weekly::confirm, "the named effect inside the finite elements, on the stored sets"),
    Step("packed-tests", Weekly, Workspace, package::tests, "the tests of all crates from their packed archives"),
    Step("fuzz", Weekly, Workspace, weekly::fuzz, "model files, steps and calibration under a fuzzer (nightly toolchain)"),
    Step("mutants", Weekly, Workspace, weekly::mutants, "30 faults planted by cargo-mutants in the core, the contact and the diagnosis"),
    Step("experiments", Weekly, Workspace, weekly::experiments, "the finite elements against nine published experiments"),
    Step("reference", Weekly, Workspace, regenerate::reference, "the reduced models along held-out runs: tables and picture"),
    Step("bindings", Weekly, Others, crate::bench_bindings::main, "ns of a step in every language"),
];

/// The program that runs one step.
const PROGRAM: &str = "target/steps/xtask";

/// Runs the steps of a tier in two lanes, or the chosen ones one after the other; prints what each cost.
///
/// # Errors
/// The steps that failed; all are run.
pub fn main(tier: Tier, args: &Args) -> Result<()> {
    if args.list {
        for Step(name, tier, _, _, what) in &STEPS {
            println!("{name:<13} {:<8} {what}", tier_name(*tier));
        }
        return Ok(());
    }
    if let Some(wrong) = args.only.iter().find(|name| STEPS.iter().all(|step| step.0 != **name)) {
        bail!("no step {wrong}; `cargo xtask test --list` lists them");
    }
    let chosen =
        |step: &&Step| if args.only.is_empty() { step.1 == tier } else { args.only.iter().any(|o| o == step.0) };
    let steps: Vec<&Step> = STEPS.iter().filter(chosen).collect();
    let before = costs();
    // A copy, since the steps build this program again.
    fs::create_dir_all(root().join("target/steps"))?;
    fs::copy(std::env::current_exe()?, root().join(PROGRAM))?;
    // Weekly steps that passed at this commit are not repeated.
    let resume = tier == Weekly && args.only.is_empty();
    let start = Instant::now();
    let lane = |lane: Lane| {
        let of_lane = steps.iter().filter(move |step| step.2 == lane);
        move |before: &BTreeMap<String, Cost>| -> Result<Vec<(&str, Cost)>> {
            of_lane.map(|step| Ok((step.0, step.run_or_resume(before, resume)?))).collect()
        }
    };
    let (workspace, others) = (lane(Workspace), lane(Others));
    let (workspace, others) = std::thread::scope(|scope| {
        let beside = scope.spawn(|| others(&before));
        (workspace(&before), beside.join())
    });
    let others = others.map_err(|_| anyhow::anyhow!("a lane panicked"))??;
    report(&[workspace?, others].concat(), &before, start.elapsed().as_secs_f64())
}

fn tier_name(tier: Tier) -> &'static str {
    match tier {
        Gate => "test",
        Nightly => "nightly",
        Weekly => "weekly",
    }
}

/// Runs one step in this process.
pub fn run_one(name: &str) -> Result<()> {
    let step = STEPS.iter().find(|step| step.0 == name).with_context(|| format!("no step {name}"))?;
    let outcome = step.3();
    println!("cpu {:.1}", cpu_of_children().unwrap_or(f64::NAN));
    outcome
}

/// What a run of a step cost, and the number of tests that its output counts.
#[derive(Clone)]
struct Cost {
    seconds: f64,
    cpu: f64,
    passed: bool,
    commit: String,
    tests: [u64; 2],
}

impl Step {
    fn run_or_resume(&self, before: &BTreeMap<String, Cost>, resume: bool) -> Result<Cost> {
        match before.get(self.0).filter(|cost| resume && cost.passed && cost.commit == commit()) {
            Some(cost) => {
                println!("   {} passed at this commit before; `--only {}` repeats it", self.0, self.0);
                Ok(cost.clone())
            }
            None => self.run(),
        }
    }

    /// Runs the step as a process, stores its cost; prints the end of its output if it failed.
    fn run(&self) -> Result<Cost> {
        let name = self.0;
        let log = root().join("target/steps").join(format!("{name}.log"));
        let file = File::create(&log).with_context(|| log.display().to_string())?;
        println!("== {name}");
        let start = Instant::now();
        let mut step = Command::new(root().join(PROGRAM));
        if self.1 == Gate {
            // The co-simulation unit is compiled and tested nightly.
            step.env("FINGERPAD_FMU_WITHOUT_UNIT", "1");
        }
        let status = step.args(["step", name]).stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file).status()?;
        let text = String::from_utf8_lossy(&fs::read(&log)?).into_owned();
        let cpu = text.lines().rev().find_map(|line| line.strip_prefix("cpu ")?.parse().ok()).unwrap_or(f64::NAN);
        let cost = Cost {
            seconds: start.elapsed().as_secs_f64(),
            cpu,
            passed: status.success(),
            commit: commit(),
            tests: counted(&text),
        };
        println!("   {name}: {} after {:.0} s", if cost.passed { "passed" } else { "FAILED" }, cost.seconds);
        if !cost.passed {
            let lines: Vec<&str> = text.lines().collect();
            println!("{}\n   all of it: target/steps/{name}.log", lines[lines.len().saturating_sub(60)..].join("\n"));
        }
        let line = format!(
            "{name} {:.1} {cpu:.1} {} {} {} {}\n",
            cost.seconds, cost.passed, cost.commit, cost.tests[0], cost.tests[1]
        );
        let mut costs = File::options().create(true).append(true).open(root().join("target/steps/costs.txt"))?;
        std::io::Write::write_all(&mut costs, line.as_bytes())?;
        Ok(cost)
    }
}

/// The last run of each step in this checkout.
fn costs() -> BTreeMap<String, Cost> {
    let text = fs::read_to_string(root().join("target/steps/costs.txt")).unwrap_or_default();
    let parse = |line: &str| -> Option<(String, Cost)> {
        let [name, seconds, cpu, passed, commit, tests, failed] =
            line.split(' ').collect::<Vec<_>>().try_into().ok()?;
        let tests = [tests.parse().ok()?, failed.parse().ok()?];
        let (seconds, cpu, passed) = (seconds.parse().ok()?, cpu.parse().ok()?, passed.parse().ok()?);
        Some((name.to_owned(), Cost { seconds, cpu, passed, commit: commit.to_owned(), tests }))
    };
    text.lines().filter_map(parse).collect()
}

/// Prints the table of costs and the number of tests.
fn report(ran: &[(&str, Cost)], before: &BTreeMap<String, Cost>, wall: f64) -> Result<()> {
    println!("\n{:<13} {:>8} {:>8} {:>8}", "step", "seconds", "CPU s", "before");
    for (name, cost) in ran {
        let earlier =
            before.get(*name).filter(|run| run.passed).map_or("-".to_owned(), |run| format!("{:.1}", run.seconds));
        let failed = if cost.passed { "" } else { "  failed" };
        println!("{name:<13} {:>8.1} {:>8.1} {earlier:>8}{failed}", cost.seconds, cost.cpu);
    }
    let cpu: f64 = ran.iter().map(|(_, cost)| cost.cpu).sum();
    println!("{:<13} {wall:>8.1} {cpu:>8.1}", "by the clock");
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!(
        "load of the machine over the last 1, 5, 15 minutes: {}\n",
        load.split(' ').take(3).collect::<Vec<_>>().join(", ")
    );
    let failed: Vec<&str> = ran.iter().filter(|(_, cost)| !cost.passed).map(|(name, _)| *name).collect();
    let tests = |k: usize| ran.iter().map(|(_, cost)| cost.tests[k]).sum::<u64>();
    println!("{} passed, {} failed", tests(0), tests(1));
    ensure!(failed.is_empty(), "failed: {0}; again: cargo xtask test --only {0}", failed.join(","));
    Ok(())
}

/// Tests passed and failed by the closing lines of cargo, pytest and Node in an output.
fn counted(text: &str) -> [u64; 2] {
    let number = |line: &str, word: &str, of_node: &str| -> Option<u64> {
        if let Some(number) = line.strip_prefix(of_node) {
            return number.parse().ok();
        }
        let closing = line.starts_with("test result:") || line.contains(" in ");
        let before = line.split_once(word).filter(|_| closing)?.0;
        before.rsplit([' ', '=']).find(|part| !part.is_empty())?.parse().ok()
    };
    [(" passed", "ℹ pass "), (" failed", "ℹ fail ")]
        .map(|(word, of_node)| text.lines().filter_map(|line| number(line, word, of_node)).sum())
}

fn commit() -> String {
    output(&mut command(".", "git rev-parse --short HEAD")).map_or("-".to_owned(), |text| text.trim().to_owned())
}

/// CPU seconds of the ended children of this process, where the system counts them.
fn cpu_of_children() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: f64 = fields.get(13..15)?.iter().filter_map(|ticks| ticks.parse::<f64>().ok()).sum();
    Some(ticks / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_lines_are_counted() {
        let text = "test a::b ... ok\ntest result: ok. 12 passed; 1 failed; 3 ignored\n======= 4 passed, 2 skipped in 3.1s =====\nℹ pass 5\n";
        assert_eq!(counted(text), [21, 1]);
    }

    #[test]
    fn names_of_steps_are_unique() {
        let mut names: Vec<&str> = STEPS.iter().map(|step| step.0).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), STEPS.len());
    }
}
