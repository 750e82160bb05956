//! `fingerpad eval`: the reduced model, through the core, along a path.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad::effects::OWN;
use fingerpad::{Effects, File, ModelFile, Status, Surroundings};
use fingerpad_diagnose::{ColumnMap, Correction, OwnColumn, RunSet, replay_all};
use fingerpad_fe::load_path::{Drive, Path as PlanePath, path_csv, response_csv};
use fingerpad_formats as formats;
use fingerpad_reduce::{TrajectoryRow, simulate_path, simulate_path_with_effects, steps};

use super::{Failure, Outputs, model, progress::during};

/// Follow a path of the plane with the reduced model
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad eval --path path.csv --out response.csv                            the shipped fingertip
  fingerpad eval --model model.fpm --path path.csv --out response.csv          your own model
  fingerpad eval --model corrected.fpm --runs holdout.csv --out predicted.csv  beside measured runs
  fingerpad eval --model charged.fpm --path path.csv --column voltage_v=120 --out response.csv

Paths are those of `simulate`: depth_mm or normal_force_n, slides or friction_x_n and friction_y_n. The response has the
columns of `simulate` and friction_limit_n, slip_margin, band_normal_n, band_friction_n: the half-widths within which
95 % of the finite-element runs lie that the fit did not see. Steps are at most 0.02 mm; all arithmetic is that of the
package on the microcontroller. A force out of reach leaves the nearest state and the status load_not_reached. Flags
of the column status are counted on standard error.

--runs takes measured runs as `diagnose` does, state columns included, writes prediction and residual of every row, and
prints the root mean square residual: for the corrected.fpm of a diagnosis the gap after of its report. A model with a law
of your own (docs/laws-of-your-own.md) reads its columns there. A --path may have them too, a value a row, between which they
change evenly; --column voltage_v=120 holds one at a value along the whole path.")]
pub struct Args {
    /// Model file; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// Path of the plane (CSV)
    #[arg(long, value_name = "PATH.csv", required_unless_present = "runs")]
    path: Option<PathBuf>,
    /// Measured runs (CSV) in place of a path
    #[arg(long, value_name = "RUNS.csv", conflicts_with = "path")]
    runs: Option<PathBuf>,
    /// Moisture of the skin along the path, corneometer units, where the model has that effect
    #[arg(long, default_value_t = 35.0)]
    hydration_au: f32,
    /// Temperature of the skin along the path, °C, where the model has that effect
    #[arg(long, default_value_t = 32.0)]
    temperature_c: f32,
    /// Width of the finger, mm, where the model has that effect
    #[arg(long, default_value_t = 16.0)]
    finger_width_mm: f32,
    /// Clock of the series at the start of the path, s, where the model has a drift
    #[arg(long, default_value_t = 0.0)]
    series_s: f32,
    /// Contact time since the last rest along the path, s, where the model has that effect; counted from the path unless said
    #[arg(long)]
    occlusion_s: Option<f32>,
    /// Value along the path of a column of your own that the model reads and the path lacks, as column=value; may be repeated
    #[arg(long, value_name = "COLUMN=VALUE", value_parser = column_value, conflicts_with = "runs")]
    column: Vec<(String, f64)>,
    /// Response to write (CSV)
    #[arg(long, value_name = "RESPONSE.csv")]
    out: PathBuf,
}

fn column_value(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected COLUMN=VALUE, as in voltage_v=120")?;
    let number: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.trim().to_owned(), number))
}

