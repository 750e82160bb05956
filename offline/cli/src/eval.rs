//! `fingerpad eval`: the reduced model, through the core, along a path.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad::effects::Column;
use fingerpad::effects::OWN;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad::{Body, LeastRadii, Orthotropy, Surface};
use fingerpad::{Effects, Error, File, Relaxation, Status, pad};
use fingerpad_diagnose::{ColumnMap, Correction, OwnColumn, RunSet, replay_all};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path as PlanePath, Turn, path_csv, response_csv};
use fingerpad_fe::material::relaxation;
use fingerpad_reduce::pad::{body_of, simulate_path_on_pad};
use fingerpad_reduce::{
    PathError, TrajectoryRow, check_path, simulate_path, simulate_path_with_effects, steps_between_rows,
};

use super::conditions::{Conditions, read_by};
use super::model::Loaded;
use super::observe::{HEADER, ObserveArgs};
use super::plausibility::{warn_of_depths, warn_of_force_unit, warn_of_no_contact};
use super::rigid_body::BodyArgs;
use super::{Failure, Mark, Outputs, model, outputs, progress::during};

/// Follow a path of the plane with the reduced model
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad eval --path path.csv --out reduced.csv                             the shipped fingertip
  fingerpad eval --model model.fpm --path path.csv --out reduced.csv           your own model
  fingerpad eval --model corrected.fpm --runs holdout.csv --out predicted.csv  beside measured runs
  fingerpad eval --model charged.fpm --path path.csv --column voltage_v=120 --out reduced.csv
  fingerpad eval --body sphere --radius-mm 10 --path path.csv --out reduced.csv  the shipped pad on a ball
  fingerpad eval --relaxation human-assumed --path path.csv --out reduced.csv  tissue that relaxes (shares assumed)
  fingerpad eval --orthotropy 0.7:30 --path path.csv --out reduced.csv         friction that depends on the direction
  fingerpad eval --model pad.fpm --path path.csv --out reduced.csv             a pad, which `pad` writes
  fingerpad eval --path - --out - < path.csv                                   from and to a pipe
  fingerpad eval --observe log.csv --out margin.csv                            margin on a surface of unknown friction

