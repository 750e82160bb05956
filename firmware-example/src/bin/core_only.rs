//! Everything the core offers and nothing else, linked with `panic-never`: that it links is the proof that nothing
//! in it can panic. Also the binary whose symbols and stack are checked.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad::build::Params;
use fingerpad::calibration::{Calibrated, Calibration, Measured, NotCalibrated, Settings};
use fingerpad::events::{Event, Queue, Watch};
use fingerpad::frames::{FrameContact, FrameResponse, RoundBed, Shape};
use fingerpad::margin::{Margin, MarginObserver, Reading, Settings as MarginSettings};
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::{Cylinder, Edge, PadFile, PadState, Plane, RelaxingPadState, Sphere};
use fingerpad::{
    BedMemory, Branch, Contact, Drive, Effects, File, ForceStateOf, Gradient, Grip, Model, Motion, NODES, Normal,
    Relaxation, RelaxingState, Response, SPRINGS, SpinState, State, Surroundings, Tangential, Tuning,
};
use panic_never as _;

/// The step as a function of its own, for the stack check.
#[inline(never)]
#[unsafe(no_mangle)]
fn one_step(model: &Model<'_>, state: &mut State, motion: &Motion) -> Response {
    fingerpad::step(model, state, *motion)
}

/// The same for a contact that also spins.
#[inline(never)]
#[unsafe(no_mangle)]
fn one_spin_step(model: &Model<'_>, state: &mut SpinState, motion: &Motion) -> Response {
    fingerpad::step(model, state, *motion)
}

/// A step with the effects of the model's file.
#[inline(never)]
#[unsafe(no_mangle)]
fn one_step_with_effects(
    effects: &Effects<'_>,
    model: &Model<'_>,
    contact: &mut Contact<SPRINGS>,
    motion: &Motion,
) -> Response {
    effects.step(model, contact, Surroundings::default(), *motion)
}

#[inline(never)]
fn requests(model: &Model<'_>, state: &mut State, f: [f32; 4]) -> (Gradient, Grip, Response) {
    let gradient = model.gradient(state, [f[0], f[1], f[2]]);
    let grip = model.least_grip([f[0], f[1]], f[2], f[3]);
    let tangential = Tangential::FrictionN([f[1], f[2]]);
    let drive = Drive { normal: Normal::ForceN(f[0]), tangential, spin_increment_rad: 0.0, dt_s: f[3] };
    let driven = model.step_driven(state, drive);
    (gradient, grip, driven.response)
}

#[inline(never)]
fn setup(bytes: &[u8], f: [f32; 4]) -> Option<(Response, State)> {
    let file = File::from_bytes(bytes).ok()?;
    let model = file.model;
    let tuned = model.tuned(Tuning { size: f[0], stiffness: f[1], lambda: f[2] }).ok()?;
    black_box((file.meta, tuned.depth_max_mm()));
    let mut state = State::default();
    state.set_strength_factor(f[3]);
    let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: 0.0, dt_s: f[3] };
    let r = one_step(&model, &mut state, &motion);
    black_box(one_step(&tuned, &mut state, &motion));
    let mut spinning = SpinState::default();
    black_box(one_spin_step(&model, &mut spinning, &Motion { spin_increment_rad: f[1], ..motion }));
    let mut contact = Contact::<SPRINGS>::default();
    let effects = Effects::of_file(&file).ok()?;
    black_box(one_step_with_effects(&effects, &model, &mut contact, &motion));
    Effects::record_rest(&mut contact);
    black_box(requests(&model, &mut state, f));
    black_box(relaxing(bytes, motion));
    black_box(calibrate(&model, f));
    black_box(observe(&model, f));
    let saved = black_box(state.to_bytes(model.data()));
    Some((r, State::from_bytes(model.data(), &saved).ok()?))
}

/// A bed whose tissue relaxes.
#[inline(never)]
fn relaxing(bytes: &[u8], motion: Motion) -> Option<RelaxingState<2>> {
    let file = File::relaxing(bytes).ok()?;
    let mut contact = Contact::<SPRINGS, 1, BedMemory<SPRINGS>>::default();
    black_box(Effects::of_file(&file).ok()?.step(&file.model, &mut contact, Surroundings::default(), motion));
    let mut forces = ForceStateOf::<SPRINGS, 1, f32, BedMemory<SPRINGS>>::default();
    black_box(file.model.step_forces(&mut forces, motion));
    let mut state = RelaxingState::<2>::relaxing();
    black_box(file.model.step(&mut state, motion));
    black_box(file.model.gradient(&state, [motion.depth_mm; 3]));
    let mut saved = [0; RelaxingState::<2>::SAVED_BYTES];
    state.write_bytes(file.model.checksum(), &mut saved).ok()?;
    RelaxingState::read_bytes(file.model.checksum(), black_box(&saved)).ok()
}

#[inline(never)]
fn calibrate(model: &Model<'_>, f: [f32; 4]) -> Option<Result<Calibrated, NotCalibrated>> {
    let mut calibration = Calibration::<SPRINGS, NODES>::new(model, Settings::default());
    let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: 0.0, dt_s: f[3] };
    for _ in 0..black_box(1000) {
        calibration.step(black_box(motion), black_box(Measured { normal_force_n: f[0], friction_n: [f[1], f[2]] }));
    }
    black_box((calibration.estimate(), calibration.model().is_ok()));
    Some(calibration.result())
}

