//! `fingerpad diagnose`: which effect is missing from the model, by measured runs.

mod arguments;
mod check;
mod group;
mod input_files;
mod repeated;
mod result_files;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::anyhow;
use fingerpad::build::Data;
use fingerpad_diagnose::laws::{Column, run_columns::template};
use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, ColumnMap, CovariateError, DiagnoseError, Diagnosis, Evidence, IMPLAUSIBLE, InputFile, LawsFile,
    Options, PowerSettings, Redecision, SelectionSettings, SessionFile, corrected_model, diagnose, diagnose_forces,
    next_step, preflight_report,
};
use fingerpad_formats as formats;
use fingerpad_report as report;
use fingerpad_smooth::ReferenceCurves;

use super::{Failure, diagnose_table, progress::during};
pub use arguments::Args;
pub use input_files::read_mapped;
use input_files::{input, laws_input, measured_inputs, read_union};
use result_files::{CORRECTED, earlier, prepare, write, write_files, write_reduced};

impl From<DiagnoseError> for Failure {
    fn from(error: DiagnoseError) -> Self {
        Self::Input(error.into())
    }
}

/// A verdict with the laws of its candidates.
fn verdict_in_words(report: &Diagnosis) -> String {
    let laws = report.effects.iter().map(|effect| match &effect.candidates[..] {
        [] | [_] => effect.law.replace('_', " "),
        all => all.iter().map(|c| c.law.replace('_', " ")).collect::<Vec<_>>().join(" or "),
    });
    let laws: Vec<String> = laws.collect();
    let word = report::diagnosis::word(report);
    if laws.is_empty() { word.to_string() } else { format!("{word} ({})", laws.join("; ")) }
}

/// How the verdict compares with that of the folder's last report, which is that of fewer runs of the same files.
fn progress_since(before: &Diagnosis, now: &Diagnosis) -> Option<String> {
    let runs = |report: &Diagnosis| -> usize {
        report.input.iter().filter(|i| i.role == "measured" || i.role == "appended").map(|i| i.runs).sum()
    };
    let hashes = |report: &Diagnosis| -> Vec<String> { report.input.iter().map(|i| i.sha256.clone()).collect() };
    let (earlier, later) = (hashes(before), hashes(now));
    let joined = runs(now).checked_sub(runs(before)).filter(|joined| *joined > 0)?;
    earlier.iter().all(|hash| later.contains(hash)).then(|| {
        format!("With {joined} more measured runs: {} became {}.", verdict_in_words(before), verdict_in_words(now))
    })
}

/// Diagnoses a table against the finite elements.
fn table(args: &Args, path: &Path) -> Result<(), Failure> {
    let names = diagnose_table::names(args.map.as_deref(), args.unit.as_deref())?;
    prepare(args, &[args.out()])?;
    let made = diagnose_table::diagnose(&args.finger, path, &names, args.seed, args.out())?;
    let diagnosis = &made.finding.report.diagnosis;
    let plan = diagnosis.next_experiment.as_ref();
    write_files(args, args.out(), made.rendered, plan, made.files)?;
    println!("{}: verdict: {}", path.display(), report::diagnosis::word(diagnosis));
    made.finding.sentences.iter().for_each(|s| println!("{s}"));
    Ok(())
}

/// Says what was understood of the files and what they can test.
fn check(
    calibration: &Path,
    measured: &[SessionFile],
    [calibration_map, map]: [&ColumnMap; 2],
    laws: &LawsFile,
) -> Result<(), Failure> {
    let sets =
        [("calibration", read_mapped(calibration, calibration_map)?), ("measured", read_union(measured, map)?.0)];
    for (role, set) in &sets {
        println!("{role}: {}: {} runs, {} rows", set.path.display(), set.runs_read, set.rows_read);
        set.notes.iter().for_each(|note| println!("  {note}"));
    }
    let [(_, calibration), (_, measured)] = &sets;
    preflight_report(calibration, measured, laws)?.iter().for_each(|line| println!("{line}"));
    Ok(())
}

