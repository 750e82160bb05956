//! Nanoseconds of a contact's step in every language, in one run over a clean and a disturbed path, and their ratio to
//! Rust's.
//!
//! Main function: [`main`]. A language is a [`Row`]: a program, built outside the repository, that reads the path from
//! standard input and prints `call ns` lines (`step`, `spin_step`). The programs alternate, and the fastest of their
//! rounds counts.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::shell::{command, root, run};
use crate::thumb::tools::C_LIBRARY;
use crate::{binding, c, fmu};

const MODEL: &str = "data/models/fingertip.fpm";
/// Paths, and their names in the table.
const PATHS: [(&str, &str); 2] = [("clean.txt", "clean"), ("disturbed.txt", "disturbed")];
const CALLS: [&str; 2] = ["step", "spin_step"];
const ROUNDS: usize = 3;

/// A language: its name, and its program's command for each of [`PATHS`].
struct Row {
    name: &'static str,
    commands: [Command; 2],
    /// Least time of each call on each path, ns.
    least_ns: [[Option<f64>; 2]; 2],
}

/// Inputs of the builds.
struct Setup {
    folder: PathBuf,
    model: PathBuf,
}

/// Builds all programs, runs them in turn, prints the table.
pub fn main() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let setup = Setup { folder: folder.path().to_owned(), model: fs::canonicalize(root().join(MODEL))? };
    run(rust("paths", &setup).arg(&setup.folder))?;
    let python = binding::bench_path(&setup.model)?;
    let mut rows = vec![
        Row::over_paths("Rust", || Ok(rust("one", &setup)))?,
        Row::over_paths("Rust, batch of 4096", || Ok(rust("batch", &setup)))?,
        Row::over_paths("C", || c(&setup))?,
        Row::over_paths("Python, batch of 4096", || Ok(again(&python)))?,
        Row::over_paths("FMU (inputs set, forces read)", || fmu(&setup))?,
        // A held object in place of the path: geometry, forces on both bodies, trial and step taken.
        Row::held("MuJoCo plugin, held object", "fingerpad")?,
        Row::held("MuJoCo's own contact, the same", "best")?,
    ];
    for round in 1..=ROUNDS {
        println!("round {round} of {ROUNDS}");
        for row in &mut rows {
            row.measure(&setup.folder)?;
        }
    }
    print(&rows);
    Ok(())
}

impl Row {
    fn over_paths(name: &'static str, build: impl Fn() -> Result<Command>) -> Result<Self> {
        let command = build()?;
        Ok(Self { name, commands: [again(&command), command], least_ns: [[None; 2]; 2] })
    }

    /// A held object; shaken where the path would be disturbed.
    fn held(name: &'static str, contact: &str) -> Result<Self> {
        let still = binding::contact_ns(contact)?;
        let mut shaken = again(&still);
        shaken.arg("--shaken");
        Ok(Self { name, commands: [still, shaken], least_ns: [[None; 2]; 2] })
    }

    fn measure(&mut self, folder: &Path) -> Result<()> {
        for ((command, least), (path, _)) in self.commands.iter_mut().zip(&mut self.least_ns).zip(PATHS) {
            let out = command.stdin(File::open(folder.join(path))?).output()?;
            ensure!(out.status.success(), "{}: {}", self.name, String::from_utf8_lossy(&out.stderr));
            let printed = String::from_utf8(out.stdout)?;
            for (least, call) in least.iter_mut().zip(CALLS) {
                let line = printed.lines().find_map(|line| line.strip_prefix(call)?.strip_prefix(' '));
                let ns: Option<f64> = line.map(|ns| ns.trim().parse()).transpose().with_context(|| printed.clone())?;
                *least = ns.map(|ns| least.map_or(ns, |before| before.min(ns)));
            }
        }
        Ok(())
    }
}

/// The same program, words, folder and environment once more.
fn again(command: &Command) -> Command {
    let mut other = Command::new(command.get_program());
    other.args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => other.env(name, value),
            None => other.env_remove(name),
        };
    }
    if let Some(folder) = command.get_current_dir() {
        other.current_dir(folder);
    }
    other
}

/// Rust's program, which also writes the paths.
fn rust(what: &str, setup: &Setup) -> Command {
    let mut cargo =
        command(C_LIBRARY, &format!("cargo run --quiet --release --package fingerpad-story --bin bench -- {what}"));
    cargo.arg(&setup.model);
    cargo
}

fn c(setup: &Setup) -> Result<Command> {
    c::prepare()?;
    let program = setup.folder.join("c");
    let mut gcc = command(C_LIBRARY, "gcc -std=c99 -O2 -I. consumer/bench.c -o");
    run(gcc.arg(&program).arg(c::library()?).arg("-lm"))?;
    let mut command = Command::new(program);
    command.arg(&setup.model);
    Ok(command)
}

fn fmu(setup: &Setup) -> Result<Command> {
    let (fmu, program) = (setup.folder.join("finger.fmu"), setup.folder.join("fmu"));
    fmu::export("fmu", &setup.model, &fmu)?;
    let unpacked = fmu::unpack(Path::new("python3"), &fmu, &setup.folder.join("unpacked"))?;
    let gcc = format!("gcc -std=c99 -O2 -I bindings/fmu/fmi {}/bench.c -ldl -o", fmu::CHECKS);
    run(command(".", &gcc).arg(&program))?;
    let description = fs::read_to_string(unpacked.join("modelDescription.xml"))?;
    let token = description.split("instantiationToken=\"").nth(1).and_then(|rest| rest.split('"').next());
    let platform = fs::read_dir(unpacked.join("binaries"))?.next().context("an FMU without binaries")??.path();
    let binary = fs::read_dir(platform)?.next().context("an FMU without a binary")??.path();
    let mut command = Command::new(program);
    command.arg(binary).arg(token.context("no token")?).arg(unpacked.join("resources"));
    Ok(command)
}

/// The table: for each path, a step without spin and one with it; each beside its ratio to the first row's.
fn print(rows: &[Row]) {
    let heads = PATHS.iter().flat_map(|(_, path)| [format!("{path}, slides"), format!("{path}, spins")]);
    println!("\n| ns a contact's step |{}", heads.map(|head| format!(" {head} | x Rust |")).collect::<String>());
    println!("|---|{}", "---:|".repeat(8));
    for row in rows {
        let times = row.least_ns.iter().flatten().zip(rows[0].least_ns.iter().flatten());
        let cells = times.map(|(time, rust)| match (time, rust) {
            (Some(time), Some(rust)) => format!(" {time:.1} | {:.2} |", time / rust),
            _ => " | |".to_owned(),
        });
        println!("| {} |{}", row.name, cells.collect::<String>());
    }
}
