//! Instructions per step of a pad.
#![no_std]
#![no_main]

use core::f32::consts::FRAC_PI_6;
use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad::frames::{Finger, FrameContact, FrameResponse, Held, Shape};
use fingerpad::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use fingerpad::pad::{Body, Cylinder, Effort, Memory, Pad, PadState, Plane, RelaxingPadState, Sphere, Surface};
use fingerpad::{Error, Motion, Regime, Relaxation, Response};
use fingerpad_firmware::count::{Count, count, start};
use fingerpad_firmware::{PATCHES, exit, pad};

struct Bench<'a, B, M> {
    pad: Pad<'a>,
    body: B,
    state: PadState<PATCHES, f32, M>,
    /// Pitch and roll, degrees, and their change in a step.
    pose: [f32; 2],
    turn: [f32; 2],
    response: Response,
}

extern "C" fn step<B: Surface<f32>, M: Memory<PATCHES, f32>>(b: &mut Bench<'_, B, M>, s: &[f32; 4]) {
    let motion = Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], spin_increment_rad: s[3], dt_s: 1e-3 };
    b.pose = [b.pose[0] + b.turn[0] * s[1], b.pose[1] + b.turn[1] * s[2]];
    b.response = b.pad.step(&mut b.state, &b.body, motion, b.pose);
}

/// Control at 1 kHz: strokes of up to 30 mm/s that turn, while the depth goes up and down between 0.5 and 2 mm. The fourth number is the
/// spin, rad.
fn samples(spin: f32) -> [[f32; 4]; 512] {
    let mut seed = 7u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    let mut out = [[0.0; 4]; 512];
    let (mut depth, mut deeper, mut vx, mut vy, mut turn) = (0.8, 0.0, 0.0, 0.0, 0.0);
    for (i, s) in out.iter_mut().enumerate() {
        if i % 64 == 0 {
            (vx, vy) = (0.06 * (next() - 0.5), 0.06 * (next() - 0.5));
            turn = spin * (next() - 0.5);
            let aim = 0.5 + 1.5 * next();
            deeper = (aim - depth) / 64.0;
        }
        depth += deeper;
        *s = [depth, vx, vy, turn];
    }
    out
}

fn print(name: &str, c: Count) {
    defmt::println!("count {=str}: least {=u32} mean {=u32} most {=u32}", name, c.least, c.mean, c.most);
}

fn row<B: Surface<f32>>(
    name: &str,
    body: B,
    start: [f32; 2],
    turn: [f32; 2],
    samples: &[[f32; 4]],
) -> Result<(), Error> {
    let pad = pad()?.with_effort(Effort::REAL_TIME);
    let state = if body.is_plane() { PadState::new(&pad)? } else { PadState::over(&pad, start)? };
    counted(name, pad, state, body, [start, turn], samples);
    Ok(())
}

/// The same with three branches of the tissue.
fn relaxing(name: &str, samples: &[[f32; 4]]) -> Result<(), Error> {
    let pad = pad()?.with_effort(Effort::REAL_TIME).with_relaxation(Relaxation::HUMAN_ASSUMED);
    counted(name, pad, RelaxingPadState::relaxing(&pad)?, Plane, [[30.0, 0.0], [0.0; 2]], samples);
    Ok(())
}

fn counted<B: Surface<f32>, M: Memory<PATCHES, f32>>(
    name: &str,
    pad: Pad<'_>,
    state: PadState<PATCHES, f32, M>,
    body: B,
    [start, turn]: [[f32; 2]; 2],
    samples: &[[f32; 4]],
) {
    let mut bench = Bench { pad, body, state, pose: start, turn, response: Response::default() };
    // Down to the first depth.
    for k in 1..=40 {
        step(&mut bench, &[0.02 * k as f32, 0.0, 0.0, 0.0]);
    }
    print(name, count(step::<B, M>, &mut bench, samples));
    black_box(&bench.response);
}

/// A pad whose steps cost nothing, so that what frames add is counted.
struct Beside<'a>(Pad<'a>);

impl Finger<PadState<PATCHES>> for Beside<'_> {
    type Scalar = f32;
    const TOUCHES_CURVED: bool = true;

    fn fresh(&self) -> Result<PadState<PATCHES>, Error> {
        self.0.fresh()
    }
    fn restart(&self, _: &mut PadState<PATCHES>) {}
    fn in_contact(&self, _: &PadState<PATCHES>) -> bool {
        true
    }
    fn neutral_deg(&self) -> [f32; 2] {
        Finger::<PadState<PATCHES>>::neutral_deg(&self.0)
    }
    fn depth_max_mm(&self) -> f32 {
        self.0.depth_max_mm()
    }
    fn hold(&self, tilt: [f32; 2]) -> Held<f32> {
        Finger::<PadState<PATCHES>>::hold(&self.0, tilt)
    }
    fn lowest_mm(&self, normal: &Vector3<f32>, tilt: [f32; 2], held: &Held<f32>) -> f32 {
        Finger::<PadState<PATCHES>>::lowest_mm(&self.0, normal, tilt, held)
    }
    fn lowest_slopes_mm(&self, tilt: [f32; 2], held: &Held<f32>) -> [f32; 2] {
        Finger::<PadState<PATCHES>>::lowest_slopes_mm(&self.0, tilt, held)
    }
    fn advance(&self, _: &mut PadState<PATCHES>, _: &Body, motion: Motion, _: [f32; 2]) -> Response {
        let mut response = Response::IN_THE_AIR;
        response.regime = Regime::Stick;
        response.normal_force_n = motion.depth_mm;
        response.friction_n = motion.slide_increment_mm;
        response
    }
}

