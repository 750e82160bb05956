//! Cases: a truth, and the data that a laboratory would hand over.

use std::path::PathBuf;

use fingerpad_diagnose::{Labels, RawRow, RunSet, laws::Column, runs_csv};

use super::Random;
use super::effects::{Effect, LIBRARY, OUTSIDE};
use super::laboratory::{Noise, Scatter};
use super::loggers::{Logged, Protocol, Rate};
use super::protocol::{self, Plan, Stroke};
use super::simulator::{Simulator, SimulatorKind, all_readings};

/// What is hidden, and the three files.
pub struct Case {
    /// Number of the case, its seed.
    pub seed: u64,
    /// The hidden effects.
    pub truth: Vec<Effect>,
    /// The size aimed at, 0.03 to 0.3; 0 where nothing is missing.
    pub size: f64,
    /// Level of confounding.
    pub level: usize,
    /// The column that was not recorded.
    pub dropped: Option<Column>,
    /// Whether the laws' forms are exact.
    pub exact_form: bool,
    /// Runs without an effect.
    pub calibration: RunSet,
    /// Runs with the effect.
    pub measured: RunSet,
    /// Further runs with the effect.
    pub holdout: RunSet,
    /// The finger, for the oracle and for further strokes.
    pub finger: Box<dyn Simulator>,
    /// The laboratory.
    pub noise: Noise,
    /// Strokes of the measured set.
    pub strokes: Vec<Stroke>,
    /// Readings of these strokes' rows that the measured set holds.
    pub read: Vec<Vec<[bool; 3]>>,
    /// How the laboratory moves and logs.
    pub protocol: Protocol,
    /// Mean time by which the forces come late in the calibration and in the measured runs, s.
    pub lag_s: [f64; 2],
}

/// Runs of a calibration.
pub const CALIBRATION_RUNS: usize = 30;

/// What is to be hidden.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Hide {
    /// Nothing.
    Nothing,
    /// A law of the library, by index.
    Law(usize),
    /// Two laws.
    Pair(usize, usize),
    /// An effect that no library has.
    Outside(usize),
    /// A law whose column is not recorded.
    Unrecorded(usize),
}

/// What a case is to be.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Wanted {
    /// Who makes the readings.
    pub simulator: SimulatorKind,
    /// How the laboratory moves and logs.
    pub protocol: Protocol,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// What is hidden.
    pub hide: Hide,
    /// Its size, 0.03 to 0.3.
    pub size: f64,
    /// Level of confounding.
    pub level: usize,
    /// Measured runs.
    pub runs: usize,
    /// Whether the laws' forms are exact.
    pub exact_form: bool,
}

/// Makes a case of the first simulator with directions over the plane and a logger without faults.
pub fn case(seed: u64, hide: Hide, size: f64, level: usize, runs: usize, exact_form: bool) -> Case {
    case_of(Protocol::Plane, seed, hide, size, level, runs, exact_form)
}

/// Makes a case of the first simulator and a protocol.
pub fn case_of(
    protocol: Protocol,
    seed: u64,
    hide: Hide,
    size: f64,
    level: usize,
    runs: usize,
    exact_form: bool,
) -> Case {
    make(Wanted { simulator: SimulatorKind::First, protocol, seed, hide, size, level, runs, exact_form })
}

/// Makes a case.
pub fn make(wanted: Wanted) -> Case {
    let Wanted { simulator, protocol, seed, hide, size, level, runs, exact_form } = wanted;
    let mut random = Random::new(seed);
    let finger = simulator.finger(&mut random);
    let noise = protocol.noise(Noise::random(&mut random));
    let turned = |mut plans: Vec<Plan>, calibration| {
        protocol.turn(&mut plans, calibration);
        plans
    };
    let calibration_plans = turned(protocol::calibration(CALIBRATION_RUNS, &mut random), true);
    let plans = turned(protocol::measured(runs, level, &mut random), false);
    let holdout_plans = turned(protocol::measured(20, level, &mut random), false);
    let strokes = protocol::strokes(&plans, 30);
    let names: Vec<&'static str> = match hide {
        Hide::Nothing => vec![],
        Hide::Law(i) | Hide::Unrecorded(i) => vec![LIBRARY[i].0],
        Hide::Pair(i, j) => vec![LIBRARY[i].0, LIBRARY[j].0],
        Hide::Outside(i) => vec![OUTSIDE[i]],
    };
    let truth: Vec<Effect> =
        names.into_iter().map(|name| sized(&*finger, &strokes, name, size, exact_form, &mut random)).collect();
    // The measured finger is the calibrated one, a little softer or rougher today.
    let today = finger.vary(0, 0.03 * random.normal());
    let today = today.vary(1, 0.03 * random.normal());
    let dropped = match hide {
        Hide::Unrecorded(i) => driver(LIBRARY[i].0),
        _ => None,
    };
    let rates = [true, false].map(|calibration| protocol.rate(seed, calibration));
    let mut set = |finger: &dyn Simulator, plans: &[Plan], truth: &[Effect], name: &str| match rates
        [usize::from(name != "calibration")]
    {
        None => measure(finger, &protocol::strokes(plans, 30), truth, &noise, &mut random, name, dropped),
        Some(rate) => measure_at(rate, finger, plans, truth, &noise, &mut random, name, dropped),
    };
    let calibration = set(&*finger, &calibration_plans, &[], "calibration");
    let measured = set(&*today, &plans, &truth, "measured");
    let holdout = set(&*today, &holdout_plans, &truth, "holdout");
    let mut faults = Random::new(seed ^ 0x1066);
    let [calibration, measured, holdout] = [(calibration, true), (measured, false), (holdout, false)]
        .map(|(set, calibration)| protocol.log(set, calibration, &mut faults));
    let (calibration, holdout, Logged { set: measured, read }) = (calibration.set, holdout.set, measured);
    Case {
        seed,
        truth,
        size,
        level,
        dropped,
        exact_form,
        calibration,
        measured,
        holdout,
        finger: today,
        noise,
        strokes,
        read,
        protocol,
        lag_s: rates.map(|rate| rate.map_or(0.0, |rate| rate.total_lag_s())),
    }
}

