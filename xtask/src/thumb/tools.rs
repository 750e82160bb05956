//! A checked toolchain for the target: builds, emulation with the log decoded, the linker.
//!
//! Main type: [`Tools`]. Finds compilers and emulates the board; independent of the checks.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;

use crate::install::{self, rustup_target, say, succeeds};
use crate::root;

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
        let rustup = match route {
            Route::Debian => false,
            Route::Rustup | Route::Auto => rustup_target(target),
        };
        let debian_linker = match (rustup, route) {
            (true, _) => None,
            (false, Route::Rustup) => bail!("`rustup target add {target}` failed"),
            (false, _) => {
                if !has_library_source() {
                    install::debian(&["rustc-web", "rust-web-src"], &format!("rustup target add {target}"))?;
                }
                Some(linker_directory()?)
            }
        };
        println!("thumb: compiler from {}", if debian_linker.is_some() { "Debian" } else { "rustup" });
        Ok(Self { debian_linker })
    }

    /// `cargo` in a workspace's folder with the environment that the route needs.
    pub fn cargo(&self, folder: &str) -> Result<Command> {
        let mut cargo = cargo_command();
        cargo.current_dir(root().join(folder));
        if let Some(linker) = &self.debian_linker {
            let mut path = vec![linker.clone()];
            path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()));
            cargo
                .env("RUSTC", DEBIAN_COMPILER)
                .env("RUSTC_BOOTSTRAP", "1")
                .env("CARGO_UNSTABLE_BUILD_STD", "core")
                .env("PATH", std::env::join_paths(path)?);
        }
        Ok(cargo)
    }

    /// Builds a workspace for `target`.
    pub fn build(&self, folder: &str, target: &str, extra: &[&str]) -> Result<()> {
        let status = self.cargo(folder)?.args(["build", "--release", "--target", target]).args(extra).status()?;
        ensure!(status.success(), "{folder} does not build for {target}");
        Ok(())
    }

    /// Clippy of a workspace without warnings.
    pub fn clippy(&self, folder: &str) -> Result<()> {
        if self.debian_linker.is_some() {
            println!("{folder} is not checked by Clippy: Debian's compiler has none");
            return Ok(());
        }
        install::component("clippy", "clippy")?;
        let status = self.cargo(folder)?.args(["clippy", "--target", TARGET, "--", "--deny", "warnings"]).status()?;
        ensure!(status.success(), "Clippy has warnings in {folder}");
        Ok(())
    }

    /// The compiled library of the language for `target`; Debian's route builds it from its sources when it is needed.
    pub fn library(&self, target: &str) -> Result<()> {
        let there = self.debian_linker.is_some() || rustup_target(target);
        ensure!(there, "no compiler for {target}; this helps: rustup target add {target}");
        Ok(())
    }

    /// rust-lld, installed with the compiler.
    pub fn linker(&self) -> Result<Command> {
        let folder = match &self.debian_linker {
            Some(folder) => folder.clone(),
            None => linker_directory()?,
        };
        Ok(Command::new(folder.join("rust-lld")))
    }
}

impl Tools {
    /// Installs missing tools.
    pub fn prepare(route: Route) -> Result<Self> {
        let compiler = Compiler::prepare(route, TARGET)?;
        if !succeeds(Command::new("qemu-system-arm").arg("--version")) {
            install::debian(&["qemu-system-arm"], "apt-get install qemu-system-arm")?;
        }
        if !succeeds(Command::new("defmt-print").arg("--version")) {
            say("cargo install --locked defmt-print");
            let done = cargo_command().args(["install", "--locked", "defmt-print"]).status()?;
            ensure!(done.success(), "defmt-print is missing; this helps: cargo install --locked defmt-print");
        }
        println!("thumb: QEMU and defmt-print are there");
        Ok(Self { compiler })
    }

    /// The file of a firmware binary.
    pub fn elf(&self, bin: &str) -> PathBuf {
        root().join(FIRMWARE).join("target").join(TARGET).join("release").join(bin)
    }

    /// One run under QEMU: exit status and decoded log. One instruction lasts 2^`shift` ns of the board's time.
    pub fn emulate(&self, bin: &str, shift: u32, limit: Duration) -> Result<(ExitStatus, String)> {
        self.emulate_file(&self.elf(bin), shift, limit)
    }

    /// The same of a file.
    pub fn emulate_file(&self, elf: &Path, shift: u32, limit: Duration) -> Result<(ExitStatus, String)> {
        let (status, raw) = qemu(elf, shift, limit)?;
        let decoded = Command::new("defmt-print").arg("-e").arg(elf).stdin(File::open(&raw)?).output()?;
        fs::remove_file(&raw)?;
        ensure!(decoded.status.success(), "defmt-print: {}", String::from_utf8_lossy(&decoded.stderr));
        Ok((status, String::from_utf8_lossy(&decoded.stdout).into_owned()))
    }
}

/// Runs a program under QEMU: exit status and the file with its output.
pub fn qemu(elf: &Path, shift: u32, limit: Duration) -> Result<(ExitStatus, PathBuf)> {
    let raw = elf.with_extension("out");
    let out = File::create(&raw)?;
    let mut qemu = Command::new("qemu-system-arm")
        .args(["-cpu", "cortex-m4", "-machine", "mps2-an386", "-nographic"])
        .args(["-icount", &format!("shift={shift}")])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(elf)
        .stdin(Stdio::null())
        .stdout(out)
        .spawn()
        .context("qemu-system-arm")?;
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

/// Cargo without the flags of the build that started this chore.
pub fn cargo_command() -> Command {
    let mut cargo = Command::new("cargo");
    for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR"] {
        cargo.env_remove(name);
    }
    cargo
}

/// Whether Debian's compiler and the sources of its library are installed.
fn has_library_source() -> bool {
    let sysroot = Command::new(DEBIAN_COMPILER).args(["--print", "sysroot"]).output();
    sysroot.is_ok_and(|out| {
        let root = PathBuf::from(String::from_utf8_lossy(&out.stdout).trim());
        root.join("lib/rustlib/src/rust/library/core/Cargo.toml").exists()
    })
}

/// The directory of rust-lld in the toolchain that runs cargo.
fn linker_directory() -> Result<PathBuf> {
    let out = Command::new("rustc").env_remove("RUSTC").args(["--print", "sysroot"]).output()?;
    let rustlib = PathBuf::from(String::from_utf8_lossy(&out.stdout).trim()).join("lib/rustlib");
    for entry in fs::read_dir(&rustlib)? {
        let bin = entry?.path().join("bin");
        if bin.join("rust-lld").exists() {
            return Ok(bin);
        }
    }
    bail!("no rust-lld below {}", rustlib.display())
}
