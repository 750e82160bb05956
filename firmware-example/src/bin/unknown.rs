//! A finger holds an object of unknown friction at 1 kHz while its weight grows: noise of 5 mN on the forces, 5 um on the encoder. The grip
//! closes when the lower bound of the margin falls, on a slippery surface and on a rough one.
//!
//! The truth is the shipped model of another strength and stiffness; finite elements are in the repository's tests. Ends with status 0 if
//! neither object slides, both grips stay within twice the least one, and the observer within its instructions and bytes.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::margin::{MarginObserver, Reading, Settings};
use fingerpad::{Drive, Error, Model, Motion, NODES, Normal, SPRINGS, State, Tangential, Tuning, step};
use fingerpad_firmware::count::{self, instructions_in};
use fingerpad_firmware::noise::Noise;
use fingerpad_firmware::{exit, model};

type Observer<'a> = MarginObserver<'a, SPRINGS, NODES>;

const STRENGTHS: [f32; 2] = [0.6, 1.6];
/// The finger is softer than the model.
const STIFFNESS: f32 = 0.87;
const DT_S: f32 = 1e-3;
const STEPS: u32 = 5_000;
const NOISE_N: f32 = 5e-3;
const NOISE_MM: f32 = 5e-3;
/// Grip at the start, N; how fast it closes below this lower bound of the margin, N/s.
const GRIP_N: f32 = 0.3;
const BOUND: f32 = 0.1;
const CLOSES_N_S: f32 = 2.0;
/// Weight of the object at the start and the end, N.
const WEIGHT_N: [f32; 2] = [0.05, 0.6];
const MASS_T: f32 = 50e-6;
const DAMPING: f32 = 8e-3;
const INSTRUCTIONS: u32 = 40_000;
const BYTES: usize = 4096;

struct Outcome {
    grip_n: f32,
    least_n: f32,
    least_margin: f32,
    strength: [f32; 3],
    most: u32,
    mean: u32,
}

fn hold(model: &Model<'_>, strength: f32) -> Result<Outcome, Error> {
    let finger = model.tuned(Tuning { stiffness: STIFFNESS, ..Tuning::default() })?;
    let mut observer = Observer::new(model, Settings::default())?;
    let (mut state, mut noise) = (State::default(), Noise(3));
    state.set_strength_factor(strength);
    let mut normal = |size: f32| size * 0.866 * (noise.uniform() + noise.uniform() + noise.uniform() + noise.uniform());
    let (mut grip, mut speed, mut place, mut seen, mut friction) = (GRIP_N, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
    let mut o = Outcome { grip_n: 0.0, least_n: 0.0, least_margin: 1.0, strength: [0.0; 3], most: 0, mean: 0 };
    let mut sum = 0;
    for i in 0..STEPS {
        let share = ((i as f32 - 500.0) / (STEPS as f32 - 500.0)).clamp(0.0, 1.0);
        let lowered = ((i as f32 - 300.0) / 200.0).clamp(0.0, 1.0);
        let weight = lowered * (WEIGHT_N[0] + (WEIGHT_N[1] - WEIGHT_N[0]) * share);
        speed += (weight - friction - DAMPING * speed) / MASS_T * DT_S;
        place += speed * DT_S;
        let press = grip * (i as f32 / 250.0).min(1.0);
        let drive = Drive {
            normal: Normal::ForceN(press),
            tangential: Tangential::SlideIncrementMm([speed * DT_S, 0.0]),
            spin_increment_rad: 0.0,
            dt_s: DT_S,
        };
        let r = finger.step_driven(&mut state, drive).response;
        friction = r.friction_n[0];
        let now = place + normal(NOISE_MM);
        let reading = Reading {
            normal_force_n: r.normal_force_n + normal(NOISE_N),
            friction_n: r.friction_n.map(|f| f + normal(NOISE_N)),
            slide_increment_mm: [now - seen, normal(NOISE_MM) * 0.1],
            normal_variance_n2: NOISE_N * NOISE_N,
            friction_covariance_n2: [NOISE_N * NOISE_N, NOISE_N * NOISE_N, 0.0],
            slide_covariance_mm2: [NOISE_MM * NOISE_MM, NOISE_MM * NOISE_MM, 0.0],
            dt_s: DT_S,
            ..Reading::default()
        };
        seen = now;
        let mut answer = Default::default();
        let took = instructions_in(|| answer = observer.step(reading));
        sum += took;
        o.most = o.most.max(took);
        if i > 300 && answer.margin_low < BOUND {
            grip += CLOSES_N_S * DT_S;
        }
        if i > 500 {
            o.least_margin = o.least_margin.min(r.slip_margin);
        }
        o.strength = [answer.strength_factor, answer.strength_low, answer.strength_high];
    }
    o.grip_n = grip;
    o.mean = sum / STEPS;
    o.least_n = least(&finger, strength);
    Ok(o)
}

/// The normal force at which the last weight is the limit, N.
fn least(finger: &Model<'_>, strength: f32) -> f32 {
    let (mut low, mut high) = (0.02f32, 2.0f32);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        let mut state = State::default();
        state.set_strength_factor(strength);
        let drive = Drive {
            normal: Normal::ForceN(middle),
            tangential: Tangential::SlideIncrementMm([0.0; 2]),
            spin_increment_rad: 0.0,
            dt_s: DT_S,
        };
        let depth_mm = finger.step_driven(&mut state, drive).motion.depth_mm;
        let slide = Motion { depth_mm, slide_increment_mm: [0.5, 0.0], spin_increment_rad: 0.0, dt_s: DT_S };
        let mut friction = 0.0;
        for _ in 0..60 {
            friction = step(finger, &mut state, slide).friction_n[0];
        }
        if friction < WEIGHT_N[1] { low = middle } else { high = middle }
    }
    high
}

#[entry]
fn main() -> ! {
    let Some(mut p) = cortex_m::Peripherals::take() else { exit(Err(())) };
    count::start(&mut p.SYST);
    let Ok(model) = model() else { exit(Err(())) };
    let mut sound = size_of::<Observer<'_>>() <= BYTES;
    for strength in STRENGTHS {
        let Ok(o) = hold(&model, strength) else { exit(Err(())) };
        defmt::println!(
            "unknown: surface {=f32}, found {=f32} ({=f32} to {=f32}); grip {=f32} N where {=f32} N would do, least margin {=f32}; a step takes {=u32} instructions, at most {=u32}; {=usize} bytes",
            strength,
            o.strength[0],
            o.strength[1],
            o.strength[2],
            o.grip_n,
            o.least_n,
            o.least_margin,
            o.mean,
            o.most,
            size_of::<Observer<'_>>()
        );
        sound &= o.least_margin > 0.0 && o.grip_n < 2.0 * o.least_n && o.most <= INSTRUCTIONS;
    }
    exit(if sound { Ok(()) } else { Err(()) })
}
