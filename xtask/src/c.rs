//! The C library: the release folder, which needs no Rust, and its tests with the tools of a user.
//!
//! Main functions: [`release`], [`gate`], [`nightly`]. Uses `thumb::tools` for the compiler and `install` for what is missing.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::install;
use crate::shell::{at_root, command, output, refusal, root, run, sh};
use crate::thumb::tools::{C_LIBRARY, Compiler, Route, TARGET};

const MODEL: &str = "data/models/fingertip.fpm";
const PAD: &str = "data/models/fingertip-pad.fpm";
const CORRECTED: &str = "firmware-example/corrected.fpm";
const DOCUMENT: &str = "core/docs/fpm-format.md";
/// The page whose programs are compiled and run.
const PAGE: &str = "docs/my-c-program.md";
/// Microcontrollers: without FPU, with single-precision FPU, RISC-V without FPU.
const TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];
/// Where the libraries of a release are built, apart from those with debug information.
const BUILT: &str = "target/handed-on";
/// What the folder holds as it lies in the repository.
const FILES: [(&str, &str); 11] = [
    ("bindings/c/fingerpad.h", "include/fingerpad.h"),
    ("bindings/c/fingerpad.hpp", "include/fingerpad.hpp"),
    ("bindings/c/release/CMakeLists.txt", "CMakeLists.txt"),
    ("bindings/c/release/README.md", "README.md"),
    ("bindings/c/release/MISRA.md", "MISRA.md"),
    ("bindings/c/release/examples/press_and_slide.c", "examples/press_and_slide.c"),
    ("bindings/c/release/fingerpad.pc", "lib/pkgconfig/fingerpad.pc"),
    ("bindings/c/release/cmake/fingerpad-config.cmake", "lib/cmake/fingerpad/fingerpad-config.cmake"),
    ("bindings/c/release/cmake/fingerpad-config-version.cmake", "lib/cmake/fingerpad/fingerpad-config-version.cmake"),
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
];
/// The models that ship, bed and pad: the constant's name, and what it is loaded with.
const MODELS: [(&str, &str, &str); 2] =
    [(MODEL, "fingertip_fpm", "fingerpad_model_load"), (PAD, "fingertip_pad_fpm", "fingerpad_pad_load")];
/// Warnings that the C programs are free of.
const STRICT: &str = "-pedantic -Wall -Wextra -Wconversion -Werror";

