//! Instructions per call of the model's step and of what one would compose instead.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad::build::{DataOf, EffectSlot, ParamsOf};
use fingerpad::calibration::{Calibration, Measured, Settings};
use fingerpad::margin::{Margin, MarginObserver, Reading, Settings as MarginSettings};
use fingerpad::{
    BedMemory, Contact, Drive, Effects, Error, ForceResponse, ForceStateOf, Memory, Motion, NODES, Normal, Relaxation,
    Response, SPRINGS, StateOf, Surroundings, Tangential, Tuning, step,
};
use fingerpad_firmware::count::{Count, count, known_loop, start};
use fingerpad_firmware::exit;
use fingerpad_firmware::rivals::{Rivals, crates, lugre, network};

/// The example's tables with `M` springs of the same stiffness, which touch one after the other.
fn example<const M: usize>() -> Result<DataOf<M, NODES>, Error> {
    let mut springs = [(1.0 / M as f32, 0.0); M];
    for (j, spring) in springs.iter_mut().enumerate() {
        spring.1 = 0.8 * j as f32 / M as f32;
    }
    ParamsOf::example_with(springs).try_build()
}

struct Bench<'a, const M: usize, const P: usize = 1, R = ()> {
    model: fingerpad::ModelOf<'a, M, NODES>,
    state: StateOf<M, P, f32, R>,
    response: Response,
    force_state: ForceStateOf<M, P, f32, R>,
    forces: ForceResponse,
}

impl<'a, const M: usize, const P: usize, R: Default> Bench<'a, M, P, R> {
    fn new(model: fingerpad::ModelOf<'a, M, NODES>) -> Self {
        let (state, force_state) = (StateOf::default(), ForceStateOf::default());
        Self { model, state, response: Response::default(), force_state, forces: ForceResponse::default() }
    }
}

#[inline(always)]
fn motion<const P: usize>(s: &[f32; 4]) -> Motion {
    let spin_increment_rad = if P > 1 { 0.02 * s[1] } else { 0.0 };
    Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], spin_increment_rad, dt_s: s[3] }
}

extern "C" fn ours<const M: usize, const P: usize, R: Memory<M, P, f32>>(b: &mut Bench<'_, M, P, R>, s: &[f32; 4]) {
    b.response = step(&b.model, &mut b.state, motion::<P>(s));
}

extern "C" fn forces<const M: usize, const P: usize, R: Memory<M, P, f32>>(b: &mut Bench<'_, M, P, R>, s: &[f32; 4]) {
    b.forces = b.model.step_forces(&mut b.force_state, motion::<P>(s));
}

/// 512 steps: stick, slip, reversals, turns, depth up and down, always in contact.
fn samples() -> [[f32; 4]; 512] {
    let mut seed = 7u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    let mut out = [[0.0; 4]; 512];
    let (mut depth, mut vx, mut vy) = (1.0, 0.0, 0.0);
    for (i, s) in out.iter_mut().enumerate() {
        if i % 32 == 0 {
            (vx, vy) = (1.2 * (next() - 0.5), 1.2 * (next() - 0.5));
            depth = 0.2 + 2.2 * next();
        }
        if i % 64 < 8 {
            (vx, vy) = (0.02 * vx, 0.02 * vy);
        }
        *s = [depth + 0.02 * next(), vx, vy, 1e-4];
    }
    out
}

fn print(name: &str, c: Count) {
    defmt::println!("count {=str}: least {=u32} mean {=u32} most {=u32}", name, c.least, c.mean, c.most);
}

fn row<const M: usize>(names: [&str; 2], samples: &[[f32; 4]]) -> Result<(), Error> {
    let data = example::<M>()?;
    let mut bench = Bench::<M>::new(data.model()?);
    print(names[0], count(forces::<M, 1, ()>, &mut bench, samples));
    print(names[1], count(ours::<M, 1, ()>, &mut bench, samples));
    black_box((&bench.response, &bench.forces));
    Ok(())
}

fn spin_row<const M: usize>(names: [&str; 2], samples: &[[f32; 4]]) -> Result<(), Error> {
    let data = example::<M>()?;
    let mut bench = Bench::<M, 2>::new(data.model()?);
    print(names[0], count(forces::<M, 2, ()>, &mut bench, samples));
    print(names[1], count(ours::<M, 2, ()>, &mut bench, samples));
    black_box((&bench.response, &bench.forces));
    Ok(())
}

/// The default bed with three branches of the tissue.
fn relaxing_row<const P: usize>(names: [&str; 2], samples: &[[f32; 4]]) -> Result<(), Error> {
    let data = example::<SPRINGS>()?;
    let model = data.model()?.with_relaxation(&Relaxation::HUMAN_ASSUMED)?;
    let mut bench = Bench::<SPRINGS, P, BedMemory<SPRINGS, P>>::new(model);
    print(names[0], count(forces::<SPRINGS, P, BedMemory<SPRINGS, P>>, &mut bench, samples));
    print(names[1], count(ours::<SPRINGS, P, BedMemory<SPRINGS, P>>, &mut bench, samples));
    black_box((&bench.response, &bench.forces));
    Ok(())
}

