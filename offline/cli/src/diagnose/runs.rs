//! `fingerpad diagnose runs`: which effect measured runs show and the model lacks.

use std::path::Path;
use std::time::Instant;

use fingerpad::build::Data;
use fingerpad_diagnose::{
    ColumnMap, Diagnosis, Evidence, IMPLAUSIBLE, InputFile, LawsFile, PowerSettings, Redecision, SelectionSettings,
    SessionFile, Verdict, corrected_model, diagnose, next_step, preflight_report,
};
use fingerpad_report as report;
use fingerpad_smooth::ReferenceCurves;

use super::arguments::RunsArgs;
use super::input_files::{input, laws_input, measured_inputs, read_mapped, read_union};
use super::repeated;
use super::result_files::{CORRECTED, earlier, prepare, write_files};
use crate::Failure;
use crate::progress::during;

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

/// Diagnoses measured runs.
pub fn run(args: &RunsArgs) -> Result<(), Failure> {
    let started = Instant::now();
    let (data, reference, options) = args.analysis.model_and_options()?;
    let [calibration_map, map, holdout_map] =
        ["calibration", "measured", "holdout"].map(|role| args.analysis.column_map(&options.own, role));
    let (calibration_map, map, holdout_map) = (calibration_map?, map?, holdout_map?);
    let session = args.session()?;
    if args.check {
        return check(&args.calibration, &session, [&calibration_map, &map], &options.own);
    }
    let (output, config) = (args.output(), args.finger.config()?);
    let given = [
        ("--calibration", Some(args.calibration.as_path())),
        ("--measured", Some(&args.measured)),
        ("--holdout", args.holdout.as_deref()),
        ("--model", args.analysis.model.as_deref()),
        ("--laws", args.analysis.laws.as_deref()),
    ];
    let appended = args.append.iter().map(|path| ("--append", Some(path.as_path())));
    prepare(&output, given.into_iter().chain(appended).chain(args.finger.inputs(&config)), &[&output.out])?;
    let before = earlier(&output);
    let calibration = read_mapped(&args.calibration, &calibration_map)?;
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
    report.input.extend(args.analysis.laws.as_deref().map(|path| laws_input(path, &options.own)));
    let corrected = correct(&mut report, &data, &reference, &evidence);
    let write = |report: &mut Diagnosis| {
        report.elapsed_s = started.elapsed().as_secs_f64();
        let rendered = report::diagnosis::render(report, &evidence).map_err(|e| Failure::Numerics(e.into()))?;
        let plan = report.next_experiment.as_ref().filter(|_| report.verdict == Verdict::Ambiguous);
        let model = corrected.as_ref().map(|bytes| (CORRECTED.to_owned(), bytes.clone()));
        write_files(&output, rendered, plan, model.into_iter().collect())
    };
    examine(args, &mut report, (&evidence, &reference, &options.settings), write)?;
    println!("{}", report::diagnosis::summary(&report));
    before.and_then(|before| progress_since(&before, &report)).iter().for_each(|sentence| println!("{sentence}"));
    report::diagnosis::repetitions(&report).for_each(|sentence| println!("{sentence}"));
    report.corrected_tables.iter().for_each(|table| println!("{CORRECTED}: {table}"));
    match &report.power {
        Some(found) if found.interrupted => {
            let place = output.out.display();
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
    args: &RunsArgs,
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
        let settings =
            PowerSettings { seconds: args.power_seconds, seed: args.analysis.seed, ..PowerSettings::default() };
        report.power = Some(repeated::simulate_power(&again, &settings));
    }
    write(report)?;
    if args.confirm_fe && !evidence.has_claims() {
        println!("--confirm-fe: no law of the finger is claimed, so there is nothing to switch on");
    } else if args.confirm_fe {
        let folder = args.output().out.join("fe");
        let strokes = args.fe_strokes as usize;
        let confirmation = crate::confirm::confirm(&args.finger, reference, evidence, strokes, &folder)?;
        report.fe_confirmation = Some(confirmation.report);
        report.next_step = next_step(report);
        write(report)?;
    }
    Ok(())
}
