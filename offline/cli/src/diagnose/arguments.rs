//! Arguments of `fingerpad diagnose`, and what they ask for.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad_diagnose::laws::Column;
use fingerpad_diagnose::{ColumnMap, CovariateError, LawsFile, PlanConstraints, Rotation, SessionFile};

use crate::{Failure, Model};

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
  fingerpad diagnose check m.csv
  fingerpad diagnose --template runs.csv
  fingerpad diagnose --calibration c.csv --measured m.csv --append n.csv --append-start-s 900 --out d
  fingerpad diagnose --calibration c1.csv --measured m1.csv --map x=Fx,y=Fy,normal=Fz --sensor-rpy-deg 180,0,0 --out d
  fingerpad diagnose --calibration c0.csv --measured m0.csv --map run=Trial --check
  fingerpad diagnose --calibration c.csv --measured m.csv --can-set depth,speed --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --laws laws.toml --out d
  fingerpad diagnose --calibration c.csv --measured m.csv --power --power-seconds 20 --out d
  fingerpad diagnose --group fingers.csv --out together

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

--group looks for a law that several fingers share (three or more), each with a calibration and measured runs of its own: the
evidence is added over the fingers, the law has one shape and a size in each finger, and the mean size has the finger as
the unit. group.json has all numbers, group_sizes.svg the sizes with their intervals, group_sizes.csv the same as a table.

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
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    /// Runs without an effect, under reference conditions (CSV)
    #[arg(long, value_name = "C.csv", required_unless_present_any = ["force_only", "table", "template", "group"])]
    pub(super) calibration: Option<PathBuf>,
    /// Runs to be explained (CSV); with --force-only several traces may be given
    #[arg(long, value_name = "M.csv", required_unless_present_any = ["table", "template", "group"], num_args = 1..)]
    pub(super) measured: Vec<PathBuf>,
    /// Further runs, opened only after the laws are chosen (CSV)
    #[arg(long, value_name = "H.csv")]
    pub(super) holdout: Option<PathBuf>,
    /// Further measured runs, whose files join --measured in this order: the verdict and the next experiment are those of all runs (CSV)
    #[arg(long, value_name = "RUN.csv", num_args = 1.., conflicts_with_all = ["force_only", "table"])]
    pub(super) append: Vec<PathBuf>,
    /// Time of the first row of each appended file on the clock of --measured, s, where its clock was started again
    #[arg(long, value_name = "S", value_delimiter = ',', allow_negative_numbers = true, requires = "append")]
    pub(super) append_start_s: Vec<f64>,
    /// Several fingers in one analysis: a list with the columns finger, calibration, measured (CSV; files beside the list)
    #[arg(
        long,
        value_name = "FINGERS.csv",
        conflicts_with_all = [
            "calibration", "measured", "holdout", "append", "force_only", "table", "check", "power", "confirm_fe", "report"
        ]
    )]
    pub(super) group: Option<PathBuf>,
    /// Model file to start from; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    pub(super) model: Option<PathBuf>,
    /// Standard deviation of a state column's readings, as column=value; may be repeated
    #[arg(long, value_name = "COLUMN=SD", value_parser = covariate)]
    pub(super) covariate_sd: Vec<CovariateError>,
    /// Laws of your own: formulas over drivers and further columns (TOML), see docs/laws-of-your-own.md
    #[arg(long, value_name = "MINE.toml", conflicts_with_all = ["force_only", "table"])]
    pub(super) laws: Option<PathBuf>,
    /// Level of the tests of a law
    #[arg(long, default_value_t = 0.01)]
    pub(super) alpha: f64,
    /// Seed of the sign flips
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Simulate what these runs can show: false alarms, detection and naming of each law at 3, 10 and 30 %
    #[arg(long, conflicts_with_all = ["force_only", "table", "check"])]
    pub(super) power: bool,
    /// With --power: time for it, s
    #[arg(long, value_name = "S", default_value_t = 120.0, requires = "power")]
    pub(super) power_seconds: f64,
    /// Groups of measured runs that are left out in turn to see whether the verdict holds; 0 for none
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(super) stability_groups: usize,
    /// Switch the effect on inside the finite-element law and re-run a part of the strokes
    #[arg(long, conflicts_with_all = ["force_only", "table"])]
    pub(super) confirm_fe: bool,
    /// With --confirm-fe: strokes that are run, as many again of the calibration
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    pub(super) fe_strokes: u32,
    /// Geometry, mesh, materials and law of the finite-element finger for --confirm-fe and --table
    #[command(
        flatten,
        next_help_heading = "The finite-element finger of --confirm-fe (coarse mesh unless said) and --table (medium)"
    )]
    pub(super) finger: Model,
    /// Forces alone: a finger moved freely on a force plate
    #[arg(long, conflicts_with_all = ["calibration", "table", "holdout"])]
    pub(super) force_only: bool,
    /// What the columns are called in the files; a minus sign turns one round
    #[arg(long, value_name = "normal=-Fz,x=Fx,y=Fy,t=Timestamp", allow_hyphen_values = true)]
    pub(super) map: Option<String>,
    /// Roll, pitch and yaw of the force sensor in the contact frame, degrees, about the fixed axes x, y, z one after the other; forces are
    /// turned by them after --map
    #[arg(
        long,
        value_name = "ROLL,PITCH,YAW",
        allow_hyphen_values = true,
        conflicts_with_all = ["sensor_matrix", "table"]
    )]
    pub(super) sensor_rpy_deg: Option<String>,
    /// The same as the rotation matrix from the sensor frame to the contact frame, nine numbers row by row
    #[arg(long, value_name = "R11,R12,...,R33", allow_hyphen_values = true, conflicts_with = "table")]
    pub(super) sensor_matrix: Option<String>,
    /// Units of columns that are not in mm, N, s, mm/s, C, deg, au: um, cm, m, in, mN, gf, kgf, lbf, ms, us, ns, min, um/s, K,
    /// F, rad, fraction and others; measured:depth=um holds for --measured alone, as calibration: and holdout: do for theirs
    #[arg(long, value_name = "depth=um,normal=mN")]
    pub(super) unit: Option<String>,
    /// Say what was understood and what can be tested, and diagnose nothing
    #[arg(long, conflicts_with_all = ["force_only", "table", "confirm_fe"])]
    pub(super) check: bool,
    /// Write a file with all columns and two rows as an example, and diagnose nothing
    #[arg(long, value_name = "RUNS.csv")]
    pub(super) template: Option<PathBuf>,
    /// What the next experiment may vary: depth, speed, direction, dwell, hydration, temperature, length, rest, and columns of
    /// the file of laws
    #[arg(long, value_name = "depth,speed,dwell", value_delimiter = ',')]
    pub(super) can_set: Vec<String>,
    /// Least rest before each stroke of the next experiment, s
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    pub(super) least_rest_s: f64,
    /// A table like Table 1 of Yoshida et al. 2011 (CSV), to be compared with the finite elements
    #[arg(long, value_name = "T.csv", conflicts_with = "measured")]
    pub(super) table: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", required_unless_present_any = ["check", "template"])]
    pub(super) out: Option<PathBuf>,
    /// Where report.json goes, if not into the folder
    #[arg(long, value_name = "R.json")]
    pub(super) report: Option<PathBuf>,
}

