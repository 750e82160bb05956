//! The reduced model beside held-out runs of the finite elements: vibration under a static load, the limit surface; and first
//! slip through noise.

use std::path::Path;

use fingerpad::events::{Change, Watch};
use fingerpad::{Model, Motion, NODES, SPRINGS, State, step};
use fingerpad_reduce::{Run, in_full_slip, replay};
use fingerpad_report::{Trace, TraceChart, traces_svg};
use fingerpad_tests::random::Random;

use crate::Failure;

/// Draws all pictures: file names and bytes.
pub fn pictures(model: &Model<'_>, runs: &Path) -> Result<Vec<(&'static str, String)>, Failure> {
    let pictures = [
        ("memory-vibration.svg", vibration(model, runs)?),
        ("memory-first-slip.svg", [0.5, 1.5].map(|depth| first_slip(model, depth)).into()),
        ("memory-limit-surface.svg", vec![limit_surface(model, runs)?]),
    ];
    Ok(pictures.map(|(name, charts)| (name, traces_svg(&charts))).into())
}

/// Complete held-out runs whose names begin so.
fn held_out(folder: &Path, beginning: &str) -> Result<Vec<Run>, Failure> {
    let files = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<_> = files.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(beginning)));
    files.sort();
    let mut runs = Vec::new();
    for file in files {
        runs.push(Run::from_bytes(&std::fs::read(&file)?, &file)?);
    }
    runs.retain(|run| run.held_out && run.ended_early.is_none());
    Ok(runs)
}

fn chart(title: String, labels: [&str; 2], traces: Vec<Trace>) -> TraceChart {
    TraceChart { title, labels: labels.map(str::to_owned), traces, ..TraceChart::default() }
}

fn trace(name: impl Into<String>, points: Vec<[f64; 2]>, is_dots: bool) -> Trace {
    Trace { name: name.into(), points, is_dots, ..Trace::default() }
}

/// The two held-out vibrations whose depth swings most: friction over time.
fn vibration(model: &Model<'_>, folder: &Path) -> Result<Vec<TraceChart>, Failure> {
    let mut runs = held_out(folder, "vibration-")?;
    let swing = |run: &Run| {
        let depths = run.samples.iter().skip_while(|s| s.slide_mm == [0.0; 2]).map(|s| f64::from(s.depth_mm));
        depths.clone().fold(0.0, f64::max) - depths.fold(f64::MAX, f64::min)
    };
    runs.retain(|run| !run.spins());
    runs.sort_by(|a, b| swing(b).total_cmp(&swing(a)));
    let charts = runs.iter().take(2).map(|run| {
        let size = |f: &[f32; 2]| f64::from(f[0].hypot(f[1]));
        let elements = run.samples.iter().map(|s| [f64::from(s.t_s), size(&s.friction_n)]).collect();
        let replayed = replay(model, run);
        let of_model =
            run.samples.iter().zip(&replayed).map(|(s, r)| [f64::from(s.t_s), size(&r.friction_n)]).collect();
        let depth = run.samples.iter().map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
        chart(
            format!("Load held under vibration of {:.0} % of {depth:.1} mm ({})", 100.0 * swing(run) / depth, run.name),
            ["Time t, s", "Friction F, newton"],
            vec![trace("model", of_model, false), trace("finite elements", elements, true)],
        )
    });
    Ok(charts.collect())
}

/// A straight slide with noise on depth and slide: the stick ratio, and the first slip that a watch reports.
fn first_slip(model: &Model<'_>, depth: f64) -> TraceChart {
    const STEPS: u32 = 3000;
    let motion = |depth: f64, [x, y]: [f64; 2]| Motion {
        depth_mm: depth as f32,
        slide_increment_mm: [x as f32, y as f32],
        dt_s: 1e-3,
        ..Motion::default()
    };
    let mut state = State::default();
    step(model, &mut state, motion(depth, [0.0; 2]));
    let full = (1..).find(|_| step(model, &mut state, motion(depth, [2e-3, 0.0])).slip_margin < 0.01);
    let length = 1.3 * 2e-3 * f64::from(full.unwrap_or(1)) / f64::from(STEPS);
    let slide = |noise_mm: f64| {
        let (mut watch, mut state, mut random) = (Watch::new(0), State::default(), Random::new(1));
        let (mut there, mut points, mut first) = ([0.0; 2], vec![], "no first slip".to_owned());
        for i in 0..STEPS + 20 {
            let slid = length * f64::from(i.saturating_sub(20));
            let to = [slid + noise_mm * random.number(), noise_mm * random.number()];
            let by = [to[0] - there[0], to[1] - there[1]];
            there = to;
            let response = step(model, &mut state, motion(depth + noise_mm * random.number(), by));
            if watch.see(&response).into_iter().any(|event| event.change == Change::FirstSlip) {
                first = format!("first slip reported at {slid:.3} mm");
            }
            points.push([slid, f64::from(response.stick_ratio)]);
        }
        trace(format!("noise of {} µm: {first}", 1e3 * noise_mm), points, false)
    };
    let traces = [0.01, 0.001, 0.0].map(slide).into();
    chart(format!("First slip through noise, {depth} mm deep"), ["Slide s, mm", "Stick ratio"], traces)
}

/// Friction and moment together in full slip, each over its own limit.
fn limit_surface(model: &Model<'_>, folder: &Path) -> Result<TraceChart, Failure> {
    let data = model.data().cast();
    let runs = held_out(folder, "spin")?;
    let rows = runs.iter().flat_map(|run| in_full_slip::<SPRINGS, NODES>(&data, run));
    let elements = rows.map(|row| [row.friction, row.moment]).collect();
    let curve = |cross: f64| -> Vec<[f64; 2]> {
        let point = |k: i32| {
            let (m, f) = (f64::from(k) * std::f64::consts::FRAC_PI_2 / 100.0).sin_cos();
            let length = 1.0 / (1.0 + cross * f * m).sqrt();
            [length * f, length * m]
        };
        (0..=100).map(point).collect()
    };
    let traces = vec![
        trace("model", curve(f64::from(model.data().spin_cross)), false),
        trace("ellipsoid", curve(0.0), false),
        trace("finite elements in full slip, held-out spins with slide", elements, true),
    ];
    let labels = ["Friction over its limit alone", "Moment about the normal over its limit alone"];
    Ok(chart("Limit surface".into(), labels, traces))
}
