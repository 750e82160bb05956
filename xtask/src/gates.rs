//! Requirements on a change: named steps in three tiers, and the time that each took.
//!
//! | tier | command | for |
//! |---|---|---|
//! | quick | `cargo xtask check` | while working: changed packages and those that depend on them |
//! | test | `cargo xtask test` | before a commit: everything that minutes allow |
//! | slow | `cargo xtask test --slow` | before a release and in CI: the rest |
//!
//! Main type: [`Step`]. The steps of a tier run in two lanes side by side (see [`Lane`]). Uses `package` for the
//! published crates, `book` for the pages, `thumb` for the firmware, `web`, `wheel`, `mujoco`, `warp`, `c_test` and `fmu_test` for the
//! bindings, `times` for the table of times and `install` for missing tools.

use std::fs::{self, File};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;

use crate::times::Times;
use crate::{book, c_test, cargo, fmu_test, install, mujoco, package, root, run, thumb, warp, web, wheel};

/// Options of `cargo xtask test`.
#[derive(clap::Args)]
pub struct Args {
    /// The steps of the slow tier, in place of those of the test tier
    #[arg(long)]
    slow: bool,
    /// Only these steps of either tier, one after the other (comma-separated or repeated)
    #[arg(long, value_enum, value_name = "STEP", value_delimiter = ',', conflicts_with = "slow")]
    only: Vec<Step>,
    /// List the steps with their tiers
    #[arg(long)]
    list: bool,
}

/// A step of `cargo xtask test`.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Step {
    /// rustfmt, in this workspace, the firmware's and those of the bindings
    Format,
    /// Unit and integration tests of the workspace that are not marked as slow, some against CalculiX, some with Gmsh; 2 000 cases
    /// for each property of the core
    Tests,
    /// Clippy without warnings: the firmware and the C library
    ThumbClippy,
    /// Instructions per call within their bounds
    ThumbCount,
    /// Neither panics nor doubles in the firmware, bounds on code size and stack
    ThumbCheck,
    /// The firmware's example programs under QEMU
    ThumbRun,
    /// Host and target give the documented digest of a million steps. Last of its lane: it builds for the host as well
    ThumbGolden,
    /// Clippy without warnings: the workspace with all targets, the core with all features (`check` does this for
    /// changed packages)
    Clippy,
    /// rustdoc without warnings
    Doc,
    /// Examples in the documentation
    Doctest,
    /// The published crates: their files, all of them compiled from their packed archives, and the core's own tests
    /// from there
    Package,
    /// Tests marked as slow: every command of the documents and of `--help` is executed, long verification cases
    SlowTests,
    /// 20 000 cases for each property of the core
    Properties,
    /// The core and the C library for other processors: Cortex-M0+, M3, M33, RISC-V
    ThumbOther,
    /// The C library on the target gives the documented vectors
    ThumbC,
    /// The C library's release folder: a CMake project outside the repository builds on it as C99 and C++17, gives the
    /// bits of the core and returns error codes on misuse
    C,
    /// The co-simulation unit (FMI 3.0): valid and bit for bit the core's by FMPy, also when built from the sources inside
    Fmu,
    /// The page: built, below its size, and tested in headless Chromium against the core on the host
    Web,
    /// The book of `docs/`: built by mdBook, complete, without a broken link, 1200 and 400 px wide in headless Chromium
    Book,
    /// The MuJoCo plugin, built against pip's MuJoCo: motion, memory, energy, misuse, a held object beside MuJoCo's contact
    Mujoco,
    /// The Python package without the program: wheel in a fresh environment, bits of the core, type stubs
    Python,
    /// The package for NVIDIA Warp, on its CPU device and on a GPU where there is one: numbers of the core, gradients, 4096 worlds of
    /// MuJoCo Warp
    Warp,
}

/// Programs and examples that hold tests. The others would be compiled once more for nothing.
const PROGRAMS_WITH_TESTS: [&str; 8] =
    ["--bin", "xtask", "--bin", "planted_faults", "--example", "grip", "--example", "haptic"];

