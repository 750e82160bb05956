//! A stored run's motion through a pad.

use nalgebra::{Rotation2, Vector2};

use super::patches::tilt;
use super::{Answer, Contact, Law, Pad, Place};
use crate::{Run, Sample};

/// Longest motion of a step, mm, and largest turn, degrees.
const STEP_MM: f64 = 0.1;
const STEP_DEG: f64 = 2.0;

/// Spin, pitch and roll of a sample, degrees.
fn turns(sample: &Sample, neutral_pitch_deg: f64) -> [f64; 3] {
    sample.turned.map_or([0.0, neutral_pitch_deg, 0.0], |t| [t.spin_deg, t.pitch_deg, t.roll_deg].map(f64::from))
}

/// Answers at every sample of a run.
pub fn replay(pad: &Pad, law: &Law, run: &Run, neutral_pitch_deg: f64) -> Vec<Answer> {
    let mut contact = Contact::new(pad);
    let at = |s: &Sample| {
        let [spin, pitch, roll] = turns(s, neutral_pitch_deg);
        [f64::from(s.slide_mm[0]), f64::from(s.slide_mm[1]), f64::from(s.depth_mm), spin, pitch, roll]
    };
    let mut now = run.samples.first().map_or([0.0; 6], at);
    let mut shift = Vector2::new(now[0], now[1]);
    let mut answers = Vec::with_capacity(run.samples.len());
    for sample in &run.samples {
        let to = at(sample);
        let way = |k: usize| to[k] - now[k];
        let long = way(0).hypot(way(1)).max(way(2).abs()) / STEP_MM;
        let turn = (3..6).map(|k| way(k).abs()).fold(0.0, f64::max) / STEP_DEG;
        let steps = long.max(turn).ceil().max(1.0) as usize;
        let from = now;
        let mut answer = Answer::default();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let next: [f64; 6] = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
            let spin = (next[3] - now[3]).to_radians();
            let slide = Vector2::new(next[0] - now[0], next[1] - now[1]);
            shift = Rotation2::new(spin) * shift + Rotation2::new(0.5 * spin) * slide;
            now = next;
            let place = Place {
                tilt: tilt((now[4] - neutral_pitch_deg).to_radians(), now[5].to_radians()),
                depth_mm: now[2],
                shift,
                spin: now[3].to_radians(),
            };
            answer = contact.step(pad, law, &place);
        }
        answers.push(answer);
    }
    answers
}
