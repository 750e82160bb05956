//! Installs the tools of a chore; if that is not possible, prints the command that does.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, bail, ensure};

use crate::shell::{command, root, run, sh, succeeds};

/// Attempts of a command that needs the network or the package manager, and the pause after each.
const ATTEMPTS: usize = 3;
const PAUSE: Duration = Duration::from_secs(10);
/// Programs of Debian packages: the command that shows whether one is there, and its package.
const PROGRAMS: [(&str, &str); 11] = [
    ("arm-none-eabi-gcc --version", "gcc-arm-none-eabi"),
    ("ccx -v", "calculix-ccx"),
    ("/usr/bin/chromium --version", "chromium"),
    ("cmake --version", "cmake"),
    ("g++ --version", "g++"),
    ("gcc --version", "gcc"),
    ("make --version", "make"),
    ("npm --version", "nodejs npm"),
    ("pkg-config --version", "pkg-config"),
    ("python3 --version", "python3 python3-venv"),
    ("qemu-system-arm --version", "qemu-system-arm"),
];

/// Runs a command that may fail on the network, up to three times.
pub fn retry(mut make: impl FnMut() -> Command) -> Result<()> {
    for _ in 1..ATTEMPTS {
        match run(&mut make()) {
            Ok(()) => return Ok(()),
            Err(error) => println!("{error:#}; again in {} s", PAUSE.as_secs()),
        }
        std::thread::sleep(PAUSE);
    }
    run(&mut make())
}

/// Installs Debian packages if this is Debian and the user is root; else fails with `hint`, the command that helps.
///
/// Waits for another package manager, and updates the lists first: old ones may hold a compiler that is too old for this project.
pub fn debian(packages: &str, hint: &str) -> Result<()> {
    let user = command(".", "id -u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    ensure!(user && Path::new("/etc/debian_version").exists(), "something is missing here; this helps: {hint}");
    let apt = |words: &str| {
        let mut apt = command(".", &format!("apt-get -qq -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 {words}"));
        apt.env("DEBIAN_FRONTEND", "noninteractive");
        apt
    };
    retry(|| apt("update"))?;
    retry(|| apt(&format!("install --yes --no-install-recommends {packages}")))
}

/// Installs what is missing of these programs, each named as its command in [`PROGRAMS`].
pub fn programs(names: &[&str]) -> Result<()> {
    let missing = PROGRAMS.iter().filter(|(line, _)| {
        let file = Path::new(line.split(' ').next().unwrap_or_default());
        names.iter().any(|name| file.file_name().is_some_and(|file| file == *name))
            && command(".", line).output().is_err()
    });
    let missing = missing.map(|(_, package)| *package).collect::<Vec<_>>().join(" ");
    if missing.is_empty() { Ok(()) } else { debian(&missing, &format!("apt-get install {missing}")) }
}

/// A program of a crate, compiled without optimisation into `target/tools` if it is not there; returns its file.
pub fn crate_program(name: &str, version: &str, more: &str) -> Result<PathBuf> {
    let program = root().join("target/tools/bin").join(name);
    if !succeeds(Command::new(&program).arg("--version")) {
        let line = format!("cargo install --debug --locked --root target/tools --version {version} {name} {more}");
        retry(|| command(".", &line))?;
    }
    Ok(program)
}

/// Whether rustup has the library of `target`, after an attempt to install it.
pub fn rustup_target(target: &str) -> bool {
    let installed = command(".", "rustup target list --installed").output();
    let there =
        installed.is_ok_and(|out| String::from_utf8_lossy(&out.stdout).lines().any(|line| line.trim() == target));
    there || succeeds(&mut command(".", &format!("rustup target add {target}")))
}

/// A part of the toolchain that a minimal installation leaves out: `clippy` or `rustfmt`.
pub fn component(name: &str, subcommand: &str) -> Result<()> {
    if succeeds(&mut command(".", &format!("cargo {subcommand} --version"))) {
        return Ok(());
    }
    sh(".", &format!("rustup component add {name}"))
}

/// The virtual environment `target/NAME` with the packages of a requirements file, created again when these have changed; returns its
/// interpreter.
pub fn python(name: &str, requirements: &str) -> Result<PathBuf> {
    let folder = root().join("target").join(name);
    let (stamp, mut list) = (folder.join("requirements.txt"), std::fs::read(root().join(requirements))?);
    // One list may include another.
    list.extend(std::fs::read(root().join("bindings/requirements-gate.txt"))?);
    let python = folder.join("bin/python");
    if std::fs::read(&stamp).is_ok_and(|installed| installed == list) {
        return Ok(python);
    }
    let make = format!("python3 -m venv --clear target/{name}");
    if sh(".", &make).is_err() {
        debian("python3 python3-venv", "apt-get install python3-venv")?;
        sh(".", &make)?;
    }
    // What the tests import is compiled when they do.
    let pip = "-m pip install --quiet --disable-pip-version-check --no-compile -r";
    let pip = format!("{} {pip} {requirements}", python.display());
    retry(|| command(".", &pip))?;
    std::fs::write(stamp, list)?;
    Ok(python)
}

/// CalculiX and Gmsh's Python package, which some tests compare with or mesh by.
pub fn peers() -> Result<()> {
    programs(&["ccx"])?;
    let gmsh = |python: &Path| succeeds(Command::new(python).args(["-c", "import gmsh"]));
    if gmsh(Path::new("python3")) {
        return Ok(());
    }
    let python = python("gmsh", "tests/requirements.txt")?;
    if !gmsh(&python) {
        // Libraries that the package links to and a bare machine does not have.
        let libraries = "libglu1-mesa libxcursor1 libxft2 libxinerama1 libxrender1";
        debian(libraries, &format!("apt-get install {libraries}"))?;
    }
    if !gmsh(&python) {
        bail!("Gmsh cannot be imported by {}", python.display());
    }
    Ok(())
}
