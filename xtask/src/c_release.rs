//! The C library as a folder that needs no Rust: libraries for a host and microcontrollers, header, model, example, packages.
//!
//! Main function: [`release`]. Uses `thumb` for the compiler.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::root;
use crate::thumb::tools::{C_LIBRARY, Compiler, Route, TARGET, cargo_command};

/// Microcontrollers: without FPU, with single-precision FPU, RISC-V without FPU.
const TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];
/// Where the libraries are built, apart from those with debug information.
const BUILT: &str = "target/handed-on";
/// What the folder holds as it lies in the repository: from `bindings/c` and from the root.
const FILES: [(&str, &str); 18] = [
    ("bindings/c/fingerpad.h", "include/fingerpad.h"),
    ("bindings/c/fingerpad.hpp", "include/fingerpad.hpp"),
    ("bindings/c/release/CMakeLists.txt", "CMakeLists.txt"),
    ("bindings/c/release/README.md", "README.md"),
    ("bindings/c/release/MISRA.md", "MISRA.md"),
    ("bindings/c/release/library.json", "library.json"),
    ("bindings/c/release/platformio_library.py", "platformio_library.py"),
    ("bindings/c/release/examples/press_and_slide.c", "examples/press_and_slide.c"),
    ("bindings/c/release/arduino/PressAndSlide/PressAndSlide.ino", "examples/PressAndSlide/PressAndSlide.ino"),
    ("bindings/c/release/arduino/library.properties", "library.properties"),
    ("bindings/c/release/zephyr/module.yml", "zephyr/module.yml"),
    ("bindings/c/release/zephyr/Kconfig", "zephyr/Kconfig"),
    ("bindings/c/release/zephyr/CMakeLists.txt", "zephyr/CMakeLists.txt"),
    ("bindings/c/release/fingerpad.pc", "lib/pkgconfig/fingerpad.pc"),
    ("bindings/c/release/cmake/fingerpad-config.cmake", "lib/cmake/fingerpad/fingerpad-config.cmake"),
    ("bindings/c/release/cmake/fingerpad-config-version.cmake", "lib/cmake/fingerpad/fingerpad-config-version.cmake"),
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
];
/// The models that ship, bed and pad: the constant's name, and what it is loaded with.
const MODELS: [(&str, &str, &str); 2] = [
    ("fingertip", "fingertip_fpm", "fingerpad_model_load"),
    ("fingertip-pad", "fingertip_pad_fpm", "fingerpad_pad_load"),
];

/// Arduino's folders below `src`, by processor and float flags (`-mfpu`, `-mfloat-abi`), and the library for each.
pub const ARDUINO: [(&str, &str); 13] = [
    ("cortex-m0", TARGETS[0]),
    ("cortex-m0plus", TARGETS[0]),
    ("cortex-m3", TARGETS[0]),
    ("cortex-m4", TARGETS[0]),
    ("cortex-m4/fpv4-sp-d16-softfp", TARGETS[0]),
    ("cortex-m4/fpv4-sp-d16-hard", TARGETS[1]),
    ("cortex-m7", TARGETS[0]),
    ("cortex-m7/fpv4-sp-d16-softfp", TARGETS[0]),
    ("cortex-m7/fpv4-sp-d16-hard", TARGETS[1]),
    ("cortex-m7/fpv5-d16-softfp", TARGETS[0]),
    ("cortex-m7/fpv5-d16-hard", TARGETS[1]),
    ("cortex-m33", TARGETS[0]),
    ("cortex-m33/fpv5-sp-d16-hard", TARGETS[1]),
];

/// Options of `cargo xtask release-c`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder to make; it must not exist yet
    #[arg(long, value_name = "FOLDER", default_value = concat!("target/fingerpad-c-", env!("CARGO_PKG_VERSION")))]
    out: PathBuf,
}

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    release(&std::path::absolute(&args.out)?)
}

