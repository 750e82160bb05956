//! Chores of the project; each prints its actions.

mod bench_bindings;
mod book;
mod c_release;
mod c_test;
mod fmu_test;
mod gates;
mod install;
mod mujoco;
mod package;
mod python;
mod quick;
mod release;
mod ros;
mod thumb;
mod times;
mod warp;
mod web;
mod wheel;

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};
use clap::Parser;

#[derive(Parser)]
#[command(about = "Chores: test, verify, bench", name = "cargo xtask")]
enum Chore {
    /// While you work: format, Clippy and unit tests of changed packages and of those that depend on them, one Hertz,
    /// one Mindlin and one diagnosis case, the directions of the packages
    Check(quick::Args),
    /// The checks before a commit; with --slow those that CI adds. Installs missing tools
    Test(gates::Args),
    /// The long verification cases, planted tables (`tables`), the tests of the published packages from what is packed
    /// (`package`), the whole Python package with its commands and notebooks (`python`), the ROS 2 packages (`ros`); names
    /// select some, --list lists the cases
    Verify {
        /// Passed on to the verification program
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// A benchmark: `bindings` (ns of a step in every language, clean and disturbed), `calculix` (CPU time against
    /// CalculiX), `core` (a step: instructions under QEMU, ns on the host), `memory` (history of a contact under noise
    /// and cycles, against marks), `pad` (instructions, errors along finite-element runs, memory, energy), `diagnose`
    /// (score card on hidden sets), `confirm` (`--confirm-fe` on the stored finite-element sets) or `mujoco` (an object
    /// held by the plugin and by MuJoCo's own contact)
    Bench {
        /// Which
        name: String,
        /// Passed on to the benchmark
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// The book of `docs/` as a static site in `target/book/html`, with all its links checked
    Book(book::Args),
    /// The finite elements against eight published experiments: one page with a figure and a verdict each (a quarter of an hour;
    /// --coarse: a minute)
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
    /// Fit the shipped model to the stored runs again, and update the documented vectors and the firmware's corrected
    /// model
    Model {
        /// Fit nothing: update the scores in the shipped files and the documented vectors to the present core
        #[arg(long)]
        scores: bool,
    },
    /// The reduced models along held-out finite-element runs: the table in `data/reference`, the tables and the picture of
    /// `docs/fast-against-finite-elements.md`
    Reference,
    /// All packages of a release in one folder: crates, Python wheels for x86_64 and aarch64, the npm package, the C library.
    /// Uploads nothing
    Release(release::Args),
    /// The C library as a folder that needs no Rust: static libraries for this host, Cortex-M with and without FPU and RISC-V,
    /// header, model, example, CMake and pkg-config files
    ReleaseC(c_release::Args),
    /// Firmware: prepare the toolchain, build, run under QEMU, check the gates
    Thumb(thumb::Args),
    /// The page: build, test in Chromium, picture, bench
    Web(web::Args),
}

fn main() -> anyhow::Result<()> {
    match Chore::parse() {
        Chore::Check(args) => quick::main(&args),
        Chore::Test(args) => gates::main(&args),
        Chore::Verify { args } => verify(args),
        Chore::Experiments { args } => {
            cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "experiments", "--"], &args)
        }
        Chore::Bench { name, args } => match name.as_str() {
            "bindings" => bench_bindings::main(),
            "calculix" => {
                install::calculix()?;
                cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "bench_calculix", "--"], &args)
            }
            "core" => {
                cargo(&["xtask", "thumb", "count"], &[])?;
                cargo(&["bench", "--package", "fingerpad-tests", "--bench", "core", "--"], &args)
            }
            "memory" => {
                cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "bench_memory", "--"], &args)
            }
            "pad" => {
                cargo(&["xtask", "thumb", "count-pad"], &[])?;
                cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "bench_pad", "--"], &args)
            }
            "diagnose" => {
                cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "bench_diagnose", "--"], &args)
            }
            "confirm" => {
                cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "bench_confirm", "--"], &args)
            }
            "mujoco" => mujoco::bench(&args),
            other => {
                bail!(
                    "no benchmark {other}; there are: bindings, calculix, core, memory, pad, diagnose, confirm, mujoco"
                )
            }
        },
        Chore::Book(args) => book::main(&args),
        Chore::Fuzz { seconds } => fuzz(seconds),
        Chore::Model { scores } => model(scores),
        Chore::Reference => {
            let program = ["--package", "fingerpad-tests", "--bin", "fast_against_finite_elements"];
            cargo(&[&["run", "--release"], &program[..]].concat(), &[])
        }
        Chore::Release(args) => release::main(&args),
        Chore::ReleaseC(args) => c_release::main(&args),
        Chore::Thumb(args) => thumb::main(&args),
        Chore::Web(args) => web::main(&args),
    }
}

/// Parts of `cargo xtask verify` besides the verification cases.
const VERIFIED: [(&str, fn() -> anyhow::Result<()>); 4] = [
    ("tables", tables),
    ("package", package::verify),
    ("python", || wheel::test(wheel::Part::Whole)),
    ("ros", ros::test),
];