struct Frames<'a> {
    finger: Beside<'a>,
    contact: FrameContact<PadState<PATCHES>, f32>,
    felt: FrameResponse,
    poses: [Isometry3<f32>; 64],
}

/// A step to the pose of a number.
extern "C" fn frame_step(b: &mut Frames<'_>, &[number, ..]: &[f32; 4]) {
    if let Some(pose) = b.poses.get(number as usize) {
        b.felt = b.contact.step(&b.finger, pose, 1e-3);
    }
}

/// The part of frames beside the step of the pad: a body that slides and turns under the finger.
fn frames(name: &str, shape: Shape<f32>, under_mm: f32) -> Result<(), Error> {
    let finger = Beside(pad()?);
    let contact = FrameContact::new(&finger, shape)?;
    let poses: [Isometry3<f32>; 64] = core::array::from_fn(|k| {
        let by = 0.01 * k as f32;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.05 * by, 0.1 * by - FRAC_PI_6, 0.2 * by));
        Isometry3::from_parts(Translation3::from(turn * Vector3::new(by, 0.3 * by, 1.0 - under_mm)), turn)
    });
    let mut bench = Frames { finger, contact, felt: FrameResponse::default(), poses };
    frame_step(&mut bench, &[0.0; 4]);
    let numbers: [[f32; 4]; 64] = core::array::from_fn(|k| [k as f32, 0.0, 0.0, 0.0]);
    print(name, count(frame_step, &mut bench, &numbers));
    black_box(&bench.felt);
    Ok(())
}

fn all() -> Result<(), Error> {
    let strokes = samples(0.0);
    let spins = samples(0.01);
    row("pad, plane, strokes", Plane, [30.0, 0.0], [0.0; 2], &strokes)?;
    row("pad, plane, strokes and spin", Plane, [30.0, 0.0], [0.0; 2], &spins)?;
    row("pad, plane, strokes, spin, rolling", Plane, [38.0, 6.0], [3.0; 2], &spins)?;
    row("pad, sphere of 10 mm, strokes", Sphere::new(10.0)?, [30.0, 0.0], [0.0; 2], &strokes)?;
    row("pad, cylinder of 10 mm, strokes", Cylinder::new(10.0, 90.0)?, [30.0, 0.0], [0.0; 2], &strokes)?;
    // There and back: up to the bound of evaluations.
    let between =
        |a: [f32; 4], b: [f32; 4]| -> [[f32; 4]; 64] { core::array::from_fn(|i| if i % 2 == 0 { a } else { b }) };
    let jumps = between([1.8, 0.0, 0.0, 0.0], [0.8, 0.0, 0.0, 0.0]);
    row("pad, plane, jumps of 1 mm", Plane, [30.0, 0.0], [0.0; 2], &jumps)?;
    let jolts = between([1.0, 0.02, 0.02, 0.0], [1.0, -0.02, -0.02, 0.0]);
    row("pad, plane, jolts of 20 um, 0.2 degrees", Plane, [30.0, 0.0], [10.0; 2], &jolts)?;
    let taps = between([-0.05, 0.0, 0.0, 0.0], [0.1, 0.02, 0.0, 0.0]);
    row("pad, plane, taps at 0.15 m/s", Plane, [30.0, 0.0], [0.0; 2], &taps)?;
    let rest = [[1.0, 0.0, 0.0, 0.0]; 64];
    row("pad, plane, at rest", Plane, [30.0, 0.0], [0.0; 2], &rest[8..])?;
    relaxing("pad with three branches, strokes", &strokes)?;
    relaxing("pad with three branches, jumps of 1 mm", &jumps)?;
    relaxing("pad with three branches, held", &rest[8..])?;
    frames("frames of a pad, plane, beside its step", Shape::plane(), 0.0)?;
    frames("frames of a pad, sphere of 10 mm, beside its step", Shape::sphere(10.0)?, 10.0)?;
    frames("frames of a pad, box, beside its step", Shape::cuboid([20.0, 20.0, 5.0], 2.0)?, 5.0)
}

#[entry]
fn main() -> ! {
    let Some(mut p) = cortex_m::Peripherals::take() else { exit(Err(())) };
    start(&mut p.SYST);
    defmt::println!(
        "a pad of {=usize} patches; {=usize} bytes of memory",
        pad().map_or(0, |p| p.patches.len()),
        size_of::<PadState<PATCHES>>()
    );
    exit(all().map_err(|_| ()))
}
