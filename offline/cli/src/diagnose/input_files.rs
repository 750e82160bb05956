//! Files that `fingerpad diagnose` reads: measured runs with a bar, and each file's entry in the report.

use std::path::Path;

use fingerpad_diagnose::laws::own_law::OwnLaw;
use fingerpad_diagnose::{ColumnMap, FilePart, InputFile, LawsFile, RunSet, SessionFile, runs_csv};
use fingerpad_formats as formats;
use sha2::{Digest, Sha256};

use crate::progress::bar;
use crate::{Failure, go_on};

/// Measured runs from a file, with a bar.
pub fn read_mapped(path: &Path, map: &ColumnMap) -> Result<RunSet, Failure> {
    Ok(read_union(&[SessionFile::first(path)], map)?.0)
}

/// Measured runs from the files of a session, with a bar.
pub fn read_union(files: &[SessionFile], map: &ColumnMap) -> Result<(RunSet, Vec<FilePart>), Failure> {
    let bar = bar("reading".into());
    let result = runs_csv::read_union(files, map, &mut |share| {
        bar.set_share(share);
        go_on().is_continue()
    });
    bar.finish_and_clear();
    result.map_err(|e| match e {
        runs_csv::ReadError::Interrupted => Failure::Interrupted("nothing was written".into()),
        runs_csv::ReadError::Csv(e) => Failure::Input(e.into()),
        runs_csv::ReadError::Run(e) => Failure::Input(e.into()),
    })
}

/// Name of a file without its folder.
fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A file of runs among the report's inputs.
pub fn input(role: &str, set: &RunSet) -> InputFile {
    InputFile {
        role: role.into(),
        file: file_name(&set.path),
        sha256: set.sha256.clone(),
        rows: set.rows_read,
        runs: set.runs_read,
        notes: set.notes.clone(),
    }
}

/// The files of the measured runs among the report's inputs.
pub fn measured_inputs(set: &RunSet, parts: &[FilePart]) -> Vec<InputFile> {
    let of = |(i, part): (usize, &FilePart)| InputFile {
        role: if i == 0 { "measured" } else { "appended" }.into(),
        file: file_name(&part.path),
        sha256: part.sha256.clone(),
        rows: part.rows_read,
        runs: part.runs_read,
        notes: if i == 0 { set.notes.clone() } else { Vec::new() },
    };
    parts.iter().enumerate().map(of).collect()
}

/// The file of laws among the report's inputs.
pub fn laws_input(path: &Path, laws: &LawsFile) -> InputFile {
    let note = |own: &OwnLaw| format!("{} acts on {}: {}", own.law.name, own.target.name(), own.text);
    InputFile {
        role: "laws".into(),
        file: file_name(path),
        sha256: laws.sha256.clone(),
        rows: 0,
        runs: 0,
        notes: laws.laws.iter().map(note).collect(),
    }
}

/// A trace of forces among the report's inputs; `notes` are the sentences of its page.
pub fn trace_input(path: &Path, rows: usize, runs: usize, notes: &[String]) -> Result<InputFile, Failure> {
    let bytes = std::fs::read(path).map_err(|source| formats::Error::File { path: path.to_path_buf(), source })?;
    Ok(InputFile {
        role: "measured".into(),
        file: file_name(path),
        sha256: Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect(),
        rows,
        runs,
        notes: notes.to_vec(),
    })
}
