//! Strokes through the core: readings of a model file, sample by sample.

use fingerpad::{BedMemory, Contact, Effects, Memory, ModelOf, Motion};

use crate::trajectory::Stroke;

/// Longest motion of one step of the core, mm.
const STEP_MM: f64 = 0.02;

/// Readings that the core predicts along a stroke, three a sample, N: normal, x, y; appended to `out`.
///
/// A stroke that begins in contact starts with the press to there. Tissue relaxes where the model has branches.
pub fn replay_stroke<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    stroke: &Stroke,
    out: &mut Vec<f64>,
) {
    if model.relaxation().is_some() {
        replay(model, effects, Contact::<M, 1, BedMemory<M>>::default(), stroke, out);
    } else {
        replay(model, effects, Contact::<M>::default(), stroke, out);
    }
}

fn replay<const M: usize, const N: usize, R: Memory<M, 1, f32>>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    mut contact: Contact<M, 1, R>,
    stroke: &Stroke,
    out: &mut Vec<f64>,
) {
    let from = out.len();
    let Some(first) = stroke.samples.first() else { return };
    let (mut depth, mut t_s) = (first.depth_mm.min(0.0), stroke.start_s);
    for sample in &stroke.samples {
        let slide = sample.slide_mm;
        let way = slide[0].abs().max(slide[1].abs()).max((sample.depth_mm - depth).abs());
        let steps = (way / STEP_MM).ceil().clamp(1.0, 1e4) as usize;
        let share = 1.0 / steps as f64;
        let mut response = fingerpad::Response::default();
        for k in 1..=steps {
            let at = if k == steps { sample.depth_mm } else { depth + (sample.depth_mm - depth) * k as f64 * share };
            let motion = Motion {
                depth_mm: at as f32,
                slide_increment_mm: slide.map(|s| (s * share) as f32),
                spin_increment_rad: 0.0,
                dt_s: ((sample.t_s - t_s) * share).max(1e-6) as f32,
            };
            response = effects.step(model, &mut contact, sample.surroundings, motion);
        }
        (depth, t_s) = (sample.depth_mm, sample.t_s);
        out.extend(effects.reading_under(&response, &contact, &sample.surroundings).map(f64::from));
    }
    Stroke::filter(&stroke.low_pass(), &mut out[from..]);
}
