//! The Python packages: the core's wheel, the MuJoCo plugin, the Warp package. Built outside the repository's environment, in one
//! virtual environment, and tested there.
//!
//! Main functions: the steps `*_gate` and `*_nightly`, [`release`]. Uses `c` for the tools of C and `install` for the environment.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::shell::{at_root, command, output, root, run, sh};
use crate::{c, install, rust};

/// Target of a wheel: every processor of its architecture.
const FLAGS: &str = "-Ctarget-cpu=generic";
/// Folders of the packages.
const PYTHON: &str = "bindings/python";
const MUJOCO: &str = "bindings/mujoco";
const WARP: &str = "bindings/warp";
/// A tier's environment and its selection of pytest.
struct Tests {
    environment: &'static str,
    requirements: &'static str,
    selection: &'static str,
}

const GATE: Tests = Tests {
    environment: "python",
    requirements: "bindings/requirements-gate.txt",
    selection: "not nightly and not weekly",
};
const NIGHTLY: Tests =
    Tests { environment: "python-nightly", requirements: "bindings/requirements-nightly.txt", selection: "nightly" };

/// The Python package without the program: bits of the core.
pub fn python_gate() -> Result<()> {
    python_tests(&wheel(&GATE, "")?, &GATE)
}

/// The wheel with the program: commands on frames, notebooks, type stubs.
pub fn python_nightly() -> Result<()> {
    let python = wheel(&NIGHTLY, "--features program")?;
    run(&mut rust::cargo("build --bin fingerpad")?)?;
    python_tests(&python, &NIGHTLY)?;
    run(module(&python, "mypy").args(["--strict", "--package", "fingerpad"]))?;
    run(module(&python, "mypy.stubtest").arg("fingerpad"))
}

fn python_tests(python: &Path, tests: &Tests) -> Result<()> {
    // The core without Python, built for the same processors.
    run(command(PYTHON, "cargo build --profile gate --locked --package fingerpad-native").env("RUSTFLAGS", FLAGS))?;
    let mut pytest = pytest(python, PYTHON, tests);
    pytest.env("FINGERPAD_NATIVE", root().join(PYTHON).join("target/gate/fingerpad-native"));
    pytest.env("FINGERPAD_CARGO_PROGRAM", root().join("target/gate/fingerpad")).env_remove("FINGERPAD_PROGRAM");
    run(&mut pytest)
}

/// Builds the core's wheel with some features and installs it in the environment of a tier; returns the interpreter.
fn wheel(tests: &Tests, features: &str) -> Result<PathBuf> {
    let python = install::python(tests.environment, tests.requirements)?;
    let wheels = tempfile::tempdir()?;
    let line = format!("{} -m maturin build --profile gate --locked {features} --out", python.display());
    run(command(PYTHON, &line).env("RUSTFLAGS", FLAGS).arg(wheels.path()))?;
    let wheel = only_file(wheels.path())?;
    let listed = output(module(&python, "zipfile --list").arg(&wheel))?;
    for file in ["licenses/LICENSE-APACHE", "licenses/LICENSE-MIT", "fingerpad/py.typed", "fingerpad/_native.pyi"] {
        ensure!(listed.contains(file), "the wheel has no file {file}");
    }
    run(module(&python, "pip install --quiet --force-reinstall --no-deps").arg(wheel))?;
    Ok(python)
}

/// A module of Python, from a line of words, run in a folder outside the repository, so that nothing of it is imported.
fn module(python: &Path, line: &str) -> Command {
    let mut command = at_root(python);
    command.current_dir(root().join("target")).env_remove("PYTHONPATH").env("PIP_DISABLE_PIP_VERSION_CHECK", "1");
    command.arg("-m").args(line.split(' '));
    command
}

fn pytest(python: &Path, folder: &str, tests: &Tests) -> Command {
    let mut pytest = at_root(python);
    pytest.current_dir(root().join(folder).join("tests")).env_remove("PYTHONPATH");
    pytest.args(["-m", "pytest", "--quiet", "--durations=5", "-m", tests.selection]);
    pytest
}

