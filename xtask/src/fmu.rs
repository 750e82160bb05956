//! What the program exports for other tools: the co-simulation unit, checked by FMPy and built again from its own sources, and the limit
//! surface, from which a Python example computes grasps.
//!
//! Main function: [`test()`]. Uses `c` for the story and `install` for FMPy.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::shell::{at_root, command, output, refusal, root, run, sh};
use crate::{c, install, rust};

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
    c::prepare()?;
    let folder = tempfile::tempdir()?;
    let python = install::python("python-nightly", "bindings/requirements-nightly.txt")?;
    let story = folder.path().join("story");
    fs::create_dir(&story)?;
    c::tell_story(&story)?;
    for (name, model) in UNITS.into_iter().zip([root().join(SHIPPED), story.join("charged.fpm")]) {
        export("fmu", &model, &folder.path().join(name))?;
    }
    let check = || {
        let units = UNITS.map(|name| folder.path().join(name));
        run(at_root(&python).arg(format!("{CHECKS}/check.py")).args(units).arg(&story))
    };
    check()?;
    page(&python, folder.path())?;
    grasps(&python, folder.path())?;
    rebuild(&python, folder.path())?;
    check()
}

/// Writes a model by the program itself in another format.
pub fn export(format: &str, model: &Path, out: &Path) -> Result<()> {
    run(&mut rust::cargo("build --bin fingerpad")?)?;
    let export = format!("target/gate/fingerpad export --format {format}");
    run(command(".", &export).arg("--model").arg(model).arg("--out").arg(out))
}

/// The lines of the page, beside the FMU that it describes.
fn page(python: &Path, folder: &Path) -> Result<()> {
    let page = fs::read_to_string(root().join(PAGE))?;
    let lines = c::block(&page, "```python\n").with_context(|| format!("{PAGE} has no Python lines"))?;
    fs::write(folder.join("page.py"), lines)?;
    let says = output(at_root(python).current_dir(folder).arg("page.py"))?;
    ensure!(says.contains("friction"), "the lines of {PAGE} do not print a friction: {says}");
    Ok(())
}

/// The grasps that are known in closed form, and those of the shipped models' limit surfaces: three fingers hold better than two.
fn grasps(python: &Path, folder: &Path) -> Result<()> {
    run(at_root(python).args([GRASP, "--check"]))?;
    for model in [SHIPPED, PAD] {
        let surface = folder.join("limit.csv");
        export("limit-surface", &root().join(model), &surface)?;
        let epsilon = |fingers: &str| -> Result<f64> {
            let says = output(at_root(python).arg(GRASP).arg(&surface).args(["--fingers", fingers]))?;
            let words: Vec<&str> = says.split_whitespace().collect();
            let found = words.windows(2).find(|pair| pair[0] == "epsilon").and_then(|pair| pair[1].parse().ok());
            found.with_context(|| format!("{GRASP} prints no epsilon: {says}"))
        };
        let [two, three] = [epsilon("2")?, epsilon("3")?];
        ensure!(0.1 < two && two < three && three < 2.0, "{model}: epsilon {two}, {three}");
    }
    refusal(at_root(python).arg(GRASP).arg(folder.join("page.py")))?;
    Ok(())
}

/// Replaces the binaries of the FMUs by what CMake and cargo make of the sources inside.
fn rebuild(python: &Path, folder: &Path) -> Result<()> {
    let unpacked = unpack(python, &folder.join(UNITS[0]), &folder.join("unpacked"))?;
    fs::remove_dir_all(unpacked.join("binaries"))?;
    sh(folder, "cmake -S unpacked/sources -B build -DCMAKE_BUILD_TYPE=Release")?;
    sh(folder, "cmake --build build")?;
    sh(folder, "cmake --install build")?;
    for name in UNITS {
        let fmu = folder.join(name);
        let there = unpack(python, &fmu, &folder.join("repacked"))?;
        fs::remove_dir_all(there.join("binaries"))?;
        fs::rename(unpacked.join("binaries"), there.join("binaries"))?;
        fs::remove_file(&fmu)?;
        let entries = fs::read_dir(&there)?.map(|entry| Ok(entry?.file_name()));
        let entries = entries.collect::<std::io::Result<Vec<_>>>()?;
        run(at_root(python).current_dir(&there).args(["-m", "zipfile", "-c"]).arg(&fmu).args(entries))?;
        fs::rename(there.join("binaries"), unpacked.join("binaries"))?;
    }
    Ok(())
}

/// Unpacks an FMU into a fresh folder.
pub fn unpack(python: &Path, fmu: &Path, to: &Path) -> Result<PathBuf> {
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
    run(at_root(python).args(["-m", "zipfile", "-e"]).arg(fmu).arg(to))?;
    Ok(to.to_owned())
}
