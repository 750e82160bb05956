//! Depth cycles of stored finite-element runs, replayed.

use std::path::Path;

use fingerpad::{Model, State, step};
use fingerpad_reduce::{Kind, Run, Sample};

use crate::row::{Row, motion};

/// Longest step of the replay, mm.
const STEP_MM: f64 = 0.005;

/// Changes of friction by cycles of depth at a held slide, against the finite elements.
///
/// # Errors
/// A file that cannot be read.
pub fn rows(model: &Model<'_>, folder: &Path) -> Result<Vec<Row>, String> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("vibration-")))
        .collect();
    files.sort();
    let mut differences = vec![];
    for file in &files {
        let bytes = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
        let run = Run::from_bytes(&bytes, file).map_err(|e| e.to_string())?;
        let turned = run.samples.iter().any(|s| s.turned.is_some_and(|t| t.spin_deg != 0.0));
        if run.kind == Kind::Vibration && run.ended_early.is_none() && !turned {
            differences.extend(changes(model, &run));
        }
    }
    if differences.is_empty() {
        println!("    (no runs of the kind `vibration` in {}: no row against the finite elements)", folder.display());
        return Ok(vec![]);
    }
    let rms = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt();
    let largest = differences.iter().fold(0.0f64, |most, d| most.max(d.abs()));
    let what = format!("{} depth cycles of {} FE runs, change of friction", differences.len(), files.len());
    Ok(vec![
        Row::new(format!("{what}: RMS"), rms, [1.5, 1.0], "% of the limit"),
        Row::new(format!("{what}: largest"), largest, [3.5, 2.0], "% of the limit"),
    ])
}

/// Change of friction from before the first cycle to each return to the held depth, model less finite elements, % of the
/// limit.
fn changes(model: &Model<'_>, run: &Run) -> Vec<f64> {
    let replayed = replay(model, &run.samples);
    let Some(start) = held_from(&run.samples) else { return vec![] };
    let (held, at) = (run.samples[start].depth_mm, run.samples[start].slide_mm);
    let limit = replayed[start].1;
    let mut out = vec![];
    let mut left = false;
    for (sample, (friction, _)) in run.samples.iter().zip(&replayed).skip(start + 1) {
        if sample.slide_mm != at {
            break;
        }
        let is_back = (sample.depth_mm - held).abs() < 1e-6;
        if left && is_back {
            let change = |k: usize| {
                let model = friction[k] - replayed[start].0[k];
                let elements = f64::from(sample.friction_n[k] - run.samples[start].friction_n[k]);
                model - elements
            };
            out.push(100.0 * change(0).hypot(change(1)) / limit);
        }
        left = !is_back;
    }
    out
}

/// The row after the slide and before the first cycle: the last one before depth changes at a constant slide.
fn held_from(samples: &[Sample]) -> Option<usize> {
    samples.windows(2).position(|pair| {
        let slid = pair[0].slide_mm != [0.0; 2];
        slid && pair[1].slide_mm == pair[0].slide_mm && pair[1].depth_mm != pair[0].depth_mm
    })
}

/// Friction, N, and its limit, N, at every row.
fn replay(model: &Model<'_>, samples: &[Sample]) -> Vec<([f64; 2], f64)> {
    let mut state = State::default();
    let mut here = [0.0f64; 3];
    samples
        .iter()
        .map(|sample| {
            let to = [sample.depth_mm, sample.slide_mm[0], sample.slide_mm[1]].map(f64::from);
            let by = [0, 1, 2].map(|k| to[k] - here[k]);
            let steps = (by.iter().fold(0.0f64, |most, b| most.max(b.abs())) / STEP_MM).ceil().max(1.0);
            let mut response = fingerpad::Response::default();
            for i in 1..=steps as u32 {
                let depth = here[0] + by[0] * f64::from(i) / steps;
                response = step(model, &mut state, motion(depth, [by[1] / steps, by[2] / steps]));
            }
            here = to;
            (response.friction_n.map(f64::from), f64::from(response.friction_limit_n))
        })
        .collect()
}