fn all(samples: &[[f32; 4]]) -> Result<(), Error> {
    row::<3>(["step_forces M=3", "step M=3"], samples)?;
    row::<4>(["step_forces M=4", "step M=4 default"], samples)?;
    row::<5>(["step_forces M=5", "step M=5"], samples)?;
    row::<8>(["step_forces M=8", "step M=8"], samples)?;
    spin_row::<3>(["spin step_forces M=3", "spin M=3"], samples)?;
    spin_row::<4>(["spin step_forces M=4", "spin M=4"], samples)?;
    relaxing_row::<1>(["step_forces, three branches", "step, three branches"], samples)?;
    relaxing_row::<2>(["spin step_forces, three branches", "spin step, three branches"], samples)?;
    let model = fingerpad_firmware::model()?;
    let mut bench = Bench::<SPRINGS>::new(model);
    print("gradient", count(gradient, &mut bench, samples));
    print("least_grip", count(grip, &mut bench, samples));
    print("step_driven by normal force", count(driven, &mut bench, samples));
    print("tuned", count(tuned, &mut bench, samples));
    effects(samples)?;
    calibration(samples)?;
    margin(samples)?;
    let mut rivals = Rivals::default();
    print("LuGre 2-D + powf + bilinear table", count(lugre, &mut rivals, samples));
    print("interpn cubic + powf + nalgebra Iwan 8", count(crates, &mut rivals, samples));
    print("network 3-16-16-3 ReLU", count(network, &mut rivals, samples));
    black_box(&rivals.out);
    Ok(())
}

/// Slots of a model file, one law each: number, parameters.
const LAWS: [(&str, u32, [f32; 4]); 19] = [
    ("hydration_bell", 1, [0.3, 55.0, 15.0, 0.0]),
    ("speed_log", 2, [0.05, 0.0, 0.0, 0.0]),
    ("speed_stribeck", 3, [0.2, 10.0, 0.0, 0.0]),
    ("viscous_drag", 4, [0.002, 0.0, 0.0, 0.0]),
    ("anisotropy", 5, [0.07, 0.13, 0.0, 0.0]),
    ("normal_relaxation", 6, [0.2, 1.4, 0.0, 0.0]),
    ("contact_ageing", 7, [0.05, 0.1, 0.5, 0.0]),
    ("static_peak", 8, [0.2, 0.3, 0.0, 0.0]),
    ("occlusion_growth", 9, [0.3, 10.0, 0.0, 0.0]),
    ("adhesion", 10, [0.015, 0.0, 0.0, 0.0]),
    ("depth_zero_offset", 11, [0.05, 0.0, 0.0, 0.0]),
    ("stiffness_drift", 14, [-0.2, 0.0, 0.0, 0.0]),
    ("subject_size", 15, [1.5, 0.0, 0.0, 0.0]),
    ("strain_stiffening", 16, [0.3, 0.0, 0.0, 0.0]),
    ("temperature", 17, [0.03, 0.0, 0.0, 0.0]),
    ("strength_drift", 18, [-0.2, 0.0, 0.0, 0.0]),
    ("strength_run_in", 19, [-0.2, 900.0, 0.0, 0.0]),
    ("refitted baseline, direction", 32, [0.01, -0.01, 0.005, 0.005]),
    ("refitted baseline, shear", 33, [0.01, 0.0, 0.02, 0.03]),
];

struct EffectBench<'a> {
    model: fingerpad::Model<'a>,
    effects: Effects<'a>,
    contact: Contact<SPRINGS>,
    response: Response,
}

extern "C" fn with_effects(b: &mut EffectBench<'_>, s: &[f32; 4]) {
    let motion = Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], spin_increment_rad: 0.0, dt_s: s[3] };
    let around = Surroundings { hydration_au: 50.0, temperature_c: 30.0, series_s: 600.0, ..Surroundings::default() };
    b.response = b.effects.step(&b.model, &mut b.contact, around, motion);
}

/// A retuned model, then each law alone and all together.
fn effects(samples: &[[f32; 4]]) -> Result<(), Error> {
    let model = fingerpad_firmware::model()?;
    let tuned = model.tuned(Tuning { size: 1.1, stiffness: 1.3, ..Tuning::default() })?;
    let mut bench = TunedBench { model: tuned, state: StateOf::default(), response: Response::default() };
    print("step, retuned finger", count(ours_tuned, &mut bench, samples));
    black_box(&bench.response);
    let slots = LAWS.map(|(_, kind, [a, b, c, d])| EffectSlot { kind, reserved: 0, values: [a, b, c, d, 0.0, 0.0] });
    let run = |name: &str, slots: &[EffectSlot]| -> Result<(), Error> {
        let (contact, response) = (Contact::<SPRINGS>::default(), Response::default());
        let mut bench = EffectBench { model, effects: Effects::new(slots)?, contact, response };
        print(name, count(with_effects, &mut bench, samples));
        black_box(&bench.response);
        Ok(())
    };
    run("effects, none in the file", &[])?;
    for (slot, (name, ..)) in slots.iter().zip(LAWS) {
        run(name, core::slice::from_ref(slot))?;
    }
    run("effects, all of them", &slots)
}

