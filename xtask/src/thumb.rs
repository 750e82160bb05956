//! The firmware chores: build, run under QEMU with the log decoded, check.
//!
//! Main type: [`Action`]. Uses [`tools`] for the toolchain and [`elf`] for the linked program; independent of the
//! model.

mod elf;
pub mod tools;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use clap::Subcommand;

use crate::install;
use crate::shell::{command, output, refusal, root, run};
use elf::Elf;
use tools::{C_LIBRARY, FIRMWARE, Route, TARGET, Tools, qemu};

/// The shipped model, which the firmware holds, from the repository's root.
const MODEL: &str = "data/models/fingertip.fpm";
/// The same model after a diagnosis.
const CORRECTED: &str = "firmware-example/corrected.fpm";
/// Format of the model file with its test vectors and its digest.
const DOCUMENT: &str = "core/docs/fpm-format.md";

/// Options of `cargo xtask thumb`.
#[derive(clap::Args)]
pub struct Args {
    /// Source of the compiler for the target
    #[arg(long, value_enum, default_value_t = Route::Auto)]
    route: Route,
    #[command(subcommand)]
    action: Action,
}

/// Actions on the firmware.
#[derive(Clone, Subcommand)]
pub enum Action {
    /// Install missing tools
    Prepare,
    /// Run one firmware binary under QEMU and decode its log
    Run {
        /// Name of the binary
        bin: String,
    },
    /// Instructions per call within their bounds: this library and common alternatives
    Count {
        /// The same calls, without bounds, by a compiler that is tuned to the processor and for processors without FPU
        #[arg(long)]
        processors: bool,
    },
    /// Instructions per step of the pad within their bounds
    CountPad,
    /// Symbols, stack and sizes of the core-only binary, with positive controls
    Check,
    /// Host and target give the same bits over a million steps, and over strokes of a corrected model with its effects
    Golden,
}

/// Cortex-M with and without FPU, and their flags of gcc.
const C_TARGETS: [(&str, &str); 2] = [
    (TARGET, "-mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    ("thumbv6m-none-eabi", "-mcpu=cortex-m0 -mfloat-abi=soft"),
];
/// A target without FPU and of another family.
const RISCV: &str = "riscv32imc-unknown-none-elf";
/// Other processors whose instructions are counted: a name, the target, flags of the compiler.
const OTHER_PROCESSORS: [(&str, &str, Option<&str>); 3] = [
    ("-C target-cpu=cortex-m4", TARGET, Some("-C target-cpu=cortex-m4")),
    ("Cortex-M3, without FPU", "thumbv7m-none-eabi", None),
    ("Cortex-M0+, without FPU and division", "thumbv6m-none-eabi", None),
];
/// Firmware programs that must end with status 0.
const PROGRAMS: [&str; 7] = ["control", "hold", "calibrate", "pivot", "hand", "unknown", "tasks"];
/// Other targets without operating system for which the core-only binary must link without panics.
const OTHER_TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv8m.main-none-eabihf"];

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    let tools = Tools::prepare(args.route)?;
    match &args.action {
        Action::Prepare => Ok(()),
        Action::Run { bin } => tools.run(bin),
        Action::Count { processors: false } => tools.count(),
        Action::Count { processors: true } => OTHER_PROCESSORS.iter().try_for_each(|other| tools.count_for(other)),
        Action::CountPad => tools.count_pad(),
        Action::Check => tools.check(),
        Action::Golden => tools.golden(),
    }
}

/// The firmware's step of the gate.
pub fn gate() -> Result<()> {
    let tools = Tools::prepare(Route::Auto)?;
    tools.build(FIRMWARE, TARGET, "--bin gate_control --bin count --bin count_pad --bin golden --bin corrected")?;
    tools.check()?;
    tools.count()?;
    tools.count_pad()
}

/// The step that compares the bits of host and target.
pub fn golden() -> Result<()> {
    Tools::prepare(Route::Auto)?.golden()
}

/// Clippy of the workspaces for microcontrollers.
pub fn clippy() -> Result<()> {
    let tools = Tools::prepare(Route::Auto)?;
    [FIRMWARE, C_LIBRARY].iter().try_for_each(|folder| tools.clippy(folder))
}

