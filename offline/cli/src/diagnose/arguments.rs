//! Arguments of `fingerpad diagnose`, and what they ask for.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::anyhow;
use fingerpad::build::Data;
use fingerpad_diagnose::laws::{Column, run_columns::states};
use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, ColumnMap, CovariateError, FACTORS, LawsFile, Options, PlanConstraints, Rotation,
    SelectionSettings, SessionFile,
};
use fingerpad_smooth::ReferenceCurves;

use crate::{Failure, Model};

/// Find where simulation and measurement disagree, name the missing effect, add it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose check m.csv
  fingerpad diagnose runs --calibration calibration.csv --measured measured.csv --out diagnosis
  fingerpad diagnose trace t.csv --map normal=-Fz,x=Fx,y=Fy,t=Timestamp --out d
  fingerpad diagnose table data/yoshida2011.csv --mesh-preset coarse --out d
  fingerpad diagnose group fingers.csv --out together
  fingerpad diagnose template runs.csv

Each has a --help of its own. `diagnose --calibration C.csv --measured M.csv` is `diagnose runs`; --force-only, --table, --group
and --template in place of a subcommand are understood, too.

The verdict is one of none, named, ambiguous and unexplained_structure; report.json has all numbers, report.html the page. DIR
holds one diagnosis: DIR/files.txt lists its files, and the next diagnosis there removes them before it writes its own. Other
files in DIR are never touched; one with a name that a diagnosis needs is refused.")]
pub struct Args {
    #[command(subcommand)]
    pub(super) command: Command,
}

/// What is diagnosed.
#[derive(clap::Subcommand)]
pub enum Command {
    /// Say what is in the files: columns, units, rates, strokes, loads, speeds, what is missing and what they can be used for
    Check(CheckFiles),
    /// Runs of press and slide with depth, slide and forces: the effect that they show and the model lacks
    Runs(Box<RunsArgs>),
    /// Forces alone: a finger moved freely on a force plate
    Trace(TraceArgs),
    /// A table of mean values like Table 1 of Yoshida et al. 2011, compared with the finite elements
    Table(Box<TableArgs>),
    /// Several fingers in one analysis: a law that they share, and its size in each
    Group(GroupArgs),
    /// Write a file of runs with all columns and two rows as an example
    Template {
        /// The file
        #[arg(value_name = "RUNS.csv")]
        file: PathBuf,
    },
}

/// Each flag that chose an analysis before there were subcommands, with the option of its files.
const EARLIER: [(&str, &str, &str); 4] = [
    ("--force-only", "--measured", "trace"),
    ("--table", "--table", "table"),
    ("--group", "--group", "group"),
    ("--template", "--template", "template"),
];

/// A command line without a subcommand of `diagnose` as one with it; any other as it is.
pub fn with_subcommand(mut words: Vec<OsString>) -> Vec<OsString> {
    let first = words.get(2).and_then(|word| word.to_str()).unwrap_or("-h");
    let has_none = first.starts_with('-') && !["-h", "--help"].contains(&first);
    if words.get(1).is_none_or(|word| word != "diagnose") || !has_none {
        return words;
    }
    let value = |word: &OsString, option: &str| {
        word.to_str().and_then(|w| w.strip_prefix(option)?.strip_prefix('=')).map(OsString::from)
    };
    let chosen = EARLIER.iter().find(|(flag, ..)| words.iter().any(|w| w == flag || value(w, flag).is_some()));
    if let Some((flag, files, _)) = chosen {
        words.retain(|word| word != flag && word != files);
        words.iter_mut().for_each(|word| *word = value(word, files).unwrap_or_else(|| std::mem::take(word)));
    }
    words.insert(2, chosen.map_or("runs", |(.., subcommand)| subcommand).into());
    words
}

/// Names and units of the columns.
#[derive(clap::Args)]
pub struct Columns {
    /// What the columns are called in the files; a minus sign turns one round
    #[arg(long, value_name = "normal=-Fz,x=Fx,y=Fy,t=Timestamp", allow_hyphen_values = true)]
    pub(super) map: Option<String>,
    /// Units of columns that are not in mm, N, s, mm/s, C, deg, au: um, cm, m, in, mN, gf, kgf, lbf, ms, us, ns, min, um/s, K,
    /// F, rad, fraction and others; measured:depth=um holds for --measured alone, as calibration: and holdout: do for theirs
    #[arg(long, value_name = "depth=um,normal=mN")]
    pub(super) unit: Option<String>,
}

/// The frame of the force sensor.
#[derive(clap::Args)]
pub struct Sensor {
    /// Roll, pitch and yaw of the force sensor in the contact frame, degrees, about the fixed axes x, y, z one after the other; forces are
    /// turned by them after --map
    #[arg(long, value_name = "ROLL,PITCH,YAW", allow_hyphen_values = true, conflicts_with = "sensor_matrix")]
    sensor_rpy_deg: Option<String>,
    /// The same as the rotation matrix from the sensor frame to the contact frame, nine numbers row by row
    #[arg(long, value_name = "R11,R12,...,R33", allow_hyphen_values = true)]
    sensor_matrix: Option<String>,
}

