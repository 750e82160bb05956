//! Replay of a stored run's motion through a pad.

use fingerpad::pad::{Body, PadState, Plane, Surface};
use fingerpad::{Motion, Response};
use fingerpad_fe::contact::{Outline, Reach, RigidBody};

use super::bodies::body_of;
use super::patches::tilt;
use super::{MOST_PATCHES, PadModel};
use crate::{Run, Sample};

/// Longest motion of a step, mm, and largest turn, degrees.
const STEP_MM: f64 = 0.1;
const STEP_DEG: f64 = 2.0;

/// Slide x and y, depth (mm), spin, pitch, roll (degrees) of a sample.
fn place(sample: &Sample, neutral_pitch_deg: f64) -> [f64; 6] {
    let [spin, pitch, roll] =
        sample.turned.map_or([0.0, neutral_pitch_deg, 0.0], |t| [t.spin_deg, t.pitch_deg, t.roll_deg].map(f64::from));
    [f64::from(sample.slide_mm[0]), f64::from(sample.slide_mm[1]), f64::from(sample.depth_mm), spin, pitch, roll]
}

/// The pad's responses at all samples of a run; empty for a body that a pad does not support.
///
/// * `outline`: undeformed surface of the finger, from which depth is measured on a curved body
pub fn replay(model: &PadModel, run: &Run, outline: &Outline) -> Vec<Response<f64>> {
    let Ok(rigid) = run.body.read() else { return Vec::new() };
    match body_of(&rigid, |x| x) {
        None => Vec::new(),
        Some(Body::Plane) => follow(model, run, &Plane, &|_| 0.0),
        Some(body) => follow(model, run, &body, &on_body(model, run, outline, &rigid)),
    }
}

/// The pad's responses at all samples of a run on a plane.
pub fn replay_on_plane(model: &PadModel, run: &Run) -> Vec<Response<f64>> {
    follow(model, run, &Plane, &|_| 0.0)
}

/// Returns a function of the pose (pitch and roll, degrees): the depth of the plane through the apex of a body minus the depth from first
/// touch of the body, mm.
fn on_body<'a>(model: &'a PadModel, run: &Run, outline: &Outline, body: &RigidBody) -> impl Fn([f64; 2]) -> f64 + 'a {
    let neutral = model.numbers.neutral_pitch_deg;
    let start = run.samples.first().map_or([0.0, 0.0, 0.0, 0.0, neutral, 0.0], |s| place(s, neutral));
    let turned = move |[pitch, roll]: [f64; 2]| tilt((pitch - neutral).to_radians(), roll.to_radians());
    let first = turned([start[4], start[5]]);
    let plane = fingerpad_fe::contact::Plane::new([
        0.0,
        0.0,
        0.0,
        0.0,
        (start[4] - neutral).to_radians(),
        start[5].to_radians(),
    ]);
    let reach = Reach::new(outline.clone(), body.clone(), &plane);
    let pivot = if first.angle() == 0.0 { nalgebra::Vector3::zeros() } else { reach.pivot_mm() };
    move |pose| {
        let tilt = turned(pose);
        let normal = tilt * nalgebra::Vector3::z();
        reach.height_mm(&tilt) - (model.pad().first_touch_mm(&normal.into()) - normal.dot(&pivot))
    }
}

/// Steps a pad along a run and returns the responses at its samples.
///
/// * `deeper_mm`: addition to the depth in a pose
fn follow(
    model: &PadModel,
    run: &Run,
    body: &impl Surface<f64>,
    deeper_mm: &dyn Fn([f64; 2]) -> f64,
) -> Vec<Response<f64>> {
    let pad = model.pad();
    let neutral = model.numbers.neutral_pitch_deg;
    let mut now = run.samples.first().map_or([0.0, 0.0, 0.0, 0.0, neutral, 0.0], |s| place(s, neutral));
    let state = if Surface::<f64>::is_plane(body) {
        PadState::<MOST_PATCHES, f64>::new(&pad)
    } else {
        PadState::over(&pad, [now[4], now[5]])
    };
    let Ok(mut state) = state else { return Vec::new() };
    let mut responses = Vec::with_capacity(run.samples.len());
    for sample in &run.samples {
        let to = place(sample, neutral);
        let change = |k: usize| to[k] - now[k];
        let translation = change(0).hypot(change(1)).max(change(2).abs()) / STEP_MM;
        let rotation = (3..6).map(|k| change(k).abs()).fold(0.0, f64::max) / STEP_DEG;
        let steps = translation.max(rotation).ceil().max(1.0) as usize;
        let from = now;
        let mut response = Response::default();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let next: [f64; 6] = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
            let motion = Motion {
                depth_mm: next[2] + deeper_mm([next[4], next[5]]),
                slide_increment_mm: [next[0] - now[0], next[1] - now[1]],
                spin_increment_rad: (next[3] - now[3]).to_radians(),
                dt_s: 1e-3,
            };
            now = next;
            response = pad.step(&mut state, body, motion, [now[4], now[5]]);
        }
        responses.push(response);
    }
    responses
}