/// What the provenance of a model file says of it under a name; nothing where it does not.
fn told<T: serde::de::DeserializeOwned>(meta: &str, name: &str) -> Option<T> {
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

/// Measured runs with the columns of the user's own that a model reads.
fn read_runs(path: &Path, columns: &[OwnColumn], model_name: &str) -> Result<RunSet, Failure> {
    let map = ColumnMap::parse_with(columns.to_vec(), None, None).map_err(|e| Failure::Input(anyhow!(e)))?;
    let set = super::diagnose::read_mapped(path, &map)?;
    let missing = map.own_columns().into_iter().find(|column| !set.recorded.contains(column));
    match missing {
        None => Ok(set),
        Some(column) => Err(Failure::Input(anyhow!(
            "{}: line 1: column `{}` is missing, which {model_name} reads",
            path.display(),
            column.name()
        ))),
    }
}

/// Longest path, steps of the reduced model: about a second of computing.
const MOST_STEPS: f64 = 1e6;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (file, model_name) = model::load(args.model.as_deref())?;
    let inputs = [("--model", &args.model), ("--path", &args.path), ("--runs", &args.runs)];
    let outputs = Outputs::beside(inputs.map(|(flag, path)| (flag, path.as_deref()))).file("--out", Some(&args.out));
    match (&args.runs, &args.path) {
        (Some(runs), _) => {
            outputs.prepare()?;
            along_runs(args, &file, &model_name, runs)
        }
        (None, Some(path)) => {
            let columns = own_columns(&file.file());
            let (plane, varying) = read_path(path, &columns)?;
            let own = AlongPath::of(args, &columns, varying, &model_name, path)?;
            outputs.prepare()?;
            let rows = during("path", |_| along_path(args, &file, &model_name, path, &plane, &own))?;
            let responses: Vec<_> = rows.iter().map(|r| r.response).collect();
            let extra: Vec<_> =
                rows.iter().map(|r| [r.friction_limit_n, r.slip_margin, r.band_normal_n, r.band_friction_n]).collect();
            during("writing", |_| response_csv::write_with_extra(&args.out, &responses, &extra))?;
            println!("{}: {} rows", args.out.display(), rows.len());
            warn(&plane, &rows, file.file().model.depth_max_mm());
            Ok(())
        }
        (None, None) => Err(Failure::Input(anyhow!("--path is missing"))),
    }
}

/// A path that the reduced model can follow, with the columns of the user's own that its file has.
fn read_path(file: &Path, columns: &[OwnColumn]) -> Result<(PlanePath, Vec<Option<Vec<f64>>>), Failure> {
    let more: Vec<path_csv::More<'_>> =
        columns.iter().map(|c| path_csv::More { name: &c.name, unit: &c.unit, range: c.range }).collect();
    let (path, varying) = path_csv::read_with(file, &more)?;
    if path.drives[1] != path.drives[2] {
        return Err(Failure::Input(anyhow!(
            "{}: one slide is driven by displacement and the other by force; the reduced model drives both alike",
            file.display()
        )));
    }
    let needed = steps(&path);
    if needed > MOST_STEPS {
        let corner = |k: usize| [path.waypoints[k].normal, path.waypoints[k].x, path.waypoints[k].y];
        let length = |k: usize| (0..3).map(|i| (corner(k)[i] - corner(k - 1)[i]).abs()).fold(0.0, f64::max);
        let longest = (1..path.waypoints.len()).max_by(|a, b| length(*a).total_cmp(&length(*b))).unwrap_or(1);
        return Err(Failure::Input(anyhow!(
            "{}: the path takes {needed:.1e} steps of 0.02 mm or 5 mN, at most {MOST_STEPS:.0e} (20 m) are followed; \
             most of them lead to data row {}, {:?}",
            file.display(),
            longest + 1,
            corner(longest)
        )));
    }
    Ok((path, varying))
}

fn along_path(
    args: &Args,
    file: &ModelFile,
    model_name: &str,
    path_file: &Path,
    path: &PlanePath,
    own: &AlongPath,
) -> Result<Vec<TrajectoryRow>, Failure> {
    let file = file.file();
    if file.effects.is_empty() {
        return Ok(simulate_path(&file.model, path));
    }
    let effects = Effects::of_file(&file)
        .map_err(|error| Failure::Input(anyhow::Error::new(error).context(model_name.to_owned())))?;
    let surroundings = Surroundings {
        hydration_au: args.hydration_au,
        temperature_c: args.temperature_c,
        finger_width_mm: args.finger_width_mm,
        series_s: args.series_s,
        occlusion_s: args.occlusion_s,
        own: own.constant,
        ..Surroundings::default()
    };
    simulate_path_with_effects(&file.model, &effects, surroundings, &own.varying, path).ok_or_else(|| {
        Failure::Input(anyhow!(
            "{}: driven by force; {model_name} has effects, which know motions alone",
            path_file.display()
        ))
    })
}

