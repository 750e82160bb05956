//! One million steps of a random path, boiled down to one number that host and target must share.
//!
//! Compiled by path into the tests of the file format, into the example `document` and into the firmware.

use fingerpad::{Model, Motion, Response, State, step};

/// Digest of all outputs of `steps` steps: presses, slides, turns, lift-offs and now and then nonsense.
pub fn digest(model: &Model<'_>, steps: u32) -> u32 {
    let mut state = State::default();
    let mut seed = 20u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed
    };
    let mut unit = {
        let mut next = next;
        move || (next() >> 8) as f32 / (1 << 24) as f32
    };
    let (mut depth, mut target, mut vx, mut vy) = (0.0f32, 1.0f32, 0.0f32, 0.0f32);
    let mut digest = 0x811c_9dc5u32;
    for i in 0..steps {
        if i % 64 == 0 {
            target = 2.8 * unit() - 0.2;
            (vx, vy) = (0.2 * unit() - 0.1, 0.2 * unit() - 0.1);
            state.set_strength_factor(0.5 + unit());
        }
        depth += 0.1 * (target - depth);
        let mut motion = Motion { depth_mm: depth, slide_increment_mm: [vx, vy], spin_increment_rad: 0.0, dt_s: 1e-4 };
        if i % 1009 == 0 {
            motion.slide_increment_mm[0] = f32::from_bits(next());
        }
        let r = step(model, &mut state, motion);
        digest = mixed(digest, &r);
    }
    digest
}

/// The digest with all words of a response.
pub fn mixed(digest: u32, r: &Response) -> u32 {
    let words = [
        r.normal_force_n.to_bits(),
        r.friction_n[0].to_bits(),
        r.friction_n[1].to_bits(),
        r.stick_ratio.to_bits(),
        r.friction_limit_n.to_bits(),
        r.slip_margin.to_bits(),
        r.spin_moment_n_mm.to_bits(),
        r.pressure_centre_mm[0].to_bits(),
        r.pressure_centre_mm[1].to_bits(),
        r.contact_area_mm2.to_bits(),
        r.band_normal_n.to_bits(),
        r.band_friction_n.to_bits(),
        r.regime as u32,
        r.status.0,
    ];
    words.into_iter().fold(digest, |digest, word| (digest ^ word).wrapping_mul(0x0100_0193).rotate_left(5))
}
