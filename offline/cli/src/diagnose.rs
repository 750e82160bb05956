//! `fingerpad diagnose`: which effect is missing from the model, by measured runs.

use std::path::{Path, PathBuf};
use std::time::Instant;

use fingerpad_diagnose::runs_csv;
use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, CovariateError, DiagnoseError, Diagnosis, InputFile, Options, ReducedDiagnosis, RunSet,
    SelectionSettings, Verdict, corrected_model, diagnose, diagnose_forces, diagnose_table, laws::Column,
};
use fingerpad_formats as formats;
use fingerpad_report as report;
use fingerpad_smooth::ReferenceCurves;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Failure, INTERRUPTED, Model};

/// Find where simulation and measurement disagree, name the missing effect, add it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose --calibration calibration.csv --measured measured.csv --out diagnosis
  fingerpad diagnose --calibration c.csv --measured m.csv --holdout h.csv --covariate-sd hydration_au=2 --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --confirm-fe --shape d --out d
  fingerpad diagnose --force-only --measured trace.csv --map normal=-Fz,x=Fx,y=Fy,t=Timestamp --out d
  fingerpad diagnose --table data/yoshida2011.csv --out d

Measured runs are described in docs/diagnose.md. The verdict is one of none, named, ambiguous and
unexplained_structure; report.json has all numbers, report.html the page, corrected.fpm the model with the effect,
next_experiment.csv the strokes that would settle an ambiguous verdict. The hold-out file is opened after the verdict
stands.

--confirm-fe fits the finite-element finger (--shape, --config, --mesh-preset) to some calibration strokes, switches the
named effect on inside its law and re-runs some of the held-out strokes (of the measured ones without a hold-out file);
its own gap before and after is in the report. Finished strokes are kept in DIR/fe, and Ctrl-C loses none of them.")]
pub struct Args {
    /// Runs without an effect, under reference conditions (CSV)
    #[arg(long, value_name = "C.csv", required_unless_present_any = ["force_only", "table"])]
    calibration: Option<PathBuf>,
    /// Runs to be explained (CSV); with --force-only several traces may be given
    #[arg(long, value_name = "M.csv", required_unless_present = "table", num_args = 1..)]
    measured: Vec<PathBuf>,
    /// Further runs, opened only after the verdict stands (CSV)
    #[arg(long, value_name = "H.csv")]
    holdout: Option<PathBuf>,
    /// Model file to start from; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// Standard deviation of a state column's readings, as column=value; may be repeated
    #[arg(long, value_name = "COLUMN=SD", value_parser = covariate)]
    covariate_sd: Vec<CovariateError>,
    /// Level of the sign-flip test
    #[arg(long, default_value_t = 0.01)]
    alpha: f64,
    /// Seed of the sign flips
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Switch the effect on inside the finite-element law and re-run a part of the strokes
    #[arg(long, conflicts_with_all = ["force_only", "table"])]
    confirm_fe: bool,
    /// With --confirm-fe: strokes that are run, as many again of the calibration
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    fe_strokes: u32,
    /// Geometry, mesh, materials and law of the finite-element finger for --confirm-fe; the coarse mesh unless said
    #[command(flatten, next_help_heading = "The finite-element finger of --confirm-fe (coarse mesh unless said)")]
    finger: Model,
    /// Forces alone: a finger moved freely on a force plate
    #[arg(long, conflicts_with_all = ["calibration", "table", "holdout"])]
    force_only: bool,
    /// With --force-only: where the columns are, a minus sign turns one round
    #[arg(long, value_name = "normal=-Fz,x=Fx,y=Fy,t=Timestamp", requires = "force_only")]
    map: Option<String>,
    /// A table like Table 1 of Yoshida et al. 2011 (CSV)
    #[arg(long, value_name = "T.csv", conflicts_with = "measured")]
    table: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Where report.json goes, if not into the folder
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
}

fn covariate(text: &str) -> Result<CovariateError, String> {
    let (name, sd) = text.split_once('=').ok_or("expected COLUMN=SD, as in hydration_au=2")?;
    let column = [Column::Dwell, Column::Occlusion, Column::Hydration, Column::Temperature, Column::Width]
        .into_iter()
        .find(|c| c.name() == name.trim())
        .ok_or_else(|| {
            format!("`{name}` is not one of dwell_s, occlusion_time_s, hydration_au, temperature_c, finger_width_mm")
        })?;
    let sd: f64 = sd.trim().parse().map_err(|_| format!("`{sd}` is not a number"))?;
    if sd >= 0.0 && sd.is_finite() {
        Ok(CovariateError { column, sd })
    } else {
        Err(format!("{sd} is not a standard deviation"))
    }
}

