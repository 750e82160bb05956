//! Any motions and readings of any bits into a calibration: no panic, and the finger stays within its range.
//! `cargo +nightly fuzz run calibration -- -max_total_time=60`
#![no_main]

use fingerpad::Motion;
use fingerpad::build::Params;
use fingerpad::calibration::{Calibration, Measured, Settings};
use libfuzzer_sys::fuzz_target;

/// Bytes of one step: six numbers, and how often it is taken.
const STEP: usize = 25;

fuzz_target!(|input: &[u8]| {
    let Ok(data) = Params::example().try_build() else { return };
    let Ok(model) = data.model() else { return };
    let Ok(mut calibration) = Calibration::<4, 37, 16>::new(&model, Settings::default()) else { return };
    for words in input.chunks_exact(STEP) {
        let f: [f32; 6] = core::array::from_fn(|i| f32::from_le_bytes(core::array::from_fn(|k| words[1 + 4 * i + k])));
        let motion = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: 0.0, dt_s: 1e-3 };
        let measured = Measured { normal_force_n: f[3], friction_n: [f[4], f[5]] };
        for k in 0..=words[0] % 32 {
            // Repeated, the plane moves on.
            let depth_mm = motion.depth_mm + 0.03 * f32::from(k);
            calibration.step(Motion { depth_mm, ..motion }, measured);
        }
        let t = calibration.estimate().tuning;
        assert!((0.5..=2.0).contains(&t.size) && (0.2..=5.0).contains(&t.stiffness), "{t:?}");
        assert!((0.1..=10.0).contains(&t.lambda), "{t:?}");
        let _ = calibration.result();
    }
});
