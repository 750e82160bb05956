//! Replay of a stored run's motion through the package that runs on the microcontroller.
//!
//! Uses runs and `fingerpad`.

use fingerpad::{DataOf, ModelOf, Motion, Response, StateOf};

use super::{Run, Sample};

/// Longest motion of one step of a replay, mm: short against every slip length.
pub const STEP_MM: f32 = 0.02;

/// Steps from one sample to the next.
fn steps_between(from: &Sample, to: &Sample) -> f32 {
    let slide = [0, 1].map(|k| to.slide_mm[k] - from.slide_mm[k]);
    let longest = slide[0].hypot(slide[1]).max((to.depth_mm - from.depth_mm).abs());
    (longest / STEP_MM).ceil().max(1.0)
}

/// Steps of a replay.
pub fn replay_steps(run: &Run) -> usize {
    1 + run.samples.windows(2).map(|pair| steps_between(&pair[0], &pair[1]) as usize).sum::<usize>()
}

/// The model's response at every sample of `run`; the first is the start.
///
/// Between samples the path is straight and cut into steps of at most [`STEP_MM`].
pub fn replay<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, run: &Run) -> Vec<Response> {
    let mut state = StateOf::default();
    let mut responses = Vec::with_capacity(run.samples.len());
    if let Some(first) = run.samples.first() {
        let motion = Motion { depth_mm: first.depth_mm, slide_increment_mm: [0.0; 2], spin_increment_rad: 0.0, dt_s: 1e-3 };
        responses.push(model.step(&mut state, motion));
    }
    for pair in run.samples.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let depth = to.depth_mm - from.depth_mm;
        let slide = [to.slide_mm[0] - from.slide_mm[0], to.slide_mm[1] - from.slide_mm[1]];
        let steps = steps_between(from, to);
        let mut response = Response::default();
        for k in 1..=steps as u32 {
            let motion = Motion {
                depth_mm: from.depth_mm + depth * (k as f32 / steps),
                slide_increment_mm: slide.map(|s| s / steps),
                spin_increment_rad: 0.0, dt_s: 1e-3,
            };
            response = model.step(&mut state, motion);
        }
        responses.push(response);
    }
    responses
}

/// Replays with a model's numbers; none if the core refuses them.
pub fn replay_data<const M: usize, const N: usize>(data: &DataOf<M, N>, run: &Run) -> Option<Vec<Response>> {
    Some(replay(&data.model().ok()?, run))
}