/// Ignored tests that `cargo xtask verify` runs.
const VERIFIED_ELSEWHERE: [&str; 6] = [
    "--skip",
    "planted_effects_are_named_or_among_the_contenders",
    "--skip",
    "no_effect_is_ever_named_wrongly",
    "--skip",
    "snakemake_does_a_population_study",
];

/// Frequency of a step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tier {
    Test,
    Slow,
    /// By its name only.
    Named,
}

/// The two sequences of steps that run side by side. Two steps that build in the same folder are in one lane, where
/// they would wait for each other anyway; while one lane downloads, links or emulates, a processor core is free for the
/// other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lane {
    /// Builds in the workspace's own target folder.
    Workspace,
    /// Builds elsewhere: firmware and bindings.
    Others,
}

impl Step {
    /// Its tier, and the lane that it runs in.
    fn place(self) -> (Tier, Lane) {
        match self {
            Self::Format | Self::Tests => (Tier::Test, Lane::Workspace),
            Self::ThumbClippy | Self::ThumbCount | Self::ThumbCheck | Self::ThumbRun | Self::ThumbGolden => {
                (Tier::Test, Lane::Others)
            }
            Self::Clippy | Self::Doc | Self::Doctest | Self::Package | Self::SlowTests | Self::Properties => {
                (Tier::Slow, Lane::Workspace)
            }
            Self::ThumbOther
            | Self::ThumbC
            | Self::C
            | Self::Fmu
            | Self::Web
            | Self::Book
            | Self::Mujoco
            | Self::Python => (Tier::Slow, Lane::Others),
            // Minutes for the compilation of its kernels.
            Self::Warp => (Tier::Named, Lane::Others),
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    fn run(self) -> Result<()> {
        match self {
            Self::Format => format(),
            Self::Clippy => clippy(),
            Self::Tests => {
                install::calculix()?;
                install::gmsh()?;
                // All packages at once, so that their dependencies are built once.
                let targets = ["test", "--release", "--workspace", "--lib", "--test", "*"];
                cases(2000, &[&targets[..], &PROGRAMS_WITH_TESTS[..]].concat())
            }
            Self::SlowTests => {
                install::calculix()?;
                let ignored = ["test", "--release", "--workspace", "--test", "*", "--", "--ignored"];
                cases(2000, &[&ignored[..], &VERIFIED_ELSEWHERE[..]].concat())
            }
            Self::Properties => {
                cases(20_000, &["test", "--release", "--package", "fingerpad", "--test", "all", "properties::"])
            }
            Self::Doc => {
                let mut doc = Command::new(env!("CARGO"));
                doc.current_dir(root()).env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--workspace", "--no-deps"]);
                run(&mut doc)
            }
            Self::Book => book::test(),
            Self::Package => package::test(),
            Self::Doctest => cargo(&["test", "--release", "--workspace", "--doc"], &[]),
            Self::Mujoco => mujoco::test(),
            Self::Python => wheel::test(wheel::Part::Fingers),
            Self::Warp => warp::test(),
            Self::ThumbClippy => thumb::step(&thumb::Action::Clippy),
            Self::ThumbGolden => thumb::step(&thumb::Action::Golden),
            Self::ThumbCheck => thumb::step(&thumb::Action::Check),
            Self::ThumbOther => thumb::step(&thumb::Action::Other),
            Self::ThumbCount => thumb::step(&thumb::COUNT),
            Self::C => c_test::test(),
            Self::Fmu => fmu_test::test(),
            Self::ThumbC => thumb::step(&thumb::Action::C),
            Self::ThumbRun => thumb::step(&thumb::Action::Programs),
            Self::Web => web::test(),
        }
    }
}

/// Runs the steps of a tier in two lanes, or the chosen ones one after the other; prints the table of times in any case.
pub fn main(args: &Args) -> Result<()> {
    if args.list {
        for step in Step::value_variants() {
            let tier = match step.place().0 {
                Tier::Test => "test",
                Tier::Slow => "slow",
                Tier::Named => "by name",
            };
            println!("{:<14} {tier}", step.name());
        }
        return Ok(());
    }
    if !args.only.is_empty() {
        return one_after_the_other(&args.only);
    }
    let tier = if args.slow { Tier::Slow } else { Tier::Test };
    let of_lane = |lane| Step::value_variants().iter().copied().filter(|step| step.place() == (tier, lane)).collect();
    let (workspace, others): (Vec<Step>, Vec<Step>) = (of_lane(Lane::Workspace), of_lane(Lane::Others));
    let start = Instant::now();
    let beside = Beside::start(&others)?;
    let outcome = in_turn(&workspace);
    println!("== the other lane: {}", names(&others).join(", "));
    let of_others = beside.finish();
    let all: Vec<Step> = workspace.iter().chain(&others).copied().collect();
    Times::read(&root())?.print(&names(&all), start.elapsed());
    match (outcome, of_others) {
        (Err(here), Err(there)) => bail!("{here:#}; {there:#}"),
        (here, there) => here.and(there),
    }
}

fn names(steps: &[Step]) -> Vec<String> {
    steps.iter().map(|step| step.name()).collect()
}

fn one_after_the_other(steps: &[Step]) -> Result<()> {
    let start = Instant::now();
    let outcome = in_turn(steps);
    Times::read(&root())?.print(&names(steps), start.elapsed());
    outcome
}

/// Runs the steps, those after a failure too, and stores the time of each; the error names all that failed.
fn in_turn(steps: &[Step]) -> Result<()> {
    let mut failed = Vec::new();
    for &step in steps {
        let name = step.name();
        println!("== {name}");
        let start = Instant::now();
        let outcome = step.run();
        Times::store(&root(), &name, start.elapsed(), outcome.is_ok())?;
        if let Err(error) = outcome {
            println!("== {name} failed: {error:#}");
            failed.push(name);
        }
    }
    ensure!(failed.is_empty(), "failed: {0}; again: cargo xtask test --only {0}", failed.join(","));
    Ok(())
}

/// Steps in a process of their own, whose output is kept in a file until they have ended.
struct Beside {
    child: Child,
    log: std::path::PathBuf,
}

impl Beside {
    fn start(steps: &[Step]) -> Result<Self> {
        let log = root().join("target/gates.log");
        fs::create_dir_all(root().join("target"))?;
        let file = File::create(&log).with_context(|| log.display().to_string())?;
        let child = Command::new(std::env::current_exe()?)
            .args(["test", "--only", &names(steps).join(",")])
            .stdin(Stdio::null())
            .stdout(file.try_clone()?)
            .stderr(file)
            .spawn()?;
        println!("beside: {} (output in {})", names(steps).join(", "), log.display());
        Ok(Self { child, log })
    }

    /// Waits for the steps and prints their output.
    fn finish(mut self) -> Result<()> {
        let status = self.child.wait()?;
        print!("{}", String::from_utf8_lossy(&fs::read(&self.log)?));
        ensure!(status.success(), "the other lane failed: see above, or {}", self.log.display());
        Ok(())
    }
}

/// Runs cargo with that many cases for each property.
fn cases(count: u32, words: &[&str]) -> Result<()> {
    let mut cargo = Command::new(env!("CARGO"));
    run(cargo.current_dir(root()).env("PROPTEST_CASES", count.to_string()).args(words))
}

/// Formatting in all workspaces.
pub fn format() -> Result<()> {
    install::component("rustfmt", "fmt")?;
    for folder in [".", "firmware-example", "bindings/c", "bindings/web", "bindings/python"] {
        run(Command::new(env!("CARGO")).current_dir(root().join(folder)).args(["fmt", "--all", "--check"]))?;
    }
    // `cargo fmt` does not format the modules that the list of effects declares.
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
