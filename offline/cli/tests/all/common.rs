//! A temporary folder with files of a user, and the program run in it.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

pub const MEASURED: &str = include_str!("../../data/examples/measured.csv");
pub const CALIBRATION: &str = include_str!("../../data/examples/calibration.csv");
pub const HOLDOUT: &str = include_str!("../../data/examples/holdout.csv");
/// The cheapest finger to simulate.
pub const COARSE: &str = "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n";

/// The folder of the package.
pub fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A temporary folder. Command lines are words separated by spaces, without the name of the program.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// With files: name and text.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self::new();
        files.iter().for_each(|(name, text)| folder.write(name, text));
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file; its folder is made.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    pub fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.bytes(name)).unwrap()
    }

    /// Names and contents of a file, or of all files in a folder.
    pub fn contents(&self, name: &str) -> BTreeMap<String, Vec<u8>> {
        match self.path(name).is_dir() {
            true => self.names(name).iter().flat_map(|inner| self.contents(&format!("{name}/{inner}"))).collect(),
            false => fs::read(self.path(name)).map(|bytes| (name.to_owned(), bytes)).into_iter().collect(),
        }
    }

    /// Cells of a column of a CSV file.
    pub fn cells(&self, file: &str, column: &str) -> Vec<String> {
        let text = self.text(file);
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        let at = header.split(',').position(|h| h == column).unwrap_or_else(|| panic!("no {column} in {header}"));
        lines.map(|line| line.split(',').nth(at).unwrap().to_owned()).collect()
    }

    /// The same as numbers; an empty cell is NaN.
    pub fn column(&self, file: &str, column: &str) -> Vec<f64> {
        self.cells(file, column).iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    }

    pub fn last(&self, file: &str, column: &str) -> f64 {
        *self.column(file, column).last().unwrap()
    }

    /// Sorted names of the files in a folder inside; empty if it is absent.
    pub fn names(&self, inside: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(inside)).into_iter().flatten();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The program with its arguments, both output streams piped.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fingerpad"));
        command.args(line.split_whitespace()).current_dir(self.0.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs to the end: exit code, standard output, standard error.
    pub fn run(&self, line: &str) -> (Option<i32>, String, String) {
        ended(self.command(line).spawn().unwrap())
    }

    /// The same of a process that the system ends after that many seconds of CPU time, which other processes do not change.
    #[cfg(unix)]
    pub fn run_limited(&self, line: &str, cpu_s: u32) -> (Option<i32>, String, String) {
        let limited = format!("ulimit -t {cpu_s}; exec '{}' {line}", env!("CARGO_BIN_EXE_fingerpad"));
        let mut shell = Command::new("sh");
        shell.args(["-c", &limited]).current_dir(self.0.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
        ended(shell.spawn().unwrap())
    }

    #[cfg(not(unix))]
    pub fn run_limited(&self, line: &str, _cpu_s: u32) -> (Option<i32>, String, String) {
        self.run(line)
    }

    /// Runs with a text on standard input.
    pub fn piped(&self, line: &str, text: &str) -> (Option<i32>, String, String) {
        let mut child = self.command(line).stdin(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        ended(child)
    }

    /// Runs and expects exit code 0; standard output and standard error.
    pub fn done(&self, line: &str) -> (String, String) {
        let (code, stdout, stderr) = self.run(line);
        assert_eq!(code, Some(0), "{line}: {stdout}{stderr}");
        (stdout, stderr)
    }

    /// Runs and expects exit code 2 and every text of `expected` on standard error.
    pub fn refused(&self, line: &str, expected: &[&str]) {
        let (code, _, stderr) = self.run(line);
        assert_eq!(code, Some(2), "{line}: {stderr}");
        for part in expected {
            assert!(stderr.contains(part), "{line}: no `{part}` in: {stderr}");
        }
    }
}

/// Waits for the end of a process: exit code, standard output, standard error.
pub fn ended(child: Child) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = child.wait_with_output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (status.code(), text(stdout), text(stderr))
}

/// Sends a signal to a process.
pub fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// A file of the package; one that ends in `.gz` is unpacked.
pub fn packaged(name: &str) -> Vec<u8> {
    let bytes = fs::read(package().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut unpacked = Vec::new();
    match name.ends_with(".gz") {
        true => flate2::read::GzDecoder::new(&bytes[..]).read_to_end(&mut unpacked).map(|_| unpacked).unwrap(),
        false => bytes,
    }
}

/// A stored set of runs of the finite-element finger.
pub fn fe_set(name: &str) -> String {
    String::from_utf8(packaged(&format!("tests/fe_sets/{name}.csv.gz"))).unwrap()
}

/// A table with another value in each cell of some columns.
pub fn changed(text: &str, columns: &[&str], of: impl Fn(f64) -> f64) -> String {
    let (header, rows) = text.split_once('\n').unwrap();
    let names: Vec<&str> = header.split(',').collect();
    assert!(columns.iter().all(|column| names.contains(column)), "{columns:?}");
    let cell = |(cell, name): (&str, &&str)| match columns.contains(name) {
        true => of(cell.parse().unwrap()).to_string(),
        false => cell.to_owned(),
    };
    let row = |row: &str| row.split(',').zip(&names).map(cell).collect::<Vec<_>>().join(",") + "\n";
    format!("{header}\n") + &rows.lines().map(row).collect::<String>()
}
