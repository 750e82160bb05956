//! Chores of the project; each prints its actions.

mod bench_bindings;
mod binding;
mod book;
mod c;
mod check;
mod fmu;
mod install;
mod model;
mod package;
mod regenerate;
mod release;
mod rust;
mod shell;
mod steps;
mod thumb;
mod web;
mod weekly;

use std::process::ExitCode;

use anyhow::bail;
use clap::Parser;

use shell::{command, run, sh};
use steps::Tier;

#[derive(Parser)]
#[command(about = "Chores: test, verify, bench", name = "cargo xtask")]
enum Chore {
    /// While you work: format, Clippy and unit tests of changed packages and of those that depend on them, one Hertz,
    /// one Mindlin and one diagnosis case, the directions of the packages
    Check(check::Args),
    /// The gate: what every change must pass; CI runs it. Installs missing tools
    Test(steps::Args),
    /// All that is not in the gate: once before an issue is closed
    Nightly(steps::Args),
    /// Long searches and counts with fixed seeds; an interrupted run goes on with the steps that have not passed
    Weekly(steps::Args),
    /// One step of a tier, in this process
    #[command(hide = true)]
    Step {
        /// Its name
        name: String,
    },
    /// The verification cases at full effort; names select some, --list lists them
    Verify {
        /// Passed on to the verification program
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// A benchmark: `bindings` (ns of a step in every language, clean and disturbed), `calculix` (CPU time against
    /// CalculiX), `core` (a step: instructions under QEMU, ns on the host), `pad` (instructions, errors along
    /// finite-element runs, memory, energy), `diagnose` (score card on hidden sets), `confirm` (`--confirm-fe` on the
    /// stored finite-element sets) or `mujoco` (an object held by the plugin and by MuJoCo's own contact)
    Bench {
        /// Which
        name: String,
        /// Passed on to the benchmark
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// The book of `docs/` as a static site in `target/book/html`, with all its links checked
    Book(book::Args),
    /// Two fingers of finite elements against nine published experiments: one page with a table and figures each (half an hour; --coarse:
    /// minutes; --fit: finds the effect that the paper's finger lacks again)
    Experiments {
        /// Passed on to the program; names select experiments
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// Fuzz the parser of model files, the step and the calibration, each for that many seconds; needs a nightly toolchain
    Fuzz {
        /// Seconds for each of the three targets
        #[arg(long, default_value_t = 60)]
        seconds: u32,
    },
    /// Make again what is stored and was computed: the models of the human finger and of the gallery, the tables and pictures beside
    /// held-out runs
    Regenerate(regenerate::Args),
    /// Score the shipped models again with the present core, without a fit, and update the documented vectors
    Scores,
    /// All packages of a release in one folder: crates, Python wheels for x86_64 and aarch64, the npm package, the C library.
    /// Uploads nothing
    Release(release::Args),
    /// The C library as a folder that needs no Rust: static libraries for this host, Cortex-M with and without FPU and RISC-V,
    /// header, models, example, CMake and pkg-config files
    ReleaseC {
        /// Folder to make; it must not exist yet
        #[arg(long, value_name = "FOLDER", default_value = concat!("target/fingerpad-c-", env!("CARGO_PKG_VERSION")))]
        out: std::path::PathBuf,
    },
    /// Firmware: prepare the toolchain, build, run under QEMU, check sizes and counts
    Thumb(thumb::Args),
    /// The page: build, picture, bench
    Web(web::Args),
}

fn main() -> ExitCode {
    match chore(Chore::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn chore(chore: Chore) -> anyhow::Result<()> {
    match chore {
        Chore::Check(args) => check::main(&args),
        Chore::Test(args) => steps::main(Tier::Gate, &args),
        Chore::Nightly(args) => steps::main(Tier::Nightly, &args),
        Chore::Weekly(args) => steps::main(Tier::Weekly, &args),
        Chore::Step { name } => steps::run_one(&name),
        Chore::Verify { args } => run(weekly::program("verify").args(args)),
        Chore::Experiments { args } => run(weekly::program("experiments").args(args)),
        Chore::Bench { name, args } => bench(&name, &args),
        Chore::Book(args) => book::main(&args),
        Chore::Fuzz { seconds } => weekly::fuzz_for(seconds),
        Chore::Regenerate(args) => regenerate::main(&args),
        Chore::Scores => model::scores(),
        Chore::Release(args) => release::main(&args),
        Chore::ReleaseC { out } => c::release(&std::path::absolute(out)?),
        Chore::Thumb(args) => thumb::main(&args),
        Chore::Web(args) => web::main(&args),
    }
}

fn bench(name: &str, args: &[String]) -> anyhow::Result<()> {
    match name {
        "bindings" => bench_bindings::main(),
        "calculix" => {
            install::programs(&["ccx"])?;
            run(weekly::program("calculix").arg("bench").args(args))
        }
        "core" => {
            sh(".", "cargo xtask thumb count")?;
            run(command(".", "cargo bench --package fingerpad-tests --features bench --bench core --").args(args))
        }
        "pad" => {
            sh(".", "cargo xtask thumb count-pad")?;
            run(weekly::program("bench_pad").args(args))
        }
        "diagnose" => run(weekly::program("bench_diagnose").args(args)),
        "confirm" => run(weekly::program("bench_confirm").args(args)),
        "mujoco" => binding::mujoco_bench(args),
        other => bail!("no benchmark {other}; there are: bindings, calculix, core, pad, diagnose, confirm, mujoco"),
    }
}