/// Diagnoses traces of forces alone; each of several goes into a folder of its own.
fn forces(args: &Args) -> Result<(), Failure> {
    let several = args.measured.len() > 1;
    if several && args.report.is_some() {
        return Err(Failure::Input(anyhow!("--report: one file for several traces; each has its own in --out")));
    }
    let folder = |path: &PathBuf| match several {
        true => args.out().join(path.file_stem().unwrap_or_default()),
        false => args.out().to_path_buf(),
    };
    let folders: Vec<PathBuf> = args.measured.iter().map(folder).collect();
    for (i, out) in folders.iter().enumerate() {
        if let Some(k) = folders[..i].iter().position(|other| other == out) {
            let [a, b] = [k, i].map(|n| args.measured[n].display());
            return Err(Failure::Input(anyhow!(
                "--measured {a} and {b}: the results of both would go to {}",
                out.display()
            )));
        }
    }
    prepare(args, &folders.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
    let map = args.column_map(&LawsFile::default(), "measured")?;
    for (path, out) in args.measured.iter().zip(&folders) {
        let trace = fingerpad_diagnose::trace_csv::read(path, &map)?;
        let found = during("forces", |_| diagnose_forces(&trace, args.alpha));
        write_reduced(args, path, out, found, trace.rows.len())?;
    }
    Ok(())
}

/// Writes a table with all columns, to be filled in.
fn write_template(path: &Path) -> Result<(), Failure> {
    let place = path.display();
    if path.exists() {
        return Err(Failure::Input(anyhow!("--template {place}: is there already and is not overwritten")));
    }
    formats::atomic_write(path, |w| w.write_all(template().as_bytes()))?;
    println!("{place}: all columns, and two rows as an example; docs/first-diagnosis.md says what they are");
    Ok(())
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(arguments::Command::Check(files)) = &args.command {
        return check::run(files);
    }
    args.validate()?;
    match (&args.template, &args.table) {
        (Some(path), _) => write_template(path),
        (None, Some(path)) => table(args, path),
        (None, None) if args.force_only => forces(args),
        (None, None) => match &args.group {
            Some(list) => fingers(args, list),
            None => runs(args),
        },
    }
}

/// The model with its curves, and the choices beside the data.
fn model_and_options(args: &Args) -> Result<(Data, ReferenceCurves, Options), Failure> {
    let own = args.laws.as_deref().map(LawsFile::read).transpose()?.unwrap_or_default();
    let plan = args.plan(&own)?;
    let (file, model) = super::model::load(args.model.as_deref())?;
    let data = *file.file().model.data();
    let reference = ReferenceCurves::from_model_data(&data, args.model.is_some());
    let mut errors = args.covariate_sd.clone();
    if !errors.iter().any(|e| e.column == Column::Hydration) {
        errors.push(CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU });
    }
    let settings = SelectionSettings { alpha: args.alpha, seed: args.seed, laws: own.with_library() };
    Ok((data, reference, Options { settings, errors, model, plan, own }))
}

/// Diagnoses several fingers together.
fn fingers(args: &Args, list: &Path) -> Result<(), Failure> {
    let (_, reference, options) = model_and_options(args)?;
    let maps = [args.column_map(&options.own, "calibration")?, args.column_map(&options.own, "measured")?];
    group::run(args, list, &maps, &reference, &options)
}

