//! A checked toolchain for the target: builds, emulation with the log decoded, the linker.
//!
//! Main types: [`Compiler`], [`Tools`]. Finds compilers and emulates the board; independent of the checks.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use defmt_decoder::{DecodeError, Table};

use crate::install::{self, rustup_target};
use crate::shell::{command, output, root, run};

/// The processor of the board that is emulated.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// Folder of the firmware's workspace, from the repository's root.
pub const FIRMWARE: &str = "firmware-example";
/// Folder of the C library's workspace, from the repository's root.
pub const C_LIBRARY: &str = "bindings/c";
const DEBIAN_COMPILER: &str = "/usr/bin/rustc";

/// Source of the compiler for the target.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Route {
    /// rustup if it can, else Debian
    Auto,
    /// `rustup target add`
    Rustup,
    /// Debian's compiler and library sources
    Debian,
}

/// A compiler for microcontrollers.
pub struct Compiler {
    /// Directory with rust-lld when Debian's compiler is used.
    debian_linker: Option<PathBuf>,
}

/// A compiler, with the tools that run and read its programs.
pub struct Tools {
    compiler: Compiler,
}

impl std::ops::Deref for Tools {
    type Target = Compiler;

    fn deref(&self) -> &Compiler {
        &self.compiler
    }
}

impl Compiler {
    /// A compiler for `target`, installed if it is missing.
    pub fn prepare(route: Route, target: &str) -> Result<Self> {
        let rustup = route != Route::Debian && rustup_target(target);
        if rustup {
            return Ok(Self { debian_linker: None });
        }
        ensure!(route != Route::Rustup, "`rustup target add {target}` failed");
        let sysroot = command(".", &format!("{DEBIAN_COMPILER} --print sysroot")).output();
        let source = "lib/rustlib/src/rust/library/core/Cargo.toml";
        if !sysroot.is_ok_and(|out| Path::new(String::from_utf8_lossy(&out.stdout).trim()).join(source).exists()) {
            install::debian("rustc-web rust-web-src", &format!("rustup target add {target}"))?;
        }
        println!("the compiler for {target} is Debian's");
        Ok(Self { debian_linker: Some(linker_directory()?) })
    }

    /// `cargo` in a workspace's folder with the environment that the route needs.
    pub fn cargo(&self, folder: &str, line: &str) -> Result<Command> {
        let mut cargo = command(folder, &format!("cargo {line}"));
        // For every build, since a change of these builds all again: stack sizes and Debian's library need the first, and nothing here
        // reads debug information.
        cargo.env("RUSTC_BOOTSTRAP", "1").env("CARGO_PROFILE_RELEASE_DEBUG", "0");
        if let Some(linker) = &self.debian_linker {
            let path = std::env::var_os("PATH").unwrap_or_default();
            let path = std::iter::once(linker.clone()).chain(std::env::split_paths(&path));
            cargo.env("RUSTC", DEBIAN_COMPILER).env("CARGO_UNSTABLE_BUILD_STD", "core");
            cargo.env("PATH", std::env::join_paths(path)?);
        }
        Ok(cargo)
    }

    /// Builds a workspace for `target`.
    pub fn build(&self, folder: &str, target: &str, extra: &str) -> Result<()> {
        run(&mut self.cargo(folder, &format!("build --release --target {target} {extra}"))?)
    }

    /// Clippy of a workspace without warnings.
    pub fn clippy(&self, folder: &str) -> Result<()> {
        if self.debian_linker.is_some() {
            println!("{folder} is not checked by Clippy: Debian's compiler has none");
            return Ok(());
        }
        install::component("clippy", "clippy")?;
        run(&mut self.cargo(folder, &format!("clippy --target {TARGET} -- --deny warnings"))?)
    }

    /// The compiled library of the language for `target`; Debian's route builds it from its sources when it is needed.
    pub fn library(&self, target: &str) -> Result<()> {
        let there = self.debian_linker.is_some() || rustup_target(target);
        ensure!(there, "no compiler for {target}; this helps: rustup target add {target}");
        Ok(())
    }

    /// rust-lld, installed with the compiler.
    pub fn linker(&self) -> Result<Command> {
        let folder = self.debian_linker.clone().map_or_else(linker_directory, Ok)?;
        Ok(Command::new(folder.join("rust-lld")))
    }
}

impl Tools {
    /// Installs missing tools.
    pub fn prepare(route: Route) -> Result<Self> {
        let compiler = Compiler::prepare(route, TARGET)?;
        install::programs(&["qemu-system-arm"])?;
        Ok(Self { compiler })
    }

    /// The file of a firmware binary.
    pub fn elf(&self, bin: &str) -> PathBuf {
        root().join(FIRMWARE).join("target").join(TARGET).join("release").join(bin)
    }

    /// One run under QEMU: exit status and decoded log. One instruction lasts 2^`shift` ns of the board's time.
    pub fn emulate(&self, elf: &Path, shift: u32, limit: Duration) -> Result<(ExitStatus, String)> {
        let (status, raw) = qemu(elf, shift, limit)?;
        let bytes = fs::read(&raw)?;
        fs::remove_file(&raw)?;
        let table = Table::parse(&fs::read(elf)?)?.with_context(|| format!("{} has no log", elf.display()))?;
        let mut decoder = table.new_stream_decoder();
        decoder.received(&bytes);
        let mut log = String::new();
        loop {
            match decoder.decode() {
                Ok(frame) => log += &format!("{}\n", frame.display(false).to_string().trim()),
                Err(DecodeError::UnexpectedEof) => return Ok((status, log)),
                Err(DecodeError::Malformed) => bail!("a malformed message in the log of {}", elf.display()),
            }
        }
    }
}

/// Runs a program under QEMU: exit status and the file with its output.
pub fn qemu(elf: &Path, shift: u32, limit: Duration) -> Result<(ExitStatus, PathBuf)> {
    let raw = elf.with_extension("out");
    let line = format!(
        "qemu-system-arm -cpu cortex-m4 -machine mps2-an386 -nographic -icount shift={shift} \
         -semihosting-config enable=on,target=native -kernel"
    );
    let mut qemu =
        command(".", &line).arg(elf).stdin(Stdio::null()).stdout(File::create(&raw)?).spawn().context(line)?;
    let start = Instant::now();
    loop {
        if let Some(status) = qemu.try_wait()? {
            return Ok((status, raw));
        }
        if start.elapsed() > limit {
            qemu.kill()?;
            qemu.wait()?;
            bail!("{} was still running after {} s", elf.display(), limit.as_secs());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The directory of rust-lld in the toolchain that runs cargo.
fn linker_directory() -> Result<PathBuf> {
    let sysroot = output(command(".", "rustc --print sysroot").env_remove("RUSTC"))?;
    let rustlib = PathBuf::from(sysroot.trim()).join("lib/rustlib");
    for entry in fs::read_dir(&rustlib)? {
        let bin = entry?.path().join("bin");
        if bin.join("rust-lld").exists() {
            return Ok(bin);
        }
    }
    bail!("no rust-lld below {}", rustlib.display())
}