Paths are those of `simulate`: depth_mm or normal_force_n, slides or friction_x_n and friction_y_n, and spin_deg,
pitch_deg and roll_deg. All of them are linear between rows. Moments in place of angles are refused. The response has
the columns of `simulate`, and friction_limit_n, slip_margin, band_normal_n, band_friction_n,
tangential_friction_x_n, tangential_friction_y_n (friction without the pressure on a body's slopes), slip_margin_relaxed
(the margin that is left when the tissue has relaxed). The bands are
half-widths that contain 95 % of the finite-element rows that were left out of the fit. Steps are at most 0.02 mm and
0.4 degrees; all arithmetic is that of the package on the microcontroller. If a force cannot be reached, the result is
the nearest state, with the status load_not_reached. Flags of the column status are counted on standard error.

--runs takes measured runs as `diagnose` does, state columns included. It writes prediction and residual of every row,
and prints the root mean square residual: for the corrected.fpm of a diagnosis this is the gap after the correction in
its report. A model with a law of your own (docs/laws-of-your-own.md) reads its columns there. A --path may have them
too, a value a row, linear between rows; --column voltage_v=120 sets a constant value along the whole path.

--observe takes a recorded log with the columns t_s, normal_force_n, friction_x_n, friction_y_n, slide_x_mm and
slide_y_mm (forces on the finger, slide of the surface against the finger's base) and, if there is a tactile skin,
stick_ratio (share of the contact area that sticks, with the noise --stick-noise). It writes for every row what
is known of the surface: strength factor and slip margin with their 95 % bands, the chance of full slip within 50 ms, and
whether this is more than the prior (docs/unknown-friction.md).

--relaxation lets the tissue relax: held, the force falls as 1 plus the sum of the shares times exp(-t/time); the
response then has more rows. human-assumed has published times (4 ms, 70 ms, 1.4 s) and assumed shares (1, 0.6, 0.6).

A model file is either a bed of springs, for one pose of the finger on a plane, or a pad, for every pose on a plane, a
sphere, a cylinder or an edge (--body). Without --model the shipped bed is used, or the shipped pad if the path leaves
the bed's pose or depth or --body is given. On a body, depth_mm counts along the normal from the place where the plane
through the body's apex would first touch in the pose; the apex lies under first touch of the pose at the start of the
path. If a pose is out of the range of a pad's fit, the nearest pose is used, with the status pose_out_of_range.

An earlier response of eval at --out is replaced, any other file only with --force. With --out - the response is
written to standard output and messages to standard error; --path - and --runs - read standard input.")]
pub struct Args {
    /// Model file; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// Path of the plane (CSV); - for standard input
    #[arg(long, value_name = "PATH.csv", required_unless_present_any = ["runs", "observe"])]
    path: Option<PathBuf>,
    /// Measured runs (CSV) in place of a path; - for standard input
    #[arg(long, value_name = "RUNS.csv", conflicts_with = "path")]
    runs: Option<PathBuf>,
    #[command(flatten)]
    observe: ObserveArgs,
    #[command(flatten)]
    conditions: Conditions,
    #[command(flatten)]
    body: BodyArgs,
    /// Branches of the tissue in place of those of the model file: `human-assumed`, `none`, or SHARE:TIME_S of up to three
    /// branches, shares over the relaxed stiffness
    #[arg(long, value_name = "BRANCHES", value_parser = relaxation::parse, conflicts_with_all = ["runs", "observe"])]
    relaxation: Option<Relaxation>,
    /// Orthotropic friction of a pad in place of that of its file: strength across an axis of the skin over the strength along it, 0.1 to
    /// 10, and the angle of that axis from x towards y, degrees, as in 0.7:30
    #[arg(long, value_name = "RATIO:AXIS_DEG", value_parser = orthotropy, conflicts_with_all = ["runs", "observe"])]
    orthotropy: Option<Orthotropy>,
    /// Constant value of an additional column that the model reads and the path does not have, as column=value; may be
    /// repeated
    #[arg(long, value_name = "COLUMN=VALUE", value_parser = column_value, conflicts_with = "runs")]
    column: Vec<(String, f64)>,
    /// Response to write (CSV); - for standard output
    #[arg(long, value_name = "RESPONSE.csv")]
    out: PathBuf,
    /// Replace a file at --out that this command did not write
    #[arg(long)]
    force: bool,
}

impl Args {
    /// The flag that only a pad has, if one is given.
    fn pad_flag(&self) -> Option<&'static str> {
        self.orthotropy.is_some().then_some("--orthotropy")
    }
}

/// Orthotropic friction from its text.
fn orthotropy(text: &str) -> Result<Orthotropy, String> {
    let expected = || format!("`{text}`: expected RATIO:AXIS_DEG, as in 0.7:30");
    let (ratio, axis_deg) = text.split_once(':').ok_or_else(expected)?;
    let [ratio, axis_deg] = [ratio, axis_deg].map(|number| number.trim().parse::<f32>().map_err(|_| expected()));
    Orthotropy::new(ratio?, axis_deg?).map_err(|e| match e {
        Error::Range { index: 0, value, .. } => format!("ratio {value} is outside 0.1 to 10"),
        _ => format!("the axis of `{text}` is outside -180 to 180 degrees"),
    })
}

fn column_value(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected COLUMN=VALUE, as in voltage_v=120")?;
    let number: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.trim().to_owned(), number))
}

/// A value of the model file's provenance; None if it is absent or of another type.
fn provenance_value<T: serde::de::DeserializeOwned>(meta: &str, name: &str) -> Option<T> {
    let meta = serde_json::from_str::<serde_json::Value>(meta).ok()?;
    serde_json::from_value(meta.get(name)?.clone()).ok()
}

