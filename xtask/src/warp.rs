//! The package for NVIDIA Warp: installed in an environment of its own beside the Python package, and tested against it.
//!
//! Main function: [`test()`]. Uses `python` for the environment.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::{python, root, run};

/// The package's folder from the repository's root.
const FOLDER: &str = "bindings/warp";

/// Installs the package and runs its tests on Warp's CPU device, and on a GPU if there is one; the head of their report
/// names it.
pub fn test() -> Result<()> {
    let python = python::kept_environment("warp", &folder().join("requirements.txt"))?;
    // The reference: the Python package without the program, which has the bits of the core.
    let mut reference = pip(&python);
    reference.env("RUSTFLAGS", "-Ctarget-cpu=generic").args(["--force-reinstall", "--no-deps"]);
    run(reference.args(["--config-settings", "build-args=--no-default-features"]).arg(root().join("bindings/python")))?;
    // A copy, so that setuptools leaves nothing in the repository.
    let copy = tempfile::tempdir()?;
    let package = copy.path().join("fingerpad-warp");
    copy_folder(&folder(), &package)?;
    run(pip(&python).args(["--force-reinstall", "--no-deps"]).arg(&package))?;
    let tests = ["-m", "pytest", "--durations=5", "-p", "no:cacheprovider"];
    run(Command::new(&python).current_dir(copy.path()).args(tests).arg(folder().join("tests")))
}

fn folder() -> PathBuf {
    root().join(FOLDER)
}

fn pip(python: &Path) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip
}

/// Copies the files of a folder and of the folders in it, those of tools (`.pytest_cache`, `__pycache__`) left out.
fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (path, name) = (entry.path(), entry.file_name());
        if !path.is_dir() {
            fs::copy(&path, to.join(name))?;
        } else if !name.to_string_lossy().starts_with(['.', '_']) {
            copy_folder(&path, &to.join(name))?;
        }
    }
    Ok(())
}
