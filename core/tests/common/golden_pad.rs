//! Steps of a pad along a random path, boiled down to one number that host and target must share.
//!
//! Compiled by path into the tests of the core and into the firmware.

use super::golden::mixed;
use fingerpad::Motion;
use fingerpad::pad::{EXAMPLE_PATCHES, Pad, PadState, Plane, Sphere};

/// Steps on either body.
pub const STEPS: u32 = 3_000;
/// What they come to on the example's pad.
pub const DIGEST: u32 = 0x4c36_7618;

/// Digest of all outputs of `steps` steps on a plane and as many on a sphere: presses, slides, spins, rolling, lift-offs and now and then
/// nonsense. 0 for a pad that is too large.
pub fn digest(pad: &Pad<'_>, steps: u32) -> u32 {
    let mut seed = 20u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed
    };
    let Ok(mut state) = PadState::<EXAMPLE_PATCHES>::new(pad) else { return 0 };
    let mut digest = 0x811c_9dc5u32;
    let mut at = [0.0f32; 3];
    let mut aim = [0.0f32; 3];
    let mut way = [0.0f32; 3];
    for i in 0..2 * steps {
        if i == steps {
            let Ok(fresh) = PadState::over(pad, [30.0, 0.0]) else { return 0 };
            state = fresh;
        }
        let mut unit = || (next() >> 8) as f32 / (1 << 24) as f32;
        if i % 64 == 0 {
            aim = [2.2 * unit() - 0.3, 30.0 + 20.0 * unit() - 10.0, 20.0 * unit() - 10.0];
            way = [0.08 * unit() - 0.04, 0.08 * unit() - 0.04, 0.01 * unit() - 0.005];
            state.set_strength_factor(0.5 + unit());
        }
        for (at, aim) in at.iter_mut().zip(aim) {
            *at += 0.1 * (aim - *at);
        }
        let [x, y, spin] = way;
        let mut motion = Motion { depth_mm: at[0], slide_increment_mm: [x, y], spin_increment_rad: spin, dt_s: 1e-3 };
        if i % 1009 == 1008 {
            motion.slide_increment_mm[0] = f32::from_bits(next());
        }
        let pose = [at[1], at[2]];
        let r = if i < steps {
            pad.step(&mut state, &Plane, motion, pose)
        } else {
            pad.step(&mut state, &Sphere::new(12.0).unwrap(), motion, pose)
        };
        digest = mixed(digest, &r);
    }
    digest
}