/// The column that a law's driver stands in, where a laboratory could fail to record it.
pub fn driver(name: &str) -> Option<Column> {
    Some(match name {
        "hydration_bell" => Column::Hydration,
        "contact_ageing" => Column::Dwell,
        "occlusion_growth" => Column::Occlusion,
        "subject_size" => Column::Width,
        "temperature" => Column::Temperature,
        _ => return None,
    })
}

/// Largest amplitude of a law that fades along the stroke: where it is gone before a tenth of the rows, none gives the
/// wanted size, and the friction of the first rows would grow without bound.
const LARGEST_PEAK: f64 = 5.0;

/// An effect of the wanted size, with its shape drawn.
fn sized(
    finger: &dyn Simulator,
    strokes: &[Stroke],
    name: &'static str,
    size: f64,
    exact: bool,
    random: &mut Random,
) -> Effect {
    let shape = match name {
        "hydration_bell" => [random.between(40.0, 65.0), random.between(10.0, 22.0)],
        "speed_stribeck" => [random.between(2.0, 9.0), 0.0],
        "anisotropy" => [random.between(-80.0, 80.0), 0.0],
        "normal_relaxation" => [random.between(0.4, 4.0), 0.0],
        "contact_ageing" => [random.between(0.15, 0.6), random.between(0.4, 1.4)],
        "static_peak" => [random.between(0.4, 1.4), 0.0],
        "occlusion_growth" => [random.between(10.0, 40.0), 0.0],
        "tare_bias" => [random.between(-1.2, 1.2), random.between(-1.2, 1.2)],
        "cross_talk" => [random.between(-1.2, 1.2), 0.0],
        "periodic_texture" => [random.between(0.8, 2.5), random.between(0.0, 6.0)],
        "patch" => [random.between(-2.0, 2.0), random.between(-2.0, 2.0)],
        "slow_clock" => [random.between(500.0, 1300.0), random.between(0.0, 6.0)],
        "direction_harmonic" => [random.between(0.0, 6.0), 0.0],
        _ => [0.0, 0.0],
    };
    let either_sign = matches!(
        name,
        "speed_log"
            | "depth_zero_offset"
            | "tare_bias"
            | "cross_talk"
            | "temperature"
            | "subject_size"
            | "stiffness_drift"
            | "depth_speed_product"
    );
    let sign = if either_sign && random.unit() < 0.5 { -1.0 } else { 1.0 };
    let form = if exact { 1.0 } else { random.between(0.85, 1.18) };
    let mut effect = Effect { name, amplitude: 0.0, shape, form };
    let plain = all_readings(finger, strokes, &[]);
    let contact: Vec<Vec<bool>> = strokes.iter().map(|s| s.rows.iter().map(|r| r.depth_mm > 0.0).collect()).collect();
    // Secant search on the logarithm: size grows about linearly with the amplitude.
    let mut amplitude = match name {
        "viscous_drag" => 0.002,
        "adhesion" | "tare_bias" => 0.02,
        "depth_zero_offset" => 0.03,
        "speed_log" | "temperature" => 0.03,
        "subject_size" => 1.0,
        _ => 0.1,
    };
    for _ in 0..7 {
        effect.amplitude = sign * amplitude;
        let with = all_readings(finger, strokes, std::slice::from_ref(&effect));
        let found = size_p90(&plain, &with, &contact);
        amplitude *= (size / found.max(1e-6)).clamp(0.2, 5.0);
        if matches!(name, "contact_ageing" | "static_peak") {
            amplitude = amplitude.min(LARGEST_PEAK);
        }
    }
    effect.amplitude = sign * amplitude;
    effect
}

/// The larger of the 90th percentiles of |ΔN|/N and |ΔF|/F over contact rows.
pub fn size_p90(plain: &[Vec<[f64; 3]>], with: &[Vec<[f64; 3]>], contact: &[Vec<bool>]) -> f64 {
    let (mut normal, mut friction) = (Vec::new(), Vec::new());
    for ((a, b), c) in plain.iter().zip(with).zip(contact) {
        for ((a, b), c) in a.iter().zip(b).zip(c) {
            if *c {
                normal.push((b[0] - a[0]).abs() / a[0].abs().max(0.02));
                let f = a[1].hypot(a[2]);
                friction.push((b[1] - a[1]).hypot(b[2] - a[2]) / f.max(0.05));
            }
        }
    }
    let p90 = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[(0.9 * (v.len() - 1) as f64) as usize]
    };
    p90(&mut normal).max(p90(&mut friction))
}