impl Sensor {
    /// Names, units and frame of the columns in the files of a role.
    pub(super) fn column_map(&self, columns: &Columns, laws: &LawsFile, role: &str) -> Result<ColumnMap, Failure> {
        let refused = |problem: String| Failure::Input(anyhow!(problem));
        let of_angles = self.sensor_rpy_deg.as_deref().map(Rotation::from_rpy_deg);
        let rotation = of_angles.or_else(|| self.sensor_matrix.as_deref().map(Rotation::from_matrix));
        let rotation = rotation.transpose().map_err(refused)?;
        let (map, unit) = (columns.map.as_deref(), columns.unit.as_deref());
        let map = ColumnMap::parse_with(laws.columns.clone(), map, unit, role).map_err(refused)?;
        Ok(map.turned_by(rotation))
    }
}

/// Where the results go.
#[derive(clap::Args)]
pub struct Output {
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Where report.json goes, if not into the folder
    #[arg(long, value_name = "R.json")]
    pub(super) report: Option<PathBuf>,
}

/// Arguments of `fingerpad diagnose check`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose check m.csv
  fingerpad diagnose check t.csv --map normal=-Fz --json

Columns are recognised by the names of docs/first-diagnosis.md, by those of --map, or by usual ones (Fn, Ft, Zeit (s), pos [mm]); the
--map and --unit that a diagnosis would need are printed. Nothing is written.")]
pub struct CheckFiles {
    /// Files of runs, of forces alone, or of a tribometer (CSV)
    #[arg(required = true, value_name = "FILE.csv")]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) columns: Columns,
    /// Print the same as JSON, a list with an entry for each file
    #[arg(long)]
    pub(super) json: bool,
}

/// Arguments of `fingerpad diagnose trace`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose trace t.csv --map normal=-Fz,x=Fx,y=Fy,t=Timestamp --out d

A trace needs no calibration and no model: its tare and, where the finger slides, its friction are looked for. The results of
several traces go into a folder of DIR each.")]
pub struct TraceArgs {
    /// Traces of force over time (CSV)
    #[arg(required = true, value_name = "T.csv")]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) columns: Columns,
    #[command(flatten)]
    pub(super) sensor: Sensor,
    /// Level of the tests
    #[arg(long, default_value_t = 0.01, value_parser = level)]
    pub(super) alpha: f64,
    #[command(flatten)]
    pub(super) output: Output,
}

/// Arguments of `fingerpad diagnose table`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose table data/yoshida2011.csv --mesh-preset coarse --out d
  fingerpad diagnose table my.csv --unit normal_force_n=N,depth_mm=mm --out d

Runs the finite elements (--shape, --config, --mesh-preset; medium mesh unless said) with the published constants at the
table's depths, shows the gap of every cell and looks for what closes it: columns depth_mm and any of normal_force_n,
contact_area_mm2, friction_coefficient, each with its spread as ..._sd where it is known. corrected.toml (for simulate and
build --config), corrected_table.csv and side_by_side.csv go to DIR as well; finished slides are kept in DIR/fe.
docs/diagnose-table.md describes it.")]
pub struct TableArgs {
    /// The table (CSV)
    #[arg(value_name = "T.csv")]
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) columns: Columns,
    /// Geometry, mesh, materials and law of the finite-element finger
    #[command(flatten)]
    pub(super) finger: Model,
    #[command(flatten)]
    pub(super) output: Output,
}

/// Model, laws and settings of a diagnosis of runs.
#[derive(clap::Args)]
pub struct Analysis {
    /// Model file to start from; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    pub(super) model: Option<PathBuf>,
    /// Standard deviation of a state column's readings, as column=value; may be repeated
    #[arg(long, value_name = "COLUMN=SD", value_parser = covariate)]
    covariate_sd: Vec<CovariateError>,
    /// Laws of your own: formulas over drivers and further columns (TOML), see docs/laws-of-your-own.md
    #[arg(long, value_name = "MINE.toml")]
    pub(super) laws: Option<PathBuf>,
    /// Level of the tests of a law
    #[arg(long, default_value_t = 0.01, value_parser = level)]
    alpha: f64,
    /// Seed of the sign flips
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// What the next experiment may vary: depth, speed, direction, dwell, hydration, temperature, length, rest, and columns of
    /// the file of laws
    #[arg(long, value_name = "depth,speed,dwell", value_delimiter = ',')]
    can_set: Vec<String>,
    /// Least rest before each stroke of the next experiment, s
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    least_rest_s: f64,
    #[command(flatten)]
    pub(super) columns: Columns,
    #[command(flatten)]
    pub(super) sensor: Sensor,
}