/// Columns of the user's own that a model's tables read, in the order of the file.
fn own_columns(file: &File<'_>) -> Vec<OwnColumn> {
    file.columns.iter().map(OwnColumn::from).collect()
}

/// Values of these columns along a path: those of its file at every waypoint, else that of --column throughout.
struct AlongPath {
    constant: [f32; OWN],
    varying: Vec<Option<Vec<f64>>>,
}

impl AlongPath {
    /// Each column is either in the path or in --column.
    fn of(
        args: &Args,
        columns: &[OwnColumn],
        varying: Vec<Option<Vec<f64>>>,
        model_name: &str,
        path: &Path,
    ) -> Result<Self, Failure> {
        let mut constant: [Option<f64>; OWN] = [None; OWN];
        for (name, value) in &args.column {
            let refuse = |problem: String| Failure::Input(anyhow!("--column {name}={value}: {problem}"));
            let Some(place) = columns.iter().position(|c| c.name == *name) else {
                let known: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                return Err(refuse(format!("{model_name} reads no such column of your own; it reads {known}")));
            };
            let OwnColumn { range: [low, high], unit, .. } = &columns[place];
            if !(value >= low && value <= high) {
                return Err(refuse(format!("is outside {low} to {high} {unit}")));
            }
            if varying[place].is_some() {
                return Err(refuse(format!("{} has that column", path.display())));
            }
            if constant[place].replace(*value).is_some() {
                return Err(refuse("it is given twice".into()));
            }
        }
        let missing = columns.iter().zip(constant).zip(&varying).find(|((_, c), v)| c.is_none() && v.is_none());
        if let Some(((column, _), _)) = missing {
            return Err(Failure::Input(anyhow!(
                "{}: line 1: column `{name}` is missing, which {model_name} reads; --column {name}={} holds it at the value \
                 of the calibration",
                path.display(),
                column.reference,
                name = column.name
            )));
        }
        Ok(Self { constant: constant.map(|v| v.unwrap_or(0.0) as f32), varying })
    }
}

/// Measured runs with the columns that a model reads.
fn read_runs(path: &Path, file: &File<'_>, model_name: &str) -> Result<RunSet, Failure> {
    let map = ColumnMap::parse_with(own_columns(file), None, None, "").map_err(|e| Failure::Input(anyhow!(e)))?;
    let set = super::diagnose::read_mapped(outputs::input(path), &map)?;
    // The others are counted from the motion if the file does not have them.
    let of_skin = [Column::Hydration, Column::Temperature, Column::Width];
    let of_skin = of_skin.into_iter().filter(|column| read_by(file).contains(column));
    let missing = map.own_columns().into_iter().chain(of_skin).find(|column| !set.recorded.contains(column));
    match missing {
        None => Ok(set),
        Some(column) => Err(Failure::Input(anyhow!(
            "{}: line 1: column `{}` is missing, which {model_name} reads",
            path.display(),
            column.name()
        ))),
    }
}

