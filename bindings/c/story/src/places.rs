//! The same paths by places instead of increments, for bindings that take slides and angles as they stand (FMU): a row a
//! step, inputs as 64-bit words and answers as 32-bit words.
//!
//! A place is followed by 32-bit increments; what rounding leaves out of one is made up in the next. A step that moves by more than
//! 0.005 mm is divided into equal parts, as the unit does.

use fingerpad::effects::Effects;
use fingerpad::host::ModelFile;
use fingerpad::{Contact, Motion, SPRINGS, SpinState, Status, Surroundings};

use crate::answers::reference;
use crate::requests::{Request, words};

/// Depth, slide x, slide y, angle, strength factor, first column of the user's own.
type Place = [f64; 6];

/// Longest part of a step, and the arm that turns its angle into a length, mm; most parts.
const PART_MM: f64 = 0.005;
const ARM_MM: f64 = 4.0;
const PARTS_MAX: f64 = 1000.0;

/// The disturbed and clean steps of a story, with strength, as places.
fn places(story: &[Request], own: f32) -> Vec<Place> {
    let mut at = [0.0, 0.0, 0.0, 0.0, 1.0, f64::from(own)];
    let mut lines = Vec::new();
    for request in story {
        match *request {
            Request::Factor(factor) if (0.1..=5.0).contains(&factor) => at[4] = f64::from(factor),
            Request::Around([.., own, _, _, _]) => at[5] = f64::from(own),
            Request::Step([depth, x, y, spin, _]) => {
                let mut row = at;
                row[0] = f64::from(depth);
                for (k, increment) in [x, y, spin].into_iter().enumerate() {
                    // A third of a nanometre beside it: places that 32 bits do not hold.
                    row[k + 1] += f64::from(increment) + 1e-10 / 3.0;
                    if row[k + 1].abs() < 1e3 {
                        at[k + 1] = row[k + 1];
                    }
                }
                lines.push(row);
            }
            _ => {}
        }
    }
    lines
}

/// Rows of `inputs | answers` for a model: with spin, or with its effects where it has some.
pub fn rows(story: &[Request], file: &ModelFile) -> Vec<String> {
    let model = file.file();
    let (mut spin, mut contact) = (SpinState::default(), Contact::<SPRINGS>::default());
    let effects = Effects::of_file(&model).expect("the story's files have known effects");
    let mut followed = [0.0f64; 4];
    let mut lines = Vec::new();
    for place in places(story, reference(&model).own[0]) {
        let factor = place[4] as f32;
        spin.set_strength_factor(factor);
        contact.state.set_strength_factor(factor);
        let mut around = Surroundings::default();
        around.own[0] = place[5] as f32;
        let mut status = Status::OK;
        let mut last = None;
        for motion in parts(place, &mut followed) {
            let r = if model.effects.is_empty() {
                model.model.step(&mut spin, motion)
            } else {
                effects.step(&model.model, &mut contact, around, motion)
            };
            status.0 |= r.status.0;
            last = Some(r);
        }
        let r = last.expect("a step has at least one part");
        let inputs: Vec<String> = place.iter().map(|x| format!("{:016x}", x.to_bits())).collect();
        let outputs = [
            r.normal_force_n,
            r.friction_n[0],
            r.friction_n[1],
            r.spin_moment_n_mm,
            r.stick_ratio,
            r.friction_limit_n,
            r.slip_margin,
            r.pressure_centre_mm[0],
            r.pressure_centre_mm[1],
            r.contact_area_mm2,
            r.band_normal_n,
            r.band_friction_n,
        ];
        lines.push(format!("{} |{} {} {}", inputs.join(" "), words(&outputs), r.regime as u8, status.0));
    }
    lines
}

/// The motions that lead in a straight line from the place that is followed to a new one.
fn parts(place: Place, followed: &mut [f64; 4]) -> Vec<Motion> {
    let from = *followed;
    let whole: [f64; 4] = std::array::from_fn(|k| place[k] - from[k]);
    let good = whole.map(|change| (change as f32).is_finite());
    let arms = [1.0, 1.0, 1.0, ARM_MM];
    let lengths = (0..4).filter(|&k| good[k]).map(|k| arms[k] * whole[k].abs());
    let count = (lengths.fold(0.0, |sum, length| sum + length) / PART_MM).ceil().clamp(1.0, PARTS_MAX);
    let mut motions = Vec::new();
    for i in 1..=count as u32 {
        let inside = f64::from(i) < count;
        let to: [f64; 4] = std::array::from_fn(|k| match inside && good[k] {
            true => from[k] + whole[k] * f64::from(i) / count,
            false => place[k],
        });
        let increments: [f32; 4] = std::array::from_fn(|k| (to[k] - followed[k]) as f32);
        for k in (0..4).filter(|&k| good[k]) {
            followed[k] = if k == 0 { to[0] } else { followed[k] + f64::from(increments[k]) };
        }
        let [_, x, y, spin_increment_rad] = increments;
        let dt_s = (1e-3 / count) as f32;
        motions.push(Motion { depth_mm: to[0] as f32, slide_increment_mm: [x, y], spin_increment_rad, dt_s });
    }
    motions
}
