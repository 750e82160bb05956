//! Two fingers hold an object while a torque about the line through them grows: a controller that sees the pads' models through an
//! encoder of 1 um grips harder before the object spins. The table shakes.
//!
//! Ends with status 0 if the object turns by no more than [`TURN_MAX_DEG`] with the controller, spins without it, and the grip stays
//! below [`GRIP_MAX`] times what a steady grip needs.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::{Model, Motion, Response, SpinState, step};
use fingerpad_firmware::grip::GripControl;
use fingerpad_firmware::noise::Noise;
use fingerpad_firmware::{exit, model};

const DT_S: f32 = 1e-3;
const STEPS: u32 = 4_000;
/// The object: mass, t, and moment of inertia, t mm²; what the pads damp, N s/mm and N mm s.
const MASS_T: f32 = 30e-6;
const INERTIA_T_MM2: f32 = 4e-3;
const GRAVITY_MM_S2: f32 = 9806.65;
const DAMPING: f32 = 8e-3;
const SPIN_DAMPING: f32 = 0.1;
/// The torque, N mm: from 1 s on it grows for 2 s to this, with a ripple of a tenth.
const TORQUE_N_MM: f32 = 1.6;
/// Shaking of the grip, mm, and half-width of the encoder's noise, mm and rad.
const SHAKE_MM: f32 = 0.01;
const ENCODER_MM: f32 = 1e-3;
const ENCODER_RAD: f32 = 1e-4;

const TURN_MAX_DEG: f32 = 20.0;
const SPINS_DEG: f32 = 90.0;
const GRIP_MAX: f32 = 2.0;

/// Two pads on both sides of the object, in their own frames: the second is the mirror image of the first.
struct Pads([SpinState; 2]);

/// Forces of both pads on the object, N and N mm, and what they are pressed with, N; the lesser margin.
struct Hold {
    force_n: [f32; 2],
    moment_n_mm: f32,
    normal_n: f32,
    margin: f32,
}

impl Pads {
    fn step(&mut self, model: &Model<'_>, depth_mm: f32, [x, y]: [f32; 2], turn: f32) -> Hold {
        let mut hold = Hold { force_n: [0.0; 2], moment_n_mm: 0.0, normal_n: 0.0, margin: 1.0 };
        for (pad, mirror) in self.0.iter_mut().zip([1.0, -1.0]) {
            let slide_increment_mm = [x, mirror * y];
            let motion = Motion { depth_mm, slide_increment_mm, spin_increment_rad: mirror * turn, dt_s: DT_S };
            let r: Response = step(model, pad, motion);
            // The plane feels the opposite of what the finger feels.
            hold.force_n = [hold.force_n[0] - r.friction_n[0], hold.force_n[1] - mirror * r.friction_n[1]];
            hold.moment_n_mm -= mirror * r.spin_moment_n_mm;
            hold.normal_n = r.normal_force_n;
            hold.margin = hold.margin.min(r.slip_margin);
        }
        hold
    }
}

struct Outcome {
    turned_deg: f32,
    fell_mm: f32,
    normal_most_n: f32,
    least_margin: f32,
}

/// A triangle wave of `hz` between −1 and 1.
fn wave(time_s: f32, hz: f32) -> f32 {
    let phase = time_s * hz;
    let phase = phase - phase as u32 as f32;
    if phase < 0.5 { 4.0 * phase - 1.0 } else { 3.0 - 4.0 * phase }
}