/// The example programs under QEMU.
pub fn programs() -> Result<()> {
    let tools = Tools::prepare(Route::Auto)?;
    PROGRAMS.iter().try_for_each(|program| tools.run(program))
}

/// The core and the C library for other processors.
pub fn processors() -> Result<()> {
    let tools = Tools::prepare(Route::Auto)?;
    OTHER_TARGETS.iter().try_for_each(|target| tools.other_target(target))?;
    tools.riscv()?;
    tools.c()
}

impl Tools {
    /// Builds and runs one binary, prints its decoded log; an error unless it ended with status 0.
    fn run(&self, bin: &str) -> Result<()> {
        self.build(FIRMWARE, TARGET, &format!("--bin {bin}"))?;
        let (status, log) = self.emulate(&self.elf(bin), 3, Duration::from_secs(300))?;
        print!("{log}");
        ensure!(status.success(), "{bin} ended with {status}");
        Ok(())
    }

    /// Prints the table of instruction counts; an error if a call is above its bound.
    fn count(&self) -> Result<()> {
        self.build(FIRMWARE, TARGET, "--bin count")?;
        let rows = self.print_counts(&self.elf("count"))?;
        let most = |part: &str| -> Result<u32> {
            rows.iter().find(|r| r.0.contains(part)).map(|r| r.1).with_context(|| format!("no row {part}"))
        };
        let ours = most("M=4 default")?;
        println!(
            "worst case: {:.2} of LuGre + powf + table, the crates' composition takes {:.1} times as many",
            f64::from(ours) / f64::from(most("LuGre")?),
            f64::from(most("interpn")?) / f64::from(ours)
        );
        for (part, bound) in INSTRUCTION_BOUNDS {
            let most = most(part)?;
            ensure!(most <= bound, "{part} takes {most} instructions, the bound is {bound}");
        }
        Ok(())
    }

    /// Prints the table of the pad; an error if a step is above its bound.
    fn count_pad(&self) -> Result<()> {
        self.build(FIRMWARE, TARGET, "--bin count_pad")?;
        for (name, most) in self.print_counts(&self.elf("count_pad"))? {
            let bound = match &name {
                name if name.starts_with("frames") => FRAMES_BOUND,
                name if name.contains("branches") => RELAXING_PAD_BOUND,
                _ => PAD_BOUND,
            };
            ensure!(most <= bound, "{name} takes {most} instructions, the bound is {bound}");
        }
        Ok(())
    }

    /// The table for another processor. QEMU's Cortex-M4F runs the code of all of them.
    fn count_for(&self, (name, target, flags): &(&str, &str, Option<&str>)) -> Result<()> {
        self.library(target)?;
        println!("{name}");
        let folder = "target/processors";
        let line = format!("build --release --no-default-features --bin count --target {target} --target-dir {folder}");
        let mut cargo = self.cargo(FIRMWARE, &line)?;
        if let Some(flags) = flags {
            cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS", flags);
        }
        run(&mut cargo)?;
        self.print_counts(&root().join(FIRMWARE).join(folder).join(target).join("release/count"))?;
        Ok(())
    }

    /// Runs a program of counts and prints its table: names and the most.
    fn print_counts(&self, elf: &Path) -> Result<Vec<(String, u32)>> {
        let (status, log) = self.emulate(elf, 10, Duration::from_secs(600))?;
        ensure!(status.success(), "count ended with {status}:\n{log}");
        println!("{:<42} {:>6} {:>6} {:>6} {:>12}", "instructions per call", "least", "mean", "most", "most/least");
        let mut rows = Vec::new();
        for line in log.lines() {
            let Some((name, numbers)) = line.strip_prefix("count ").and_then(|l| l.split_once(": ")) else { continue };
            let n: Vec<u32> = numbers.split_whitespace().filter_map(|w| w.parse().ok()).collect();
            let [least, mean, most] = n[..] else { bail!("not understood: {line}") };
            println!("{name:<42} {least:>6} {mean:>6} {most:>6} {:>12.2}", f64::from(most) / f64::from(least));
            rows.push((name.to_owned(), most));
        }
        Ok(rows)
    }

