//! Installs the tools of a chore; if that is not possible, prints the command that does.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Result, bail, ensure};

/// Installs Debian packages if this is Debian and the user is root; else fails with `hint`, the command that helps.
///
/// The lists are updated first: old ones may hold a compiler that is too old for this project.
pub fn debian(packages: &[&str], hint: &str) -> Result<()> {
    let root = Command::new("id").arg("-u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    if !(root && Path::new("/etc/debian_version").exists()) {
        bail!("something is missing here; this helps: {hint}");
    }
    say("apt-get update");
    Command::new("apt-get").arg("update").stdout(Stdio::null()).status()?;
    say(&format!("apt-get install --yes --no-install-recommends {}", packages.join(" ")));
    let mut apt = Command::new("apt-get");
    apt.env("DEBIAN_FRONTEND", "noninteractive").args(["install", "--yes", "--no-install-recommends"]);
    let done = apt.args(packages).stdout(Stdio::null()).status()?;
    ensure!(done.success(), "apt-get could not install {}; this helps: {hint}", packages.join(" "));
    Ok(())
}

/// Whether rustup has the library of `target`, after an attempt to install it.
pub fn rustup_target(target: &str) -> bool {
    let installed = Command::new("rustup").args(["target", "list", "--installed"]).output();
    if let Ok(listed) = &installed
        && String::from_utf8_lossy(&listed.stdout).lines().any(|line| line.trim() == target)
    {
        return true;
    }
    say(&format!("rustup target add {target}"));
    Command::new("rustup").args(["target", "add", target]).status().is_ok_and(|status| status.success())
}

/// A part of the toolchain that a minimal installation leaves out: `clippy` or `rustfmt`.
pub fn component(name: &str, subcommand: &str) -> Result<()> {
    if succeeds(Command::new("cargo").args([subcommand, "--version"])) {
        return Ok(());
    }
    let hint = format!("rustup component add {name}");
    say(&hint);
    ensure!(
        Command::new("rustup").args(["component", "add", name]).status().is_ok_and(|status| status.success()),
        "`cargo {subcommand}` is missing; this helps: {hint}"
    );
    Ok(())
}

/// CalculiX, CalculiX solver of some tests.
pub fn calculix() -> Result<()> {
    if Command::new("ccx").arg("-v").output().is_ok() {
        return Ok(());
    }
    debian(&["calculix-ccx"], "apt-get install calculix-ccx")
}

/// Gmsh's Python package, which meshes CAD files in some tests: that of `python3`, or one of our own under `target`.
pub fn gmsh() -> Result<()> {
    const IMPORT: [&str; 2] = ["-c", "import gmsh"];
    let own = crate::root().join("target/gmsh");
    let python = own.join("bin/python");
    if succeeds(Command::new("python3").args(IMPORT)) || succeeds(Command::new(&python).args(IMPORT)) {
        return Ok(());
    }
    let venv = || succeeds(Command::new("python3").args(["-m", "venv"]).arg(&own));
    if !venv() {
        debian(&["python3-venv"], "apt-get install python3-venv")?;
        ensure!(venv(), "python3 -m venv {} fails", own.display());
    }
    say("pip install gmsh==4.15.2");
    let pip = Command::new(&python).args(["-m", "pip", "install", "--quiet", "gmsh==4.15.2"]).status()?;
    ensure!(pip.success(), "Gmsh could not be installed; this helps: pip install gmsh");
    if !succeeds(Command::new(&python).args(IMPORT)) {
        // Libraries that the package links to and a bare machine does not have.
        let libraries = ["libglu1-mesa", "libxcursor1", "libxft2", "libxinerama1", "libxrender1"];
        debian(&libraries, &format!("apt-get install {}", libraries.join(" ")))?;
    }
    Ok(())
}

/// Whether a command is there and ends well.
pub fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Prints the command that is run.
pub fn say(command: &str) {
    println!("+ {command}");
}