/// Measures strokes: effects, scatter of each run, row noise, reading errors of the state's columns.
pub fn measure(
    finger: &dyn Simulator,
    strokes: &[Stroke],
    truth: &[Effect],
    noise: &Noise,
    random: &mut Random,
    name: &str,
    dropped: Option<Column>,
) -> RunSet {
    record(strokes, noise, random, name, dropped, &mut |stroke, scatter| finger.readings(stroke, truth, scatter))
}

/// Measures strokes with a logger of a constant rate, whose file has no time since touch.
#[expect(clippy::too_many_arguments, reason = "the arguments of `measure` and the rate")]
fn measure_at(
    rate: Rate,
    finger: &dyn Simulator,
    plans: &[Plan],
    truth: &[Effect],
    noise: &Noise,
    random: &mut Random,
    name: &str,
    dropped: Option<Column>,
) -> RunSet {
    let logged = protocol::logged_strokes(plans, rate.rate_hz, rate.lifts, random);
    let (strokes, read): (Vec<Stroke>, Vec<Vec<usize>>) = logged.into_iter().map(|l| (l.stroke, l.read)).unzip();
    let mut runs = written(&strokes, noise, random, name, dropped, &mut |stroke, scatter| {
        let times: Vec<f64> = stroke.rows.iter().map(|row| row.t_s).collect();
        rate.through(&times, finger.readings(stroke, truth, scatter))
    });
    for ((_, rows), read) in runs.iter_mut().zip(&read) {
        *rows = read.iter().map(|i| RawRow { contact_time_s: f64::NAN, ..rows[*i] }).collect();
    }
    let mut set = RunSet::from_rows(PathBuf::from(format!("{name}.csv")), runs).expect("rows in order");
    // As a file is read.
    set.runs.iter_mut().for_each(|run| {
        run.thin(runs_csv::KEPT_ROWS);
    });
    set
}

/// The set that a laboratory writes down of strokes whose readings without row noise are `readings`.
pub fn record(
    strokes: &[Stroke],
    noise: &Noise,
    random: &mut Random,
    name: &str,
    dropped: Option<Column>,
    readings: &mut dyn FnMut(&Stroke, &Scatter) -> Vec<[f64; 3]>,
) -> RunSet {
    let runs = written(strokes, noise, random, name, dropped, readings);
    RunSet::from_rows(PathBuf::from(format!("{name}.csv")), runs).expect("rows in order")
}

/// The runs of [`record`].
fn written(
    strokes: &[Stroke],
    noise: &Noise,
    random: &mut Random,
    name: &str,
    dropped: Option<Column>,
    readings: &mut dyn FnMut(&Stroke, &Scatter) -> Vec<[f64; 3]>,
) -> Vec<(Labels, Vec<RawRow>)> {
    let keep = |column: Column, value: f64| if dropped == Some(column) { f64::NAN } else { value };
    let mut walk_n = [0.0; 3];
    strokes
        .iter()
        .enumerate()
        .map(|(i, stroke)| {
            let mut scatter = noise.run(random);
            if noise.walk_n > 0.0 {
                walk_n.iter_mut().for_each(|at| *at += noise.walk_n * random.normal());
                scatter.offset_n.iter_mut().zip(walk_n).for_each(|(offset, at)| *offset += at);
            }
            let readings = readings(&noise.trembling(stroke, random), &scatter);
            let hydration = stroke.plan.hydration_au + noise.hydration_au * random.normal();
            let rows: Vec<RawRow> = stroke
                .rows
                .iter()
                .zip(readings)
                .enumerate()
                .map(|(k, (row, reading))| RawRow {
                    line: 2 + i * stroke.rows.len() + k,
                    t_s: row.t_s,
                    depth_mm: row.depth_mm,
                    slide_mm: row.slide_mm,
                    force_n: noise.row(noise.mixed(reading), random),
                    contact_time_s: row.contact_s,
                    speed_mm_s: f64::NAN,
                    direction_deg: f64::NAN,
                    dwell_s: keep(Column::Dwell, stroke.plan.dwell_s),
                    occlusion_time_s: keep(Column::Occlusion, row.occlusion_s),
                    hydration_au: keep(Column::Hydration, hydration),
                    temperature_c: keep(Column::Temperature, stroke.plan.temperature_c),
                    finger_width_mm: keep(Column::Width, stroke.plan.width_mm),
                    own: [f64::NAN; 4],
                })
                .collect();
            (Labels { run: format!("{name}{i}"), ..Labels::default() }, rows)
        })
        .collect()
}

/// Rows of a plan that the diagnosis proposed, as strokes.
pub fn proposed(plans: &[Plan]) -> Vec<Stroke> {
    protocol::strokes(plans, 30)
}