impl From<DiagnoseError> for Failure {
    fn from(error: DiagnoseError) -> Self {
        Self::Input(error.into())
    }
}

/// Measured runs from a file, with a bar.
pub fn read(path: &Path) -> Result<RunSet, Failure> {
    let style =
        ProgressStyle::with_template("{prefix:>16} {bar:30} {percent:>3} %  {eta} left").expect("a valid template");
    let bar = ProgressBar::new(1000).with_style(style).with_prefix("reading");
    let result = runs_csv::read(path, &mut |share| {
        bar.set_position((share * 1000.0) as u64);
        !INTERRUPTED.load(std::sync::atomic::Ordering::Relaxed)
    });
    bar.finish_and_clear();
    result.map_err(|e| match e {
        runs_csv::ReadError::Interrupted => Failure::Interrupted("nothing was written".into()),
        runs_csv::ReadError::Csv(e) => Failure::Input(e.into()),
        runs_csv::ReadError::Run(e) => Failure::Input(e.into()),
    })
}

fn input(role: &str, set: &RunSet) -> InputFile {
    InputFile {
        role: role.into(),
        file: set.path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        sha256: set.sha256.clone(),
        rows: set.rows_read,
        runs: set.runs_read,
        notes: set.notes.clone(),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !(args.alpha > 0.0 && args.alpha < 0.5) {
        return Err(Failure::Input(anyhow::anyhow!("--alpha {}: not between 0 and 0.5", args.alpha)));
    }
    std::fs::create_dir_all(&args.out).map_err(|source| formats::Error::File { path: args.out.clone(), source })?;
    let started = Instant::now();
    if let Some(path) = &args.table {
        let table = fingerpad_identify::table_csv::read(path)?;
        let mut rows = Vec::new();
        for (i, r) in table.iter().enumerate() {
            let area = r.contact_area_mm2.ok_or_else(|| {
                Failure::Input(anyhow::anyhow!(
                    "{}: data row {}: column contact_area_mm2 is missing",
                    path.display(),
                    i + 1
                ))
            })?;
            rows.push([r.depth_mm, r.normal_force_n, r.friction_coefficient, area]);
        }
        if rows.len() < 4 {
            return Err(Failure::Input(anyhow::anyhow!(
                "{}: {} rows where at least 4 are needed",
                path.display(),
                rows.len()
            )));
        }
        return write_reduced(args, path, &args.out, diagnose_table(&rows), rows.len());
    }
    if args.force_only {
        let several = args.measured.len() > 1;
        for path in &args.measured {
            let trace = fingerpad_diagnose::trace_csv::read(path, args.map.as_deref())?;
            let out = if several { args.out.join(path.file_stem().unwrap_or_default()) } else { args.out.clone() };
            std::fs::create_dir_all(&out).map_err(|source| formats::Error::File { path: out.clone(), source })?;
            write_reduced(args, path, &out, diagnose_forces(&trace, args.alpha), trace.len())?;
        }
        return Ok(());
    }
    let [measured_path] = &args.measured[..] else {
        return Err(Failure::Input(anyhow::anyhow!("--measured takes one file here; several belong to --force-only")));
    };
    let Some(calibration_path) = &args.calibration else {
        return Err(Failure::Input(anyhow::anyhow!("--calibration is missing")));
    };
    let calibration = read(calibration_path)?;
    let measured = read(measured_path)?;
    let (file, model) = super::model::load(args.model.as_deref())?;
    let data = *file.file().model.data();
    let reference = ReferenceCurves::from_model_data(&data, args.model.is_some());
    let mut errors = args.covariate_sd.clone();
    if !errors.iter().any(|e| e.column == Column::Hydration) {
        errors.push(CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU });
    }
    let options = Options { settings: SelectionSettings { alpha: args.alpha, seed: args.seed }, errors, model };
    let spinner = ProgressBar::new_spinner();
    spinner.enable_steady_tick(std::time::Duration::from_millis(120));
    let mut held: Option<InputFile> = None;
    let (mut report, evidence) = diagnose::<Failure>(
        &calibration,
        &measured,
        &reference,
        &options,
        || match &args.holdout {
            None => Ok(None),
            Some(path) => {
                let set = read(path)?;
                held = Some(input("holdout", &set));
                Ok(Some(set))
            }
        },
        &mut |stage| spinner.set_message(stage.to_owned()),
    )?;
    spinner.finish_and_clear();
    report.input = vec![input("calibration", &calibration), input("measured", &measured)];
    report.input.extend(held);
    let model_file = args.out.join("corrected.fpm");
    if report.effects.is_empty() || report.holdout.refused_after_n.is_some() {
        let _ = std::fs::remove_file(&model_file);
    } else {
        match corrected_model(&data, &reference, &evidence) {
            Ok(made) => {
                formats::atomic_write(&model_file, |w| w.write_all(&made.bytes))?;
                report.corrected_model = Some("corrected.fpm".into());
                report.corrected_rms_n = Some(made.rms_n);
            }
            Err(reason) => {
                let _ = std::fs::remove_file(&model_file);
                eprintln!("warning: corrected.fpm is not written: {reason}");
            }
        }
    }
    report.elapsed_s = started.elapsed().as_secs_f64();
    // The finite elements take minutes: what stands is written before.
    write(args, &report, &evidence)?;
    if args.confirm_fe && report.effects.is_empty() {
        println!("--confirm-fe: nothing is claimed, so there is nothing to switch on");
    } else if args.confirm_fe {
        let folder = args.out.join("fe");
        let strokes = args.fe_strokes as usize;
        let confirmation = super::confirm::confirm(&args.finger, &reference, &evidence, strokes, &folder)?;
        report.fe_confirmation = Some(confirmation.report);
        report.elapsed_s = started.elapsed().as_secs_f64();
        write(args, &report, &evidence)?;
    }
    println!("{}", report::diagnosis::summary(&report));
    Ok(())
}

