//! The observer of the margin to slip against finite elements: errors, bounds, announcements, beside thresholds that are usual.
//!
//! Main types: [`truth::Truth`] (what happens), [`truth::Sensors`] (what is measured), [`score::Lab`] (experiments). [`stored`] reads the
//! runs, [`tables`] makes the tables of the page, [`chart`] its picture. Uses the core, stored runs and charts.

pub mod poses;
pub mod score;
pub mod truth;

use std::path::Path;

use crate::synthetic_truth::Random;
use fingerpad::Model;
use fingerpad::pad::Pad;
use fingerpad_reduce::{Kind, Run};
use fingerpad_report::{Trace, TraceChart};

use score::{Alarm, Errors, LIMITS_N, Lab, MARGINS, announcements, errors, observe, tuned_thresholds};
use truth::{Ride, Row, Sensors, Truth, measure};

/// The page, from the root of the repository.
pub const PAGE: &str = "docs/unknown-friction.md";
/// Pulls of finite elements whose lambda is not that of the design, from the root of the repository.
pub const OTHER_LAMBDA: &str = "data/reference/pulls.csv";
/// Runs with a larger normal force are left out, N: the end of the bed's range, where it is up to 18 % too soft.
const NORMAL_MAX_N: f64 = 1.4;
const SEED: u64 = 1;

/// Why the runs cannot be read.
pub type Failure = Box<dyn std::error::Error>;

/// The runs of one finger.
pub struct Runs {
    /// Pulls at a constant depth or normal force.
    pub straight: Vec<Truth>,
    /// Pulls whose depth changes on the way.
    pub oblique: Vec<Truth>,
}

/// Runs that end in full slip: those that no fit has seen, or the others.
///
/// # Errors
/// A file that is not a run.
pub fn stored(model: &Model<'_>, folder: &Path, held_out: bool) -> Result<Runs, Failure> {
    let mut files: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    files.sort_by_key(|entry| entry.file_name());
    let mut runs = Runs { straight: Vec::new(), oblique: Vec::new() };
    for entry in files {
        let path = entry.path();
        if path.extension().is_none_or(|e| e != "fprun") {
            continue;
        }
        let run = Run::from_bytes(&std::fs::read(&path)?, &path)?;
        let list = match run.kind {
            Kind::Straight | Kind::Force => &mut runs.straight,
            Kind::Oblique => &mut runs.oblique,
            _ => continue,
        };
        if run.held_out == held_out {
            list.extend(pull(model, &run));
        }
    }
    Ok(runs)
}

/// The part of a run up to its lift-off, if it ends in full slip; to the first row in full slip if the depth changes.
fn pull(model: &Model<'_>, run: &Run) -> Option<Truth> {
    let mut rows: Vec<Row> = Vec::new();
    for s in &run.samples {
        let normal_n = f64::from(s.normal_force_n);
        if normal_n <= 0.0 && rows.last().is_some_and(|last| last.normal_n > 0.02) {
            break;
        }
        let (slide_mm, friction_n) = (s.slide_mm.map(f64::from), s.friction_n.map(f64::from));
        rows.push(Row { normal_n, slide_mm, friction_n, stick: s.stick_ratio.into(), margin: 1.0 });
    }
    let slides = |row: &Row| row.slide_mm != [0.0; 2];
    let slip = rows.iter().position(|row| slides(row) && row.stick < truth::SLIPS)?;
    if run.kind == Kind::Oblique {
        rows.truncate(slip + 1);
    }
    if rows.iter().any(|row| row.normal_n > NORMAL_MAX_N) {
        return None;
    }
    let mut truth = Truth { name: run.name.clone(), lambda: 1.0, strength: 1.0, pressed: 0, rows };
    truth.complete(model);
    Some(truth)
}