    /// The digests of a million steps, and of a million with effects, on the host and on the target.
    fn golden(&self) -> Result<()> {
        let plain = self.agrees("golden", "document", MODEL)?;
        let digest = plain.trim_start_matches("golden: ");
        let document = fs::read_to_string(root().join(DOCUMENT))?;
        ensure!(document.contains(&format!("digest `{digest}`")), "{DOCUMENT} has another digest than {digest}");
        println!("{plain} on host and target, 1000000 steps, all outputs");
        let corrected = self.agrees("corrected", "strokes", CORRECTED)?;
        println!("{corrected} on host and target, 1000000 steps with the effects of {CORRECTED}, all readings");
        Ok(())
    }

    /// The line that a program prints on the target, if an example of the core prints the same of a model on the host.
    fn agrees(&self, bin: &str, example: &str, model: &str) -> Result<String> {
        self.build(FIRMWARE, TARGET, &format!("--bin {bin}"))?;
        let (status, log) = self.emulate(&self.elf(bin), 3, Duration::from_secs(300))?;
        ensure!(status.success(), "{bin} ended with {status}");
        // All packages, so that the core is the one that the tests have built.
        run(&mut crate::rust::cargo(&format!("build --example {example}"))?)?;
        let host = output(&mut command(".", &format!("target/gate/examples/{example} {model}")))?;
        let host = host.lines().last().unwrap_or_default().to_owned();
        ensure!(log.trim() == host, "host and target differ: {host} and {}", log.trim());
        Ok(host)
    }

    /// Builds the C library and a C program on it, runs that, and compares with the documented vectors.
    fn c(&self) -> Result<()> {
        install::programs(&["arm-none-eabi-gcc"])?;
        let folder = root().join(C_LIBRARY);
        let header = fs::read_to_string(folder.join("fingerpad.h"))?;
        self.build(C_LIBRARY, TARGET, "--lib")?;
        let written = fs::read_to_string(folder.join("fingerpad.h"))?;
        ensure!(
            header == written,
            "{C_LIBRARY}/fingerpad.h was not up to date with the library; now it is: inspect it"
        );
        for (target, flags) in C_TARGETS {
            self.library(target)?;
            self.build(C_LIBRARY, target, "--lib")?;
            self.bare_metal(target, flags)?;
        }
        Ok(())
    }

    /// The C program on the library for `target`, under QEMU: it must print the documented vectors.
    fn bare_metal(&self, target: &str, flags: &str) -> Result<()> {
        let folder = root().join(C_LIBRARY);
        let release = folder.join("target").join(target).join("release");
        let program = release.join("bare_metal");
        let line = format!(
            "arm-none-eabi-gcc -std=c11 -Wall -Wextra -Werror -O2 -ffreestanding -nostdlib -mthumb {flags} -Wl,--gc-sections \
             -Wl,-z,noexecstack -Wa,-I,. -I. -Tbare_metal.ld bare_metal.c -o"
        );
        run(command(C_LIBRARY, &line).arg(&program).arg(release.join("libfingerpad_c.a")))?;
        // The board's Cortex-M4F runs the code of a Cortex-M0 as well.
        let (status, raw) = qemu(&program, 3, Duration::from_secs(60))?;
        let output_text = fs::read_to_string(&raw)?;
        fs::remove_file(&raw)?;
        ensure!(status.success(), "the C program ended with {status}:\n{output_text}");

        let document = fs::read_to_string(root().join(DOCUMENT))?;
        let vectors = document.split_once("```vectors\n").and_then(|(_, rest)| rest.split_once("```"));
        let wanted: Vec<&str> = vectors.context("no vectors in the document")?.0.lines().collect();
        let printed: Vec<&str> = output_text.lines().collect();
        ensure!(wanted.len() == printed.len(), "{} lines printed, {} documented", printed.len(), wanted.len());
        for (want, print) in wanted.iter().zip(&printed) {
            let want = want.split_once(" | ").context("a vector without |")?.1;
            let same = want.split_whitespace().collect::<Vec<_>>() == print.split_whitespace().collect::<Vec<_>>();
            ensure!(same, "{target}: documented {want}\nprinted    {print}");
        }
        let elf = Elf::read(&program)?;
        let panics = elf.symbols(is_panic);
        ensure!(panics.is_empty(), "panics in the C program: {panics:?}");
        println!("C on {target}: {} vectors bit for bit, no panics linked", wanted.len());
        Ok(())
    }

