//! The firmware chores: prepare the toolchain, build, run under QEMU with the log decoded, check.
//!
//! Room: uses `std::process` and the tools it names; knows nothing of the model. No shell is involved.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::{Subcommand, ValueEnum};

const TARGET: &str = "thumbv7em-none-eabihf";
const DEBIAN_COMPILER: &str = "/usr/bin/rustc";

/// Options of `cargo xtask thumb`.
#[derive(clap::Args)]
pub struct Args {
    /// Where the compiler for the target comes from
    #[arg(long, value_enum, default_value_t = Route::Auto)]
    route: Route,
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Route {
    /// rustup if it can, else Debian
    Auto,
    /// `rustup target add`
    Rustup,
    /// Debian's compiler and library sources
    Debian,
}

#[derive(Clone, Subcommand)]
enum Action {
    /// Install what is missing
    Prepare,
    /// Run one firmware binary under QEMU and decode its log
    Run {
        /// Name of the binary
        bin: String,
    },
    /// Prepare, build, run every binary (the default)
    All,
}

/// Firmware binaries that must end with status 0.
const BINARIES: [&str; 1] = ["hello"];

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    let tools = Tools::prepare(args.route)?;
    match args.action.clone().unwrap_or(Action::All) {
        Action::Prepare => Ok(()),
        Action::Run { bin } => tools.run(&bin),
        Action::All => {
            tools.build(TARGET, &[])?;
            for bin in BINARIES {
                tools.run(bin)?;
            }
            println!("thumb: all {} binaries ended with status 0", BINARIES.len());
            Ok(())
        }
    }
}

/// A toolchain that has been checked to be there.
struct Tools {
    firmware: PathBuf,
    /// Directory with rust-lld when Debian's compiler is used.
    debian_linker: Option<PathBuf>,
}

impl Tools {
    fn prepare(route: Route) -> Result<Self> {
        let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware-example").canonicalize()?;
        let rustup = match route {
            Route::Debian => false,
            Route::Rustup | Route::Auto => rustup_target(TARGET),
        };
        let debian_linker = match (rustup, route) {
            (true, _) => None,
            (false, Route::Rustup) => bail!("`rustup target add {TARGET}` failed"),
            (false, _) => {
                if !has_library_source() {
                    apt_install(&["rustc-web", "rust-web-src"], &format!("rustup target add {TARGET}"))?;
                }
                Some(linker_directory()?)
            }
        };
        if !succeeds(Command::new("qemu-system-arm").arg("--version")) {
            apt_install(&["qemu-system-arm"], "apt-get install qemu-system-arm")?;
        }
        if !succeeds(Command::new("defmt-print").arg("--version")) {
            say("cargo install --locked defmt-print");
            let done = cargo_command().args(["install", "--locked", "defmt-print"]).status()?;
            ensure!(done.success(), "defmt-print is missing; this helps: cargo install --locked defmt-print");
        }
        println!(
            "thumb: compiler from {}; QEMU and defmt-print are there",
            if debian_linker.is_some() { "Debian" } else { "rustup" }
        );
        Ok(Self { firmware, debian_linker })
    }

    /// `cargo` in the firmware's folder with the environment that the route needs.
    fn cargo(&self) -> Result<Command> {
        let mut cargo = cargo_command();
        cargo.current_dir(&self.firmware);
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

    fn build(&self, target: &str, extra: &[&str]) -> Result<()> {
        let status = self.cargo()?.args(["build", "--release", "--target", target]).args(extra).status()?;
        ensure!(status.success(), "the firmware does not build for {target}");
        Ok(())
    }

    fn elf(&self, bin: &str) -> PathBuf {
        self.firmware.join("target").join(TARGET).join("release").join(bin)
    }

    /// Builds and runs one binary, prints its decoded log; an error unless it ended with status 0.
    fn run(&self, bin: &str) -> Result<()> {
        self.build(TARGET, &["--bin", bin])?;
        println!("thumb: {bin}");
        let (status, log) = self.emulate(bin, 3, Duration::from_secs(300))?;
        print!("{log}");
        ensure!(status.success(), "{bin} ended with {status}");
        Ok(())
    }

    /// One run under QEMU: exit status and decoded log. One instruction lasts 2^`shift` ns of the board's time.
    fn emulate(&self, bin: &str, shift: u32, limit: Duration) -> Result<(ExitStatus, String)> {
        let elf = self.elf(bin);
        let raw = elf.with_extension("defmt");
        let mut qemu = Command::new("qemu-system-arm")
            .args(["-cpu", "cortex-m4", "-machine", "mps2-an386", "-nographic"])
            .args(["-icount", &format!("shift={shift}")])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(&elf)
            .stdin(Stdio::null())
            .stdout(File::create(&raw)?)
            .spawn()
            .context("qemu-system-arm")?;
        let start = Instant::now();
        let status = loop {
            if let Some(status) = qemu.try_wait()? {
                break status;
            }
            if start.elapsed() > limit {
                qemu.kill()?;
                qemu.wait()?;
                bail!("{bin} was still running after {} s", limit.as_secs());
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let decoded = Command::new("defmt-print").arg("-e").arg(&elf).stdin(File::open(&raw)?).output()?;
        fs::remove_file(&raw)?;
        ensure!(decoded.status.success(), "defmt-print: {}", String::from_utf8_lossy(&decoded.stderr));
        Ok((status, String::from_utf8_lossy(&decoded.stdout).into_owned()))
    }
}

/// Cargo without the flags of the build that started this chore.
fn cargo_command() -> Command {
    let mut cargo = Command::new("cargo");
    for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR"] {
        cargo.env_remove(name);
    }
    cargo
}

fn say(command: &str) {
    println!("thumb: {command}");
}

fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

fn rustup_target(target: &str) -> bool {
    let installed = Command::new("rustup").args(["target", "list", "--installed"]).output();
    if let Ok(listed) = &installed
        && String::from_utf8_lossy(&listed.stdout).lines().any(|line| line.trim() == target)
    {
        return true;
    }
    say(&format!("rustup target add {target}"));
    Command::new("rustup").args(["target", "add", target]).status().is_ok_and(|status| status.success())
}

/// Whether Debian's compiler and the sources of its library are installed.
fn has_library_source() -> bool {
    let sysroot = Command::new(DEBIAN_COMPILER).args(["--print", "sysroot"]).output();
    sysroot.is_ok_and(|out| {
        let root = PathBuf::from(String::from_utf8_lossy(&out.stdout).trim());
        root.join("lib/rustlib/src/rust/library/core/Cargo.toml").exists()
    })
}

/// Installs Debian packages if this is Debian and we are root; else fails with `hint`, the line that would help.
fn apt_install(packages: &[&str], hint: &str) -> Result<()> {
    let root = Command::new("id").arg("-u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    if !(root && Path::new("/etc/debian_version").exists()) {
        bail!("something is missing here; this helps: {hint}");
    }
    let install = || -> Result<bool> {
        say(&format!("apt-get install --yes --no-install-recommends {}", packages.join(" ")));
        let mut apt = Command::new("apt-get");
        apt.env("DEBIAN_FRONTEND", "noninteractive").args(["install", "--yes", "--no-install-recommends"]);
        Ok(apt.args(packages).stdout(Stdio::null()).status()?.success())
    };
    if install()? {
        return Ok(());
    }
    say("apt-get update");
    Command::new("apt-get").arg("update").stdout(Stdio::null()).status()?;
    ensure!(install()?, "apt-get could not install {}; this helps: {hint}", packages.join(" "));
    Ok(())
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