#[inline(never)]
fn observe(model: &Model<'_>, f: [f32; 4]) -> Option<Margin> {
    let mut observer = MarginObserver::<SPRINGS, NODES>::new(model, MarginSettings::default()).ok()?;
    let reading = Reading {
        normal_force_n: f[0],
        friction_n: [f[1], f[2]],
        slide_increment_mm: [f[1], f[2]],
        normal_variance_n2: f[3],
        friction_covariance_n2: [f[3], f[3], f[2]],
        slide_covariance_mm2: [f[3], f[3], f[2]],
        stick_ratio: f[1],
        stick_variance: f[3],
        spin_increment_rad: f[1],
        spin_moment_n_mm: f[2],
        spin_variance_n2_mm2: f[3],
        dt_s: f[3],
    };
    observer.step(black_box(reading));
    Some(observer.step(black_box(reading)))
}

#[inline(never)]
fn build(f: [f32; 4], out: &mut [u8]) -> Option<usize> {
    let mut params = Params::example();
    params.depth_max_mm = f[0];
    params.nodes[3].normal_force_n = f[1];
    params.try_build().ok()?.write_file(&[], "", out).ok()
}

/// A pad on a plane and on other bodies.
#[inline(never)]
fn pads(bytes: &mut [u8], f: [f32; 4]) -> Option<Response> {
    let pad = PadFile::from_bytes(bytes).ok()?.pad;
    let mut state = PadState::<38>::new(&pad).ok()?;
    let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: f[3], dt_s: f[3] };
    state.set_strength_factor(f[1]);
    black_box(pad.step(&mut state, &Plane, motion, [f[0], f[1]]));
    black_box(pad.patch_states(&state, &Plane));
    let mut over = PadState::<38>::over(&pad, [f[0], f[1]]).ok()?;
    let edge = Edge::new(f[0], f[1], f[2]).ok()?;
    black_box(pad.step(&mut over, &Sphere::new(f[0]).ok()?, motion, [f[0], f[1]]));
    black_box(pad.step(&mut over, &Cylinder::new(f[0], f[1]).ok()?, motion, [f[0], f[1]]));
    black_box(pad.step(&mut over, &edge, motion, [f[0], f[1]]));
    black_box(pad.energy_mj(&over, &edge));
    let branches = Relaxation::new(&[Branch { share: f[0], time_s: f[1] }]).ok()?;
    let pad = pad.with_relaxation(branches);
    let mut relaxing = RelaxingPadState::<38>::relaxing(&pad).ok()?;
    black_box(pad.step(&mut relaxing, &edge, motion, [f[0], f[1]]));
    Some(pad.step(&mut relaxing, &Plane, motion, [f[0], f[1]]))
}

/// A pad and a bed on shapes in frames of their own.
#[inline(never)]
fn frames(bytes: &[u8], f: [f32; 4]) -> Option<[FrameResponse; 2]> {
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(f[0], f[1], f[2], f[3]));
    let pose = Isometry3::from_parts(Translation3::new(f[0], f[1], f[2]), turn);
    let pad = PadFile::from_bytes(bytes).ok()?.pad;
    let mut last = FrameResponse::default();
    for shape in [
        Shape::ellipsoid([f[0], f[1], f[2]]),
        Shape::capsule(f[0], f[1]),
        Shape::cylinder(f[0], f[1]),
        Shape::edge(f[0], f[1]),
        Shape::cuboid([f[0], f[1], f[2]], f[3]),
    ] {
        let mut contact = FrameContact::<PadState<38>, f32>::new(&pad, shape.ok()?).ok()?;
        contact.state_mut().set_strength_factor(f[1]);
        last = contact.step(&pad, black_box(&pose), f[3]);
    }
    let bed = RoundBed::new(File::from_bytes(bytes).ok()?.model);
    let mut contact = FrameContact::<SpinState, f32>::new(&bed, Shape::plane()).ok()?;
    Some([last, contact.step(&bed, black_box(&pose), f[3])])
}

#[inline(never)]
fn surroundings(r: &Response, queue: &mut Queue<8>) -> Option<Event> {
    let (mut producer, mut consumer) = queue.split();
    let mut watch = Watch::new(1);
    watch.look(r, &mut producer);
    consumer.dequeue()
}

#[entry]
fn main() -> ! {
    let mut buffer = [0u8; 8192];
    let mut queue = Queue::new();
    loop {
        #[cfg(feature = "panics")]
        black_box(buffer[black_box(9000usize)]);
        let f = black_box([1.0f32, 0.1, 0.2, 1e-3]);
        black_box(build(f, black_box(&mut buffer)));
        black_box(pads(black_box(&mut buffer), f));
        black_box(frames(black_box(&buffer), f));
        if let Some((r, state)) = setup(black_box(&buffer), f) {
            black_box(state);
            black_box(surroundings(&r, &mut queue));
        }
    }
}