pub fn mujoco_gate() -> Result<()> {
    run(&mut pytest(&plugin(&GATE)?, MUJOCO, &GATE))
}

/// The wheel with what it depends on, in an environment of its own, as a user installs it.
pub fn mujoco_nightly() -> Result<()> {
    let python = plugin(&NIGHTLY)?;
    let wheels = tempfile::tempdir()?;
    let wheel = plugin_wheel(&python, wheels.path())?;
    sh(".", "python3 -m venv --clear target/mujoco-wheel")?;
    let fresh = root().join("target/mujoco-wheel/bin/python");
    install::retry(|| {
        let mut pip = module(&fresh, "pip install --quiet");
        pip.arg(&wheel);
        pip
    })?;
    run(pytest(&python, MUJOCO, &NIGHTLY).env("FINGERPAD_WHEEL_PYTHON", fresh))
}

/// Builds the plugin and prints the tables of the held object: `args` are those of `examples/hold.py`.
pub fn mujoco_bench(args: &[String]) -> Result<()> {
    run(held(&plugin(&GATE)?).args(args))
}

/// The command that prints the nanoseconds of a contact of the held object, by the plugin or by MuJoCo's own contact; with
/// `--shaken`, while all is shaken.
pub fn contact_ns(contact: &str) -> Result<Command> {
    let mut command = held(&plugin(&GATE)?);
    command.args(["--contact-ns", contact]);
    Ok(command)
}

fn held(python: &Path) -> Command {
    let mut command = at_root(python);
    command.current_dir(root().join(MUJOCO)).arg("examples/hold.py");
    command
}

/// The C library, the Python packages and the plugin, built against pip's MuJoCo; returns the Python that has them.
fn plugin(tests: &Tests) -> Result<PathBuf> {
    install::programs(&["gcc", "make"])?;
    let library = c::library()?;
    let python = install::python(tests.environment, tests.requirements)?;
    let wheels = tempfile::tempdir()?;
    let mut build = wheel_build(&python, wheels.path());
    run(build.env("SKBUILD_CMAKE_DEFINE", format!("FINGERPAD_LIBRARY={}", library.display())))?;
    let wheel = only_file(wheels.path())?;
    run(module(&python, "pip install --quiet --force-reinstall --no-deps").arg(wheel))?;
    Ok(python)
}

/// The command that builds the plugin's wheel in a folder, against the MuJoCo and with the tools of an environment.
fn wheel_build(python: &Path, out: &Path) -> Command {
    let mut build = module(python, "pip wheel --quiet --no-build-isolation --no-deps --wheel-dir");
    build.arg(out).arg(root().join(MUJOCO));
    build
}

/// The plugin's wheel as it is handed on, in a folder: its tag names the oldest glibc that has the symbols it needs.
fn plugin_wheel(python: &Path, out: &Path) -> Result<PathBuf> {
    let built = tempfile::tempdir()?;
    run(&mut wheel_build(python, built.path()))?;
    // MuJoCo's library is that of its package.
    let mut repair = module(python, "auditwheel repair --exclude libmujoco.so.* --wheel-dir");
    let programs = std::env::var_os("PATH").unwrap_or_default();
    let own = python.parent().context("no folder")?.to_owned();
    let path = std::env::join_paths([own].into_iter().chain(std::env::split_paths(&programs)))?;
    run(repair.env("PATH", path).arg(out).arg(only_file(built.path())?))?;
    let wheels = fs::read_dir(out)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    let wheel = wheels.into_iter().find(|wheel| wheel.to_string_lossy().contains("fingerpad_mujoco-"));
    let wheel = wheel.context("auditwheel made no wheel")?;
    ensure!(wheel.to_string_lossy().contains("manylinux"), "{}: no tag of manylinux", wheel.display());
    Ok(wheel)
}

