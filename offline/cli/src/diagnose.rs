//! `fingerpad diagnose`: which effect is missing from the model, by measured runs.

mod repeated;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::anyhow;
use fingerpad_diagnose::laws::run_columns::template;
use fingerpad_diagnose::runs_csv;
use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, ColumnMap, CovariateError, DiagnoseError, Diagnosis, Evidence, FilePart, InputFile, LawsFile,
    NextExperiment, Options, PlanConstraints, PowerSettings, Redecision, ReducedDiagnosis, Rotation, RunSet,
    SelectionSettings, SessionFile, Verdict, corrected_model, diagnose, diagnose_forces, laws::Column, understand,
};
use fingerpad_formats as formats;
use fingerpad_report as report;
use fingerpad_smooth::ReferenceCurves;

use super::{Failure, Mark, Model, Outputs, bar, diagnose_table, go_on, progress::during, results};

/// Find where simulation and measurement disagree, name the missing effect, add it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose --calibration calibration.csv --measured measured.csv --out diagnosis
  fingerpad diagnose --calibration c.csv --measured m.csv --holdout h.csv --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --covariate-sd hydration_au=2 --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --confirm-fe --shape d --out d
  fingerpad diagnose --force-only --measured t.csv --map normal=-Fz,x=Fx,y=Fy,t=Timestamp --out d
  fingerpad diagnose --table data/yoshida2011.csv --mesh-preset coarse --out d
  fingerpad diagnose --table my.csv --unit normal_force_n=N,depth_mm=mm --out d
  fingerpad diagnose --template runs.csv
  fingerpad diagnose --calibration c.csv --measured m.csv --append n.csv --append-start-s 900 --out d
  fingerpad diagnose --calibration c1.csv --measured m1.csv --map x=Fx,y=Fy,normal=Fz --sensor-rpy-deg 180,0,0 --out d
  fingerpad diagnose --calibration c0.csv --measured m0.csv --map run=Trial --check
  fingerpad diagnose --calibration c.csv --measured m.csv --can-set depth,speed --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --laws laws.toml --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --power --power-seconds 20 --out d

--check prints how the files were read and which laws they can test. Files may be compressed by gzip; commas,
semicolons or tabs separate cells, with the latter two decimals may have commas, and the row below the header may name the
units. Values of another unit are reported with the --unit that converts them. No run of a file may stand in another one.
With --can-set the next experiment keeps to what the device can do; the cheapest plan that suffices is proposed.

--append joins further runs to the measured ones, such as the strokes of next_experiment.csv once they are measured: the
result is that of one file with all runs. Run the command again with one more file after each round. Run names must
differ between files, and so must the times on their common clock (--append-start-s).

--sensor-rpy-deg or --sensor-matrix turns forces that a robot logged in the frame of its force-torque sensor into the
contact frame (x, y, normal force). Signs and units of --map and --unit come first. A matrix that is left-handed or not
orthogonal is refused. Torques are not read.

--power simulates the measured runs with the calibrated model, noise and scatter, without an effect and with each law at
3, 10 and 30 % of the force, and decides each set: how often these runs raise a false alarm, and how often they detect
and name an effect. It takes two minutes unless --power-seconds says otherwise; Ctrl-C keeps the sets that were counted.

--laws adds laws of your own, formulas over drivers and further columns of the runs; a law that is named stands in
corrected.fpm as a table, so that firmware runs it as it is. docs/laws-of-your-own.md has ten of them.

Measured runs are described in docs/diagnose.md. The verdict is one of none, named, ambiguous and
unexplained_structure; report.json has all numbers, report.html the page, corrected.fpm the model with the effect,
next_experiment.csv the strokes that would settle an ambiguous verdict. The hold-out file is opened after the laws are
chosen; a name that leaves more than two noise floors on it is withdrawn.

--confirm-fe fits the finite-element finger (--shape, --config, --mesh-preset) to some calibration strokes, switches the
named effect on inside its law and re-runs some of the held-out strokes (of the measured ones without a hold-out file);
its own gap before and after is in the report. Finished strokes are kept in DIR/fe, and Ctrl-C loses none of them.

