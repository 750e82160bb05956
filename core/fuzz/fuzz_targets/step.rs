//! Any motions of any bits: no panic, nothing out of its range, nothing bad unflagged.
//! `cargo +nightly fuzz run step -- -max_total_time=60`
#![no_main]

use fingerpad::{Drive, Motion, Normal, Params, State, Status, Tangential, step};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let Ok(data) = Params::example().try_build() else { return };
    let Ok(model) = data.model() else { return };
    let mut state = State::default();
    for words in input.chunks_exact(17) {
        let f: [f32; 4] = core::array::from_fn(|i| f32::from_le_bytes(core::array::from_fn(|k| words[1 + 4 * i + k])));
        let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: 0.0, dt_s: f[3] };
        let r = match words[0] % 4 {
            0 => {
                state.set_strength_factor(f[3]);
                step(&model, &mut state, motion)
            }
            1 => {
                let drive =
                    Drive { normal: Normal::ForceN(f[0]), tangential: Tangential::FrictionN([f[1], f[2]]), dt_s: f[3] };
                model.step_driven(&mut state, drive).response
            }
            2 => {
                let g = model.gradient(&state, [f[0], f[1], f[2]]);
                assert!(g.normal_n_mm.iter().chain(g.friction_n_mm.as_flattened()).all(|x| x.is_finite()), "{g:?}");
                let grip = model.least_grip([f[0], f[1]], f[2], f[3]);
                assert!(grip.depth_mm.is_finite() && grip.normal_force_n.is_finite(), "{grip:?}");
                continue;
            }
            _ => step(&model, &mut state, motion),
        };
        let [x, y] = r.friction_n;
        assert!(r.normal_force_n >= 0.0 && r.normal_force_n < 10.0, "{r:?}");
        assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6) && r.friction_limit_n < 20.0, "{r:?}");
        assert!((0.0..=1.0).contains(&r.stick_ratio) && (0.0..=1.0).contains(&r.slip_margin), "{r:?}");
        let good = f.iter().all(|x| x.is_finite()) && f[3] > 0.0;
        assert!(good || r.status != Status::OK, "{motion:?} {r:?}");
    }
});