/// Makes the folder: everything that a C project needs, for this kind of host and the microcontrollers.
pub fn release(out: &Path) -> Result<()> {
    ensure!(!out.exists(), "{} is there already", out.display());
    let host = host()?;
    build_host(&host)?;
    let compiler = Compiler::prepare(Route::Auto, TARGET)?;
    for target in TARGETS {
        compiler.library(target)?;
        let mut cargo = compiler.cargo(C_LIBRARY)?;
        ensure!(static_library(&mut cargo, target).status()?.success(), "{C_LIBRARY} does not build for {target}");
    }
    for target in TARGETS.into_iter().chain([host.as_str()]) {
        let built = root().join(C_LIBRARY).join(BUILT).join(target).join("release/libfingerpad_c.a");
        copy(&built, &out.join("lib/fingerpad").join(target).join("libfingerpad.a"))?;
    }
    for (from, to) in FILES {
        let text = fs::read_to_string(root().join(from)).with_context(|| from.to_owned())?;
        let text = text.replace("@VERSION@", env!("CARGO_PKG_VERSION")).replace("@HOST@", &host);
        write(&out.join(to), text.as_bytes())?;
    }
    for (file, name, load) in MODELS {
        let model = fs::read(root().join(format!("data/models/{file}.fpm")))?;
        write(&out.join(format!("share/fingerpad/{file}.fpm")), &model)?;
        write(&out.join(format!("include/{name}.h")), constant(&model, name, load).as_bytes())?;
    }
    arduino(out)?;
    let megabytes = size(out)? as f64 / 1e6;
    println!("{}: libraries for {host}, {}; {megabytes:.1} MB", out.display(), TARGETS.join(", "));
    Ok(())
}

/// What Arduino takes from `src`: headers that include those of `include`, and linker scripts in place of copies of the libraries.
fn arduino(out: &Path) -> Result<()> {
    for header in fs::read_dir(out.join("include"))? {
        let name = header?.file_name().to_string_lossy().into_owned();
        write(&out.join("src").join(&name), format!("#include \"../include/{name}\"\n").as_bytes())?;
    }
    for (folder, target) in ARDUINO {
        let up = "../".repeat(folder.split('/').count() + 1);
        let script = format!("/* A linker script. */\nINPUT({up}lib/fingerpad/{target}/libfingerpad.a)\n");
        write(&out.join("src").join(folder).join("libfingerpad.a"), script.as_bytes())?;
    }
    Ok(())
}

/// Bytes of all files in a folder.
pub fn size(folder: &Path) -> Result<u64> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        bytes += if entry.file_type()?.is_dir() { size(&entry.path())? } else { entry.metadata()?.len() };
    }
    Ok(bytes)
}

/// The host's kind, as the compiler names it.
pub fn host() -> Result<String> {
    let out = Command::new("rustc").env_remove("RUSTC").arg("-vV").output()?;
    let says = String::from_utf8_lossy(&out.stdout).into_owned();
    let host = says.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc -vV names no host")?;
    Ok(host.to_owned())
}

fn build_host(host: &str) -> Result<()> {
    let mut cargo = cargo_command();
    cargo.current_dir(root().join(C_LIBRARY));
    ensure!(static_library(&mut cargo, host).status()?.success(), "{C_LIBRARY} does not build for {host}");
    Ok(())
}

/// The static library without debug information, which would name this machine's folders.
fn static_library<'a>(cargo: &'a mut Command, target: &str) -> &'a mut Command {
    cargo.env("CARGO_PROFILE_RELEASE_DEBUG", "0").env("CARGO_PROFILE_RELEASE_STRIP", "debuginfo").args([
        "rustc",
        "--lib",
        "--release",
        "--crate-type",
        "staticlib",
        "--target-dir",
        BUILT,
        "--target",
        target,
    ])
}

/// A model file as a constant of words, which every compiler puts at an address divisible by 4.
fn constant(model: &[u8], name: &str, load: &str) -> String {
    let upper = name.to_uppercase();
    let words: Vec<String> = model
        .chunks(4)
        .map(|chunk| {
            let word = std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0));
            format!("0x{:08x}u,", u32::from_le_bytes(word))
        })
        .collect();
    let lines: Vec<String> = words.chunks(8).map(|line| format!("  {}", line.join(" "))).collect();
    format!(
        "/* A shipped model file as a constant for {load}; little-endian words. */\n\
         #ifndef {upper}_H\n#define {upper}_H\n\n#include <stdint.h>\n\n\
         #define {upper}_BYTES {}u\n\nstatic const uint32_t {name}[{}] = {{\n{}\n}};\n\n#endif\n",
        model.len(),
        words.len(),
        lines.join("\n")
    )
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    write(to, &fs::read(from).with_context(|| from.display().to_string())?)
}

fn write(to: &Path, bytes: &[u8]) -> Result<()> {
    fs::create_dir_all(to.parent().context("a file without folder")?)?;
    fs::write(to, bytes).with_context(|| to.display().to_string())
}