    /// Symbols, link, stack and sizes of the core-only binary.
    fn check(&self) -> Result<()> {
        self.build(FIRMWARE, TARGET, "--bin gate_control")?;
        // With the compiler's own stack sizes.
        let line = format!("rustc --release --target {TARGET} --bin core_only -- -Zemit-stack-sizes");
        run(&mut self.cargo(FIRMWARE, &line)?)?;
        let (core, control) = (Elf::read(&self.elf("core_only"))?, Elf::read(&self.elf("gate_control"))?);
        for (what, gate) in GATES {
            let (found, seen) = (core.symbols(gate), control.symbols(gate));
            println!("{what}: {} in core_only, {} in gate_control", found.len(), seen.len());
            ensure!(found.is_empty(), "{what} in core_only: {found:?}");
            ensure!(!seen.is_empty(), "the check for {what} does not find them where they are");
        }
        let line = format!("build --release --target {TARGET} --bin core_only --features panics");
        let refused = refusal(&mut self.cargo(FIRMWARE, &line)?)?;
        ensure!(refused.contains("panic-never"), "a panicking core_only should not link: {refused}");
        println!("panic-never: core_only links, with a panic in it it does not");
        Self::sizes(&core)
    }

    /// The core-only binary on a target without a double-precision unit, perhaps without any.
    fn other_target(&self, target: &str) -> Result<()> {
        self.library(target)?;
        self.build(FIRMWARE, target, "--no-default-features --bin core_only --bin gate_control")?;
        let release = root().join(FIRMWARE).join("target").join(target).join("release");
        let (core, control) = (Elf::read(&release.join("core_only"))?, Elf::read(&release.join("gate_control"))?);
        // The third check, for square roots, would find them where there is no FPU.
        for (what, gate) in &GATES[..2] {
            let (found, seen) = (core.symbols(gate), control.symbols(gate));
            ensure!(found.is_empty(), "{target}: {what} in core_only: {found:?}");
            ensure!(!seen.is_empty(), "{target}: the check for {what} does not find them where they are");
        }
        println!("{target}: core_only links without panics or doubles in software; both seen in gate_control");
        Ok(())
    }

    /// The C library for a microcontroller without FPU, linked whole: its exports need no panic and no double.
    fn riscv(&self) -> Result<()> {
        self.library(RISCV)?;
        let (mut link, out) = self.riscv_link("", |_| true)?;
        run(&mut link)?;
        let elf = Elf::read(&out)?;
        let linked = elf.symbols(|name| name.starts_with("fingerpad_")).len();
        ensure!(linked > 20, "{RISCV}: only {linked} functions of the library were linked");
        let panics = elf.symbols(is_panic);
        let doubles = elf.symbols(|name| name.ends_with("df3") || name.ends_with("df2") || name.ends_with("sfdf2"));
        ensure!(panics.is_empty() && doubles.is_empty(), "{RISCV}: {panics:?} {doubles:?}");
        let refused = refusal(&mut self.riscv_link("--features panics", |_| true)?.0)?;
        ensure!(refused.contains("panic"), "{RISCV}: a library that panics should not link: {refused}");
        // Of a program that names nothing of tissue that relaxes.
        let (mut link, out) = self.riscv_link("", |name| !name.contains("relax"))?;
        run(&mut link)?;
        let relaxing = [elf.symbols(remembers).len(), Elf::read(&out)?.symbols(remembers).len()];
        ensure!(
            relaxing[0] > 0 && relaxing[1] == 0,
            "{RISCV}: steps of tissue that relaxes, with and without: {relaxing:?}"
        );
        let writable = elf.writable_bytes();
        ensure!(writable == 0, "{RISCV}: the C library has {writable} bytes that could change");
        println!(
            "{RISCV}: the C library links whole without panics, doubles in software or writable data, with a panic in it it does not; \
             steps of tissue that relaxes only where they are named"
        );
        Ok(())
    }