/// Arguments of `fingerpad diagnose group`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose group fingers.csv --out together

Looks for a law that several fingers share (three or more), each with a calibration and measured runs of its own: the evidence
is added over the fingers, the law has one shape and a size in each finger, and the mean size has the finger as the unit.
group.json has all numbers, group_sizes.svg the sizes with their intervals, group_sizes.csv the same as a table.")]
pub struct GroupArgs {
    /// List with the columns finger, calibration, measured (CSV; files beside the list)
    #[arg(value_name = "FINGERS.csv")]
    pub(super) list: PathBuf,
    #[command(flatten)]
    pub(super) analysis: Analysis,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
}

/// Arguments of `fingerpad diagnose runs`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad diagnose runs --calibration calibration.csv --measured measured.csv --out diagnosis
  fingerpad diagnose runs --calibration c.csv --measured m.csv --holdout h.csv --out d
  fingerpad diagnose runs --calibration c.csv --measured m.csv --covariate-sd hydration_au=2 --out d
  fingerpad diagnose runs --calibration c.csv --measured m.csv --confirm-fe --shape d --out d
  fingerpad diagnose runs --calibration c.csv --measured m.csv --append n.csv --append-start-s 900 --out d
  fingerpad diagnose runs --calibration c1.csv --measured m1.csv --map x=Fx,y=Fy,normal=Fz --sensor-rpy-deg 180,0,0 --out d
  fingerpad diagnose runs --calibration c0.csv --measured m0.csv --map run=Trial --check
  fingerpad diagnose runs --calibration c.csv --measured m.csv --can-set depth,speed --out d
  fingerpad diagnose runs --calibration c.csv --measured m.csv --laws laws.toml --out d
  fingerpad diagnose runs --calibration c.csv --measured m.csv --power --power-seconds 20 --out d

Measured runs are described in docs/diagnose.md. Files may be compressed by gzip; commas, semicolons or tabs separate cells,
with the latter two decimals may have commas, and the row below the header may name the units. Values of another unit are
reported with the --unit that converts them. No run of a file may stand in another one.

--check prints how the files were read and which laws they can test. corrected.fpm is the model with the effect,
next_experiment.csv the strokes that would settle an ambiguous verdict; with --can-set it keeps to what the device can do, and
the cheapest plan that suffices is proposed. The hold-out file is opened after the laws are chosen; a name that leaves more than
two noise floors on it is withdrawn.

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

--confirm-fe fits the finite-element finger (--shape, --config, --mesh-preset) to some calibration strokes, switches the
named effect on inside its law and re-runs some of the held-out strokes (of the measured ones without a hold-out file);
its own gap before and after is in the report. Finished strokes are kept in DIR/fe, and Ctrl-C loses none of them.")]
pub struct RunsArgs {
    /// Runs without an effect, under reference conditions (CSV)
    #[arg(long, value_name = "C.csv")]
    pub(super) calibration: PathBuf,
    /// Runs to be explained (CSV)
    #[arg(long, value_name = "M.csv")]
    pub(super) measured: PathBuf,
    /// Further runs, opened only after the laws are chosen (CSV)
    #[arg(long, value_name = "H.csv")]
    pub(super) holdout: Option<PathBuf>,
    /// Further measured runs, whose files join --measured in this order: the verdict and the next experiment are those of all runs (CSV)
    #[arg(long, value_name = "RUN.csv", num_args = 1..)]
    pub(super) append: Vec<PathBuf>,
    /// Time of the first row of each appended file on the clock of --measured, s, where its clock was started again
    #[arg(long, value_name = "S", value_delimiter = ',', allow_negative_numbers = true, requires = "append")]
    append_start_s: Vec<f64>,
    #[command(flatten)]
    pub(super) analysis: Analysis,
    /// Say what was understood and what can be tested, and diagnose nothing
    #[arg(long, conflicts_with_all = ["confirm_fe", "power"])]
    pub(super) check: bool,
    /// Simulate what these runs can show: false alarms, detection and naming of each law at 3, 10 and 30 %
    #[arg(long)]
    pub(super) power: bool,
    /// With --power: time for it, s
    #[arg(long, value_name = "S", default_value_t = 120.0, requires = "power", value_parser = power_time)]
    pub(super) power_seconds: f64,
    /// Groups of measured runs that are left out in turn to see whether the verdict holds; 0 for none
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(super) stability_groups: usize,
    /// Switch the effect on inside the finite-element law and re-run a part of the strokes
    #[arg(long)]
    pub(super) confirm_fe: bool,
    /// With --confirm-fe: strokes that are run, as many again of the calibration
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    pub(super) fe_strokes: u32,
    /// Folder for the results
    #[arg(long, value_name = "DIR", required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Where report.json goes, if not into the folder
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
    /// Geometry, mesh, materials and law of the finite-element finger for --confirm-fe
    #[command(flatten, next_help_heading = "The finite-element finger of --confirm-fe (coarse mesh unless said)")]
    pub(super) finger: Model,
}