/// A first look in place of a diagnosis.
#[derive(clap::Subcommand)]
pub enum Command {
    /// Say what is in the files: columns, units, rates, strokes, loads, speeds, what is missing and what they can be used for
    Check(CheckFiles),
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
    /// What the columns are called in the files; a minus sign turns one round
    #[arg(long, value_name = "normal=-Fz,t=Timestamp", allow_hyphen_values = true)]
    pub(super) map: Option<String>,
    /// Units of columns that are not in mm, N, s, mm/s, C, deg, au
    #[arg(long, value_name = "depth=um,normal=mN")]
    pub(super) unit: Option<String>,
    /// Print the same as JSON, a list with an entry for each file
    #[arg(long)]
    pub(super) json: bool,
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

impl Args {
    /// The folder for the results, which the command line demands where anything is written to it.
    pub(super) fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new("."))
    }

    /// Refuses numbers outside their ranges.
    pub(super) fn validate(&self) -> Result<(), Failure> {
        let problem = if !(self.alpha > 0.0 && self.alpha < 0.5) {
            format!("--alpha {}: not between 0 and 0.5", self.alpha)
        } else if !(self.least_rest_s >= 0.0 && self.least_rest_s.is_finite()) {
            format!("--least-rest-s {}: not a time", self.least_rest_s)
        } else if !(self.power_seconds > 0.0 && self.power_seconds <= 86_400.0) {
            format!("--power-seconds {}: not between 0 and 86400 s", self.power_seconds)
        } else {
            return Ok(());
        };
        Err(Failure::Input(anyhow!(problem)))
    }

    /// What the laboratory can do; columns of a file of laws are factors under their own names.
    pub(super) fn plan(&self, own: &LawsFile) -> Result<PlanConstraints, Failure> {
        let factor = |name: &String| {
            let known = FACTORS.iter().find(|(short, column)| name == short || name == column);
            let of_own = own.columns.iter().find(|c| c.name == *name && c.derived.is_none());
            known.map(|(_, column)| (*column).to_owned()).or(of_own.map(|c| c.name.clone())).ok_or_else(|| {
                let names: Vec<&str> = FACTORS
                    .iter()
                    .map(|(short, _)| *short)
                    .chain(own.columns.iter().filter(|c| c.derived.is_none()).map(|c| c.name.as_str()))
                    .collect();
                Failure::Input(anyhow!("--can-set {name}: none of {}", names.join(", ")))
            })
        };
        let can_set: Vec<String> = self.can_set.iter().map(factor).collect::<Result<_, _>>()?;
        Ok(PlanConstraints { can_set: (!can_set.is_empty()).then_some(can_set), least_rest_s: self.least_rest_s })
    }

    /// Names, units and frame of the columns in the files of a role.
    pub(super) fn column_map(&self, laws: &LawsFile, role: &str) -> Result<ColumnMap, Failure> {
        let refused = |problem: String| Failure::Input(anyhow!(problem));
        let of_angles = self.sensor_rpy_deg.as_deref().map(Rotation::from_rpy_deg);
        let rotation = of_angles.or_else(|| self.sensor_matrix.as_deref().map(Rotation::from_matrix));
        let rotation = rotation.transpose().map_err(refused)?;
        let (map, unit) = (self.map.as_deref(), self.unit.as_deref());
        let map = ColumnMap::parse_with(laws.columns.clone(), map, unit, role).map_err(refused)?;
        Ok(map.turned_by(rotation))
    }

    /// The files of the measured runs: that of --measured and those of --append.
    pub(super) fn session(&self, measured: &Path) -> Result<Vec<SessionFile>, Failure> {
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
        Ok([SessionFile::first(measured)].into_iter().chain(appended).collect())
    }
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
