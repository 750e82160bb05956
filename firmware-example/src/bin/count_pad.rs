//! Instructions per step of a pad.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad::pad::{Cylinder, Effort, Pad, PadState, Plane, Sphere, Surface};
use fingerpad::{Error, Motion, Response};
use fingerpad_firmware::count::{Count, count, start};
use fingerpad_firmware::{PATCHES, exit, pad};

struct Bench<'a, B> {
    pad: Pad<'a>,
    body: B,
    state: PadState<PATCHES>,
    /// Pitch and roll, degrees, and their change in a step.
    pose: [f32; 2],
    turn: [f32; 2],
    response: Response,
}

extern "C" fn step<B: Surface<f32>>(b: &mut Bench<'_, B>, s: &[f32; 4]) {
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
    let mut bench = Bench { pad, body, state, pose: start, turn, response: Response::default() };
    // Down to the first depth.
    for k in 1..=40 {
        step(&mut bench, &[0.02 * k as f32, 0.0, 0.0, 0.0]);
    }
    print(name, count(step::<B>, &mut bench, samples));
    black_box(&bench.response);
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
    row("pad, plane, at rest", Plane, [30.0, 0.0], [0.0; 2], &rest[8..])
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