impl RunsArgs {
    /// Where the results go; with --check nothing is written.
    pub(super) fn output(&self) -> Output {
        Output { out: self.out.clone().unwrap_or_else(|| ".".into()), report: self.report.clone() }
    }

    /// The files of the measured runs: that of --measured and those of --append.
    pub(super) fn session(&self) -> Result<Vec<SessionFile>, Failure> {
        let (files, starts) = (self.append.len(), self.append_start_s.len());
        if starts != 0 && starts != files {
            return Err(Failure::Input(anyhow!("--append-start-s: {starts} times for {files} files of --append")));
        }
        if let Some(start_s) = self.append_start_s.iter().find(|s| !s.is_finite()) {
            return Err(Failure::Input(anyhow!("--append-start-s {start_s}: not a finite time")));
        }
        let appended = self.append.iter().enumerate();
        let appended =
            appended.map(|(i, path)| SessionFile { path: path.clone(), start_s: self.append_start_s.get(i).copied() });
        Ok([SessionFile::first(&self.measured)].into_iter().chain(appended).collect())
    }
}

impl Analysis {
    /// Names, units and frame of the columns in the files of a role.
    pub(super) fn column_map(&self, laws: &LawsFile, role: &str) -> Result<ColumnMap, Failure> {
        self.sensor.column_map(&self.columns, laws, role)
    }

    /// The model with its curves, and the choices beside the data.
    pub(super) fn model_and_options(&self) -> Result<(Data, ReferenceCurves, Options), Failure> {
        let own = self.laws.as_deref().map(LawsFile::read).transpose()?.unwrap_or_default();
        let plan = self.plan(&own)?;
        let (file, model) = crate::model::load(self.model.as_deref())?;
        let data = *file.file().model.data();
        let reference = ReferenceCurves::from_model_data(&data, self.model.is_some());
        let mut errors = self.covariate_sd.clone();
        if !errors.iter().any(|e| e.column == Column::Hydration) {
            errors.push(CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU });
        }
        let settings = SelectionSettings { alpha: self.alpha, seed: self.seed, laws: own.with_library() };
        Ok((data, reference, Options { settings, errors, model, plan, own }))
    }

    /// What the laboratory can do; columns of a file of laws are factors under their own names.
    fn plan(&self, own: &LawsFile) -> Result<PlanConstraints, Failure> {
        if !(self.least_rest_s >= 0.0 && self.least_rest_s.is_finite()) {
            return Err(Failure::Input(anyhow!("--least-rest-s {}: not a time", self.least_rest_s)));
        }
        let own: Vec<&str> = own.columns.iter().filter(|c| c.derived.is_none()).map(|c| c.name.as_str()).collect();
        let factor = |name: &String| {
            let known = FACTORS.iter().find(|f| [f.short(), f.name].contains(&name.as_str()));
            known.map(|f| f.name).or(own.iter().copied().find(|c| c == name)).map(str::to_owned).ok_or_else(|| {
                let names: Vec<&str> =
                    FACTORS.iter().map(|f| -> &str { f.short() }).chain(own.iter().copied()).collect();
                Failure::Input(anyhow!("--can-set {name}: none of {}", names.join(", ")))
            })
        };
        let can_set: Vec<String> = self.can_set.iter().map(factor).collect::<Result<_, _>>()?;
        Ok(PlanConstraints { can_set: (!can_set.is_empty()).then_some(can_set), least_rest_s: self.least_rest_s })
    }
}

/// A level of a test.
fn level(text: &str) -> Result<f64, String> {
    between(text, 0.5)
}

/// The time of --power.
fn power_time(text: &str) -> Result<f64, String> {
    between(text, 86_400.0)
}

fn between(text: &str, high: f64) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value < high { Ok(value) } else { Err(format!("not between 0 and {high}")) }
}

fn covariate(text: &str) -> Result<CovariateError, String> {
    let (name, sd) = text.split_once('=').ok_or("expected COLUMN=SD, as in hydration_au=2")?;
    let known = || states().map(|(column, _)| column);
    let column = known().find(|c| c.name() == name.trim()).ok_or_else(|| {
        format!("`{name}` is not one of {}", known().map(Column::name).collect::<Vec<_>>().join(", "))
    })?;
    let sd: f64 = sd.trim().parse().map_err(|_| format!("`{sd}` is not a number"))?;
    if sd >= 0.0 && sd.is_finite() {
        Ok(CovariateError { column, sd })
    } else {
        Err(format!("{sd} is not a standard deviation"))
    }
}