struct TunedBench<'a> {
    model: fingerpad::Model<'a>,
    state: StateOf<SPRINGS>,
    response: Response,
}

extern "C" fn ours_tuned(b: &mut TunedBench<'_>, s: &[f32; 4]) {
    b.response = step(
        &b.model,
        &mut b.state,
        Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], spin_increment_rad: 0.0, dt_s: s[3] },
    );
}

extern "C" fn gradient(b: &mut Bench<'_, SPRINGS>, s: &[f32; 4]) {
    ours(b, s);
    black_box(b.model.gradient(&b.state, [0.0, s[1], s[2]]));
}

extern "C" fn grip(b: &mut Bench<'_, SPRINGS>, s: &[f32; 4]) {
    black_box(b.model.least_grip([0.3 * s[0], s[1]], 0.2, 1.0));
}

extern "C" fn driven(b: &mut Bench<'_, SPRINGS>, s: &[f32; 4]) {
    let drive = Drive {
        normal: Normal::ForceN(0.5 * s[0]),
        tangential: Tangential::SlideIncrementMm([s[1], s[2]]),
        spin_increment_rad: 0.0,
        dt_s: s[3],
    };
    b.response = b.model.step_driven(&mut b.state, drive).response;
}

/// A calibration whose finger goes along the samples' depths and slides.
struct CalibrationBench<'a> {
    calibration: Calibration<'a, SPRINGS, NODES>,
    measured: Measured,
}

extern "C" fn recorded(b: &mut CalibrationBench<'_>, s: &[f32; 4]) {
    let motion = Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], spin_increment_rad: 0.0, dt_s: s[3] };
    b.calibration.record(motion, b.measured);
}

extern "C" fn worked(b: &mut CalibrationBench<'_>, _: &[f32; 4]) {
    b.calibration.work();
}

/// The two halves of a step of calibration.
fn calibration(samples: &[[f32; 4]]) -> Result<(), Error> {
    let model = fingerpad_firmware::model()?;
    let measured = Measured { normal_force_n: 0.4, friction_n: [0.1, 0.0] };
    let mut bench = CalibrationBench { calibration: Calibration::new(&model, Settings::default()), measured };
    print("calibration, a reading", count(recorded, &mut bench, samples));
    print("calibration, work on a block", count(worked, &mut bench, samples));
    black_box(bench.calibration.estimate());
    Ok(())
}

/// An observer of the margin; with a long step every reading ends a block.
struct MarginBench<'a> {
    observer: MarginObserver<'a, SPRINGS, NODES>,
    answer: Margin,
    dt_s: f32,
    stick_variance: f32,
}

extern "C" fn observed(b: &mut MarginBench<'_>, s: &[f32; 4]) {
    b.answer = b.observer.step(Reading {
        normal_force_n: 0.3 * s[0] + 0.1,
        friction_n: [0.1 * s[0] + 0.1 * s[1], 0.1 * s[2]],
        slide_increment_mm: [0.1 * s[1], 0.1 * s[2]],
        normal_variance_n2: 25e-6,
        friction_covariance_n2: [25e-6, 25e-6, 0.0],
        slide_covariance_mm2: [25e-6, 25e-6, 0.0],
        stick_ratio: 0.8,
        stick_variance: b.stick_variance,
        dt_s: b.dt_s,
        ..Reading::default()
    });
}

/// Readings at 1 kHz, mostly without the end of a block, and readings that all end one.
fn margin(samples: &[[f32; 4]]) -> Result<(), Error> {
    let observer = MarginObserver::new(&fingerpad_firmware::model()?, MarginSettings::default())?;
    for (what, stick_variance) in
        [("margin observer, a block in each reading", 0.0), ("margin observer, also the stick ratio", 0.01)]
    {
        let mut bench =
            MarginBench { observer: observer.clone(), answer: Margin::default(), dt_s: 0.2, stick_variance };
        print(what, count(observed, &mut bench, samples));
        black_box(&bench.answer);
    }
    Ok(())
}

extern "C" fn tuned(b: &mut Bench<'_, SPRINGS>, s: &[f32; 4]) {
    let tuning = Tuning { size: 0.8 + 0.1 * s[0], stiffness: 1.3, ..Tuning::default() };
    let _ = black_box(b.model.tuned(tuning));
}

#[entry]
fn main() -> ! {
    let Some(mut p) = cortex_m::Peripherals::take() else { exit(Err(())) };
    start(&mut p.SYST);
    // Reading the counter costs the same each time; the loop of one turn takes 3 instructions.
    let reading = known_loop(1) - 3;
    let mut sound = true;
    for n in [1, 10, 100, 1000, 100_000] {
        sound &= known_loop(n) - reading == 2 * n + 1;
    }
    defmt::println!("counter: {=str}", if sound { "sound" } else { "unsound" });
    let done = all(&samples());
    exit(if sound && done.is_ok() { Ok(()) } else { Err(()) })
}
