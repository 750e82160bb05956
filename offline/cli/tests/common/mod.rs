//! The program under test, as every test of the command line runs it.

pub mod charged;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The program with its arguments, in a folder, both streams piped.
pub fn fingerpad(arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fingerpad"));
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs to the end: exit code, standard output, standard error.
pub fn run(arguments: &[&str], folder: &Path) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = fingerpad(arguments, folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (status.code(), text(stdout), text(stderr))
}

/// Runs and expects exit code 2 and every text of `expected` on stderr.
pub fn refused(arguments: &[&str], folder: &Path, expected: &[&str]) {
    let (code, _, stderr) = run(arguments, folder);
    assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
    for part in expected {
        assert!(stderr.contains(part), "{arguments:?}: no `{part}` in: {stderr}");
    }
}

/// Writes a file into a folder.
pub fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}