--table runs the finite elements (--shape, --config, --mesh-preset; medium mesh unless said) with the published constants
at the table's depths, shows the gap of every cell and looks for what closes it: columns depth_mm and any of
normal_force_n, contact_area_mm2, friction_coefficient, each with its spread as ..._sd where it is known.
corrected.toml (for simulate and build --config), corrected_table.csv and side_by_side.csv go to DIR as well; finished
slides are kept in DIR/fe. docs/diagnose-table.md describes it.

DIR holds one diagnosis: DIR/files.txt lists its files, and the next diagnosis there removes them before it writes its
own. Other files in DIR are never touched; one with a name that a diagnosis needs is refused.")]
pub struct Args {
    /// Runs without an effect, under reference conditions (CSV)
    #[arg(long, value_name = "C.csv", required_unless_present_any = ["force_only", "table", "template"])]
    calibration: Option<PathBuf>,
    /// Runs to be explained (CSV); with --force-only several traces may be given
    #[arg(long, value_name = "M.csv", required_unless_present_any = ["table", "template"], num_args = 1..)]
    measured: Vec<PathBuf>,
    /// Further runs, opened only after the laws are chosen (CSV)
    #[arg(long, value_name = "H.csv")]
    holdout: Option<PathBuf>,
    /// Further measured runs, whose files join --measured in this order: the verdict and the next experiment are those of all runs (CSV)
    #[arg(long, value_name = "RUN.csv", num_args = 1.., conflicts_with_all = ["force_only", "table"])]
    append: Vec<PathBuf>,
    /// Time of the first row of each appended file on the clock of --measured, s, where its clock was started again
    #[arg(long, value_name = "S", value_delimiter = ',', allow_negative_numbers = true, requires = "append")]
    append_start_s: Vec<f64>,
    /// Model file to start from; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// Standard deviation of a state column's readings, as column=value; may be repeated
    #[arg(long, value_name = "COLUMN=SD", value_parser = covariate)]
    covariate_sd: Vec<CovariateError>,
    /// Laws of your own: formulas over drivers and further columns (TOML), see docs/laws-of-your-own.md
    #[arg(long, value_name = "MINE.toml", conflicts_with_all = ["force_only", "table"])]
    laws: Option<PathBuf>,
    /// Level of the sign-flip test
    #[arg(long, default_value_t = 0.01)]
    alpha: f64,
    /// Seed of the sign flips
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulate what these runs can show: false alarms, detection and naming of each law at 3, 10 and 30 %
    #[arg(long, conflicts_with_all = ["force_only", "table", "check"])]
    power: bool,
    /// With --power: time for it, s
    #[arg(long, value_name = "S", default_value_t = 120.0, requires = "power")]
    power_seconds: f64,
    /// Groups of measured runs that are left out in turn to see whether the verdict holds; 0 for none
    #[arg(long, value_name = "N", default_value_t = 10)]
    stability_groups: usize,
    /// Switch the effect on inside the finite-element law and re-run a part of the strokes
    #[arg(long, conflicts_with_all = ["force_only", "table"])]
    confirm_fe: bool,
    /// With --confirm-fe: strokes that are run, as many again of the calibration
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    fe_strokes: u32,
    /// Geometry, mesh, materials and law of the finite-element finger for --confirm-fe and --table
    #[command(
        flatten,
        next_help_heading = "The finite-element finger of --confirm-fe (coarse mesh unless said) and --table (medium)"
    )]
    finger: Model,
    /// Forces alone: a finger moved freely on a force plate
    #[arg(long, conflicts_with_all = ["calibration", "table", "holdout"])]
    force_only: bool,
    /// What the columns are called in the files; a minus sign turns one round
    #[arg(long, value_name = "normal=-Fz,x=Fx,y=Fy,t=Timestamp", allow_hyphen_values = true)]
    map: Option<String>,
    /// Roll, pitch and yaw of the force sensor in the contact frame, degrees, about the fixed axes x, y, z one after the other; forces are
    /// turned by them after --map
    #[arg(
        long,
        value_name = "ROLL,PITCH,YAW",
        allow_hyphen_values = true,
        conflicts_with_all = ["sensor_matrix", "table"]
    )]
    sensor_rpy_deg: Option<String>,
    /// The same as the rotation matrix from the sensor frame to the contact frame, nine numbers row by row
    #[arg(long, value_name = "R11,R12,...,R33", allow_hyphen_values = true, conflicts_with = "table")]
    sensor_matrix: Option<String>,
    /// Units of columns that are not in mm, N, s, mm/s, C, deg, au: um, cm, m, in, mN, gf, kgf, ms, us, min, um/s, K, F, rad,
    /// fraction and others
    #[arg(long, value_name = "depth=um,normal=mN")]
    unit: Option<String>,
    /// Say what was understood and what can be tested, and diagnose nothing
    #[arg(long, conflicts_with_all = ["force_only", "table", "confirm_fe"])]
    check: bool,
    /// Write a file with all columns and two rows as an example, and diagnose nothing
    #[arg(long, value_name = "RUNS.csv")]
    template: Option<PathBuf>,
    /// What the next experiment may vary: depth, speed, direction, dwell, hydration, temperature, length, rest, and columns of
    /// the file of laws
    #[arg(long, value_name = "depth,speed,dwell", value_delimiter = ',')]
    can_set: Vec<String>,
    /// Least rest before each stroke of the next experiment, s
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    least_rest_s: f64,
    /// A table like Table 1 of Yoshida et al. 2011 (CSV), to be compared with the finite elements
    #[arg(long, value_name = "T.csv", conflicts_with = "measured")]
    table: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", required_unless_present_any = ["check", "template"])]
    out: Option<PathBuf>,
    /// Where report.json goes, if not into the folder
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
}

