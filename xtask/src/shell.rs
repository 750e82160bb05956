//! Commands of the chores: built from a line of words, printed, run in a folder of the repository.
//!
//! Main functions: [`command`], [`run`], [`sh`], [`output`]. Uses nothing else of this program.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result, ensure};

/// Variables of the build that started this chore, which must not change other builds.
const NOT_INHERITED: [&str; 4] = ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR"];

/// The repository's root.
pub fn root() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.canonicalize().unwrap_or(root)
}

/// A command in a folder of the repository, from a line of words separated by spaces.
pub fn command(folder: impl AsRef<Path>, line: &str) -> Command {
    let mut words = line.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or_default());
    command.current_dir(root().join(folder)).args(words);
    for name in NOT_INHERITED {
        command.env_remove(name);
    }
    command
}

/// A program by its file, run in the repository's root.
pub fn at_root(program: impl AsRef<Path>) -> Command {
    let mut command = Command::new(program.as_ref());
    command.current_dir(root());
    command
}

/// Runs a command line in a folder of the repository.
pub fn sh(folder: impl AsRef<Path>, line: &str) -> Result<()> {
    run(&mut command(folder, line))
}

/// Prints a command, runs it, and fails if it does.
pub fn run(command: &mut Command) -> Result<()> {
    println!("+ {}", shown(command));
    let status = command.status().with_context(|| shown(command))?;
    ensure!(status.success(), "`{}` ended with {status}", shown(command));
    Ok(())
}

/// What a command prints, if it ends well.
pub fn output(command: &mut Command) -> Result<String> {
    let out = finished(command)?;
    ensure!(out.status.success(), "`{}` ended with {}:\n{}", shown(command), out.status, both(&out));
    Ok(String::from_utf8(out.stdout)?)
}

/// What a command prints to both outputs, in one line of single spaces, if it fails as it should.
pub fn refusal(command: &mut Command) -> Result<String> {
    let out = finished(command)?;
    ensure!(!out.status.success(), "`{}` should have failed", shown(command));
    Ok(both(&out).split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Whether a command is there and ends well.
pub fn succeeds(command: &mut Command) -> bool {
    finished(command).is_ok_and(|out| out.status.success())
}

fn finished(command: &mut Command) -> Result<Output> {
    command.stdin(Stdio::null()).output().with_context(|| shown(command))
}

fn both(out: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr))
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
