//! The Python package: built as a wheel, installed in a fresh environment outside the repository, tested there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{cargo, install, python, root, run};

/// Target of a wheel: every processor of its architecture.
pub const FLAGS: &str = "-Ctarget-cpu=generic";
/// Command of maturin for every wheel.
pub const BUILD: [&str; 3] = ["build", "--release", "--locked"];

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
        Self::with("requirements-build.txt")
    }

    /// One with the packages of a file of requirements.
    fn with(requirements: &str) -> Result<Self> {
        let environment = Self { folder: tempfile::tempdir()? };
        python::environment(&environment.folder.path().join("venv"), &package().join(requirements))?;
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

/// Builds the wheel and inspects it.
fn build(environment: &Environment, part: Part) -> Result<PathBuf> {
    let wheels = environment.folder.path().join("wheels");
    let mut maturin = environment.command("maturin");
    maturin.current_dir(package()).env("RUSTFLAGS", FLAGS);
    run(maturin.args(BUILD).args(features(part)).arg("--out").arg(&wheels))?;
    inspected(environment, &wheels)
}

/// The wheel in a folder; no licence and no type may be missing in it.
fn inspected(environment: &Environment, wheels: &Path) -> Result<PathBuf> {
    let mut made = fs::read_dir(wheels)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    let wheel = made.pop().context("maturin made no wheel")?;
    let listed = environment.command("python").args(["-m", "zipfile", "--list"]).arg(&wheel).output()?;
    let listed = String::from_utf8(listed.stdout)?;
    for file in ["licenses/LICENSE-APACHE", "licenses/LICENSE-MIT", "fingerpad/py.typed", "fingerpad/_native.pyi"] {
        ensure!(listed.contains(file), "the wheel has no file {file}");
    }
    Ok(wheel)
}

/// Wheels of the core for any Linux of the last ten years on x86_64 and aarch64, and the sources as an archive, in a folder. The
/// wheel for this processor is installed in a fresh environment and used there.
pub fn release(out: &Path) -> Result<()> {
    let environment = Environment::with("requirements-release.txt")?;
    let mut wheels = Vec::new();
    for (processor, target, machine) in
        [("x86-64", "x86_64-unknown-linux-gnu", 62u8), ("generic", "aarch64-unknown-linux-gnu", 183)]
    {
        ensure!(install::rustup_target(target), "no compiler for {target}; this helps: rustup target add {target}");
        let folder = environment.folder.path().join(target);
        let mut maturin = environment.command("maturin");
        maturin.current_dir(package()).env("RUSTFLAGS", format!("-Ctarget-cpu={processor}"));
        maturin.env("CARGO_ZIGBUILD_PYTHON_PATH", environment.folder.path().join("venv/bin/python"));
        maturin.args(BUILD).arg("--zig");
        maturin.args(["--target", target, "--compatibility", "manylinux2014"]);
        run(maturin.arg("--out").arg(&folder))?;
        let wheel = inspected(&environment, &folder)?;
        let read = "import sys, zipfile; w = zipfile.ZipFile(sys.argv[1]); \
                    n = [n for n in w.namelist() if n.endswith('.so')]; print(len(n), w.read(n[0])[18])";
        let found = environment.command("python").args(["-c", read]).arg(&wheel).output()?;
        let found = String::from_utf8(found.stdout)?;
        ensure!(found.trim() == format!("1 {machine}"), "{}: not one library for {target}: {found}", wheel.display());
        wheels.push(wheel);
    }
    let native = wheels.iter().find(|wheel| wheel.to_string_lossy().contains(std::env::consts::ARCH));
    if let Some(wheel) = native {
        environment.pip(&[&wheel.display().to_string()])?;
        let step = "import fingerpad; m = fingerpad.Model.shipped(); print(m); r = fingerpad.Finger(m).step(depth_mm=1.0); \
                    assert r.normal_force_n > 0.1, r";
        run(environment.command("python").args(["-c", step]))?;
    }
    fs::create_dir_all(out)?;
    for wheel in wheels {
        fs::copy(&wheel, out.join(wheel.file_name().context("a wheel has a name")?))?;
    }
    let mut maturin = environment.command("maturin");
    run(maturin.current_dir(package()).arg("sdist").arg("--out").arg(out))
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