/// Diagnoses measured runs.
fn runs(args: &Args) -> Result<(), Failure> {
    let started = Instant::now();
    let [measured_path] = &args.measured[..] else {
        return Err(Failure::Input(anyhow!("--measured takes one file here; several belong to --force-only")));
    };
    let Some(calibration_path) = &args.calibration else {
        return Err(Failure::Input(anyhow!("--calibration is missing")));
    };
    let (data, reference, options) = model_and_options(args)?;
    let [calibration_map, map, holdout_map] =
        ["calibration", "measured", "holdout"].map(|role| args.column_map(&options.own, role));
    let (calibration_map, map, holdout_map) = (calibration_map?, map?, holdout_map?);
    let session = args.session(measured_path)?;
    if args.check {
        return check(calibration_path, &session, [&calibration_map, &map], &options.own);
    }
    prepare(args, &[args.out()])?;
    let before = earlier(args);
    let calibration = read_mapped(calibration_path, &calibration_map)?;
    let (measured, parts) = read_union(&session, &map)?;
    let mut held: Option<InputFile> = None;
    let (mut report, evidence) = during("diagnosis", |tell| {
        let open_holdout = || match &args.holdout {
            None => Ok(None),
            Some(path) => {
                let set = read_mapped(path, &holdout_map)?;
                held = Some(input("holdout", &set));
                Ok(Some(set))
            }
        };
        diagnose::<Failure>(&calibration, &measured, &reference, &options, open_holdout, &mut |stage| tell(stage))
    })?;
    report.input = vec![input("calibration", &calibration)];
    report.input.extend(measured_inputs(&measured, &parts));
    report.input.extend(held);
    report.input.extend(args.laws.as_deref().map(|path| laws_input(path, &options.own)));
    let corrected = correct(&mut report, &data, &reference, &evidence);
    examine(args, &mut report, (&evidence, &reference, &options.settings), |report| {
        report.elapsed_s = started.elapsed().as_secs_f64();
        write(args, report, &evidence, corrected.as_deref())
    })?;
    println!("{}", report::diagnosis::summary(&report));
    before.and_then(|before| progress_since(&before, &report)).iter().for_each(|sentence| println!("{sentence}"));
    report::diagnosis::repetitions(&report).for_each(|sentence| println!("{sentence}"));
    report.corrected_tables.iter().for_each(|table| println!("{CORRECTED}: {table}"));
    match &report.power {
        Some(found) if found.interrupted => {
            let place = args.out().display();
            Err(Failure::Interrupted(format!("the report with {} simulated sets was written to {place}", found.sets)))
        }
        _ => Ok(()),
    }
}

/// The corrected model as a file, where an effect of the finger is claimed, held-out runs do not refuse it, and nothing is implausible.
fn correct(report: &mut Diagnosis, data: &Data, reference: &ReferenceCurves, evidence: &Evidence) -> Option<Vec<u8>> {
    let is_implausible = report.cautions.iter().any(|caution| caution.kind == IMPLAUSIBLE);
    if is_implausible || !evidence.has_claims() || report.holdout.refused_after_n.is_some() {
        return None;
    }
    match during("corrected model", |_| corrected_model(data, reference, evidence)) {
        Ok(made) => {
            report.corrected_model = Some(CORRECTED.into());
            report.corrected_rms_n = Some(made.rms_n);
            report.corrected_tables = made.tables;
            Some(made.bytes)
        }
        Err(reason) => {
            eprintln!("warning: {CORRECTED} is not written: {reason}");
            None
        }
    }
}

/// Stability, power and confirmation by finite elements, as far as they are asked for. Power and confirmation take minutes:
/// `write` writes the report before each of them.
fn examine(
    args: &Args,
    report: &mut Diagnosis,
    (evidence, reference, settings): (&Evidence, &ReferenceCurves, &SelectionSettings),
    write: impl Fn(&mut Diagnosis) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let again = Redecision::new(evidence, reference, settings);
    if args.stability_groups > 0 {
        // Where held-out runs changed the verdict, decisions without them say nothing about it.
        let found = repeated::leave_out_groups(&again, args.stability_groups, PowerSettings::default().threads);
        report.stability = found.filter(|found| found.all.verdict == report.verdict);
    }
    if args.power {
        write(report)?;
        let settings = PowerSettings { seconds: args.power_seconds, seed: args.seed, ..PowerSettings::default() };
        report.power = Some(repeated::simulate_power(&again, &settings));
    }
    write(report)?;
    if args.confirm_fe && !evidence.has_claims() {
        println!("--confirm-fe: no law of the finger is claimed, so there is nothing to switch on");
    } else if args.confirm_fe {
        let folder = args.out().join("fe");
        let strokes = args.fe_strokes as usize;
        let confirmation = super::confirm::confirm(&args.finger, reference, evidence, strokes, &folder)?;
        report.fe_confirmation = Some(confirmation.report);
        report.next_step = next_step(report);
        write(report)?;
    }
    Ok(())
}
