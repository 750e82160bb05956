//! The release folder as a Zephyr module and as an Arduino library.
//!
//! Main function: [`check`]. Zephyr and Arduino's toolchains are not needed: their files are parsed, the module's CMakeLists.txt runs
//! with the two functions of Zephyr that it calls, the sketch runs on the host with a small `Arduino.h`.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::c_release::{self, ARDUINO};
use crate::thumb::tools::C_LIBRARY;
use crate::{python, root, run};

/// Pages that state the size of the folder, and the words around it.
const SIZE_STATED: [(&str, &str); 2] =
    [("docs/my-c-program.md", " MB to hand on"), ("bindings/c/release/README.md", " MB in all")];

/// Checks the metadata, chooses the library for boards, links for processors, and runs the sketch; `folder` is for what it makes.
pub fn check(release: &Path, folder: &Path) -> Result<()> {
    let packages = root().join(C_LIBRARY).join("packages");
    let python = python::environment(&folder.join("python"), &packages.join("requirements.txt"))?;
    run(Command::new(python).arg(packages.join("check.py")).arg(release))?;
    zephyr(release, &packages, &folder.join("zephyr"))?;
    links_for_every_arduino_folder(release, folder)?;
    sketch(release, &packages, folder)?;
    size_is_stated(release)
}

/// The library that the module chooses for a board's settings, and its refusal of others.
fn zephyr(release: &Path, packages: &Path, folder: &Path) -> Result<()> {
    let source = folder.join("source");
    fs::create_dir_all(&source)?;
    fs::copy(packages.join("zephyr_CMakeLists.txt"), source.join("CMakeLists.txt"))?;
    let configure = |build: &str, settings: &str| -> Result<(bool, String)> {
        let mut cmake = Command::new("cmake");
        cmake.arg("-S").arg(&source).arg("-B").arg(folder.join(build)).arg(format!("-DMODULE={}", release.display()));
        cmake.args(settings.split_whitespace().map(|setting| format!("-DCONFIG_{setting}")));
        if build == "host" {
            cmake.arg(format!("-DAPPLICATION={}", release.join("examples/press_and_slide.c").display()));
        }
        let out = cmake.output()?;
        let says = [out.stdout, out.stderr].concat();
        // CMake breaks its messages into lines.
        let says = String::from_utf8_lossy(&says).split_whitespace().collect::<Vec<_>>().join(" ");
        Ok((out.status.success(), says))
    };
    let host = c_release::host()?;
    let cortex_m = "FINGERPAD=y CPU_CORTEX_M=y";
    let risc_v = "FINGERPAD=y RISCV=y RISCV_ISA_EXT_M=y RISCV_ISA_EXT_A=y RISCV_ISA_EXT_C=y";
    let chosen = [
        ("m0", format!("{cortex_m} CPU_CORTEX_M0PLUS=y"), "thumbv6m-none-eabi"),
        ("m4", format!("{cortex_m} CPU_CORTEX_M4=y"), "thumbv6m-none-eabi"),
        ("m4_softfp", format!("{cortex_m} CPU_CORTEX_M4=y FPU=y FP_SOFTABI=y"), "thumbv6m-none-eabi"),
        ("m4f", format!("{cortex_m} CPU_CORTEX_M4=y FPU=y FP_HARDABI=y"), "thumbv7em-none-eabihf"),
        ("m33f", format!("{cortex_m} CPU_CORTEX_M33=y FPU=y FP_HARDABI=y"), "thumbv7em-none-eabihf"),
        ("risc_v", risc_v.to_owned(), "riscv32imac-unknown-none-elf"),
        ("set", "FINGERPAD=y FINGERPAD_TARGET=thumbv6m-none-eabi".to_owned(), "thumbv6m-none-eabi"),
        ("host", "FINGERPAD=y ARCH_POSIX=y 64BIT=y".to_owned(), host.as_str()),
    ];
    for (build, settings, target) in &chosen {
        let (done, says) = configure(build, settings)?;
        ensure!(done && says.contains(&format!("/lib/fingerpad/{target}/libfingerpad.a")), "{settings}: {says}");
    }
    let (done, says) = configure("off", "CPU_CORTEX_M=y")?;
    ensure!(done && !says.contains("imported"), "without CONFIG_FINGERPAD nothing is linked: {says}");
    for (build, settings) in [
        ("m55", format!("{cortex_m} CPU_CORTEX_M55=y FPU=y FP_HARDABI=y")),
        ("risc_v_f", format!("{risc_v} FPU=y")),
        ("posix_32", "FINGERPAD=y ARCH_POSIX=y".to_owned()),
        ("wrong", "FINGERPAD=y FINGERPAD_TARGET=avr-none".to_owned()),
    ] {
        let (done, says) = configure(build, &settings)?;
        ensure!(!done && says.contains("fingerpad has no library for"), "{settings} should be refused: {says}");
    }
    run(Command::new("cmake").arg("--build").arg(folder.join("host")))?;
    let out = Command::new(folder.join("host/application")).output()?;
    let says = String::from_utf8_lossy(&out.stdout);
    ensure!(out.status.success() && says.contains("first slip"), "the application on the module: {says}");
    println!("Zephyr: the library for {} boards, an application on the host", chosen.len());
    Ok(())
}

