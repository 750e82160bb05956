//! The Python package: built as a wheel, installed in a fresh environment outside the repository, tested there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{cargo, python, root, run};

/// Target of a wheel: every processor of its architecture.
const FLAGS: &str = "-Ctarget-cpu=generic";

/// The part that is built and tested.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Models, fingers and types, in the default wheel, which is without the program and builds within a minute.
    Fingers,
    /// The wheel with the program: the commands on frames and the notebooks as well.
    Whole,
}

/// A fresh environment with the wheel.
struct Environment {
    folder: tempfile::TempDir,
}

impl Environment {
    fn new() -> Result<Self> {
        let environment = Self { folder: tempfile::tempdir()? };
        python::environment(&environment.folder.path().join("venv"), &package().join("requirements-build.txt"))?;
        Ok(environment)
    }

    /// A program of the environment, started in its folder, so that nothing of the repository is imported.
    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(self.folder.path().join("venv/bin").join(program));
        command.current_dir(self.folder.path()).env_remove("PYTHONPATH").env("PIP_DISABLE_PIP_VERSION_CHECK", "1");
        command
    }

    fn pip(&self, what: &[&str]) -> Result<()> {
        run(self.command("python").args(["-m", "pip", "install", "--quiet"]).args(what))
    }
}

/// Builds the wheel, installs it with the packages of its tests, and runs them.
pub fn test(part: Part) -> Result<()> {
    let environment = Environment::new()?;
    let wheel = build(&environment, part)?;
    let extras = if part == Part::Whole { "test,notebooks" } else { "test" };
    environment.pip(&[&format!("{}[{extras}]", wheel.display())])?;
    let mut files =
        vec!["test_bits.py", "test_docs.py", "test_finger.py", "test_fingers.py", "test_limits.py", "test_program.py"];
    if part == Part::Whole {
        files.extend(["test_commands.py", "test_notebooks.py"]);
        cargo(&["build", "--release", "--package", "fingerpad-cli"], &[])?;
    }
    let mut clippy = Command::new(env!("CARGO"));
    clippy.current_dir(package()).env("RUSTFLAGS", FLAGS).args(["clippy", "--release", "--all-targets"]);
    run(clippy.args(features(part)).args(["--", "--deny", "warnings"]))?;
    run(environment
        .command("python")
        .args(["-m", "pytest", "--quiet", "--durations", "5", "-p", "no:cacheprovider"])
        .args(files.iter().map(|name| package().join("tests").join(name)))
        .env("FINGERPAD_NATIVE", native(part)?)
        .env("FINGERPAD_CARGO_PROGRAM", root().join("target/release/fingerpad"))
        .env_remove("FINGERPAD_PROGRAM"))?;
    run(environment.command("mypy").args(["--strict", "--package", "fingerpad"]))?;
    run(environment.command("stubtest").arg("fingerpad"))
}

/// The core without Python, built for the same processors.
fn native(part: Part) -> Result<PathBuf> {
    let mut example = Command::new(env!("CARGO"));
    example.current_dir(package()).env("RUSTFLAGS", FLAGS);
    run(example.args(["build", "--release", "--locked", "--example", "native"]).args(features(part)))?;
    Ok(package().join("target/release/examples/native"))
}

fn features(part: Part) -> &'static [&'static str] {
    if part == Part::Whole { &["--features", "program"] } else { &[] }
}

/// Builds the wheel and inspects it: no licence may be missing.
fn build(environment: &Environment, part: Part) -> Result<PathBuf> {
    let wheels = environment.folder.path().join("wheels");
    let mut maturin = environment.command("maturin");
    maturin.current_dir(package()).env("RUSTFLAGS", FLAGS);
    run(maturin.args(["build", "--release", "--locked"]).args(features(part)).arg("--out").arg(&wheels))?;
    let mut made = fs::read_dir(&wheels)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    let wheel = made.pop().context("maturin made no wheel")?;
    let listed = environment.command("python").args(["-m", "zipfile", "--list"]).arg(&wheel).output()?;
    let listed = String::from_utf8(listed.stdout)?;
    for file in ["licenses/LICENSE-APACHE", "licenses/LICENSE-MIT", "fingerpad/py.typed", "fingerpad/_native.pyi"] {
        ensure!(listed.contains(file), "the wheel has no file {file}");
    }
    Ok(wheel)
}

/// The command that times a batch of fingers over a path, in an environment that exists as long as the returned folder.
pub fn bench_path(model: &Path) -> Result<(tempfile::TempDir, Command)> {
    let environment = Environment::new()?;
    let wheel = build(&environment, Part::Fingers)?;
    environment.pip(&[&wheel.display().to_string()])?;
    let mut command = environment.command("python");
    command.arg(package().join("bench/path.py")).arg(model);
    Ok((environment.folder, command))
}

/// The folder of the package.
fn package() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bindings/python");
    package.canonicalize().unwrap_or(package)
}
