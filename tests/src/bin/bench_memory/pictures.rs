//! Figures of the history of a contact, finite elements beside the model.

use std::path::Path;

use fingerpad::events::{Change, Queue, Watch};
use fingerpad::{Model, NODES, SPRINGS, State, step};
use fingerpad_reduce::{FullSlip, Run, in_full_slip, replay};
use fingerpad_report::{Trace, TraceChart, traces_png};

use crate::row::{Noise, Row, full_slip_slide_mm, motion};

/// Draws all pictures into a folder.
///
/// # Errors
/// A run that cannot be read, a file that cannot be written.
pub fn draw(model: &Model<'_>, runs: &Path, seed: u64, folder: &Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let pictures = [
        ("memory-vibration.png", vibration(model, runs)?),
        ("memory-first-slip.png", first_slip(model, seed)),
        ("memory-limit-surface.png", limit_surface(model, runs)?),
    ];
    for (name, charts) in pictures {
        let file = folder.join(name);
        let bytes = traces_png(&charts).map_err(|e| e.to_string())?;
        std::fs::write(&file, bytes).map_err(|e| format!("{}: {e}", file.display()))?;
        println!("{}", file.display());
    }
    Ok(())
}

/// Held-out runs of a kind, by name.
fn held_out(folder: &Path, kind: &str) -> Result<Vec<Run>, String> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&format!("{kind}-"))))
        .collect();
    files.sort();
    let read = |file: &std::path::PathBuf| {
        let bytes = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
        Run::from_bytes(&bytes, file).map_err(|e| e.to_string())
    };
    let runs: Vec<Run> = files.iter().map(read).collect::<Result<_, _>>()?;
    let runs: Vec<Run> = runs.into_iter().filter(|run| run.held_out && run.ended_early.is_none()).collect();
    if runs.is_empty() { Err(format!("{}: no held-out runs of the kind {kind}", folder.display())) } else { Ok(runs) }
}

fn chart(title: impl Into<String>, labels: [&str; 2], traces: Vec<Trace>) -> TraceChart {
    TraceChart { title: title.into(), labels: labels.map(str::to_owned), least: [0.0; 2], traces }
}

fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Trace {
    Trace { name: name.into(), points, is_dots: false }
}

fn dots(name: impl Into<String>, points: Vec<[f64; 2]>) -> Trace {
    Trace { name: name.into(), points, is_dots: true }
}

/// The two held-out vibrations whose depth swings most: friction along its direction over time.
fn vibration(model: &Model<'_>, folder: &Path) -> Result<Vec<TraceChart>, String> {
    let mut runs = held_out(folder, "vibration")?;
    let swing = |run: &Run| {
        let depths = run.samples.iter().skip_while(|s| s.slide_mm == [0.0; 2]).map(|s| f64::from(s.depth_mm));
        depths.clone().fold(0.0, f64::max) - depths.fold(f64::MAX, f64::min)
    };
    runs.retain(|run| run.samples.iter().all(|s| s.turned.is_none_or(|t| t.spin_deg == 0.0)));
    runs.sort_by(|a, b| swing(b).total_cmp(&swing(a)));
    let charts = runs.iter().take(2).map(|run| {
        let replayed = replay(model, run);
        let most = |f: &[f32; 2]| f64::from(f[0].hypot(f[1]));
        let elements = run.samples.iter().map(|s| [f64::from(s.t_s), most(&s.friction_n)]).collect();
        let of_model = run.samples.iter().zip(&replayed);
        let of_model = of_model.map(|(s, r)| [f64::from(s.t_s), most(&r.friction_n)]);
        let depth = run.samples.iter().map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
        chart(
            format!("Load held under vibration of {:.0} % of {depth:.1} mm ({})", 100.0 * swing(run) / depth, run.name),
            ["Time t, s", "Friction F, newton"],
            vec![line("model", of_model.collect()), dots("finite elements", elements)],
        )
    });
    Ok(charts.collect())
}