/// What each flag of the status means.
const FLAGS: [(Status, &str); 9] = [
    (Status::BAD_INPUT, "a depth or slide that is no number"),
    (Status::BAD_TIME_STEP, "a time step that is not positive"),
    (Status::DEPTH_ABOVE_RANGE, "deeper than the model was fitted: the answer is that of the largest depth"),
    (Status::LARGE_INCREMENT, "a slide of one step beyond 64 mm, cut to that"),
    (Status::LOAD_NOT_REACHED, "a force out of reach: the nearest state stands there"),
    (Status::SPIN_IGNORED, "a turn of the plane, which was left out"),
    (Status::MEMORY_LOST, "an inconsistent memory of the contact, which was reset"),
    (
        Status::EFFECT_HELD,
        "an effect beyond its range, held there: a pull beyond the normal force, a force that is no number, a driver beyond \
         the table of a law",
    ),
    (Status::POSE_OUT_OF_RANGE, "a pose beyond those that the model was fitted in: the answer is that of the nearest"),
];

/// Says on standard error what the response's flags say, and what looks like a wrong unit or sign.
///
/// * `range_mm`: the depth up to which the model was fitted
fn warn(path: &PlanePath, rows: &[TrajectoryRow], range_mm: f32) {
    for (flag, meaning) in FLAGS {
        let of_flag = |r: &&TrajectoryRow| r.response.status.contains(flag);
        let Some(first) = rows.iter().position(|r| of_flag(&r)) else { continue };
        let count = rows.iter().filter(of_flag).count();
        let meaning = meaning.replace("was fitted", &format!("was fitted ({range_mm} mm)"));
        eprintln!(
            "warning: {flag} in {count} of {} rows, first in data row {} (t_s {:.4}, depth_mm {}): {meaning}",
            rows.len(),
            first + 1,
            rows[first].response.t_s,
            rows[first].response.depth_mm
        );
    }
    if path.drives[0] != Drive::Displacement {
        return;
    }
    let deepest = path.waypoints.iter().map(|w| w.normal).fold(f64::NEG_INFINITY, f64::max);
    if deepest <= 0.0 {
        eprintln!(
            "warning: no row touches: depth_mm is {deepest} at most and counts from first touch into the finger; is its \
             sign turned round?"
        );
    } else if deepest < 0.02 {
        eprintln!("warning: depth_mm is {deepest} at most; is the column in metres?");
    } else if deepest > 10.0 {
        eprintln!("warning: depth_mm goes up to {deepest} mm into a fingertip; is the column in micrometres?");
    }
}

/// Prediction and residual of measured runs, in the conditions that were recorded.
fn along_runs(args: &Args, file: &ModelFile, model_name: &str, path: &Path) -> Result<(), Failure> {
    let file = file.file();
    let mut set = read_runs(path, &own_columns(&file), model_name)?;
    // A diagnosis that corrected columns with reading errors left the way in the file.
    let corrections: Vec<Correction> = told(file.meta, "column_corrections").unwrap_or_default();
    corrections.iter().for_each(|c| c.apply(&mut set));
    let effects = Effects::of_file(&file)
        .map_err(|error| Failure::Input(anyhow::Error::new(error).context(model_name.to_owned())))?;
    let (rms_n, predicted) = during("runs", |_| replay_all(&file.model, &effects, &set));
    formats::atomic_write(&args.out, |out| {
        writeln!(
            out,
            "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,residual_normal_n,residual_x_n,residual_y_n"
        )?;
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
    println!(
        "{}: {} runs, {} rows; root mean square residual normal {:.5}, x {:.5}, y {:.5} N",
        args.out.display(),
        set.runs.len(),
        set.rows(),
        rms_n[0],
        rms_n[1],
        rms_n[2]
    );
    Ok(())
}
