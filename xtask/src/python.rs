//! A Python environment of a chore's own, with packages from PyPI.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::{install, root, run};

/// The virtual environment `target/NAME` with the packages of a requirements file, created again when these have changed; returns its
/// interpreter.
pub fn kept_environment(name: &str, requirements: &Path) -> Result<PathBuf> {
    let folder = root().join("target").join(name);
    let (stamp, list) = (folder.join("requirements.txt"), fs::read(requirements)?);
    if fs::read(&stamp).is_ok_and(|installed| installed == list) {
        return Ok(folder.join("bin/python"));
    }
    let python = environment(&folder, requirements)?;
    fs::write(stamp, list)?;
    Ok(python)
}

/// Makes a virtual environment in `folder` with the packages of a requirements file; returns its interpreter.
pub fn environment(folder: &Path, requirements: &Path) -> Result<PathBuf> {
    let make = || install::succeeds(Command::new("python3").args(["-m", "venv", "--clear"]).arg(folder));
    if !make() {
        install::debian(&["python3", "python3-venv"], "apt-get install python3-venv")?;
        run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(folder))?;
    }
    let python = folder.join("bin/python");
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(requirements))?;
    Ok(python)
}