/// A program with one step, linked for every processor and float flags that Arduino looks for.
fn links_for_every_arduino_folder(release: &Path, folder: &Path) -> Result<()> {
    let source = folder.join("one_step.c");
    let program = folder.join("one_step");
    fs::write(
        &source,
        "#include <fingerpad.h>\n\
         static fingerpad_model model;\nstatic fingerpad_state state;\nfingerpad_response response;\n\
         void _start(void)\n{\n    const fingerpad_motion motion = {1.0f, 0.1f, 0.0f, 0.0f, 1e-3f};\n    \
         (void)fingerpad_step(&model, &state, motion, &response);\n}\n",
    )?;
    let link = |flags: &str, place: &str| -> Result<std::process::Output> {
        let mut gcc = Command::new("arm-none-eabi-gcc");
        gcc.args(flags.split_whitespace()).args(["-mthumb", "-nostdlib", "-Werror", "-I"]).arg(release.join("src"));
        gcc.arg(&source).arg("-L").arg(release.join("src").join(place));
        Ok(gcc.args(["-lfingerpad", "-lgcc", "-Wl,--gc-sections", "-o"]).arg(&program).output()?)
    };
    for (place, _) in ARDUINO {
        let flags = flags(place)?;
        let out = link(&flags, place)?;
        ensure!(out.status.success(), "{flags} from src/{place}: {}", String::from_utf8_lossy(&out.stderr));
    }
    let hard = link(&flags("cortex-m4/fpv4-sp-d16-hard")?, "cortex-m4")?;
    ensure!(!hard.status.success(), "a library with soft calls links into a program with hard calls");
    println!("Arduino: a step links for {} processors and float flags", ARDUINO.len());
    Ok(())
}

/// The compiler's flags of a folder such as `cortex-m4/fpv4-sp-d16-hard`.
fn flags(place: &str) -> Result<String> {
    let (processor, floats) = place.split_once('/').unwrap_or((place, ""));
    if floats.is_empty() {
        return Ok(format!("-mcpu={processor} -mfloat-abi=soft"));
    }
    let (fpu, abi) = floats.rsplit_once('-').with_context(|| place.to_owned())?;
    Ok(format!("-mcpu={processor} -mfpu={fpu} -mfloat-abi={abi}"))
}

/// The sketch on the host: 124 rows, whose last friction is a steady one below the normal force.
fn sketch(release: &Path, packages: &Path, folder: &Path) -> Result<()> {
    let program = folder.join("sketch");
    let sketch = release.join("examples/PressAndSlide/PressAndSlide.ino");
    let mut compile = Command::new("g++");
    compile.args(["-std=gnu++11", "-Wall", "-Wextra", "-Werror"]).arg(format!("-DSKETCH=\"{}\"", sketch.display()));
    compile.arg("-I").arg(release.join("src")).arg("-I").arg(packages).arg(packages.join("sketch.cpp"));
    let library = release.join("lib/fingerpad").join(c_release::host()?).join("libfingerpad.a");
    run(compile.arg(library).arg("-o").arg(&program))?;
    let out = Command::new(&program).output()?;
    let says = String::from_utf8(out.stdout)?;
    let rows: Vec<Vec<f64>> = says
        .lines()
        .map(|line| line.split('\t').filter_map(|number| number.parse().ok()).collect())
        .filter(|row: &Vec<f64>| row.len() == 3)
        .collect();
    let (before, last) = match &rows[..] {
        [.., before, last] => (before, last),
        _ => anyhow::bail!("the sketch prints {says}"),
    };
    ensure!(
        rows.len() == 124 && before == last && last[0] > 0.1 && last[1] > 0.3 * last[0] && last[2] < 0.05,
        "the sketch ends with {last:?} after {} rows",
        rows.len()
    );
    println!("Arduino: the sketch ends at {} N of friction under {} N", last[1], last[0]);
    Ok(())
}

/// The pages state the folder's size within 1 MB.
fn size_is_stated(release: &Path) -> Result<()> {
    let megabytes = c_release::size(release)? as f64 / 1e6;
    for (page, words) in SIZE_STATED {
        let text = fs::read_to_string(root().join(page))?;
        let before = text.split_once(words).with_context(|| format!("{page} does not state the size of the folder"))?.0;
        let stated = before.rsplit(|c: char| !c.is_ascii_digit()).next().and_then(|number| number.parse::<f64>().ok());
        let stated = stated.with_context(|| format!("{page}: no number before '{words}'"))?;
        ensure!((stated - megabytes).abs() < 1.0, "{page} states {stated} MB, the folder has {megabytes:.1}");
    }
    println!("the folder has {megabytes:.1} MB, as the pages state");
    Ok(())
}
