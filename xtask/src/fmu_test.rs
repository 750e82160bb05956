//! What the program exports for other tools: the co-simulation unit, checked by FMPy and built again from its own sources, and the limit
//! surface, from which a Python example computes grasps.
//!
//! Main function: [`test()`]. Uses `c_test` for the story and `python` for FMPy.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{c_test, python, root, run};

/// The page whose Python lines are run.
const PAGE: &str = "docs/my-simulation.md";
/// The unit's checks and its benchmark.
pub const CHECKS: &str = "bindings/fmu_check";
/// The model that ships, and the story's with effects and tables over a voltage.
const UNITS: [&str; 2] = ["finger.fmu", "charged.fmu"];
const SHIPPED: &str = "data/models/fingertip.fpm";
const PAD: &str = "data/models/fingertip-pad.fpm";
/// Computes the quality of grasps from a limit surface.
const GRASP: &str = "bindings/python/examples/grasp.py";

/// Exports two models, compares them with the core's own answers, and again with the unit built from an FMU's sources.
pub fn test() -> Result<()> {
    c_test::prepare()?;
    let folder = tempfile::tempdir()?;
    let python = python::environment(&folder.path().join("python"), &root().join(CHECKS).join("requirements.txt"))?;
    let story = folder.path().join("story");
    fs::create_dir(&story)?;
    c_test::tell_story(&story)?;
    for (name, model) in UNITS.into_iter().zip([root().join(SHIPPED), story.join("charged.fpm")]) {
        export(&model, &folder.path().join(name))?;
    }
    check(&python, folder.path(), &story)?;
    page(&python, folder.path())?;
    grasps(&python, folder.path())?;
    rebuild(&python, folder.path())?;
    check(&python, folder.path(), &story)
}

/// Writes the FMU of a model by the program itself.
pub fn export(model: &Path, out: &Path) -> Result<()> {
    export_as("fmu", model, out)
}

fn export_as(format: &str, model: &Path, out: &Path) -> Result<()> {
    let program = ["run", "--quiet", "--release", "--package", "fingerpad-cli", "--", "export"];
    run(Command::new(env!("CARGO"))
        .current_dir(root())
        .args(program)
        .args(["--format", format, "--model"])
        .arg(fs::canonicalize(model)?)
        .arg("--out")
        .arg(out))
}

fn check(python: &Path, folder: &Path, story: &Path) -> Result<()> {
    let mut check = Command::new(python);
    check.arg(root().join(CHECKS).join("check.py"));
    run(check.args(UNITS.map(|name| folder.join(name))).arg(story))
}

/// The lines of the page, beside the FMU that it speaks of.
fn page(python: &Path, folder: &Path) -> Result<()> {
    let page = fs::read_to_string(root().join(PAGE))?;
    let lines = c_test::block(&page, "```python\n").with_context(|| format!("{PAGE} has no Python lines"))?;
    fs::write(folder.join("page.py"), lines)?;
    let out = Command::new(python).current_dir(folder).arg("page.py").output()?;
    let says = String::from_utf8_lossy(&out.stdout);
    print!("{says}{}", String::from_utf8_lossy(&out.stderr));
    ensure!(out.status.success() && says.contains("friction"), "the lines of {PAGE} do not print a friction");
    Ok(())
}

/// The grasps that are known in closed form, and those of the shipped models' limit surfaces: three fingers hold better than two.
fn grasps(python: &Path, folder: &Path) -> Result<()> {
    let example = root().join(GRASP);
    run(Command::new(python).arg(&example).arg("--check"))?;
    for model in [SHIPPED, PAD] {
        let surface = folder.join("limit.csv");
        export_as("limit-surface", &root().join(model), &surface)?;
        let mut epsilon = Vec::new();
        for fingers in ["2", "3"] {
            let out = Command::new(python).arg(&example).arg(&surface).args(["--fingers", fingers]).output()?;
            let says = [out.stdout, out.stderr].concat();
            let says = String::from_utf8_lossy(&says);
            print!("{model}: {says}");
            let words: Vec<&str> = says.split_whitespace().collect();
            let found = words.windows(2).find(|pair| pair[0] == "epsilon").and_then(|pair| pair[1].parse::<f64>().ok());
            epsilon.push(found.with_context(|| format!("{GRASP} prints no epsilon"))?);
        }
        ensure!(0.1 < epsilon[0] && epsilon[0] < epsilon[1] && epsilon[1] < 2.0, "{model}: epsilon {epsilon:?}");
    }
    let refused = Command::new(python).arg(&example).arg(folder.join("page.py")).output()?;
    ensure!(!refused.status.success(), "a file that is not a limit surface is taken");
    Ok(())
}

/// Replaces the binaries of the FMUs by what CMake and cargo make of the sources inside.
fn rebuild(python: &Path, folder: &Path) -> Result<()> {
    let unpacked = unpack(python, &folder.join(UNITS[0]), &folder.join("unpacked"))?;
    fs::remove_dir_all(unpacked.join("binaries"))?;
    let build = folder.join("build");
    let (sources, kind) = (unpacked.join("sources"), "-DCMAKE_BUILD_TYPE=Release");
    run(Command::new("cmake").arg("-S").arg(sources).arg("-B").arg(&build).arg(kind))?;
    run(Command::new("cmake").arg("--build").arg(&build))?;
    run(Command::new("cmake").arg("--install").arg(&build))?;
    for name in UNITS {
        let fmu = folder.join(name);
        let there = unpack(python, &fmu, &folder.join("repacked"))?;
        fs::remove_dir_all(there.join("binaries"))?;
        fs::rename(unpacked.join("binaries"), there.join("binaries"))?;
        fs::remove_file(&fmu)?;
        let mut zip = Command::new(python);
        run(zip.current_dir(&there).args(["-m", "zipfile", "-c"]).arg(&fmu).args(entries(&there)?))?;
        fs::rename(there.join("binaries"), unpacked.join("binaries"))?;
    }
    Ok(())
}

/// Unpacks an FMU into a fresh folder.
pub fn unpack(python: &Path, fmu: &Path, to: &Path) -> Result<PathBuf> {
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
    run(Command::new(python).args(["-m", "zipfile", "-e"]).arg(fmu).arg(to))?;
    Ok(to.to_owned())
}

fn entries(folder: &Path) -> Result<Vec<std::ffi::OsString>> {
    Ok(fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect::<std::io::Result<_>>()?)
}
