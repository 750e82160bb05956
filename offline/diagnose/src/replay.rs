//! Measured runs through the core: a model file's predicted readings, row by row.

use fingerpad::{Contact, Effects, ModelOf, Motion, Scaling, Surroundings};

use super::laws::Row;
use super::runs::{Run, RunSet};

/// Longest motion of one step, mm.
const STEP_MM: f64 = 0.02;

/// What the laws may read in a row; what is not recorded is left to the core.
fn surroundings(row: &Row) -> Surroundings {
    let reference = Surroundings::default();
    let known = |v: f64, or: f32| if v.is_finite() { v as f32 } else { or };
    let some = |v: f64| v.is_finite().then_some(v as f32);
    Surroundings {
        hydration_au: known(row.hydration_au, reference.hydration_au),
        temperature_c: known(row.temperature_c, reference.temperature_c),
        finger_width_mm: known(row.width_mm, reference.finger_width_mm),
        series_s: row.t_s as f32,
        dwell_s: some(row.dwell_s),
        occlusion_s: some(row.occlusion_s),
        speed_mm_s: (row.speed_mm_s > 0.0).then_some(row.speed_mm_s as f32),
    }
}

/// Predicted readings of a run, three per row, N: normal, x, y; appended to `out`.
pub fn replay<const M: usize, const N: usize, S: Scaling>(
    model: &ModelOf<'_, M, N, S>,
    effects: &Effects<'_>,
    run: &Run,
    out: &mut Vec<f64>,
) {
    let mut contact = Contact::default();
    let Some(first) = run.rows.first() else { return };
    // A run that was recorded from within contact starts with the press to there.
    let (mut depth, mut t_s) = (0.0, first.t_s - first.contact_time_s.max(1e-3));
    if first.depth_mm <= 0.0 {
        (depth, t_s) = (first.depth_mm, first.t_s - 1e-3);
    }
    for (i, row) in run.rows.iter().enumerate() {
        let around = surroundings(row);
        let slide = if row.depth_mm <= 0.0 && i == 0 { [0.0; 2] } else { run.increment(i) };
        let way = slide[0].abs().max(slide[1].abs()).max((row.depth_mm - depth).abs());
        let steps = (way / STEP_MM).ceil().clamp(1.0, 1e4) as usize;
        let share = 1.0 / steps as f64;
        let mut response = fingerpad::Response::default();
        for k in 1..=steps {
            let at = if k == steps { row.depth_mm } else { depth + (row.depth_mm - depth) * k as f64 * share };
            let motion = Motion {
                depth_mm: at as f32,
                slide_increment_mm: slide.map(|s| (s * share) as f32),
                dt_s: ((row.t_s - t_s) * share).max(1e-6) as f32,
            };
            response = effects.step(model, &mut contact, around, motion);
        }
        (depth, t_s) = (row.depth_mm, row.t_s);
        out.extend(effects.reading(&response).map(f64::from));
    }
}

/// Root mean square of readings less prediction over all rows of a set, N: normal, x, y; and the predictions.
pub fn replay_all<const M: usize, const N: usize, S: Scaling>(
    model: &ModelOf<'_, M, N, S>,
    effects: &Effects<'_>,
    set: &RunSet,
) -> ([f64; 3], Vec<f64>) {
    let mut out = Vec::with_capacity(3 * set.rows());
    let mut sums = super::heldout::Squares::default();
    for run in &set.runs {
        let from = out.len();
        replay(model, effects, run, &mut out);
        let readings = run.force_n.iter().flatten();
        sums.add(readings.zip(&out[from..]).map(|(y, p)| y - p));
    }
    (sums.rms(), out)
}