/// Writes a diagnosis of forces alone or of a table.
fn write_reduced(args: &Args, path: &Path, out: &Path, mut brief: ReducedDiagnosis, rows: usize) -> Result<(), Failure> {
    use sha2::Digest;
    let bytes = std::fs::read(path).map_err(|source| formats::Error::File { path: path.to_path_buf(), source })?;
    brief.report.input = vec![InputFile {
        role: "measured".into(),
        file: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        sha256: sha2::Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect(),
        rows,
        runs: brief.report.holdout.runs,
        notes: brief.sentences.clone(),
    }];
    brief.report.seed = args.seed;
    let rendered = report::diagnosis::render_reduced(&brief).map_err(|e| Failure::Numerics(e.into()))?;
    let json = args.report.clone().unwrap_or_else(|| out.join("report.json"));
    formats::atomic_write(&json, |w| w.write_all(rendered.json.as_bytes()))?;
    formats::atomic_write(&out.join("report.html"), |w| w.write_all(rendered.html.as_bytes()))?;
    for (name, png) in &rendered.figures {
        formats::atomic_write(&out.join(name), |w| w.write_all(png))?;
    }
    if let Some(plan) = &brief.report.next_experiment {
        let text = report::diagnosis::plan_csv(plan);
        formats::atomic_write(&out.join("next_experiment.csv"), |w| w.write_all(text.as_bytes()))?;
    }
    println!("{}: verdict: {}", path.display(), report::diagnosis::word(&brief.report));
    brief.sentences.iter().for_each(|s| println!("{s}"));
    Ok(())
}

fn write(args: &Args, report: &Diagnosis, evidence: &fingerpad_diagnose::Evidence) -> Result<(), Failure> {
    let rendered = report::diagnosis::render(report, evidence).map_err(|e| Failure::Numerics(e.into()))?;
    let json = args.report.clone().unwrap_or_else(|| args.out.join("report.json"));
    formats::atomic_write(&json, |w| w.write_all(rendered.json.as_bytes()))?;
    formats::atomic_write(&args.out.join("report.html"), |w| w.write_all(rendered.html.as_bytes()))?;
    for (name, png) in &rendered.figures {
        formats::atomic_write(&args.out.join(name), |w| w.write_all(png))?;
    }
    let next = args.out.join("next_experiment.csv");
    match &report.next_experiment {
        Some(plan) if report.verdict == Verdict::Ambiguous => {
            let text = report::diagnosis::plan_csv(plan);
            formats::atomic_write(&next, |w| w.write_all(text.as_bytes()))?;
        }
        // One of an earlier diagnosis would be taken for this one's.
        _ => {
            let _ = std::fs::remove_file(&next);
        }
    }
    Ok(())
}
