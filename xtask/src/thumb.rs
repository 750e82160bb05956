//! The firmware chores: prepare the toolchain, build, run under QEMU with the log decoded, check.
//!
//! Room: uses `std::process` and the tools it names; knows nothing of the model. No shell is involved.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::{Subcommand, ValueEnum};

use crate::elf::Elf;

const TARGET: &str = "thumbv7em-none-eabihf";
/// The model that the firmware holds, from its folder.
const MODEL: &str = "../data/models/fingertip.fpm";
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
    /// Instructions per call: ours and what one would compose instead
    Count,
    /// Symbols, stack and sizes of the core-only binary, with positive controls
    Check,
    /// Host and target give the same bits over a million steps, and over strokes of a corrected model with its effects
    Golden,
    /// The C library, its header and a C program that prints the documented vectors
    C,
    /// All of these (the default)
    All,
}

/// What a diagnosis made of it, from its folder.
const CORRECTED: &str = "corrected.fpm";
/// A target without FPU and of another family.
const RISCV: &str = "riscv32imc-unknown-none-elf";
/// Firmware programs that must end with status 0.
const PROGRAMS: [&str; 2] = ["control", "hold"];
/// Other targets without operating system for which the core-only binary must link without panics.
const OTHER_TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv8m.main-none-eabihf"];

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    let tools = Tools::prepare(args.route)?;
    match args.action.clone().unwrap_or(Action::All) {
        Action::Prepare => Ok(()),
        Action::Run { bin } => tools.run(&bin),
        Action::Count => tools.count(),
        Action::Check => tools.check(),
        Action::Golden => tools.golden(),
        Action::C => tools.c(),
        Action::All => {
            for program in PROGRAMS {
                tools.run(program)?;
            }
            tools.golden()?;
            tools.c()?;
            tools.check()?;
            tools.count()
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

    /// Prints the table of instruction counts; an error if the worst step is above its budget.
    fn count(&self) -> Result<()> {
        self.build(TARGET, &["--bin", "count"])?;
        let (status, log) = self.emulate("count", 10, Duration::from_secs(300))?;
        ensure!(status.success(), "count ended with {status}:\n{log}");
        println!("{:<42} {:>6} {:>6} {:>6} {:>12}", "instructions per call", "least", "mean", "most", "most/least");
        let mut rows = Vec::new();
        for line in log.lines() {
            let Some((name, numbers)) = line.strip_prefix("count ").and_then(|l| l.split_once(": ")) else { continue };
            let n: Vec<u32> = numbers.split_whitespace().filter_map(|w| w.parse().ok()).collect();
            let [least, mean, most] = n[..] else { bail!("not understood: {line}") };
            println!("{name:<42} {least:>6} {mean:>6} {most:>6} {:>12.2}", f64::from(most) / f64::from(least));
            rows.push((name.to_owned(), mean, most));
        }
        let most = |part: &str| -> Result<u32> {
            rows.iter().find(|r| r.0.contains(part)).map(|r| r.2).with_context(|| format!("no row {part}"))
        };
        let ours = most("default")?;
        println!(
            "worst case: {:.2} of LuGre + powf + table, the crates' composition takes {:.1} times as many",
            f64::from(ours) / f64::from(most("LuGre")?),
            f64::from(most("interpn")?) / f64::from(ours)
        );
        ensure!(ours <= STEP_BUDGET, "a step takes {ours} instructions, the budget is {STEP_BUDGET}");
        Ok(())
    }

    /// The digests of a million steps, and of a million with effects, on the host and on the target.
    fn golden(&self) -> Result<()> {
        let plain = self.agrees("golden", "document", MODEL)?;
        let digest = plain.trim_start_matches("golden: ");
        let document = fs::read_to_string(self.firmware.join("../docs/fpm-format.md"))?;
        ensure!(document.contains(digest), "docs/fpm-format.md has another digest than {digest}");
        println!("{plain} on host and target, 1000000 steps, all outputs");
        let corrected = self.agrees("corrected", "strokes", CORRECTED)?;
        println!("{corrected} on host and target, 1000000 steps with the effects of {CORRECTED}, all readings");
        Ok(())
    }

    /// The line that a program prints on the target, if an example of the core prints the same of a model on the host.
    fn agrees(&self, bin: &str, example: &str, model: &str) -> Result<String> {
        self.build(TARGET, &["--bin", bin])?;
        let (status, log) = self.emulate(bin, 3, Duration::from_secs(300))?;
        ensure!(status.success(), "{bin} ended with {status}");
        let host = cargo_command()
            .current_dir(self.firmware.join(".."))
            .args(["run", "--quiet", "--release", "--package", "fingerpad", "--example", example, "--"])
            .arg(self.firmware.join(model))
            .output()?;
        ensure!(host.status.success(), "{}", String::from_utf8_lossy(&host.stderr));
        let host = String::from_utf8_lossy(&host.stdout).lines().last().unwrap_or_default().to_owned();
        ensure!(log.trim() == host, "host and target differ: {host} and {}", log.trim());
        Ok(host)
    }

    /// Builds the C library and a C program on it, runs that, and compares with `docs/fpm-format.md`.
    fn c(&self) -> Result<()> {
        if !succeeds(Command::new("arm-none-eabi-gcc").arg("--version")) {
            apt_install(&["gcc-arm-none-eabi"], "apt-get install gcc-arm-none-eabi")?;
        }
        self.build(TARGET, &["--package", "fingerpad-c"])?;
        let release = self.firmware.join("target").join(TARGET).join("release");
        let program = release.join("c_example");
        let status = Command::new("arm-none-eabi-gcc")
            .current_dir(&self.firmware)
            .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-ffreestanding", "-nostdlib"])
            .args(["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"])
            .args(["-Wl,--gc-sections", "-Wl,-z,noexecstack", "-Wa,-I,.", "-Icapi", "-Tcapi/example.ld"])
            .arg("capi/example.c")
            .arg(release.join("libfingerpad_c.a"))
            .arg("-o")
            .arg(&program)
            .status()?;
        ensure!(status.success(), "the C program does not build");
        let (status, raw) = qemu(&program, 3, Duration::from_secs(60))?;
        let says = fs::read_to_string(&raw)?;
        fs::remove_file(&raw)?;
        ensure!(status.success(), "the C program ended with {status}:\n{says}");

        let document = fs::read_to_string(self.firmware.join("../docs/fpm-format.md"))?;
        let vectors = document.split_once("```vectors\n").and_then(|(_, rest)| rest.split_once("```"));
        let wanted: Vec<&str> = vectors.context("no vectors in the document")?.0.lines().collect();
        let printed: Vec<&str> = says.lines().collect();
        ensure!(wanted.len() == printed.len(), "{} lines printed, {} documented", printed.len(), wanted.len());
        for (want, print) in wanted.iter().zip(&printed) {
            let want = want.split_once(" | ").context("a vector without |")?.1;
            let same = want.split_whitespace().collect::<Vec<_>>() == print.split_whitespace().collect::<Vec<_>>();
            ensure!(same, "documented {want}\nprinted    {print}");
        }
        let elf = Elf::read(&program)?;
        let panics = elf.symbols(is_panic);
        ensure!(panics.is_empty(), "panics in the C program: {panics:?}");
        println!("C: {} vectors bit for bit, no panics linked", wanted.len());
        Ok(())
    }

    /// Symbols, link, stack and sizes of the core-only binary.
    fn check(&self) -> Result<()> {
        self.build(TARGET, &["--bin", "core_only", "--bin", "gate_control"])?;
        let (core, control) = (Elf::read(&self.elf("core_only"))?, Elf::read(&self.elf("gate_control"))?);
        for (what, gate) in GATES {
            let (found, seen) = (core.symbols(gate), control.symbols(gate));
            println!("{what}: {} in core_only, {} in gate_control", found.len(), seen.len());
            ensure!(found.is_empty(), "{what} in core_only: {found:?}");
            ensure!(!seen.is_empty(), "the check for {what} does not see them where they are");
        }
        let mut bad = self.cargo()?;
        bad.args([
            "build",
            "--release",
            "--bin",
            "core_only",
            "--features",
            "panics",
            "--target-dir",
            "target/control",
        ]);
        let out = bad.output()?;
        let says = String::from_utf8_lossy(&out.stderr);
        ensure!(!out.status.success() && says.contains("panic-never"), "a panicking core_only should not link: {says}");
        println!("panic-never: core_only links, with a panic in it it does not");

        for target in OTHER_TARGETS {
            if self.debian_linker.is_none() && !rustup_target(target) {
                bail!("no compiler for {target}; this helps: rustup target add {target}");
            }
            self.build(target, &["--bin", "core_only"])?;
            self.build(target, &["--bin", "gate_control"])?;
            let release = self.firmware.join("target").join(target).join("release");
            let (core, control) = (Elf::read(&release.join("core_only"))?, Elf::read(&release.join("gate_control"))?);
            // Without a double-precision unit, so everywhere here; the root is software only where there is no FPU.
            for (what, gate) in &GATES[..2] {
                let (found, seen) = (core.symbols(gate), control.symbols(gate));
                ensure!(found.is_empty(), "{target}: {what} in core_only: {found:?}");
                ensure!(!seen.is_empty(), "{target}: the check for {what} does not see them where they are");
            }
            println!("{target}: core_only links without panics or doubles in software; both seen in gate_control");
        }
        self.riscv()?;
        self.sizes()
    }

    /// The C library for a microcontroller without FPU, linked whole: what it exports needs no panic and no double.
    fn riscv(&self) -> Result<()> {
        if self.debian_linker.is_none() && !rustup_target(RISCV) {
            bail!("no compiler for {RISCV}; this helps: rustup target add {RISCV}");
        }
        let (status, _, out) = self.riscv_link(&[], "target")?;
        ensure!(status.success(), "the library does not link for {RISCV}");
        let elf = Elf::read(&out)?;
        ensure!(!elf.symbols(|name| name == "fingerpad_step").is_empty(), "{RISCV}: the link left nothing to look at");
        let panics = elf.symbols(is_panic);
        let doubles = elf.symbols(|name| name.ends_with("df3") || name.ends_with("df2") || name.ends_with("sfdf2"));
        ensure!(panics.is_empty() && doubles.is_empty(), "{RISCV}: {panics:?} {doubles:?}");
        let (status, says, _) = self.riscv_link(&["--features", "panics"], "target/control")?;
        ensure!(!status.success() && says.contains("panic"), "{RISCV}: a library that panics should not link: {says}");
        println!("{RISCV}: the C library links without panics or doubles in software, with a panic in it it does not");
        Ok(())
    }

    /// Builds the C library below `target` and links what it exports: how that ended, what the linker says, the file.
    fn riscv_link(&self, extra: &[&str], target: &str) -> Result<(ExitStatus, String, PathBuf)> {
        // Flags for the host's processor, which the workspace sets, would be taken for this target as well.
        let status = self
            .cargo()?
            .env("CARGO_TARGET_RISCV32IMC_UNKNOWN_NONE_ELF_RUSTFLAGS", "-Ctarget-cpu=generic-rv32")
            .args(["build", "--release", "--target", RISCV, "--package", "fingerpad-c", "--target-dir", target])
            .args(extra)
            .status()?;
        ensure!(status.success(), "the C library does not build for {RISCV}");
        let release = self.firmware.join(target).join(RISCV).join("release");
        let out = release.join("fingerpad_c.elf");
        let linked = self
            .linker()?
            .args(["-flavor", "gnu", "--gc-sections", "-e", "fingerpad_step", "-u", "fingerpad_model_load"])
            .arg(release.join("libfingerpad_c.a"))
            .arg("-o")
            .arg(&out)
            .output()?;
        Ok((linked.status, String::from_utf8_lossy(&linked.stderr).into_owned(), out))
    }

    /// rust-lld, as it comes with the compiler.
    fn linker(&self) -> Result<Command> {
        let folder = match &self.debian_linker {
            Some(folder) => folder.clone(),
            None => linker_directory()?,
        };
        Ok(Command::new(folder.join("rust-lld")))
    }

    /// Stack and code of a step, from a build with the compiler's own stack sizes.
    fn sizes(&self) -> Result<()> {
        let mut cargo = self.cargo()?;
        cargo.env("RUSTC_BOOTSTRAP", "1").args(["rustc", "--release", "--bin", "core_only"]);
        cargo.args(["--target-dir", "target/stack", "--", "-Zemit-stack-sizes"]);
        ensure!(cargo.status()?.success(), "the build with stack sizes failed");
        let elf = Elf::read(&self.firmware.join("target/stack").join(TARGET).join("release/core_only"))?;
        let step = elf.function("one_step")?;
        let (stack, through) = elf.worst_stack(step)?;
        println!("step: {} bytes of code, {stack} bytes of stack ({})", elf.code_size(step), through.join(" > "));
        let model = fs::metadata(self.firmware.join(MODEL))?.len();
        println!("tables: {model} bytes (the model file); state: {} bytes", STATE_BYTES);
        ensure!(elf.code_size(step) <= 2500 && stack <= 160, "over the budget of 2500 and 160 bytes");
        Ok(())
    }

    /// One run under QEMU: exit status and decoded log. One instruction lasts 2^`shift` ns of the board's time.
    fn emulate(&self, bin: &str, shift: u32, limit: Duration) -> Result<(ExitStatus, String)> {
        let elf = self.elf(bin);
        let (status, raw) = qemu(&elf, shift, limit)?;
        let decoded = Command::new("defmt-print").arg("-e").arg(&elf).stdin(File::open(&raw)?).output()?;
        fs::remove_file(&raw)?;
        ensure!(decoded.status.success(), "defmt-print: {}", String::from_utf8_lossy(&decoded.stderr));
        Ok((status, String::from_utf8_lossy(&decoded.stdout).into_owned()))
    }
}

/// Most instructions that a step of the default model may take.
const STEP_BUDGET: u32 = 380;
/// Two elements, resultant, its way and energies of two words each, seven words.
const STATE_BYTES: u32 = 68;

/// Runs a program under QEMU: exit status and the file with what it wrote.
fn qemu(elf: &Path, shift: u32, limit: Duration) -> Result<(ExitStatus, PathBuf)> {
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

type Gate = fn(&str) -> bool;

/// What the core must not link.
const GATES: [(&str, Gate); 3] = [
    ("panics", is_panic),
    ("doubles in software", |name| {
        ["__aeabi_d", "__aeabi_f2d", "__aeabi_i2d", "__aeabi_ui2d", "__aeabi_l2d", "__aeabi_ul2d"]
            .iter()
            .any(|p| name.starts_with(p) && !name.starts_with("__aeabi_div"))
    }),
    ("square roots in software", |name| name == "sqrtf" || name.ends_with("::sqrtf")),
];

fn is_panic(name: &str) -> bool {
    name.contains("core::panicking") || name.contains("panic_fmt") || name.contains("unwrap_failed")
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