    /// Builds the C library; returns the command that links those of its exports that are wanted, and the file that this makes.
    fn riscv_link(&self, extra: &str, wanted: fn(&str) -> bool) -> Result<(Command, PathBuf)> {
        self.build(C_LIBRARY, RISCV, &format!("--lib {extra}"))?;
        let release = root().join(C_LIBRARY).join("target").join(RISCV).join("release");
        let out = release.join("fingerpad_c.elf");
        let header = fs::read_to_string(root().join(C_LIBRARY).join("fingerpad.h"))?;
        let mut linker = self.linker()?;
        linker.args(["-flavor", "gnu", "--gc-sections", "-e", "fingerpad_step"]);
        linker.args(exported(&header).iter().filter(|name| wanted(name)).flat_map(|name| ["-u", name]));
        linker.arg(release.join("libfingerpad_c.a")).arg("-o").arg(&out);
        Ok((linker, out))
    }

    /// Stack and code of a step within their bounds.
    fn sizes(elf: &Elf) -> Result<()> {
        let step = elf.function("one_step")?;
        let (stack, through) = elf.worst_stack(step)?;
        println!("step: {} bytes of code, {stack} bytes of stack ({})", elf.code_size(step), through.join(" > "));
        let model = fs::metadata(root().join(MODEL))?.len();
        let [state, forces] = STATE_BYTES;
        println!("tables: {model} bytes (the model file); state: {state} bytes, of forces alone {forces}");
        ensure!(
            elf.code_size(step) <= CODE_BOUND && stack <= STACK_BOUND,
            "over the bounds of {CODE_BOUND} and {STACK_BOUND} bytes"
        );
        Ok(())
    }
}

/// Most instructions of a call, by a part of its row's name. The step's bound is the number in docs/numbers.md; the others leave
/// 5 % to the compiler.
const INSTRUCTION_BOUNDS: [(&str, u32); 15] = [
    ("margin observer, a block", 40_000),
    ("margin observer, also the stick", 40_000),
    ("spin step, three branches", 3140),
    ("step, three branches", 1744),
    ("step M=4 default", 778),
    ("step_forces M=4", 497),
    ("spin step_forces M=4", 1088),
    ("step, retuned finger", 879),
    ("gradient", 1781),
    ("least_grip", 1189),
    ("step_driven by normal force", 6496),
    ("tuned", 83),
    ("calibration, work on a block", 4986),
    ("effects, none in the file", 1085),
    ("effects, all of them", 2609),
];
/// Most instructions of a step of the pad: a bounded number of rounds, each of bounded cost. The counter overflows
/// beyond 650 000.
const PAD_BOUND: u32 = 250_000;
/// The same for tissue that relaxes.
const RELAXING_PAD_BOUND: u32 = 280_000;
/// Most instructions of what frames add to a step.
const FRAMES_BOUND: u32 = 1530;
/// Most bytes of code and literals of a step, and of stack below it.
const CODE_BOUND: u64 = 3600;
const STACK_BOUND: u64 = 256;
/// Bytes of a state with and without the history of slip: four anchors of two words, 8 words for the plane, depth and strength factor,
/// and 11 for the reversals and limits.
const STATE_BYTES: [u32; 2] = [108, 64];

type Gate = fn(&str) -> bool;

/// Symbols that the core must not link.
const GATES: [(&str, Gate); 3] = [
    ("panics", is_panic),
    ("doubles in software", |name| {
        ["__aeabi_d", "__aeabi_f2d", "__aeabi_i2d", "__aeabi_ui2d", "__aeabi_l2d", "__aeabi_ul2d"]
            .iter()
            .any(|p| name.starts_with(p) && !name.starts_with("__aeabi_div"))
    }),
    ("square roots in software", |name| name == "sqrtf" || name.ends_with("::sqrtf")),
];

/// The functions that a header declares.
fn exported(header: &str) -> Vec<&str> {
    let declarations = header.lines().filter(|line| !line.starts_with("//") && !line.starts_with(" *"));
    let names = declarations.filter_map(|line| line.split_once('(')?.0.rsplit([' ', '*']).next());
    names.filter(|name| name.starts_with("fingerpad_")).collect()
}

/// Part of a step of a pad whose tissue relaxes.
fn remembers(name: &str) -> bool {
    name.contains("Pad") && name.contains("remember")
}

fn is_panic(name: &str) -> bool {
    name.contains("core::panicking") || name.contains("panic_fmt") || name.contains("unwrap_failed")
}