/// Makes the release folder: everything that a C project needs, for this kind of host and the microcontrollers.
pub fn release(out: &Path) -> Result<()> {
    ensure!(!out.exists(), "{} exists already", out.display());
    let host = host()?;
    let compiler = Compiler::prepare(Route::Auto, TARGET)?;
    for target in TARGETS.into_iter().chain([host.as_str()]) {
        // Without debug information, which would name this machine's folders.
        let line = format!("rustc --lib --release --crate-type staticlib --target-dir {BUILT} --target {target}");
        let mut cargo = if target == host {
            command(C_LIBRARY, &format!("cargo {line}"))
        } else {
            compiler.library(target)?;
            compiler.cargo(C_LIBRARY, &line)?
        };
        run(cargo.env("CARGO_PROFILE_RELEASE_DEBUG", "0").env("CARGO_PROFILE_RELEASE_STRIP", "debuginfo"))?;
        let built = root().join(C_LIBRARY).join(BUILT).join(target).join("release/libfingerpad_c.a");
        write(&out.join("lib/fingerpad").join(target).join("libfingerpad.a"), &fs::read(built)?)?;
    }
    for (from, to) in FILES {
        let text = fs::read_to_string(root().join(from)).with_context(|| from.to_owned())?;
        let text = text.replace("@VERSION@", env!("CARGO_PKG_VERSION")).replace("@HOST@", &host);
        write(&out.join(to), text.as_bytes())?;
    }
    for (file, name, load) in MODELS {
        let model = fs::read(root().join(file))?;
        write(&out.join("share/fingerpad").join(Path::new(file).file_name().context(file)?), &model)?;
        write(&out.join(format!("include/{name}.h")), constant(&model, name, load).as_bytes())?;
    }
    println!("{}: libraries for {host}, {}; {:.1} MB", out.display(), TARGETS.join(", "), size(out)? as f64 / 1e6);
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
fn host() -> Result<String> {
    let says = output(command(".", "rustc -vV").env_remove("RUSTC"))?;
    Ok(says.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc -vV names no host")?.to_owned())
}

/// A model file as a constant of words, which every compiler puts at an address divisible by 4.
fn constant(model: &[u8], name: &str, load: &str) -> String {
    let upper = name.to_uppercase();
    let word = |chunk: &[u8]| u32::from_le_bytes(std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0)));
    let words: Vec<String> = model.chunks(4).map(|chunk| format!("0x{:08x}u,", word(chunk))).collect();
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

fn write(to: &Path, bytes: &[u8]) -> Result<()> {
    fs::create_dir_all(to.parent().context("a file without folder")?)?;
    fs::write(to, bytes).with_context(|| to.display().to_string())
}

/// CMake, pkg-config, a C and a C++ compiler.
pub fn prepare() -> Result<()> {
    install::programs(&["cmake", "pkg-config", "gcc", "g++", "make"])
}

/// Builds the libraries for this machine, without debug information, and returns the static one.
pub fn library() -> Result<PathBuf> {
    run(command(C_LIBRARY, "cargo build --release --locked --no-default-features")
        .env("CARGO_PROFILE_RELEASE_DEBUG", "0"))?;
    Ok(root().join(C_LIBRARY).join("target/release/libfingerpad_c.a"))
}

/// The header must be the one that the library's build writes.
fn header_is_current() -> Result<()> {
    let header = root().join(C_LIBRARY).join("fingerpad.h");
    let before = fs::read(&header)?;
    sh(C_LIBRARY, "cargo build --release --locked")?;
    ensure!(
        before == fs::read(&header)?,
        "{C_LIBRARY}/fingerpad.h was not up to date with the library; now it is: inspect it"
    );
    Ok(())
}

/// Writes the story, and the core's answers to it, into `folder`.
pub fn tell_story(folder: &Path) -> Result<()> {
    let line = format!(
        "cargo run --quiet --profile gate --locked --package fingerpad-story -- ../../{MODEL} ../../{CORRECTED}"
    );
    run(command(C_LIBRARY, &line).arg(folder))
}

/// The C library in C99 on this machine: documented vectors, the story, misuse.
pub fn gate() -> Result<()> {
    install::programs(&["gcc"])?;
    let folder = tempfile::tempdir()?;
    let library = library()?;
    tell_story(folder.path())?;
    for program in ["vectors", "story", "misuse"] {
        let line = format!("gcc -std=c99 {STRICT} -I. consumer/{program}.c -o");
        run(command(C_LIBRARY, &line).arg(folder.path().join(program)).arg(&library).arg("-lm"))?;
    }
    let program = |name: &str| folder.path().join(name);
    vectors_and_story(&program, folder.path())?;
    run(at_root(program("misuse")).arg(MODEL).arg(folder.path().join("charged.fpm")))
}

/// The documented vectors, and every answer of the story, bit for bit, by programs of one language.
fn vectors_and_story(program: &dyn Fn(&str) -> PathBuf, story: &Path) -> Result<()> {
    run(at_root(program("vectors")).args([MODEL, DOCUMENT]))?;
    let (shipped, charged) = (root().join(MODEL), story.join("charged.fpm"));
    let answers = |model: &Path, charged: &Path| -> Result<String> {
        let told = File::open(story.join("story.txt"))?;
        let out = Command::new(program("story")).arg(model).arg(charged).stdin(told).output()?;
        ensure!(out.status.success(), "story: {}", String::from_utf8_lossy(&out.stderr));
        Ok(String::from_utf8(out.stdout)?)
    };
    let wanted = fs::read_to_string(story.join("answers.txt"))?;
    let got = answers(&shipped, &charged)?;
    let told = fs::read_to_string(story.join("story.txt"))?;
    for ((want, got), request) in wanted.lines().zip(got.lines()).zip(told.lines()) {
        ensure!(want == got, "request {request}:\nthe core {want}\nC        {got}");
    }
    ensure!(wanted.lines().count() == got.lines().count(), "the number of answers differs");
    ensure!(answers(&charged, &shipped)? != wanted, "the comparison does not see that the models were exchanged");
    println!("C: {} answers of the story bit for bit", wanted.lines().count());
    Ok(())
}

/// The release folder in a folder outside the repository: CMake, pkg-config, C++17 and C++20, sanitizers, the page's programs.
pub fn nightly() -> Result<()> {
    prepare()?;
    header_is_current()?;
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    let release = at("release");
    self::release(&release)?;
    fs::create_dir(at("story"))?;
    tell_story(&at("story"))?;
    copy_folder(&root().join(C_LIBRARY).join("consumer"), &at("consumer"))?;
    let cmake = |build: &str, options: &str| {
        let mut cmake = command(folder.path(), &format!("cmake -S consumer -B {build} {options}"));
        cmake.arg(format!("-DCMAKE_PREFIX_PATH={}", release.display()));
        cmake
    };
    for (build, options) in
        [("plain", "-DCMAKE_BUILD_TYPE=Release"), ("sanitized", "-DCMAKE_BUILD_TYPE=Debug -DSANITIZE=ON")]
    {
        run(&mut cmake(build, options))?;
        sh(folder.path(), &format!("cmake --build {build} --parallel 2"))?;
        for language in ["", "_cpp"] {
            let program = |name: &str| at(build).join(format!("{name}{language}"));
            vectors_and_story(&program, &at("story"))?;
            run(at_root(program("roll_on_ball")).arg(PAD))?;
            run(at_root(program("misuse")).arg(MODEL).arg(at("story").join("charged.fpm")))?;
        }
        run(at_root(at(build).join("wrapper")).args([MODEL, PAD]))?;
    }
    // A project that requires a version or a processor that is not there is not configured.
    let says = refusal(&mut cmake("refused", "-DFINGERPAD_TARGET=avr-none"))?;
    ensure!(says.contains("no library for 'avr-none'"), "{says}");
    let lists = at("consumer/CMakeLists.txt");
    fs::write(&lists, fs::read_to_string(&lists)?.replace("fingerpad 0.1", "fingerpad 9.0"))?;
    let says = refusal(&mut cmake("refused", ""))?;
    ensure!(says.contains("requested version \"9.0\""), "{says}");
    // The folder installed by CMake, then found by pkg-config alone.
    sh(folder.path(), "cmake -S release -B installing")?;
    run(command(folder.path(), "cmake --install installing --prefix").arg(at("prefix")))?;
    let mut asked = command(folder.path(), "pkg-config --cflags --libs");
    let flags = output(asked.env("PKG_CONFIG_PATH", at("prefix/lib/pkgconfig")).arg("fingerpad >= 0.1"))?;
    sh(folder.path(), &format!("gcc -std=c99 consumer/vectors.c {flags} -o found"))?;
    run(at_root(at("found")).args([MODEL, DOCUMENT]))?;
    page(&release, folder.path())
}

/// The page's programs and the shipped example, compiled as the page says; the C++20 program imports nothing from the C++ library, and
/// its friction is that of the C program.
fn page(release: &Path, folder: &Path) -> Result<()> {
    let page = fs::read_to_string(root().join(PAGE))?;
    for (name, fence) in [("mine.c", "```c\n"), ("mine.cpp", "```cpp\n")] {
        fs::write(folder.join(name), block(&page, fence).with_context(|| format!("{PAGE} has no {name}"))?)?;
    }
    fs::copy(release.join("examples/press_and_slide.c"), folder.join("example.c"))?;
    let library = format!("release/lib/fingerpad/{}/libfingerpad.a", host()?);
    for program in ["mine", "example"] {
        sh(
            folder,
            &format!("gcc -std=c99 {STRICT} -Wno-conversion -I release/include {program}.c {library} -o {program}"),
        )?;
        let says = output(&mut command(folder, &format!("./{program}")))?;
        ensure!(says.contains("slip"), "{program} does not report slip: {says}");
    }
    let pad = &page[page.find("## A pad").with_context(|| format!("{PAGE} has no pad"))?..];
    fs::write(folder.join("pad.c"), block(pad, "```c\n").context("the pad has no program")?)?;
    fs::copy(root().join(PAD), folder.join("fingertip-pad.fpm"))?;
    sh(folder, &format!("gcc -std=c99 {STRICT} -Wno-conversion -I release/include pad.c {library} -lm -o pad"))?;
    let says = output(&mut command(folder, "./pad"))?;
    ensure!(block(pad, "```text\n").is_some_and(|text| text.trim() == says.trim()), "the pad's program prints {says}");
    let strict = "-std=c++20 -Wall -Wextra -Werror -fno-exceptions -fno-rtti";
    sh(folder, &format!("g++ {strict} -I release/include -c mine.cpp -o mine_cpp.o"))?;
    let imported = output(&mut command(folder, "nm --undefined-only --format=just-symbols mine_cpp.o"))?;
    let expected = ["printf", "puts", "memcpy", "memset", "memmove", "__stack_chk_fail", "_GLOBAL_OFFSET_TABLE_"];
    let foreign = imported.lines().filter(|name| !name.starts_with("fingerpad_") && !expected.contains(name));
    let foreign: Vec<&str> = foreign.collect();
    ensure!(imported.contains("fingerpad_step") && foreign.is_empty(), "the wrapper imports {foreign:?}");
    sh(folder, &format!("g++ mine_cpp.o {library} -o mine_cpp"))?;
    let friction = |program: &str| -> Result<Vec<String>> {
        let says = output(&mut command(folder, program))?;
        Ok(says.lines().filter_map(|line| line.split_whitespace().nth(1).map(str::to_owned)).collect())
    };
    let (c, cpp) = (friction("./mine")?, friction("./mine_cpp")?);
    if c.len() != 10 || c != cpp {
        bail!("the page's programs differ: in C {c:?}, in C++ {cpp:?}");
    }
    Ok(())
}

/// The first fenced block that starts so.
pub fn block<'a>(page: &'a str, fence: &str) -> Option<&'a str> {
    let (_, rest) = page.split_once(fence)?;
    Some(rest.split_once("```")?.0)
}

/// Copies the files of a folder, which has no folders in it.
fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}
