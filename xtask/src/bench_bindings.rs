//! Nanoseconds of a step in every language, in one run over one path, and how many times Rust's they are.
//!
//! Main function: [`main`]. A language is a line of [`ROWS`]: a function that builds its program outside the repository and
//! returns the command that reads the path from standard input and prints `call ns` lines (`step`, `spin_step`).

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::thumb::tools::{C_LIBRARY, cargo_command};
use crate::{c_release, c_test, fmu_test, mujoco, root, run, web};

const MODEL: &str = "data/models/fingertip.fpm";
const CALLS: [&str; 2] = ["step", "spin_step"];

/// What a language's program is built from.
struct Setup {
    folder: PathBuf,
    model: PathBuf,
    path: PathBuf,
}

/// The languages beside Rust, by name.
const ROWS: [(&str, fn(&Setup) -> Result<Command>); 5] = [
    ("C", c),
    ("FMU (inputs set, forces read)", fmu),
    // With pose and the skin's laws in every step.
    ("the page's module in V8", |_| web::bench_path()),
    // A held object in place of the path: geometry, forces on both bodies, trial and step taken.
    ("MuJoCo plugin, held object", |_| mujoco::contact_ns("fingerpad")),
    ("MuJoCo's own contact, the same", |_| mujoco::contact_ns("best")),
];

/// Runs Rust and all languages, prints the table.
pub fn main() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let setup = Setup {
        folder: folder.path().to_owned(),
        model: fs::canonicalize(root().join(MODEL))?,
        path: folder.path().join("path.txt"),
    };
    let commands = ROWS.map(|(name, build)| Ok((name, build(&setup)?))).into_iter().collect::<Result<Vec<_>>>()?;
    let rust = run_rust(&setup)?;
    println!("\n{:<32} {:>9} {:>7} {:>9} {:>7}", "ns a contact step", "slides", "x Rust", "and spins", "x Rust");
    print_row("Rust", &rust, &rust);
    for (name, mut command) in commands {
        let out = command.stdin(File::open(&setup.path)?).output()?;
        ensure!(out.status.success(), "{name}: {}", String::from_utf8_lossy(&out.stderr));
        print_row(name, &times(&String::from_utf8(out.stdout)?)?, &rust);
    }
    Ok(())
}

/// Rust's own times; writes the path.
fn run_rust(setup: &Setup) -> Result<[Option<f64>; 2]> {
    let mut cargo = cargo_command();
    cargo.current_dir(root().join(C_LIBRARY)).args(["run", "--quiet", "--release", "--package", "fingerpad-story"]);
    let out = cargo.args(["--bin", "bench", "--"]).arg(&setup.model).arg(&setup.path).output()?;
    ensure!(out.status.success(), "Rust: {}", String::from_utf8_lossy(&out.stderr));
    times(&String::from_utf8(out.stdout)?)
}

fn c(setup: &Setup) -> Result<Command> {
    c_test::prepare()?;
    let release = setup.folder.join("fingerpad-c");
    c_release::release(&release)?;
    let (source, program) = (root().join(C_LIBRARY).join("consumer"), setup.folder.join("c"));
    let mut gcc = Command::new("gcc");
    gcc.args(["-std=c99", "-O2", "-I"]).arg(release.join("include")).arg(source.join("bench.c"));
    gcc.arg(release.join("lib/fingerpad").join(c_release::host()?).join("libfingerpad.a"));
    run(gcc.arg("-o").arg(&program))?;
    let mut command = Command::new(program);
    command.arg(&setup.model);
    Ok(command)
}

fn fmu(setup: &Setup) -> Result<Command> {
    let (fmu, program) = (setup.folder.join("finger.fmu"), setup.folder.join("fmu"));
    fmu_test::export(&setup.model, &fmu)?;
    let unpacked = fmu_test::unpack(Path::new("python3"), &fmu, &setup.folder.join("unpacked"))?;
    let mut gcc = Command::new("gcc");
    gcc.args(["-std=c99", "-O2", "-I"]).arg(root().join("bindings/fmu/fmi"));
    run(gcc.arg(root().join(fmu_test::CHECKS).join("bench.c")).args(["-ldl", "-o"]).arg(&program))?;
    let description = fs::read_to_string(unpacked.join("modelDescription.xml"))?;
    let token = description.split("instantiationToken=\"").nth(1).and_then(|rest| rest.split('"').next());
    let platform = fs::read_dir(unpacked.join("binaries"))?.next().context("an FMU without binaries")??.path();
    let binary = fs::read_dir(platform)?.next().context("an FMU without a binary")??.path();
    let mut command = Command::new(program);
    command.arg(binary).arg(token.context("no token")?).arg(unpacked.join("resources"));
    Ok(command)
}

/// The times of the calls that a program has.
fn times(says: &str) -> Result<[Option<f64>; 2]> {
    let found = CALLS.map(|call| {
        let line = says.lines().find_map(|line| line.strip_prefix(call)?.strip_prefix(' '));
        line.map(|ns| ns.trim().parse().with_context(|| format!("not understood: {says}"))).transpose()
    });
    let [step, spin_step] = found;
    Ok([step?, spin_step?])
}

fn print_row(name: &str, times: &[Option<f64>; 2], rust: &[Option<f64>; 2]) {
    let columns: String = times
        .iter()
        .zip(rust)
        .map(|(time, rust)| match (time, rust) {
            (Some(time), Some(rust)) => format!(" {time:>9.1} {:>7.2}", time / rust),
            _ => format!(" {:>9} {:>7}", "", ""),
        })
        .collect();
    println!("{name:<32}{columns}");
}
