//! The MuJoCo plugin: build it against pip's MuJoCo, test it, measure it.
//!
//! Main functions: [`test()`], [`bench()`]. Uses `c_test` for the tools of C and `python` for the environment.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::thumb::tools::{C_LIBRARY, cargo_command};
use crate::{c_test, python, root, run};

/// The plugin's folder from the repository's root.
const FOLDER: &str = "bindings/mujoco";

/// Builds the plugin and runs its tests.
pub fn test() -> Result<()> {
    let python = build()?;
    run(Command::new(python).current_dir(folder()).args(["-m", "pytest", "--quiet", "--durations=5", "tests"]))
}

/// Builds the plugin and prints the tables of the held object: `args` are those of `examples/hold.py`.
pub fn bench(args: &[String]) -> Result<()> {
    let python = build()?;
    run(Command::new(python).current_dir(folder()).arg("examples/hold.py").args(args))
}

/// The command that prints the nanoseconds of a contact of the held object, by the plugin or by MuJoCo's own contact; with
/// `--shaken`, while all is shaken.
pub fn contact_ns(contact: &str) -> Result<Command> {
    let mut command = Command::new(build()?);
    command.current_dir(folder()).args(["examples/hold.py", "--contact-ns", contact]);
    Ok(command)
}

fn folder() -> PathBuf {
    root().join(FOLDER)
}

/// The C library, the Python packages and the plugin; returns the Python that has them.
fn build() -> Result<PathBuf> {
    c_test::prepare()?;
    let mut cargo = cargo_command();
    run(cargo.current_dir(root().join(C_LIBRARY)).args(["build", "--release"]))?;
    let python = python::kept_environment("mujoco", &folder().join("requirements.txt"))?;
    let asked = "import mujoco, pathlib; print(pathlib.Path(mujoco.__file__).parent)";
    let out = Command::new(&python).args(["-c", asked]).output()?;
    ensure!(out.status.success(), "mujoco cannot be imported: {}", String::from_utf8_lossy(&out.stderr));
    let mujoco = String::from_utf8(out.stdout).context("MuJoCo's folder is not UTF-8")?;
    let mut configure = Command::new("cmake");
    configure.current_dir(folder()).args(["-S", ".", "-B", "build"]);
    run(configure.arg(format!("-DMUJOCO_FOLDER={}", mujoco.trim())))?;
    run(Command::new("cmake").current_dir(folder()).args(["--build", "build"]))?;
    Ok(python)
}
