//! A 50 g object held between two pads through `step` at 1 kHz for 1000 s, gravity at 0.8 of the limit.
//!
//! Ends with status 0 if after settling the object's position keeps its bits to the end.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::{Model, Motion, State, step};
use fingerpad_firmware::{exit, model};

const MASS_T: f32 = 50e-6;
const GRAVITY_MM_S2: f32 = 9806.65;
/// Viscosity of both pads together along the skin, N s/mm. Takes the swinging out; the model has none.
const DAMPING: f32 = 8e-3;
const DT_S: f32 = 1e-3;
const STEPS: u32 = 1_000_000;
const SETTLED: u32 = 5_000;

struct Outcome {
    first_mm: f32,
    last_mm: f32,
    changes: u32,
    friction_share: f32,
}

fn hold(model: &Model<'_>) -> Outcome {
    let weight = MASS_T * GRAVITY_MM_S2;
    let grip = model.least_grip([0.5 * weight, 0.0], 0.2, 1.0);
    let mut pads = [State::default(); 2];
    let (mut position, mut speed, mut load) = (0.0f32, 0.0f32, 0.0f32);
    let mut outcome = Outcome { first_mm: 0.0, last_mm: 0.0, changes: 0, friction_share: 0.0 };
    for i in 0..STEPS {
        // The table under the object is lowered in half a second, after 0.2 s of pressing.
        let depth = grip.depth_mm * (i as f32 / 200.0).min(1.0);
        let weight_now = weight * ((i as f32 - 200.0) / 500.0).clamp(0.0, 1.0);
        speed += (weight_now - load - DAMPING * speed) / MASS_T * DT_S;
        let before = position;
        position += speed * DT_S;
        // The object is each pad's plane; what moves is what the rounded position moves.
        let motion = Motion {
            depth_mm: depth,
            slide_increment_mm: [position - before, 0.0],
            spin_increment_rad: 0.0,
            dt_s: DT_S,
        };
        load = 0.0;
        for pad in &mut pads {
            let r = step(model, pad, motion);
            load += r.friction_n[0];
            outcome.friction_share = 1.0 - r.slip_margin;
        }
        if i == SETTLED {
            outcome.first_mm = position;
        } else if i > SETTLED && position.to_bits() != before.to_bits() {
            outcome.changes += 1;
        }
    }
    outcome.last_mm = position;
    outcome
}

#[entry]
fn main() -> ! {
    let Ok(model) = model() else { exit(Err(())) };
    let o = hold(&model);
    defmt::println!(
        "hold: {=u32} steps, friction at {=f32} of the limit, position {=f32} mm (bits {=u32:x} then {=u32:x}), {=u32} changes after settling",
        STEPS,
        o.friction_share,
        o.last_mm,
        o.first_mm.to_bits(),
        o.last_mm.to_bits(),
        o.changes
    );
    let held = o.changes == 0 && o.first_mm.to_bits() == o.last_mm.to_bits() && o.last_mm > 0.1;
    // The grip leaves a fifth of the limit, and of the rest what the finger may hold less than the model says.
    let expected = 0.8 * (1.0 - model.data().band_friction[0]);
    exit(if held && (o.friction_share - expected).abs() < 0.015 { Ok(()) } else { Err(()) })
}
