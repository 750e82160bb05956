//! `fingerpad eval --observe`: the observer of the margin along a recorded log of force and motion.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad::host::ModelFile;
use fingerpad::margin::{Known, Margin, MarginObserver, Reading, Settings};
use fingerpad_formats::Columns;

use super::{Failure, Outputs, outputs, progress::during};

/// The log and the errors of its sensors.
#[derive(clap::Args)]
pub struct ObserveArgs {
    /// Recorded forces and motion (CSV) in place of a path: the slip margin on a surface of unknown friction; - for
    /// standard input
    #[arg(long, value_name = "LOG.csv", conflicts_with_all = ["path", "runs", "column"])]
    pub observe: Option<PathBuf>,
    /// Standard deviation of the noise of the log's forces, N
    #[arg(long, value_name = "N", default_value_t = 0.005, requires = "observe")]
    force_noise_n: f32,
    /// Standard deviation of the noise of the log's slide, mm
    #[arg(long, value_name = "MM", default_value_t = 0.005, requires = "observe")]
    slide_noise_mm: f32,
    /// Standard deviation of the noise of the log's column stick_ratio, if it has one
    #[arg(long, value_name = "SHARE", default_value_t = 0.05, requires = "observe")]
    stick_noise: f32,
    /// Time constant of the force sensor, s
    #[arg(long, value_name = "S", default_value_t = 0.0, requires = "observe")]
    force_lag_s: f32,
}

/// First line of the answers.
pub const HEADER: &str = "t_s,strength_factor,strength_low,strength_high,slip_margin,margin_low,margin_high,slip_chance,\
                          stiffness_factor,information,known,surface_changed,status";
const COLUMNS: [&str; 7] =
    ["t_s", "normal_force_n", "friction_x_n", "friction_y_n", "slide_x_mm", "slide_y_mm", "stick_ratio"];

/// Replays the log `path` through the observer and writes its answers to `out`.
pub fn run(args: &ObserveArgs, path: &Path, file: &ModelFile, outputs: Outputs, out: &Path) -> Result<(), Failure> {
    if !(args.stick_noise > 0.0) {
        return Err(Failure::Input(anyhow!("--stick-noise {}: not above 0", args.stick_noise)));
    }
    let rows = during("reading", |_| read(outputs::input(path)))?;
    outputs.prepare()?;
    let settings = Settings { force_lag_s: args.force_lag_s, ..Settings::default() };
    let mut observer = MarginObserver::<4, 37>::new(&file.file().model, settings)
        .map_err(|e| Failure::Input(anyhow!("--force-lag-s {}: {e}", args.force_lag_s)))?;
    let [force, slide, stick] = [args.force_noise_n, args.slide_noise_mm, args.stick_noise].map(|sd| sd * sd);
    let mut before = rows[0];
    let mut dt_s = (rows[1][0] - rows[0][0]) as f32;
    let mut lines = Vec::new();
    let mut left_out = 0;
    for (k, row) in rows.into_iter().enumerate() {
        if k > 0 {
            dt_s = (row[0] - before[0]) as f32;
        }
        let margin = observer.step(Reading {
            normal_force_n: row[1] as f32,
            friction_n: [row[2] as f32, row[3] as f32],
            slide_increment_mm: [(row[4] - before[4]) as f32, (row[5] - before[5]) as f32],
            normal_variance_n2: force,
            friction_covariance_n2: [force, force, 0.0],
            slide_covariance_mm2: [slide, slide, 0.0],
            stick_ratio: row[6] as f32,
            stick_variance: if row[6].is_nan() { 0.0 } else { stick },
            dt_s,
            ..Reading::default()
        });
        left_out += usize::from(margin.status != fingerpad::Status::OK);
        lines.push(line(row[0], &margin));
        before = row;
    }
    outputs::write(out, |w| {
        writeln!(w, "{HEADER}")?;
        lines.iter().try_for_each(|line| writeln!(w, "{line}"))
    })?;
    outputs::say(out, &format!("{}: {} rows", out.display(), lines.len()));
    if left_out > 0 {
        eprintln!(
            "{left_out} rows taught nothing: an unsound number, a clock that stands still, or a force beyond the model"
        );
    }
    Ok(())
}

/// The rows of the log: time, normal force, friction along x and y, slide along x and y, stick ratio (NaN without its column).
fn read(path: &Path) -> Result<Vec<[f64; COLUMNS.len()]>, Failure> {
    let columns = Columns::read(path, &COLUMNS)?;
    columns.need_rows(2)?;
    let mut places = [None; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = if name == "stick_ratio" { columns.find(name) } else { Some(columns.need(name)?) };
    }
    let mut rows = Vec::with_capacity(columns.rows.len());
    for row in &columns.rows {
        let mut numbers = [f64::NAN; COLUMNS.len()];
        for (number, place) in numbers.iter_mut().zip(places) {
            if let Some(place) = place {
                *number = columns.number(row, place)?;
            }
        }
        rows.push(numbers);
    }
    Ok(rows)
}

fn line(t_s: f64, m: &Margin) -> String {
    let known = match m.known {
        Known::NoContact => "no_contact",
        Known::Prior => "prior",
        Known::Part => "part",
        Known::Strength => "strength",
    };
    let numbers = [
        m.strength_factor,
        m.strength_low,
        m.strength_high,
        m.slip_margin,
        m.margin_low,
        m.margin_high,
        m.slip_chance,
        m.stiffness_factor,
        m.information,
    ];
    let numbers: String = numbers.iter().map(|x| format!(",{x}")).collect();
    format!("{t_s}{numbers},{known},{},{}", u8::from(m.surface_changed), m.status)
}