impl Args {
    /// The folder for the results, which the command line demands where anything is written to it.
    fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new("."))
    }
}

/// Factors of the next experiment: short names and columns.
const FACTORS: [(&str, &str); 8] = [
    ("depth", "depth_mm"),
    ("speed", "speed_mm_s"),
    ("direction", "direction_deg"),
    ("dwell", "dwell_s"),
    ("hydration", "hydration_au"),
    ("temperature", "temperature_c"),
    ("length", "length_mm"),
    ("rest", "rest_before_s"),
];

/// What the laboratory can do; columns of a file of laws are factors under their own names.
fn plan(args: &Args, own: &LawsFile) -> Result<PlanConstraints, Failure> {
    let factor = |name: &String| {
        let known = FACTORS.iter().find(|(short, column)| name == short || name == column);
        let of_own = own.columns.iter().find(|c| c.name == *name);
        known.map(|(_, column)| (*column).to_owned()).or(of_own.map(|c| c.name.clone())).ok_or_else(|| {
            let names: Vec<&str> =
                FACTORS.iter().map(|(short, _)| *short).chain(own.columns.iter().map(|c| c.name.as_str())).collect();
            Failure::Input(anyhow!("--can-set {name}: none of {}", names.join(", ")))
        })
    };
    let can_set: Vec<String> = args.can_set.iter().map(factor).collect::<Result<_, _>>()?;
    Ok(PlanConstraints { can_set: (!can_set.is_empty()).then_some(can_set), least_rest_s: args.least_rest_s })
}

/// Files of a diagnosis.
const CORRECTED: &str = "corrected.fpm";
const NEXT: &str = "next_experiment.csv";
const JSON: &str = "report.json";
const PAGE: &str = "report.html";
/// All of them, the pictures included.
const NAMES: &[&str] = &[
    CORRECTED,
    NEXT,
    JSON,
    PAGE,
    "map_before.png",
    "map_after.png",
    "traces.png",
    "driver_1.png",
    "driver_2.png",
    "driver_3.png",
    "driver_4.png",
    "evidence.png",
    "heldout.png",
    "confirmation.png",
    "stability.svg",
    "forces.png",
    "table.png",
    "candidates.png",
    diagnose_table::CORRECTED_CONFIG,
    diagnose_table::CORRECTED_SHAPE,
    diagnose_table::CORRECTED_TABLE,
    diagnose_table::SIDE_BY_SIDE,
];

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
pub fn read_mapped(path: &Path, map: &ColumnMap) -> Result<RunSet, Failure> {
    Ok(read_union(&[SessionFile::first(path)], map)?.0)
}

