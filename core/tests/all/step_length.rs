//! Results do not depend on the length of a step: directions down to nanometres, forces along random paths.

use crate::common::{Noise, shipped};
use fingerpad::build::DataOf;
use fingerpad::{Motion, NODES, Response, Scalar, StateOf, step};

/// A path at constant depth: slides of 45 degrees, mm, one after the other, with noise on the depth in every step.
struct Stroke {
    depth_mm: f64,
    noise_mm: f64,
    slides_mm: &'static [f64],
}

/// Angle of friction to x at the end of a stroke, degrees.
fn angle<const M: usize, const P: usize, T: Scalar>(
    data: &DataOf<M, NODES, T>,
    number: impl Fn(f64) -> T,
    stroke: &Stroke,
    step_mm: f64,
) -> f64 {
    let model = data.model_unchecked();
    let (mut state, mut noise) = (StateOf::<M, P, T>::default(), Noise(7));
    let mut last = Response::default();
    for slide in stroke.slides_mm {
        let by = number(slide.signum() * step_mm * core::f64::consts::FRAC_1_SQRT_2);
        for _ in 0..(slide.abs() / step_mm).round() as u32 {
            let depth_mm = number(stroke.depth_mm + stroke.noise_mm * f64::from(noise.next()));
            let motion = Motion { depth_mm, slide_increment_mm: [by; 2], dt_s: number(1e-4), ..Motion::default() };
            last = step(&model, &mut state, motion);
        }
    }
    let [x, y] = last.friction_n.map(|f| f64::from(f.to_f32()));
    y.atan2(x).to_degrees()
}

/// Largest difference of the angle from that of steps of 100 nm in double precision, degrees.
fn largest_turn<const M: usize, const P: usize>(name: &str, data: &DataOf<M, NODES>) -> f64 {
    let double = data.cast::<f64>();
    let strokes = [
        ("one way", Stroke { depth_mm: 0.3, noise_mm: 0.0, slides_mm: &[4.0] }),
        ("reversed", Stroke { depth_mm: 0.3, noise_mm: 0.0, slides_mm: &[1.0, -4.0] }),
        ("noise of 1 um on the depth", Stroke { depth_mm: 0.3, noise_mm: 1e-3, slides_mm: &[4.0] }),
    ];
    let mut largest = 0.0f64;
    for (what, stroke) in strokes {
        let fine = angle::<M, P, f64>(&double, |x| x, &stroke, 1e-4);
        for step_mm in [1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
            let single = angle::<M, P, f32>(data, |x| x as f32, &stroke, step_mm);
            let double = angle::<M, P, f64>(&double, |x| x, &stroke, step_mm);
            println!("{name}, P = {P}, {what}, {step_mm:e} mm: {single:.3} and {double:.3} degrees");
            largest = largest.max((single - fine).abs()).max((double - fine).abs());
        }
    }
    largest
}

/// Steady slip at 45 degrees: friction points the same way whatever the length of a step.
#[test]
fn slow_slip_points_the_way_of_fast_slip() {
    assert!(largest_turn::<4, 1>("shipped", &shipped()) < 0.2);
}

#[test]
#[ignore = "nightly"]
fn slow_slip_points_the_way_of_fast_slip_with_spin() {
    assert!(largest_turn::<4, 2>("shipped", &shipped()) < 0.2);
}

/// Friction at 100 places of each leg of a random path that is walked in a number of steps per leg, over the limit.
fn walked<const M: usize>(data: &DataOf<M, NODES>, seed: u64, noise_mm: f32, steps: u32) -> Vec<[f64; 2]> {
    let model = data.model().unwrap();
    let (mut state, mut random, mut places) = (StateOf::<M>::default(), Noise(seed), Noise(seed + 1));
    let (mut from, mut found) = ([0.6f32, 0.0, 0.0], vec![]);
    // The same noise at the same place, straight in between.
    let (mut before, mut after) = (0.0, 0.0);
    for _ in 0..8 {
        let to = [1.0 + 0.8 * random.next(), from[1] + random.next(), from[2] + random.next()];
        for k in 0..steps {
            let of_place = steps / 100;
            if k % of_place == 0 {
                (before, after) = (after, noise_mm * places.next());
            }
            let share = (k % of_place + 1) as f32 / of_place as f32;
            let depth =
                from[0] + (to[0] - from[0]) * ((k + 1) as f32 / steps as f32) + before + (after - before) * share;
            let by = [1, 2].map(|i| (to[i] - from[i]) / steps as f32);
            let motion = Motion { depth_mm: depth, slide_increment_mm: by, dt_s: 1e-3, ..Motion::default() };
            let r = step(&model, &mut state, motion);
            if (k + 1) % of_place == 0 {
                found.push(r.friction_n.map(|f| f64::from(f / r.friction_limit_n)));
            }
        }
        from = to;
    }
    found
}

/// Root mean square and largest difference of friction between two numbers of steps per leg, % of the limit.
fn apart<const M: usize>(data: &DataOf<M, NODES>, noise_mm: f32, [few, many]: [u32; 2]) -> [f64; 2] {
    let (mut sum, mut count, mut most) = (0.0, 0.0, 0.0f64);
    for seed in 0..20 {
        let [few, many] = [few, many].map(|steps| walked(data, 10 * seed + 3, noise_mm, steps));
        for (a, b) in few.iter().zip(&many) {
            let square = (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
            (sum, count, most) = (sum + square, count + 1.0, most.max(square));
        }
    }
    [100.0 * f64::sqrt(sum / count), 100.0 * most.sqrt()]
}

/// Random paths of legs of about 1 mm, all axes at once, with and without noise of 1 um on the depth.
#[test]
fn random_paths_converge_with_the_number_of_steps() {
    converge(&[[100, 1000], [1000, 10_000]]);
}

#[test]
#[ignore = "nightly"]
fn random_paths_of_short_steps_converge() {
    converge(&[[10_000, 100_000]]);
}

fn converge(counts: &[[u32; 2]]) {
    for noise_mm in [0.0, 1e-3] {
        for &steps in counts {
            let [rms, most] = apart(&shipped(), noise_mm, steps);
            println!("noise {noise_mm} mm, {steps:?} steps: {rms:.4} % of the limit, at most {most:.3} %");
            // First order in the length of a step, down to the slack of 4 nm.
            let bound = (30.0 / f64::from(steps[0])).max(0.005);
            assert!(rms < bound && most < 10.0 * bound, "{noise_mm} {steps:?}: {rms} {most}");
        }
    }
}
