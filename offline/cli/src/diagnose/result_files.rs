//! Files that `fingerpad diagnose` writes.

use std::path::Path;

use fingerpad_diagnose::{Diagnosis, Evidence, NextExperiment, ReducedDiagnosis, Verdict};
use fingerpad_formats as formats;
use fingerpad_report as report;

use super::arguments::Args;
use super::input_files::trace_input;
use crate::{Failure, Mark, Outputs, diagnose_table, results};

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
    diagnose_table::CORRECTED_CONFIG,
    diagnose_table::CORRECTED_SHAPE,
    diagnose_table::CORRECTED_TABLE,
    diagnose_table::SIDE_BY_SIDE,
];

/// Where report.json goes, if not among the other results.
fn elsewhere(args: &Args) -> Option<&Path> {
    args.report.as_deref().filter(|path| **path != args.out().join(JSON))
}

/// The report of the earlier diagnosis in the same place.
pub fn earlier(args: &Args) -> Option<Diagnosis> {
    let json = elsewhere(args).map_or_else(|| args.out().join(JSON), Path::to_path_buf);
    std::fs::read(json).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok())
}

/// Checks the files of the command and makes its folders.
pub fn prepare(args: &Args, folders: &[&Path]) -> Result<(), Failure> {
    let config = args.finger.config()?;
    let given = [
        ("--calibration", &args.calibration),
        ("--holdout", &args.holdout),
        ("--model", &args.model),
        ("--laws", &args.laws),
        ("--table", &args.table),
    ];
    let inputs = given.map(|(flag, path)| (flag, path.as_deref()));
    let measured = args.measured.iter().map(|path| ("--measured", Some(path.as_path())));
    let measured = measured.chain(args.append.iter().map(|path| ("--append", Some(path.as_path()))));
    let mut outputs = Outputs::beside(inputs.into_iter().chain(measured).chain(args.finger.inputs(&config))).file(
        "--report",
        elsewhere(args),
        vec![Mark::holding("{", "\"fingerpad-diagnosis/")],
    );
    for folder in folders {
        outputs = outputs.shared_folder("--out", folder, NAMES);
    }
    outputs.prepare()
}

/// Writes a diagnosis of forces alone.
pub fn write_reduced(
    args: &Args,
    path: &Path,
    out: &Path,
    mut found: ReducedDiagnosis,
    rows: usize,
) -> Result<(), Failure> {
    found.report.input = vec![trace_input(path, rows, found.report.holdout.runs, &found.sentences)?];
    found.report.seed = args.seed;
    let rendered = report::diagnosis::render_reduced(&found).map_err(|e| Failure::Numerics(e.into()))?;
    write_files(args, out, rendered, found.report.next_experiment.as_ref(), Vec::new())?;
    for (kind, text) in report::diagnosis::cautions(&found.report) {
        println!("{kind}: {}: {text}", path.display());
    }
    let only = if found.report.verdict == Verdict::None { " (of a tare; nothing else was looked for)" } else { "" };
    println!("{}: verdict: {}{only}", path.display(), report::diagnosis::word(&found.report));
    found.sentences.iter().for_each(|s| println!("{s}"));
    println!("Next: {}", found.report.next_step);
    Ok(())
}

/// Writes a diagnosis of measured runs, with the corrected model.
pub fn write(args: &Args, report: &Diagnosis, evidence: &Evidence, model: Option<&[u8]>) -> Result<(), Failure> {
    let rendered = report::diagnosis::render(report, evidence).map_err(|e| Failure::Numerics(e.into()))?;
    let plan = report.next_experiment.as_ref().filter(|_| report.verdict == Verdict::Ambiguous);
    let model = model.map(|bytes| (CORRECTED.to_owned(), bytes.to_vec()));
    write_files(args, args.out(), rendered, plan, model.into_iter().collect())
}

/// Writes a diagnosis in place of the folder's earlier one, the page last.
pub fn write_files(
    args: &Args,
    out: &Path,
    rendered: report::Rendered,
    plan: Option<&NextExperiment>,
    beside: Vec<(String, Vec<u8>)>,
) -> Result<(), Failure> {
    let mut files: Vec<_> = rendered.figures.iter().map(report::Picture::file).collect();
    files.extend(beside);
    files.extend(plan.map(|plan| (NEXT.to_owned(), report::diagnosis::plan_csv(plan).into_bytes())));
    match elsewhere(args) {
        Some(json) => formats::atomic_write(json, |w| w.write_all(rendered.json.as_bytes()))?,
        None => files.push((JSON.to_owned(), rendered.json.into_bytes())),
    }
    files.push((PAGE.to_owned(), rendered.html.into_bytes()));
    results::write(out, &files)
}