/// Measured runs from the files of a session, with a bar.
fn read_union(files: &[SessionFile], map: &ColumnMap) -> Result<(RunSet, Vec<FilePart>), Failure> {
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

/// The files of the measured runs: that of --measured and those of --append.
fn session(args: &Args, measured: &Path) -> Result<Vec<SessionFile>, Failure> {
    let (files, starts) = (args.append.len(), args.append_start_s.len());
    if starts != 0 && starts != files {
        return Err(Failure::Input(anyhow!("--append-start-s: {starts} times for {files} files of --append")));
    }
    if let Some(start_s) = args.append_start_s.iter().find(|s| !s.is_finite()) {
        return Err(Failure::Input(anyhow!("--append-start-s {start_s}: not a finite time")));
    }
    let appended = args.append.iter().enumerate();
    let appended =
        appended.map(|(i, path)| SessionFile { path: path.clone(), start_s: args.append_start_s.get(i).copied() });
    Ok([SessionFile::first(measured)].into_iter().chain(appended).collect())
}

/// The files of the measured runs among the report's inputs.
fn measured_inputs(set: &RunSet, parts: &[FilePart]) -> Vec<InputFile> {
    let of = |(i, part): (usize, &FilePart)| InputFile {
        role: if i == 0 { "measured" } else { "appended" }.into(),
        file: part.path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        sha256: part.sha256.clone(),
        rows: part.rows_read,
        runs: part.runs_read,
        notes: if i == 0 { set.notes.clone() } else { Vec::new() },
    };
    parts.iter().enumerate().map(of).collect()
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

/// The file of laws among the report's inputs.
fn laws_input(path: &Path, laws: &LawsFile) -> InputFile {
    let note = |own: &fingerpad_diagnose::laws::own_law::OwnLaw| {
        format!("{} acts on {}: {}", own.law.name, own.target.name(), own.text)
    };
    InputFile {
        role: "laws".into(),
        file: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        sha256: laws.sha256.clone(),
        rows: 0,
        runs: 0,
        notes: laws.laws.iter().map(note).collect(),
    }
}

/// Where report.json goes, if not among the other results.
fn elsewhere(args: &Args) -> Option<&Path> {
    args.report.as_deref().filter(|path| **path != args.out().join(JSON))
}

/// Checks the files of the command and makes its folders.
fn prepare(args: &Args, folders: &[&Path]) -> Result<(), Failure> {
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

fn column_map(args: &Args, laws: &LawsFile) -> Result<ColumnMap, Failure> {
    let refused = |problem: String| Failure::Input(anyhow!(problem));
    let of_angles = args.sensor_rpy_deg.as_deref().map(Rotation::from_rpy_deg);
    let rotation = of_angles.or_else(|| args.sensor_matrix.as_deref().map(Rotation::from_matrix));
    let rotation = rotation.transpose().map_err(refused)?;
    let map =
        ColumnMap::parse_with(laws.columns.clone(), args.map.as_deref(), args.unit.as_deref()).map_err(refused)?;
    Ok(map.turned_by(rotation))
}

/// Says what was understood of the files and what they can test.
fn check(calibration: &Path, measured: &[SessionFile], map: &ColumnMap, laws: &LawsFile) -> Result<(), Failure> {
    let sets = [("calibration", read_mapped(calibration, map)?), ("measured", read_union(measured, map)?.0)];
    for (role, set) in &sets {
        println!("{role}: {}: {} runs, {} rows", set.path.display(), set.runs_read, set.rows_read);
        set.notes.iter().for_each(|note| println!("  {note}"));
    }
    let [(_, calibration), (_, measured)] = &sets;
    understand(calibration, measured, laws)?.iter().for_each(|line| println!("{line}"));
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
    let map = column_map(args, &LawsFile::default())?;
    for (path, out) in args.measured.iter().zip(&folders) {
        let trace = fingerpad_diagnose::trace_csv::read(path, &map)?;
        let found = during("forces", |_| diagnose_forces(&trace, args.alpha));
        write_reduced(args, path, out, found, trace.rows.len())?;
    }
    Ok(())
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !(args.alpha > 0.0 && args.alpha < 0.5) {
        return Err(Failure::Input(anyhow!("--alpha {}: not between 0 and 0.5", args.alpha)));
    }
    if !(args.least_rest_s >= 0.0 && args.least_rest_s.is_finite()) {
        return Err(Failure::Input(anyhow!("--least-rest-s {}: not a time", args.least_rest_s)));
    }
    if !(args.power_seconds > 0.0 && args.power_seconds <= 86_400.0) {
        return Err(Failure::Input(anyhow!("--power-seconds {}: not between 0 and 86400 s", args.power_seconds)));
    }
    if let Some(path) = &args.template {
        if path.exists() {
            return Err(Failure::Input(anyhow!(
                "--template {}: is there already and is not overwritten",
                path.display()
            )));
        }
        formats::atomic_write(path, |w| w.write_all(template().as_bytes()))?;
        println!(
            "{}: all columns, and two rows as an example; docs/first-diagnosis.md says what they are",
            path.display()
        );
        return Ok(());
    }
    let started = Instant::now();
    if let Some(path) = &args.table {
        return table(args, path);
    }
    if args.force_only {
        return forces(args);
    }
    let [measured_path] = &args.measured[..] else {
        return Err(Failure::Input(anyhow!("--measured takes one file here; several belong to --force-only")));
    };
    let Some(calibration_path) = &args.calibration else {
        return Err(Failure::Input(anyhow!("--calibration is missing")));
    };
    let own = args.laws.as_deref().map(LawsFile::read).transpose()?.unwrap_or_default();
    let plan = plan(args, &own)?;
    let map = column_map(args, &own)?;
    let session = session(args, measured_path)?;
    if args.check {
        return check(calibration_path, &session, &map, &own);
    }
    prepare(args, &[args.out()])?;
    let json = elsewhere(args).map_or_else(|| args.out().join(JSON), Path::to_path_buf);
    let before: Option<Diagnosis> = std::fs::read(json).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let calibration = read_mapped(calibration_path, &map)?;
    let (measured, parts) = read_union(&session, &map)?;
    let (file, model) = super::model::load(args.model.as_deref())?;
    let data = *file.file().model.data();
    let reference = ReferenceCurves::from_model_data(&data, args.model.is_some());
    let mut errors = args.covariate_sd.clone();
    if !errors.iter().any(|e| e.column == Column::Hydration) {
        errors.push(CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU });
    }
    let selection = SelectionSettings { alpha: args.alpha, seed: args.seed, laws: own.with_library() };
    let options = Options { settings: selection, errors, model, plan, own };
    let mut held: Option<InputFile> = None;
    let (mut report, evidence) = during("diagnosis", |tell| {
        let open_holdout = || match &args.holdout {
            None => Ok(None),
            Some(path) => {
                let set = read_mapped(path, &map)?;
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
    let mut model_bytes = None;
    if evidence.has_claims() && report.holdout.refused_after_n.is_none() {
        match during("corrected model", |_| corrected_model(&data, &reference, &evidence)) {
            Ok(made) => {
                report.corrected_model = Some(CORRECTED.into());
                report.corrected_rms_n = Some(made.rms_n);
                report.corrected_tables = made.tables;
                model_bytes = Some(made.bytes);
            }
            Err(reason) => eprintln!("warning: {CORRECTED} is not written: {reason}"),
        }
    }
    let again = Redecision::new(&evidence, &reference, &options.settings);
    let threads = PowerSettings::default().threads;
    if args.stability_groups > 0 {
        // Where held-out runs changed the verdict, decisions without them say nothing about it.
        let found = repeated::leave_out_groups(&again, args.stability_groups, threads);
        report.stability = found.filter(|found| found.all.verdict == report.verdict);
    }
    report.elapsed_s = started.elapsed().as_secs_f64();
    if args.power {
        // Power takes minutes: what stands is written before.
        write(args, &report, &evidence, model_bytes.as_deref())?;
        let settings = PowerSettings { seconds: args.power_seconds, seed: args.seed, ..PowerSettings::default() };
        report.power = Some(repeated::simulate_power(&again, &settings));
        report.elapsed_s = started.elapsed().as_secs_f64();
    }
    // The finite elements take minutes: what stands is written before.
    write(args, &report, &evidence, model_bytes.as_deref())?;
    if args.confirm_fe && !evidence.has_claims() {
        println!("--confirm-fe: no law of the finger is claimed, so there is nothing to switch on");
    } else if args.confirm_fe {
        let folder = args.out().join("fe");
        let strokes = args.fe_strokes as usize;
        let confirmation = super::confirm::confirm(&args.finger, &reference, &evidence, strokes, &folder)?;
        report.fe_confirmation = Some(confirmation.report);
        report.elapsed_s = started.elapsed().as_secs_f64();
        write(args, &report, &evidence, model_bytes.as_deref())?;
    }
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

/// Writes a diagnosis of forces alone or of a table.
fn write_reduced(
    args: &Args,
    path: &Path,
    out: &Path,
    mut found: ReducedDiagnosis,
    rows: usize,
) -> Result<(), Failure> {
    use sha2::Digest;
    let bytes = std::fs::read(path).map_err(|source| formats::Error::File { path: path.to_path_buf(), source })?;
    found.report.input = vec![InputFile {
        role: "measured".into(),
        file: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
        sha256: sha2::Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect(),
        rows,
        runs: found.report.holdout.runs,
        notes: found.sentences.clone(),
    }];
    found.report.seed = args.seed;
    let rendered = report::diagnosis::render_reduced(&found).map_err(|e| Failure::Numerics(e.into()))?;
    write_files(args, out, rendered, found.report.next_experiment.as_ref(), Vec::new())?;
    for (kind, text) in report::diagnosis::cautions(&found.report) {
        println!("{kind}: {}: {text}", path.display());
    }
    println!("{}: verdict: {}", path.display(), report::diagnosis::word(&found.report));
    found.sentences.iter().for_each(|s| println!("{s}"));
    Ok(())
}

fn write(args: &Args, report: &Diagnosis, evidence: &Evidence, model: Option<&[u8]>) -> Result<(), Failure> {
    let rendered = report::diagnosis::render(report, evidence).map_err(|e| Failure::Numerics(e.into()))?;
    let plan = report.next_experiment.as_ref().filter(|_| report.verdict == Verdict::Ambiguous);
    let model = model.map(|bytes| (CORRECTED.to_owned(), bytes.to_vec()));
    write_files(args, args.out(), rendered, plan, model.into_iter().collect())
}

/// Writes a diagnosis in place of the folder's earlier one, the page last.
fn write_files(
    args: &Args,
    out: &Path,
    rendered: report::Rendered,
    plan: Option<&NextExperiment>,
    beside: Vec<(String, Vec<u8>)>,
) -> Result<(), Failure> {
    let mut files = rendered.figures;
    files.extend(beside);
    files.extend(plan.map(|plan| (NEXT.to_owned(), report::diagnosis::plan_csv(plan).into_bytes())));
    match elsewhere(args) {
        Some(json) => formats::atomic_write(json, |w| w.write_all(rendered.json.as_bytes()))?,
        None => files.push((JSON.to_owned(), rendered.json.into_bytes())),
    }
    files.push((PAGE.to_owned(), rendered.html.into_bytes()));
    results::write(out, &files)
}