/// A straight slide with noise on depth and slide: the stick ratio, and the first slip that a watch reports.
fn first_slip(model: &Model<'_>, seed: u64) -> Vec<TraceChart> {
    let slide = |depth: f64, noise_mm: f64| {
        let mut queue: Queue<256> = Queue::new();
        let (mut producer, mut consumer) = queue.split();
        let (mut watch, mut state, mut random) = (Watch::new(0), State::default(), Noise::new(seed));
        let (steps, air) = (3000, 20);
        let length = 1.3 * full_slip_slide_mm(model, depth, [1.0, 0.0]) / f64::from(steps);
        let (mut there, mut points) = ([0.0; 2], vec![]);
        for i in 0..steps + air {
            let slid = length * f64::from(i.max(air) - air);
            let to = [slid + noise_mm * random.uniform(), noise_mm * random.uniform()];
            let by = [to[0] - there[0], to[1] - there[1]];
            there = to;
            let response = step(model, &mut state, motion(depth + noise_mm * random.uniform(), by));
            watch.look(&response, &mut producer);
            points.push([slid, f64::from(response.stick_ratio)]);
        }
        let first = std::iter::from_fn(|| consumer.dequeue()).find(|event| event.change == Change::FirstSlip);
        let first_slip = first.map_or("no first slip".into(), |event| {
            format!("first slip reported at {:.3} mm", length * f64::from(event.tick.max(air) - air))
        });
        line(format!("noise of {} µm: {first_slip}", 1e3 * noise_mm), points)
    };
    let at = |depth: f64| {
        let traces = [0.01, 0.001, 0.0].map(|noise| slide(depth, noise)).into();
        chart(format!("First slip through noise, {depth} mm deep"), ["Slide s, mm", "Stick ratio"], traces)
    };
    vec![at(0.5), at(1.5)]
}

/// Friction and moment together in full slip, each over its own limit.
fn limit_surface(model: &Model<'_>, folder: &Path) -> Result<Vec<TraceChart>, String> {
    let elements = held_out_full_slip(model, folder)?.iter().map(|row| [row.friction, row.moment]).collect();
    let cross = f64::from(model.data().spin_cross);
    let curve = |cross: f64| -> Vec<[f64; 2]> {
        let point = |k: i32| {
            let (m, f) = (f64::from(k) * std::f64::consts::FRAC_PI_2 / 100.0).sin_cos();
            let length = 1.0 / (1.0 + cross * f * m).sqrt();
            [length * f, length * m]
        };
        (0..=100).map(point).collect()
    };
    let traces = vec![
        line("model", curve(cross)),
        line("ellipsoid", curve(0.0)),
        dots("finite elements in full slip, held-out spins with slide", elements),
    ];
    let labels = ["Friction over its limit alone", "Moment about the normal over its limit alone"];
    Ok(vec![chart("Limit surface", labels, traces)])
}

/// Rows of held-out runs with spin in which the finite elements slip as a whole.
fn held_out_full_slip(model: &Model<'_>, folder: &Path) -> Result<Vec<FullSlip>, String> {
    let data = model.data().cast();
    let mut points = vec![];
    for kind in ["spin", "spin_slide", "spin_reversal"] {
        let runs = held_out(folder, kind)?;
        points.extend(runs.iter().flat_map(|run| in_full_slip::<SPRINGS, NODES>(&data, run)));
    }
    Ok(points)
}

/// The limit of friction and moment together against the finite elements.
///
/// # Errors
/// A run that cannot be read.
pub fn limit_row(model: &Model<'_>, folder: &Path) -> Result<Row, String> {
    let points = held_out_full_slip(model, folder)?;
    let cross = f64::from(model.data().spin_cross);
    let off =
        |&FullSlip { friction: f, moment: m, .. }: &FullSlip| ((f * f + m * m + cross * f * m).sqrt() - 1.0).powi(2);
    let rms = (points.iter().map(off).sum::<f64>() / points.len() as f64).sqrt();
    let what = format!("{} rows of held-out FE runs in full slip with spin: friction and moment, RMS", points.len());
    Ok(Row::new(what, 100.0 * rms, [3.0, 2.0], "% of the limit"))
}