/// Holds the object at `depth_mm`; `control` may press deeper.
fn hold(model: &Model<'_>, depth_mm: f32, control: bool) -> Outcome {
    let (mut pads, mut observed) = (Pads([SpinState::default(); 2]), Pads([SpinState::default(); 2]));
    let (mut grip, mut noise) = (GripControl::default(), Noise(3));
    let (mut place, mut speed, mut angle, mut rate) = ([0.0f32; 2], [0.0f32; 2], 0.0f32, 0.0f32);
    let mut held = Hold { force_n: [0.0; 2], moment_n_mm: 0.0, normal_n: 0.0, margin: 1.0 };
    // What the encoders read last: errors do not add up.
    let mut read = [0.0f32; 3];
    let mut extra = 0.0;
    let mut o = Outcome { turned_deg: 0.0, fell_mm: 0.0, normal_most_n: 0.0, least_margin: 1.0 };
    for i in 0..STEPS {
        let time = i as f32 * DT_S;
        let commanded = depth_mm * (time / 0.2).min(1.0) + extra;
        let depth = commanded + SHAKE_MM * wave(time, 27.0);
        let weight = MASS_T * GRAVITY_MM_S2 * ((time - 0.2) / 0.5).clamp(0.0, 1.0);
        let torque = TORQUE_N_MM * ((time - 1.0) / 2.0).clamp(0.0, 1.0) * (1.0 + 0.1 * wave(time, 5.0));
        let before = (place, angle);
        for (k, load) in [weight, 0.0].into_iter().enumerate() {
            speed[k] += (load + held.force_n[k] - DAMPING * speed[k]) / MASS_T * DT_S;
            place[k] += speed[k] * DT_S;
        }
        rate += (torque + held.moment_n_mm - SPIN_DAMPING * rate) / INERTIA_T_MM2 * DT_S;
        angle += rate * DT_S;
        held = pads.step(model, depth, [place[0] - before.0[0], place[1] - before.0[1]], angle - before.1);

        let now = [
            place[0] + ENCODER_MM * noise.uniform(),
            place[1] + ENCODER_MM * noise.uniform(),
            angle + ENCODER_RAD * noise.uniform(),
        ];
        let [x, y, turn] = [now[0] - read[0], now[1] - read[1], now[2] - read[2]];
        read = now;
        let seen = observed.step(model, depth + ENCODER_MM * noise.uniform(), [x, y], turn);
        if control && time > 0.2 {
            extra = grip.update(seen.margin, DT_S);
        }
        if time > 1.0 {
            o.turned_deg = o.turned_deg.max(angle.abs().to_degrees());
            o.fell_mm = o.fell_mm.max(place[0]);
            o.normal_most_n = o.normal_most_n.max(held.normal_n);
            o.least_margin = o.least_margin.min(held.margin);
        }
        if angle.abs() > 6.0 || place[0] > 50.0 {
            break;
        }
    }
    o
}

/// The least depth of a steady grip with which the object does not spin, mm, to 0.02 mm.
fn least_steady_depth(model: &Model<'_>, held_without_torque_mm: f32) -> f32 {
    let (mut low, mut high) = (held_without_torque_mm, model.depth_max_mm());
    while high - low > 0.02 {
        let middle = 0.5 * (low + high);
        if hold(model, middle, false).turned_deg < SPINS_DEG {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[entry]
fn main() -> ! {
    let Ok(model) = model() else { exit(Err(())) };
    // Enough for the weight alone, with the band of the model and a margin of 0.3.
    let grip = model.least_grip([0.5 * MASS_T * GRAVITY_MM_S2, 0.0], 0.3, 1.0);
    let alone = hold(&model, grip.depth_mm, false);
    let controlled = hold(&model, grip.depth_mm, true);
    let needed = hold(&model, least_steady_depth(&model, grip.depth_mm), false);
    defmt::println!(
        "pivot: with the controller the object turns by {=f32} deg, sinks by {=f32} mm, least margin {=f32}, grip at most {=f32} N; steady grip of {=f32} N turns it by {=f32} deg, least steady grip is {=f32} N",
        controlled.turned_deg,
        controlled.fell_mm,
        controlled.least_margin,
        controlled.normal_most_n,
        alone.normal_most_n,
        alone.turned_deg,
        needed.normal_most_n
    );
    let held = controlled.turned_deg < TURN_MAX_DEG && controlled.least_margin > 0.1;
    let spins = alone.turned_deg > SPINS_DEG;
    let gentle = controlled.normal_most_n < GRIP_MAX * needed.normal_most_n;
    exit(if held && spins && gentle { Ok(()) } else { Err(()) })
}