/// Most steps of a path between its rows: about a second of computing. Rows are as many as the file has.
const MOST_STEPS: f64 = 1e6;
/// First line of the prediction of measured runs.
const PREDICTION: &str = "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,\
                          residual_normal_n,residual_x_n,residual_y_n";

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (mut file, mut model_name) = model::load_in_time(args.model.as_deref())?;
    let inputs = [
        ("--model", &args.model),
        ("--path", &args.path),
        ("--runs", &args.runs),
        ("--observe", &args.observe.observe),
    ];
    let marks =
        [response_csv::header(true) + "\n", format!("{PREDICTION}\n"), format!("{HEADER}\n")].map(Mark::beginning);
    let outputs = Outputs::beside(inputs.map(|(flag, path)| (flag, path.as_deref())))
        .stream("--out", &args.out, marks.into())
        .force(args.force);
    // Standard input can be read once only.
    let mut shipped_path = None;
    if let (None, Some(path_file), Loaded::Bed(bed)) = (&args.model, &args.path, &file) {
        let read = during("reading", |_| path_csv::read_with(outputs::input(path_file), &[]))?;
        if let Some(reason) = needs_pad(args, &bed.file(), &read.0) {
            let (pad, name) = model::shipped_pad()?;
            eprintln!("{name}: {reason}");
            (file, model_name) = (Loaded::Pad(pad), name);
        }
        shipped_path = Some(read);
    }
    let file = match file {
        Loaded::Bed(file) => file,
        Loaded::Pad(_) if args.observe.observe.is_some() => {
            return Err(Failure::Input(anyhow!("{model_name}: --observe needs a bed of springs")));
        }
        Loaded::Pad(file) => return on_pad(args, &file, outputs, &model_name, shipped_path),
    };
    if args.body.is_given() {
        return Err(Failure::Input(anyhow!(
            "{model_name}: a bed of springs supports the plane only; a pad supports other bodies"
        )));
    }
    if let Some(flag) = args.pad_flag() {
        return Err(Failure::Input(anyhow!("{model_name}: {flag} needs a pad; a bed of springs does not have it")));
    }
    if let Some(log) = &args.observe.observe {
        if file.file().model.relaxation().is_some() {
            return Err(Failure::Input(anyhow!(
                "{model_name}: section RELX: --observe needs a bed of springs whose tissue does not relax"
            )));
        }
        return super::observe::run(&args.observe, log, &file, outputs, &args.out);
    }
    match (&args.runs, &args.path) {
        (Some(runs), _) => {
            outputs.prepare()?;
            along_runs(args, &file, &model_name, runs)
        }
        (None, Some(path)) => {
            let columns = own_columns(&file.file());
            args.conditions.check(&file.file(), &model_name)?;
            let (plane, varying) = match shipped_path {
                Some(read) => read,
                None => during("reading", |_| read_path(path, &columns))?,
            };
            check(path, &plane, &file, &model_name)?;
            let own = AlongPath::of(args, &columns, varying, &model_name, path)?;
            let mut file = file.file();
            if let Some(relaxation) = &args.relaxation {
                let refused = |e| Failure::Input(anyhow::Error::new(e).context(format!("{model_name}: --relaxation")));
                file = file.with_relaxation(relaxation).map_err(refused)?;
            }
            if let Some(sentence) = file.model.relaxation().and_then(relaxation::assumption) {
                eprintln!("{sentence}");
            }
            outputs.prepare()?;
            warn_of_depths(&plane);
            let rows = during("path", |_| along_path(args, &file, &model_name, path, &plane, &own))?;
            write(args, &plane, &rows, &Range::of_bed(&file))
        }
        (None, None) => Err(Failure::Input(anyhow!("--path is missing"))),
    }
}

/// Why a path needs the pad that ships instead of the bed, if it does.
fn needs_pad(args: &Args, bed: &File<'_>, path: &PlanePath) -> Option<String> {
    if let Some(flag) = args.body.is_given().then_some("--body").or(args.pad_flag()) {
        return Some(format!("{flag} requires a pad"));
    }
    let [pitch, roll] = bed.model.data().pose_deg;
    let turned = |turn: &Option<Turn>, of_bed: f32| {
        turn.as_ref().is_some_and(|turn| turn.values.iter().any(|deg| (deg - f64::from(of_bed)).abs() > 1e-3))
    };
    if turned(&path.turns.pitch, pitch) || turned(&path.turns.roll, roll) {
        return Some(format!("the path leaves the pose of the shipped bed of springs (pitch {pitch}°, roll {roll}°)"));
    }
    let deepest = path.waypoints.iter().map(|w| w.normal).fold(0.0, f64::max);
    let most = bed.model.depth_max_mm();
    let is_deeper = path.drives[0] == Drive::Displacement && deepest > f64::from(most) + 1e-6;
    is_deeper.then(|| format!("the path is deeper than the shipped bed of springs was fitted ({most:.2} mm)"))
}

