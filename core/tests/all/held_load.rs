//! A held load under a vibration of the spin: the first cycles may relax it, the others leave it.

use fingerpad::{Motion, SpinState, step};

use crate::common::{Noise, shipped};

/// Friction after 1, 10 and 100 000 cycles of spin, over that before.
fn left(amplitude_rad: f32, slide_mm: [f32; 2], noise_mm: f32, steps: u32) -> [f32; 3] {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut state, mut noise) = (SpinState::default(), Noise(9));
    let at = |x, y, spin| Motion { depth_mm: 1.0, slide_increment_mm: [x, y], spin_increment_rad: spin, dt_s: 1e-3 };
    step(&model, &mut state, at(0.0, 0.0, 0.0));
    let held = step(&model, &mut state, at(slide_mm[0], slide_mm[1], 0.0));
    assert!(held.slip_margin > 0.03, "{held:?}");
    let friction = |[x, y]: [f32; 2]| x.hypot(y);
    let (mut left, mut off) = ([0.0; 3], [0.0f32; 2]);
    let mut response = held;
    for cycle in 1..=100_000 {
        for quarter in [1.0, -1.0, -1.0, 1.0] {
            for _ in 0..steps {
                // Places with noise about where the plane is held.
                let to = [0, 1].map(|_| noise_mm * noise.next());
                let by = [to[0] - off[0], to[1] - off[1]];
                off = to;
                response = step(&model, &mut state, at(by[0], by[1], quarter * amplitude_rad / steps as f32));
            }
        }
        if let Some(place) = [1, 10, 100_000].iter().position(|n| *n == cycle) {
            left[place] = friction(response.friction_n) / friction(held.friction_n);
        }
    }
    left
}

#[test]
fn spin_to_and_fro_relaxes_a_load_once() {
    for amplitude in [0.001, 0.01, 0.05] {
        for slide in [[0.3, 0.0], [-0.6, 0.5], [0.0, -0.9]] {
            for (noise, steps) in [(0.0, 1), (0.0, 3), (1e-3, 1)] {
                let [one, ten, last] = left(amplitude, slide, noise, steps);
                println!("{amplitude} rad, {slide:?} mm, noise {noise} mm: {one:.4} {ten:.4} {last:.4}");
                assert!(one <= 1.0 + 5e-3 && one > 0.8, "{amplitude} {slide:?} {noise}: {one}");
                let bound = if noise > 0.0 { 0.02 } else { 1e-3 };
                assert!((last - ten).abs() < bound, "{amplitude} {slide:?} {noise}: {ten} {last}");
            }
        }
    }
}