/// The tables of the page by the names of their places: errors, announcements, map. `number` experiments each.
///
/// # Errors
/// What [`stored`] refuses.
pub fn tables(
    model: &Model<'_>,
    pad: &Pad<'_>,
    root: &Path,
    number: usize,
) -> Result<Vec<(&'static str, String)>, Failure> {
    let held = stored(model, &root.join("data/runs"), true)?;
    let fitted = stored(model, &root.join("data/runs"), false)?;
    let other = Truth::read(model, &std::fs::read_to_string(root.join(OTHER_LAMBDA))?);
    let small = Sensors::of(5.0, 5.0);
    let sets = [
        ("pulls, 5 mN, 5 µm", &held.straight, small, false),
        ("the same after a test motion", &held.straight, small, true),
        ("finite elements of lambda 0.4 and 1, 5 mN, 5 µm", &other, small, false),
        ("depth changes, 5 mN, 5 µm", &held.oblique, small, false),
        ("pulls, 20 mN, 30 µm", &held.straight, Sensors::of(20.0, 30.0), false),
        ("stick ratio within 0.05: pulls", &held.straight, small.with_stick(0.05), false),
        ("stick ratio within 0.05: finite elements of lambda 0.4 and 1", &other, small.with_stick(0.05), false),
        ("stick ratio within 0.05: depth changes", &held.oblique, small.with_stick(0.05), false),
    ];
    let mut table = String::from("| runs, noise | | ");
    table += &MARGINS.map(|m| format!("{m}")).join(" | ");
    table += &format!(" |\n|---|---|{}\n", "---|".repeat(MARGINS.len()));
    for (name, runs, sensors, test_motion) in sets {
        // Lambda times 0.4 has a limit of 0.35 N.
        let limits = if core::ptr::eq(runs, &other) { [0.25, 9.0] } else { LIMITS_N };
        let all = errors(&mut Lab::new(*model, runs.clone(), limits, SEED), &sensors, number, test_motion);
        let mut line = |name: &str, of: fn(&Errors) -> f64| {
            table += &format!("| {name} | {} |\n", all.each_ref().map(|e| format!("{:.0}", 100.0 * of(e))).join(" | "));
        };
        line(&format!("{name} | bias, %"), Errors::bias);
        line("| bias and scatter, %", Errors::rms);
        line("| band of the strength covers, %", |e| e.covered[0] / e.number);
        line("| band of the margin covers, %", |e| e.covered[1] / e.number);
        line("| lower bound is below the truth, %", |e| e.safe / e.number);
    }
    let mut alarms = String::from(
        "| runs, noise | what announces | slips announced | median lead, mm | false in holds |\n|---|---|---|---|---|\n",
    );
    for (name, runs, others, sensors) in [
        ("pulls, 5 mN, 5 µm", &held.straight, &fitted.straight, small),
        ("depth changes, 5 mN, 5 µm", &held.oblique, &fitted.oblique, small),
        ("pulls, 20 mN, 30 µm", &held.straight, &fitted.straight, Sensors::of(20.0, 30.0)),
        ("pulls, 5 mN, 5 µm, stick ratio within 0.05", &held.straight, &fitted.straight, small.with_stick(0.05)),
    ] {
        let tuned = tuned_thresholds(&mut Lab::new(*model, others.clone(), LIMITS_N, SEED + 1), &sensors, number / 2);
        let [rate, ratio, shakes] = tuned;
        let list = [Alarm::Observer, Alarm::Chance, rate, ratio, shakes];
        let found = announcements(&mut Lab::new(*model, runs.clone(), LIMITS_N, SEED + 2), &sensors, number, &list);
        for (k, (alarm, a)) in list.iter().zip(&found).enumerate() {
            let lead = if a.lead_mm.is_empty() { "–".into() } else { format!("{:.2}", a.median_lead_mm()) };
            alarms += &format!(
                "| {} | {alarm} | {} of {} | {lead} | {} of {} |\n",
                if k == 0 { name } else { "" },
                a.before,
                a.slips,
                a.false_ones,
                a.holds
            );
        }
    }
    Ok(vec![
        ("poses", poses::table(model, pad, &root.join("data/runs"))?),
        ("errors", table),
        ("announcements", alarms),
        ("map", map(model, &held.straight, number)),
    ])
}

/// Bias and scatter over noise and limit, at three margins.
fn map(model: &Model<'_>, runs: &[Truth], number: usize) -> String {
    let margins = [0.5, 0.35, 0.25, 0.15];
    let mut map = String::from("| noise | limit, N | ");
    map += &margins.map(|m| format!("{m}")).join(" | ");
    map += &format!(" |\n|---|---|{}\n", "---|".repeat(margins.len()));
    for (force, encoder) in [(1.0, 1.0), (5.0, 5.0), (20.0, 30.0), (50.0, 30.0)] {
        for limits in [[0.05, 0.2], [0.2, 0.4], [0.4, 0.8], [0.8, 3.0]] {
            let sensors = Sensors::of(force, encoder);
            let all = errors(&mut Lab::new(*model, runs.to_vec(), limits, SEED), &sensors, number / 2, false);
            let of = |m: f64| 100.0 * all[MARGINS.iter().position(|x| *x == m).expect("one of them")].rms();
            map += &format!(
                "| {force:.0} mN, {encoder:.0} µm | {} to {} | {} |\n",
                limits[0],
                limits[1],
                margins.map(|m| format!("{:.0}", of(m))).join(" | ")
            );
        }
    }
    map
}

/// A pull with its true margin, the estimate, its band, and the moment of the announcement.
///
/// # Errors
/// What [`stored`] refuses.
pub fn chart(model: &Model<'_>, root: &Path) -> Result<TraceChart, Failure> {
    let runs = stored(model, &root.join("data/runs"), true)?.straight;
    let run = runs.iter().find(|run| run.name == "straight-05h").ok_or("the run straight-05h is missing")?;
    let sensors = Sensors::of(5.0, 5.0);
    let ride = Ride { speed_mm_s: 5.0, until: (run.rows.len() - 1) as f64, hold_s: 0.0 };
    let readings = measure(run, ride, &sensors, &mut Random::new(SEED));
    let answers = observe(model, &sensors, &readings);
    let slides = || readings.iter().zip(&answers).filter(|(m, _)| m.way_mm > 0.0).step_by(8);
    let trace = |name: &str, is_dots: bool, points: Vec<[f64; 2]>| Trace {
        name: name.into(),
        is_dots,
        points,
        ..Trace::default()
    };
    let along = |name: &str, of: &dyn Fn(&truth::Measured, &fingerpad::margin::Margin) -> f64| {
        trace(name, false, slides().map(|(m, a)| [m.way_mm, of(m, a)]).collect())
    };
    let announced = Alarm::Observer.at(&readings, &answers, &sensors);
    let slip = readings.iter().find(|m| m.way_mm > 0.0 && m.truth.stick < truth::SLIPS);
    let mut moments: Vec<[f64; 2]> = announced.map(|k| [readings[k].way_mm, 0.0]).into_iter().collect();
    moments.extend(slip.map(|m| [m.way_mm, 0.0]));
    Ok(TraceChart {
        title: "Slip margin during a pull on an unknown surface".into(),
        labels: ["slide, mm".into(), "slip margin".into()],
        least: [0.0, 1.0],
        traces: vec![
            along("true margin (finite elements)", &|m, _| m.truth.margin),
            along("estimate", &|_, a| a.slip_margin.into()),
            along("lower end of the 95 % band", &|_, a| a.margin_low.into()),
            along("upper end", &|_, a| a.margin_high.into()),
            trace("slip announced; full slip", true, moments),
        ],
        ..TraceChart::default()
    })
}