/// Writes the response and prints a summary of its status flags.
fn write(args: &Args, path: &PlanePath, rows: &[TrajectoryRow], range: &Range) -> Result<(), Failure> {
    let responses: Vec<_> = rows.iter().map(|r| r.response).collect();
    let extra: Vec<_> = rows
        .iter()
        .map(|r| {
            let [x, y] = r.tangential_friction_n;
            [r.friction_limit_n, r.slip_margin, r.band_normal_n, r.band_friction_n, x, y, r.slip_margin_relaxed]
        })
        .collect();
    response_csv::check(&args.out, &responses)?;
    during("writing", |_| outputs::write(&args.out, |w| response_csv::write_to(w, &responses, Some(&extra))))?;
    outputs::say(&args.out, &format!("{}: {} rows", args.out.display(), rows.len()));
    warn_of_flags(rows, range);
    warn_of_no_contact(path, &responses);
    Ok(())
}

/// Follows a path with a pad.
fn on_pad(
    args: &Args,
    file: &PadModelFile,
    outputs: Outputs,
    model_name: &str,
    read: Option<ReadPath>,
) -> Result<(), Failure> {
    let Some(path_file) = &args.path else {
        return Err(Failure::Input(anyhow!(
            "{model_name}: a pad follows a --path; measured --runs need a bed of springs"
        )));
    };
    if let Some((name, value)) = args.column.first() {
        return Err(Failure::Input(anyhow!(
            "--column {name}={value}: {model_name} is a pad, which reads no such column"
        )));
    }
    args.conditions.refuse_for_pad(model_name)?;
    let mut config = Config::default();
    args.body.apply(&mut config).map_err(Failure::Input)?;
    let Some(body) = body_of(&config.rigid_body.read()?, |x| x as f32) else {
        return Err(Failure::Input(anyhow!(
            "--body: a pad takes a plane, a sphere, a cylinder and an edge; `simulate` takes others"
        )));
    };
    let mut pad = file.file().pad;
    if let Some(relaxation) = args.relaxation {
        pad = pad.with_relaxation(relaxation);
    }
    if let Some(orthotropy) = args.orthotropy {
        pad = pad.with_orthotropy(orthotropy);
    }
    if let Some(sentence) = relaxation::assumption(pad.relaxation()) {
        eprintln!("{sentence}");
    }
    let LeastRadii { sphere_mm, cylinder_mm, edge_mm } = pad.least_radii_mm();
    if body.blunted(pad.least_radii_mm()).is_some() {
        return Err(Failure::Input(anyhow!(
            "--body: radius_mm = {} is below what the patches of {model_name} can see: {sphere_mm:.2} mm for a sphere, \
             {cylinder_mm:.2} mm for a cylinder, {edge_mm:.2} mm for an edge; `simulate` takes sharper bodies",
            config.rigid_body.radius_mm.unwrap_or(f64::NAN)
        )));
    }
    let (path, _) = match read {
        Some(read) => read,
        None => during("reading", |_| path_csv::read_with(outputs::input(path_file), &[]))?,
    };
    refuse_long(path_file, &path)?;
    outputs.prepare()?;
    if body == Body::Plane {
        warn_of_depths(&path);
    }
    let rows = during("path", |_| simulate_path_on_pad(&pad, &body, &path));
    let rows = rows.map_err(|e| Failure::Input(anyhow!("{}: {e}", path_file.display())))?;
    write(args, &path, &rows, &Range::of_pad(&pad))
}

