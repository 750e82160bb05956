//! The ROS 2 recipe: colcon builds the vendor package and the example on it, from a release folder of the C library.
//!
//! Main function: [`test()`]. Uses `c_release` for the folder and `c_test` for the tools of C.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{c_release, c_test, install, root, run};

/// The packages of the recipe, the one that others use first.
const PACKAGES: [&str; 2] = ["fingerpad_vendor", "fingerpad_example"];
/// Debian's colcon and ament, which are enough to build a package without a distribution of ROS.
const DEBIAN: [&str; 3] = ["python3-colcon-cmake", "python3-colcon-ros", "ament-cmake"];
/// Only Debian's own Python finds Debian's ament.
const PATH: &str = "/usr/bin:/bin";

/// Builds both packages in a workspace outside the repository and runs the example; without a release folder, the
/// vendor package must name the missing folder.
pub fn test() -> Result<()> {
    c_test::prepare()?;
    if !DEBIAN.iter().all(|package| install::succeeds(Command::new("dpkg").args(["--status", package]))) {
        install::debian(&DEBIAN, &format!("apt-get install {}", DEBIAN.join(" ")))?;
    }
    let workspace = tempfile::tempdir()?;
    let release = workspace.path().join("release");
    c_release::release(&release)?;
    for package in PACKAGES {
        let from = root().join("bindings/c/ros").join(package);
        c_test::copy_folder(&from, &workspace.path().join("src").join(package))?;
    }
    let colcon = || {
        let mut colcon = Command::new("/usr/bin/colcon");
        colcon.current_dir(workspace.path()).env("PATH", PATH).args(["build", "--base-paths", "src"]);
        colcon
    };
    let without = colcon().env_remove("FINGERPAD_RELEASE").output()?;
    // CMake breaks its messages into lines.
    let printed = String::from_utf8_lossy(&without.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    ensure!(
        !without.status.success() && printed.contains("which is no folder of the C library"),
        "the vendor package should require the release folder: {printed}"
    );
    run(colcon().env("FINGERPAD_RELEASE", &release))?;
    let press = workspace.path().join("install/fingerpad_example/lib/fingerpad_example/press");
    let out = Command::new(&press).output().with_context(|| press.display().to_string())?;
    let printed = String::from_utf8_lossy(&out.stdout);
    print!("{printed}");
    ensure!(out.status.success() && printed.contains("slide 1.00 mm: friction"), "the example prints no slide");
    Ok(())
}