/// The file that a folder holds.
fn only_file(folder: &Path) -> Result<PathBuf> {
    Ok(fs::read_dir(folder)?.next().with_context(|| format!("{}: empty", folder.display()))??.path())
}

pub fn warp_gate() -> Result<()> {
    warp(&GATE)
}

/// On a GPU as well if there is one; the head of the report names it. Beside the plugin for MuJoCo, whose forces are the same.
pub fn warp_nightly() -> Result<()> {
    plugin(&NIGHTLY)?;
    warp(&NIGHTLY)?;
    // Newton needs an older MuJoCo than the other tests.
    let python = install::python("python-newton", "bindings/requirements-newton.txt")?;
    install_warp(&python)?;
    run(pytest(&python, WARP, &NIGHTLY).arg("test_newton.py"))
}

/// Runs the tests of the package beside the Python package, which has the bits of the core.
fn warp(tests: &Tests) -> Result<()> {
    let python = wheel(tests, "")?;
    install_warp(&python)?;
    run(&mut pytest(&python, WARP, tests))
}

fn install_warp(python: &Path) -> Result<()> {
    // A copy, so that setuptools leaves nothing in the repository.
    let copy = tempfile::tempdir()?;
    run(command(".", "cp -r bindings/warp").arg(copy.path()))?;
    run(module(python, "pip install --quiet --force-reinstall --no-deps").arg(copy.path().join("warp")))
}

/// Wheels of the core for any Linux of the last ten years on x86_64 and aarch64, and its sources as an archive, in a folder; the wheel of the
/// plugin for this processor. Those for this processor are installed and used.
pub fn release(out: &Path) -> Result<()> {
    let python = install::python("release-python", "bindings/python/requirements-release.txt")?;
    fs::create_dir_all(out)?;
    let maturin = |words: &str| {
        let mut maturin = at_root(&python);
        maturin.current_dir(root().join(PYTHON)).args(["-m", "maturin"]).args(words.split(' ')).arg("--out").arg(out);
        maturin
    };
    for (processor, target) in [("x86-64", "x86_64-unknown-linux-gnu"), ("generic", "aarch64-unknown-linux-gnu")] {
        ensure!(install::rustup_target(target), "no compiler for {target}; this helps: rustup target add {target}");
        let line = format!("build --release --locked --zig --target {target} --compatibility manylinux2014");
        let zig = root().join("target/release-python/bin/python");
        run(maturin(&line)
            .env("RUSTFLAGS", format!("-Ctarget-cpu={processor}"))
            .env("CARGO_ZIGBUILD_PYTHON_PATH", zig))?;
    }
    run(&mut maturin("sdist"))?;
    let wheels = fs::read_dir(out)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    install::programs(&["gcc", "make"])?;
    let plugin = plugin_wheel(&python, out)?;
    run(module(&python, "pip install --quiet --force-reinstall --no-deps").arg(plugin))?;
    let load = "import fingerpad_mujoco, mujoco; mujoco.MjModel.from_xml_string('<mujoco><extension><plugin plugin=\"fingerpad.contact\"/></extension></mujoco>')";
    run(at_root(&python).current_dir(root().join("target")).args(["-W", "error", "-c", load]))?;
    if let Some(wheel) = wheels.iter().find(|wheel| wheel.to_string_lossy().contains(std::env::consts::ARCH)) {
        run(module(&python, "pip install --quiet --force-reinstall").arg(wheel))?;
        let step = "import fingerpad; r = fingerpad.Finger(fingerpad.Model.shipped()).step(depth_mm=1.0); assert r.normal_force_n > 0.1, r";
        run(at_root(&python).current_dir(root().join("target")).args(["-c", step]))?;
    }
    Ok(())
}

/// The command that times a batch of fingers over a path.
pub fn bench_path(model: &Path) -> Result<Command> {
    let mut command = at_root(wheel(&GATE, "")?);
    command.arg(root().join(PYTHON).join("bench/path.py")).arg(model).current_dir(root().join("target"));
    Ok(command)
}
