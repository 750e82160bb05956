//! Files that `fingerpad diagnose` writes.

use std::path::Path;

use fingerpad_diagnose::{Diagnosis, NextExperiment};
use fingerpad_formats as formats;
use fingerpad_report as report;

use super::arguments::Output;
use super::table;
use crate::{Failure, Mark, Outputs, results};

/// The corrected model.
pub const CORRECTED: &str = "corrected.fpm";
const NEXT: &str = "next_experiment.csv";
const JSON: &str = "report.json";
const PAGE: &str = "report.html";
/// All files of a diagnosis, the pictures included.
const NAMES: &[&str] = &[
    CORRECTED,
    NEXT,
    JSON,
    PAGE,
    "map_before.svg",
    "map_after.svg",
    "traces.svg",
    "driver_1.svg",
    "driver_2.svg",
    "driver_3.svg",
    "driver_4.svg",
    "evidence.svg",
    "heldout.svg",
    "confirmation.svg",
    "stability.svg",
    "forces.svg",
    "table.svg",
    "candidates.svg",
    table::CORRECTED_CONFIG,
    table::CORRECTED_SHAPE,
    table::CORRECTED_TABLE,
    table::SIDE_BY_SIDE,
];

/// Where report.json goes, if not among the other results.
fn elsewhere(output: &Output) -> Option<&Path> {
    output.report.as_deref().filter(|path| **path != output.out.join(JSON))
}

/// The report of the earlier diagnosis in the same place.
pub fn earlier(output: &Output) -> Option<Diagnosis> {
    let json = elsewhere(output).map_or_else(|| output.out.join(JSON), Path::to_path_buf);
    std::fs::read(json).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok())
}

/// Checks the files of the command and makes its folders.
///
/// * `inputs`: each with its option
pub fn prepare<'a>(
    output: &Output,
    inputs: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>,
    folders: &[&Path],
) -> Result<(), Failure> {
    let marks = vec![Mark::holding("{", "\"fingerpad-diagnosis/")];
    let mut outputs = Outputs::beside(inputs).file("--report", elsewhere(output), marks);
    for folder in folders {
        outputs = outputs.shared_folder("--out", folder, NAMES);
    }
    outputs.prepare()
}

/// Writes a diagnosis in place of the folder's earlier one, the page last.
pub fn write_files(
    output: &Output,
    rendered: report::Rendered,
    plan: Option<&NextExperiment>,
    beside: Vec<(String, Vec<u8>)>,
) -> Result<(), Failure> {
    let mut files: Vec<_> = rendered.figures.iter().map(report::Picture::file).collect();
    files.extend(beside);
    files.extend(plan.map(|plan| (NEXT.to_owned(), report::diagnosis::plan_csv(plan).into_bytes())));
    match elsewhere(output) {
        Some(json) => formats::atomic_write(json, |w| w.write_all(rendered.json.as_bytes()))?,
        None => files.push((JSON.to_owned(), rendered.json.into_bytes())),
    }
    files.push((PAGE.to_owned(), rendered.html.into_bytes()));
    results::write(&output.out, &files)
}
