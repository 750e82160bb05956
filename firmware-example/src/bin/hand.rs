//! A hand of two pads at 1 kHz: two fingers hold a plate, roll it between them, and its weight doubles meanwhile. A controller that sees
//! the pads through an encoder with noise grips harder before the plate slips.
//!
//! Rolling turns one finger steeper and the other flatter: contacts move over the skin and their forces change. The plate gives way
//! between the fingers until both press it alike. Ends with status 0 if the plate sinks by no more than [`SINKS_MM`] with the
//! controller and falls without it, and no step of a pad lacks equilibrium.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::pad::{Pad, PadState, Plane};
use fingerpad::{Error, Motion, Response, Status};
use fingerpad_firmware::grip::GripControl;
use fingerpad_firmware::noise::Noise;
use fingerpad_firmware::{PATCHES, exit, pad};

const DT_S: f32 = 1e-3;
const STEPS: u32 = 2_500;
/// The plate: mass, t; what the pads damp, N s/mm.
const MASS_T: f32 = 30e-6;
const GRAVITY_MM_S2: f32 = 9806.65;
const DAMPING: f32 = 8e-3;
/// Depth of the grip at the start, mm: enough for the plate at rest.
const DEPTH_MM: f32 = 0.7;
/// Pose of both fingers at the start, degrees, and by how much they turn: one up, the other down, both about their own axis.
const PITCH_DEG: f32 = 35.0;
const TURN_DEG: [f32; 2] = [15.0, 8.0];
/// Half-width of the encoder's noise, mm and degrees.
const ENCODER_MM: f32 = 1e-3;
const ENCODER_DEG: f32 = 0.01;

const SINKS_MM: f32 = 2.5;
const FALLS_MM: f32 = 10.0;

/// Two pads on both sides of the plate, in their own frames: the second is the mirror image of the first.
struct Pads([PadState<PATCHES>; 2]);

/// Where the plate is between the pads: along gravity, across and along the line through them, mm; and share of the turn of the fingers.
type Place = [f32; 4];

impl Pads {
    fn new(pad: &Pad<'_>) -> Result<Self, Error> {
        Ok(Self([PadState::new(pad)?, PadState::new(pad)?]))
    }

    /// Force of both pads on the plate, N; the lesser margin; flags.
    fn step(&mut self, pad: &Pad<'_>, depth_mm: f32, by: [f32; 2], place: &Place) -> ([f32; 3], f32, Status) {
        let (mut force, mut margin, mut status) = ([0.0; 3], 1.0f32, Status::OK);
        for (state, mirror) in self.0.iter_mut().zip([1.0, -1.0]) {
            let motion = Motion {
                depth_mm: depth_mm + mirror * place[2],
                slide_increment_mm: [by[0], mirror * by[1]],
                spin_increment_rad: 0.0,
                dt_s: DT_S,
            };
            let pose = [PITCH_DEG + mirror * TURN_DEG[0] * place[3], TURN_DEG[1] * place[3]];
            let r: Response = pad.step(state, &Plane, motion, pose);
            force[0] -= r.friction_n[0];
            force[1] -= mirror * r.friction_n[1];
            force[2] -= mirror * r.normal_force_n;
            margin = margin.min(r.slip_margin);
            status = status.with(r.status);
        }
        (force, margin, status)
    }
}

struct Outcome {
    sank_mm: f32,
    least_margin: f32,
    depth_most_mm: f32,
    status: Status,
}

fn hold(pad: &Pad<'_>, control: bool) -> Result<Outcome, Error> {
    let (mut pads, mut observed) = (Pads::new(pad)?, Pads::new(pad)?);
    let (mut grip, mut noise) = (GripControl::default(), Noise(5));
    let (mut place, mut speed, mut read) = ([0.0f32; 4], [0.0f32; 3], [0.0f32; 2]);
    let (mut force, mut extra) = ([0.0f32; 3], 0.0);
    let mut o = Outcome { sank_mm: 0.0, least_margin: 1.0, depth_most_mm: 0.0, status: Status::OK };
    for i in 0..STEPS {
        let time = i as f32 * DT_S;
        let share = |from: f32, to: f32| ((time - from) / (to - from)).clamp(0.0, 1.0);
        let depth = DEPTH_MM * share(0.0, 0.2) + extra;
        // The plate rests on a table until it is gripped; what is poured onto it later weighs as much again.
        let weight = MASS_T * GRAVITY_MM_S2 * (share(0.2, 0.5) + share(1.0, 2.0));
        let before = place;
        for (k, load) in [weight, 0.0, 0.0].into_iter().enumerate() {
            speed[k] += (load + force[k] - DAMPING * speed[k]) / MASS_T * DT_S;
            place[k] += speed[k] * DT_S;
        }
        place[3] = share(0.8, 1.8);
        let (of_pads, margin, status) = pads.step(pad, depth, [place[0] - before[0], place[1] - before[1]], &place);
        force = of_pads;
        let now = [0, 1].map(|k| place[k] + ENCODER_MM * noise.uniform());
        let by = [now[0] - read[0], now[1] - read[1]];
        read = now;
        let turned = place[3] + ENCODER_DEG / TURN_DEG[0] * noise.uniform();
        let seen = [now[0], now[1], place[2] + ENCODER_MM * noise.uniform(), turned];
        let (_, answer, _) = observed.step(pad, depth + ENCODER_MM * noise.uniform(), by, &seen);
        if control && time > 0.2 {
            extra = grip.update(answer, DT_S);
        }
        o.status = o.status.with(status);
        if time > 0.5 {
            o.sank_mm = o.sank_mm.max(place[0]);
            o.least_margin = o.least_margin.min(margin);
            o.depth_most_mm = o.depth_most_mm.max(depth);
        }
        if place[0] > 2.0 * FALLS_MM {
            break;
        }
    }
    Ok(o)
}

fn both() -> Result<bool, Error> {
    let pad = pad()?;
    let (controlled, alone) = (hold(&pad, true)?, hold(&pad, false)?);
    defmt::println!(
        "hand: with the controller the plate sinks by {=f32} mm, least margin {=f32}, deepest grip {=f32} mm; without it by {=f32} mm",
        controlled.sank_mm,
        controlled.least_margin,
        controlled.depth_most_mm,
        alone.sank_mm
    );
    let held = controlled.sank_mm < SINKS_MM && controlled.least_margin > 0.05;
    Ok(held && alone.sank_mm > FALLS_MM && controlled.status == Status::OK)
}

#[entry]
fn main() -> ! {
    exit(if both() == Ok(true) { Ok(()) } else { Err(()) })
}
