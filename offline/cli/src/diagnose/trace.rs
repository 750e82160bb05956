//! `fingerpad diagnose trace`: forces alone.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad_diagnose::{LawsFile, Verdict, diagnose_forces, trace_csv};
use fingerpad_report as report;

use super::arguments::{Output, TraceArgs};
use super::input_files::trace_input;
use super::result_files::{prepare, write_files};
use crate::Failure;
use crate::progress::during;

/// Diagnoses traces of forces alone; each of several goes into a folder of its own.
pub fn run(args: &TraceArgs) -> Result<(), Failure> {
    let several = args.files.len() > 1;
    if several && args.output.report.is_some() {
        return Err(Failure::Input(anyhow!("--report: one file for several traces; each has its own in --out")));
    }
    let output = |path: &PathBuf| {
        let out = &args.output.out;
        let out = if several { out.join(path.file_stem().unwrap_or_default()) } else { out.clone() };
        Output { out, report: args.output.report.clone() }
    };
    let outputs: Vec<Output> = args.files.iter().map(output).collect();
    for (i, Output { out, .. }) in outputs.iter().enumerate() {
        if let Some(k) = outputs[..i].iter().position(|other| other.out == *out) {
            let [a, b] = [k, i].map(|n| args.files[n].display());
            return Err(Failure::Input(anyhow!("{a} and {b}: the results of both would go to {}", out.display())));
        }
    }
    let folders: Vec<&Path> = outputs.iter().map(|output| output.out.as_path()).collect();
    prepare(&args.output, args.files.iter().map(|path| ("--measured", Some(path.as_path()))), &folders)?;
    let map = args.sensor.column_map(&args.columns, &LawsFile::default(), "measured")?;
    for (path, output) in args.files.iter().zip(&outputs) {
        let trace = trace_csv::read(path, &map)?;
        let mut found = during("forces", |_| diagnose_forces(&trace, args.alpha));
        found.report.input = vec![trace_input(path, trace.rows.len(), found.report.holdout.runs, &found.sentences)?];
        let rendered = report::diagnosis::render_reduced(&found).map_err(|e| Failure::Numerics(e.into()))?;
        write_files(output, rendered, found.report.next_experiment.as_ref(), Vec::new())?;
        for (kind, text) in report::diagnosis::cautions(&found.report) {
            println!("{kind}: {}: {text}", path.display());
        }
        let only = if found.report.verdict == Verdict::None { " (of a tare; nothing else was looked for)" } else { "" };
        println!("{}: verdict: {}{only}", path.display(), report::diagnosis::word(&found.report));
        found.sentences.iter().for_each(|s| println!("{s}"));
        println!("Next: {}", found.report.next_step);
    }
    Ok(())
}