/// Refuses a path that is absurdly long.
fn refuse_long(path_file: &Path, path: &PlanePath) -> Result<(), Failure> {
    let needed = steps_between_rows(path);
    if needed > MOST_STEPS {
        return Err(Failure::Input(anyhow!(
            "{}: the path takes {needed:.1e} steps of 0.02 mm, 0.4° or 5 mN between its rows, at most {MOST_STEPS:.0e} are \
             followed (20 m of motion): shorten it or divide it",
            path_file.display()
        )));
    }
    Ok(())
}

/// The range in which a model was fitted.
struct Range {
    depth_max_mm: f32,
    pitch_deg: [f32; 2],
    roll_max_deg: f32,
    /// Meaning of a result beyond the depth.
    beyond: &'static str,
}

impl Range {
    fn of_bed(file: &File<'_>) -> Self {
        let [pitch_deg, roll_deg] = file.model.data().pose_deg;
        Self {
            depth_max_mm: file.model.depth_max_mm(),
            pitch_deg: [pitch_deg; 2],
            roll_max_deg: roll_deg.abs(),
            beyond: "the result is that of the largest depth",
        }
    }

    fn of_pad(pad: &pad::Pad<'_>) -> Self {
        let n = pad.numbers;
        Self {
            depth_max_mm: n.depth_max_mm,
            pitch_deg: n.pitch_range_deg,
            roll_max_deg: n.roll_max_deg,
            beyond: "the result is extrapolated, up to twice that depth",
        }
    }
}

/// A path and the columns of the user's own that its file has.
type ReadPath = (PlanePath, Vec<Option<Vec<f64>>>);

/// Reads a path with the columns of the user's own that a model reads.
fn read_path(path_file: &Path, columns: &[OwnColumn]) -> Result<ReadPath, Failure> {
    let more: Vec<path_csv::More<'_>> =
        columns.iter().map(|c| path_csv::More { name: &c.name, unit: &c.unit, range: c.range }).collect();
    Ok(path_csv::read_with(outputs::input(path_file), &more)?)
}

/// Refuses a path that a bed cannot follow.
fn check(path_file: &Path, path: &PlanePath, model_file: &ModelFile, model_name: &str) -> Result<(), Failure> {
    let file = model_file.file();
    check_path(&file.model, !file.effects.is_empty(), path).map_err(|e| match e {
        PathError::OnePose { .. } | PathError::ForceWithEffects { .. } => {
            Failure::Input(anyhow!("{} with {model_name}: {e}", path_file.display()))
        }
        _ => Failure::Input(anyhow!("{}: {e}", path_file.display())),
    })?;
    refuse_long(path_file, path)
}

fn along_path(
    args: &Args,
    file: &File<'_>,
    model_name: &str,
    path_file: &Path,
    path: &PlanePath,
    own: &AlongPath,
) -> Result<Vec<TrajectoryRow>, Failure> {
    let rows = if file.effects.is_empty() {
        simulate_path(&file.model, path)
    } else {
        let effects = Effects::of_file(file)
            .map_err(|error| Failure::Input(anyhow::Error::new(error).context(model_name.to_owned())))?;
        let surroundings = args.conditions.surroundings(own.constant);
        simulate_path_with_effects(&file.model, &effects, surroundings, &own.varying, path)
    };
    rows.map_err(|e| Failure::Input(anyhow!("{}: {e}", path_file.display())))
}

/// Meaning of each status flag.
const FLAGS: [(Status, &str); 10] = [
    (Status::BAD_INPUT, "a depth or slide that is not finite"),
    (Status::BAD_TIME_STEP, "a time step that is not positive"),
    (Status::DEPTH_ABOVE_RANGE, "deeper than the model was fitted:"),
    (Status::LARGE_INCREMENT, "a slide of one step beyond 64 mm, cut to that"),
    (Status::LOAD_NOT_REACHED, "a force out of reach: the result is the nearest state"),
    (Status::SPIN_IGNORED, "a turn of the plane, which was left out"),
    (Status::MEMORY_LOST, "an inconsistent memory of the contact, which was reset"),
    (
        Status::EFFECT_HELD,
        "an effect beyond its range, clamped: a pull beyond the normal force, a force that is not finite, a driver beyond \
         the table of a law",
    ),
    (Status::NOT_CONVERGED, "no equilibrium within the rounds of a step: too large a step, or too sharp a body"),
    (
        Status::POSE_OUT_OF_RANGE,
        "a pose beyond those that the model was fitted in: the result is that of the nearest pose",
    ),
];

