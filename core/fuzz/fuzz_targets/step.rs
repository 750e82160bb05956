//! Any motions of any bits on the shipped model and the example, with and without spin, while strength, tuning and effects
//! change: no panic, nothing out of its range, nothing bad unflagged.
//! `cargo +nightly fuzz run step -- -max_total_time=60`
#![no_main]

use std::sync::LazyLock;

use fingerpad::{
    Contact, Data, Drive, EffectSlot, Effects, ModelFile, Motion, Normal, Params, Response, SPRINGS, SpinState, State,
    StateOf, Status, Surroundings, Tangential, Tuned, Tuning, step,
};
use libfuzzer_sys::fuzz_target;

/// The shipped model if it is of this version, and the example.
static MODELS: LazyLock<Vec<Data>> = LazyLock::new(|| {
    let shipped = ModelFile::new(include_bytes!("../../../data/models/fingertip.fpm")).ok();
    let example = Params::example().try_build().ok();
    shipped.map(|file| *file.file().model.data()).into_iter().chain(example).collect()
});

/// A kind of deed and six numbers.
const WORDS: usize = 1 + 6 * 4;

fuzz_target!(|input: &[u8]| {
    for data in MODELS.iter() {
        let Ok(plain) = data.model() else { continue };
        let Ok(mut tuned) = plain.tuned(Tuning::default()) else { continue };
        let (mut state, mut spun, mut contact) = (State::default(), SpinState::default(), Contact::default());
        for words in input.chunks_exact(WORDS) {
            let f: [f32; 6] =
                core::array::from_fn(|i| f32::from_le_bytes(core::array::from_fn(|k| words[1 + 4 * i + k])));
            match words[0] % 4 {
                0 => {
                    let tuning = Tuning { size: f[0], stiffness: f[1], lambda: f[2], tau0_mpa: f[3] };
                    tuned = plain.tuned(tuning).unwrap_or(tuned);
                    state.set_strength_factor(f[4]);
                    spun.set_strength_factor(f[5]);
                }
                1 => asks(&tuned, &state, f),
                2 => {
                    let slot = EffectSlot { kind: u32::from(words[0] / 4), reserved: 0, values: f };
                    let slots = [slot];
                    let Ok(effects) = Effects::new(&slots) else { continue };
                    let around = Surroundings { speed_mm_s: Some(f[5]), hydration_au: f[4], ..Surroundings::default() };
                    sane(&effects.step(&tuned, &mut contact, around, motion(f, 0.0)));
                }
                _ => {
                    moves(&tuned, &mut state, motion(f, 0.0));
                    moves(&tuned, &mut spun, motion(f, f[3]));
                }
            }
        }
    }
});

fn motion(f: [f32; 6], spin_increment_rad: f32) -> Motion {
    Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad, dt_s: f[4] }
}

fn moves<const P: usize>(model: &Tuned<'_>, state: &mut StateOf<SPRINGS, P>, motion: Motion) {
    let r = step(model, state, motion);
    sane(&r);
    let [x, y] = motion.slide_increment_mm;
    let good = [motion.depth_mm, x, y, motion.spin_increment_rad, motion.dt_s].iter().all(|x| x.is_finite());
    assert!((good && motion.dt_s > 0.0) || r.status != Status::OK, "{motion:?} {r:?}");
    assert!(!r.status.contains(Status::MEMORY_LOST), "{motion:?} {r:?}");
}

/// Driven steps, gradients and grips.
fn asks(model: &Tuned<'_>, state: &State, f: [f32; 6]) {
    let tangential = Tangential::FrictionN([f[1], f[2]]);
    let drive = Drive { normal: Normal::ForceN(f[0]), tangential, spin_increment_rad: 0.0, dt_s: f[4] };
    sane(&model.step_driven(&mut { *state }, drive).response);
    let g = model.gradient(state, [f[0], f[1], f[2]]);
    assert!(g.normal_n_mm.iter().chain(g.friction_n_mm.as_flattened()).all(|x| x.is_finite()), "{g:?}");
    let grip = model.least_grip([f[0], f[1]], f[2], f[3]);
    assert!(grip.depth_mm.is_finite() && grip.normal_force_n.is_finite(), "{grip:?}");
}

fn sane(r: &Response) {
    let [x, y] = r.friction_n;
    assert!(r.normal_force_n >= 0.0 && r.normal_force_n.is_finite(), "{r:?}");
    assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6) && r.friction_limit_n.is_finite(), "{r:?}");
    assert!((0.0..=1.0).contains(&r.stick_ratio) && (0.0..=1.0).contains(&r.slip_margin), "{r:?}");
    assert!(r.spin_moment_n_mm.is_finite(), "{r:?}");
}