/// The verification cases and the parts of [`VERIFIED`] of these names; all of them without names.
fn verify(args: Vec<String>) -> anyhow::Result<()> {
    let all = args.is_empty();
    let (parts, cases): (Vec<_>, Vec<_>) =
        args.into_iter().partition(|arg| VERIFIED.iter().any(|(name, _)| name == arg));
    if all || !cases.is_empty() {
        cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "verify", "--"], &cases)?;
    }
    for (name, part) in VERIFIED {
        if all || parts.iter().any(|wanted| wanted == name) {
            part()?;
        }
    }
    Ok(())
}

/// Tables with planted errors, which take long.
fn tables() -> anyhow::Result<()> {
    cargo(&["test", "--release", "--package", "fingerpad-identify", "--test", "planted", "--", "--ignored"], &[])?;
    cargo(&["test", "--release", "--package", "fingerpad-tests", "--test", "all", "table::", "--", "--ignored"], &[])
}

/// The shipped model from the stored runs, or its scores alone; then its bytes as documented in
/// `core/docs/fpm-format.md`.
fn model(scores: bool) -> anyhow::Result<()> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = "data/models/fingertip.fpm";
    if scores {
        cargo(&["run", "--release", "--package", "fingerpad-tests", "--bin", "rescore_models"], &[])?;
        return document(&root, file);
    }
    let fit = ["--package", "fingerpad-cli", "--", "reduce", "--force", "--runs", "data/runs", "--out", file];
    run(Command::new(env!("CARGO")).current_dir(&root).args(["run", "--release"]).args(fit))?;
    document(&root, file)?;
    corrected(&root)
}

/// Updates the documented vectors, size and digest to a model file.
fn document(root: &std::path::Path, file: &str) -> anyhow::Result<()> {
    let show = ["run", "--quiet", "--release", "--package", "fingerpad", "--example", "document", "--", file];
    let out = Command::new(env!("CARGO")).current_dir(root).args(show).output()?;
    let printed = String::from_utf8(out.stdout)?;
    let parts: Vec<&str> = printed.trim().split("\n\n").collect();
    let [size, hex, vectors, golden] = parts[..] else { bail!("unexpected output: {printed}") };
    let document = root.join("core/docs/fpm-format.md");
    let mut text = std::fs::read_to_string(&document)?;
    let digest = golden.trim_start_matches("golden: ");
    for (from, to, new) in [
        ("`data/models/fingertip.fpm` has ", ", and starts", size.to_owned()),
        ("```hex\n", "\n```", hex.to_owned()),
        ("```vectors\n", "\n```", vectors.to_owned()),
        ("have the digest `", "`", digest.to_owned()),
    ] {
        let start = text.find(from).with_context(|| format!("{}: no {from}", document.display()))? + from.len();
        let end = start + text[start..].find(to).with_context(|| format!("{}: no {to}", document.display()))?;
        text.replace_range(start..end, &new);
    }
    std::fs::write(&document, text)?;
    println!("{size}, digest {digest}: in {}", document.display());
    Ok(())
}

/// The corrected model of the firmware: the shipped one after a diagnosis of a stored set (relaxation inside the finite
/// elements).
fn corrected(root: &std::path::Path) -> anyhow::Result<()> {
    let dir = root.join("target/corrected");
    std::fs::create_dir_all(&dir)?;
    for name in ["calibration_d.csv", "set_07.csv"] {
        let packed = root.join("tests/data/fe_sets").join(format!("{name}.gz"));
        let mut from = flate2::read::GzDecoder::new(std::fs::File::open(packed)?);
        std::io::copy(&mut from, &mut std::fs::File::create(dir.join(name))?)?;
    }
    let diagnose = ["run", "--release", "--package", "fingerpad-cli", "--", "diagnose", "--calibration"];
    run(Command::new(env!("CARGO"))
        .current_dir(root)
        .args(diagnose)
        .arg(dir.join("calibration_d.csv"))
        .arg("--measured")
        .arg(dir.join("set_07.csv"))
        .arg("--out")
        .arg(&dir))?;
    std::fs::copy(dir.join("corrected.fpm"), root.join("firmware-example/corrected.fpm"))?;
    println!("firmware-example/corrected.fpm");
    Ok(())
}

/// Runs the fuzz targets of the core; a find ends it with its input.
fn fuzz(seconds: u32) -> anyhow::Result<()> {
    let there = Command::new("cargo").args(["+nightly", "fuzz", "--version"]).output()?.status.success();
    if !there {
        run(Command::new("cargo").args(["install", "--locked", "cargo-fuzz"]))
            .context("cargo-fuzz could not be installed; `rustup toolchain install nightly` may help")?;
    }
    let core = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../core");
    for target in ["file", "step", "calibration"] {
        let most = format!("-max_total_time={seconds}");
        run(Command::new("cargo").current_dir(&core).args(["+nightly", "fuzz", "run", target, "--", &most]))?;
    }
    Ok(())
}

/// The repository's root.
fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn cargo(words: &[&str], more: &[String]) -> anyhow::Result<()> {
    run(Command::new(env!("CARGO")).current_dir(root()).args(words).args(more))
}

fn run(command: &mut Command) -> anyhow::Result<()> {
    println!("+ {command:?}");
    let status = command.status().with_context(|| format!("{command:?}"))?;
    if !status.success() {
        bail!("{command:?}: {status}");
    }
    Ok(())
}