/// Counts the response's flags on standard error.
fn warn_of_flags(rows: &[TrajectoryRow], range: &Range) {
    let [least, most] = range.pitch_deg;
    let roll = range.roll_max_deg;
    let poses = format!("was fitted in (pitch {least} to {most}°, roll {0:+} to {roll:+}°)", -roll);
    for (flag, meaning) in FLAGS {
        let of_flag = |r: &&TrajectoryRow| r.response.status.contains(flag);
        let Some(first) = rows.iter().position(|r| of_flag(&r)) else { continue };
        let count = rows.iter().filter(of_flag).count();
        let meaning = meaning
            .replace("was fitted:", &format!("was fitted ({:.4} mm): {}", range.depth_max_mm, range.beyond))
            .replace("was fitted in", &poses);
        let at = &rows[first].response;
        eprintln!(
            "warning: {flag} in {count} of {} rows, first in row {} of the response (t_s {:.4}, depth_mm {:.4}): {meaning}",
            rows.len(),
            first + 1,
            at.t_s,
            at.depth_mm
        );
    }
}

/// Prediction and residual of measured runs, in the conditions that were recorded.
fn along_runs(args: &Args, file: &ModelFile, model_name: &str, path: &Path) -> Result<(), Failure> {
    let file = file.file();
    let mut set = read_runs(path, &file, model_name)?;
    // A diagnosis that corrected columns with reading errors stored the corrections in the file.
    let corrections: Vec<Correction> = provenance_value(file.meta, "column_corrections").unwrap_or_default();
    corrections.iter().for_each(|c| c.apply(&mut set));
    let effects = Effects::of_file(&file)
        .map_err(|error| Failure::Input(anyhow::Error::new(error).context(model_name.to_owned())))?;
    let (rms_n, predicted) = during("runs", |_| replay_all(&file.model, &effects, &set));
    let readings = set.runs.iter().flat_map(|run| &run.force_n).map(|reading| reading[0]);
    warn_of_force_unit(readings.zip(predicted.iter().step_by(3).copied()));
    outputs::write(&args.out, |out| {
        writeln!(out, "{PREDICTION}")?;
        let mut at = predicted.chunks_exact(3);
        for run in &set.runs {
            for ((row, [x, y]), reading) in run.rows.iter().zip(&run.slide_mm).zip(&run.force_n) {
                let p = at.next().expect("three numbers a row");
                if reading.iter().all(|f| f.is_nan()) {
                    // A turn that the logger lost: no row of the file.
                    continue;
                }
                let left = [0, 1, 2]
                    .map(|k| reading[k] - p[k])
                    .map(|r| if r.is_nan() { String::new() } else { r.to_string() });
                let name = if run.labels.run.contains([',', '"']) {
                    format!("\"{}\"", run.labels.run.replace('"', "\"\""))
                } else {
                    run.labels.run.clone()
                };
                writeln!(
                    out,
                    "{name},{},{},{x},{y},{},{},{},{},{},{}",
                    row.t_s, row.depth_mm, p[0], p[1], p[2], left[0], left[1], left[2]
                )?;
            }
        }
        Ok(())
    })?;
    let [normal, x, y] = rms_n;
    let line = format!(
        "{}: {} runs, {} rows; root mean square residual normal {normal:.5}, x {x:.5}, y {y:.5} N",
        args.out.display(),
        set.runs.len(),
        set.rows()
    );
    outputs::say(&args.out, &line);
    Ok(())
}
