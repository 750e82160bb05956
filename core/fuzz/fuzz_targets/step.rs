//! Any motions of any bits, while strength and tuning change in mid-path: no panic, nothing out of its range, nothing bad
//! unflagged. `cargo +nightly fuzz run step -- -max_total_time=60`
#![no_main]

use fingerpad::build::Params;
use fingerpad::{Drive, Motion, Normal, Response, SpinState, State, Status, Tangential, Tuning, step};
use libfuzzer_sys::fuzz_target;

/// Bytes of one command: what to do, and five numbers.
const COMMAND: usize = 21;

fn in_range(r: &Response) {
    let [x, y] = r.friction_n;
    assert!(r.normal_force_n >= 0.0 && r.normal_force_n < 1e3, "{r:?}");
    assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-3) && r.friction_limit_n < 1e4, "{r:?}");
    assert!(r.spin_moment_n_mm.abs() < 1e6 && r.pressure_centre_mm.iter().all(|c| c.is_finite()), "{r:?}");
    assert!((0.0..=1.0).contains(&r.stick_ratio) && (0.0..=1.0).contains(&r.slip_margin), "{r:?}");
}

/// Requests that leave the state alone.
fn ask(model: &Model<'_>, state: &State, f: [f32; 5]) {
    let g = model.gradient(state, [f[0], f[1], f[2]]);
    assert!(g.normal_n_mm.iter().chain(g.friction_n_mm.as_flattened()).all(|x| x.is_finite()), "{g:?}");
    let grip = model.least_grip([f[0], f[1]], f[2], f[3]);
    assert!(grip.depth_mm.is_finite() && grip.normal_force_n.is_finite(), "{grip:?}");
}

fuzz_target!(|input: &[u8]| {
    let Ok(data) = Params::example().try_build() else { return };
    let Ok(fitted) = data.model() else { return };
    let mut tuning = Tuning::default();
    let (mut state, mut spinning) = (State::default(), SpinState::default());
    for words in input.chunks_exact(COMMAND) {
        let f: [f32; 5] = core::array::from_fn(|i| f32::from_le_bytes(core::array::from_fn(|k| words[1 + 4 * i + k])));
        let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: f[4], dt_s: f[3] };
        let Ok(model) = fitted.tuned(tuning) else { return };
        match words[0] % 5 {
            0 => {
                state.set_strength_factor(f[3]);
                spinning.set_strength_factor(f[3]);
            }
            1 => {
                let to = Tuning { size: f[0], stiffness: f[1], lambda: f[2] };
                tuning = fitted.tuned(to).map_or(tuning, |_| to);
                continue;
            }
            2 => {
                let drive = Drive {
                    normal: Normal::ForceN(f[0]),
                    tangential: Tangential::FrictionN([f[1], f[2]]),
                    spin_increment_rad: f[4],
                    dt_s: f[3],
                };
                in_range(&model.step_driven(&mut state, drive).response);
                in_range(&model.step_driven(&mut spinning, drive).response);
                continue;
            }
            3 => ask(&model, &state, f),
            _ => {}
        }
        let r = step(&model, &mut state, motion);
        in_range(&r);
        in_range(&step(&model, &mut spinning, motion));
        let good = f.iter().all(|x| x.is_finite()) && f[3] > 0.0;
        assert!(good || r.status != Status::OK, "{motion:?} {r:?}");
    }
});
