//! Many contacts at once: the bits of one by one, on calm and on disturbed motions; slices of another length are refused and nothing moves.

use crate::common::{Noise, models};
use fingerpad::host::{BatchLength, Forces, Motions};
use fingerpad::{ModelOf, Motion, Regime, StateOf, Status, Tuning, step};

const COUNT: usize = 29;

/// Steps `COUNT` contacts together and one by one over a path that presses, slides, turns back, lifts and, if `disturbed`,
/// has noise, jumps, values that are not numbers and changes of strength.
fn compare<const P: usize>(model: &ModelOf<'_, 4, 37>, disturbed: bool) {
    let mut together = [StateOf::<4, P>::default(); COUNT];
    let mut alone = together;
    let (mut numbers, mut regime, mut status) = ([[0.0f32; COUNT]; 6], [Regime::NoContact; COUNT], [Status::OK; COUNT]);
    let seed = 20;
    let mut noise = Noise(seed);
    let mut seen = [0usize; 4];
    for k in 0..4000 {
        let mut depth: [f32; COUNT] = std::array::from_fn(|i| {
            let wave = (0.004 * k as f32 + i as f32).sin() + 0.1 * i as f32 / COUNT as f32;
            if i % 7 == 3 { 1.3 * wave } else { 1.1 + 0.4 * wave }
        });
        let way = |i: usize, by: f32| 0.01 * (0.013 * k as f32 + by + i as f32).sin();
        let mut x: [f32; COUNT] = std::array::from_fn(|i| way(i, 0.0));
        let mut y: [f32; COUNT] = std::array::from_fn(|i| way(i, 1.0));
        let mut spin: [f32; COUNT] = std::array::from_fn(|i| 0.1 * way(i, 2.0));
        if disturbed {
            for i in 0..COUNT {
                depth[i] += 0.01 * noise.next();
                x[i] += 0.01 * noise.next();
                y[i] += 0.01 * noise.next();
            }
            let i = k % COUNT;
            match k % 97 {
                11 => depth[i] = f32::NAN,
                23 => x[i] = f32::INFINITY,
                37 => y[i] = 1e3 * noise.next(),
                41 => spin[i] = f32::NAN,
                53 => depth[i] = 9.0,
                67 => {
                    let factor = 1.0 + 0.9 * noise.next();
                    together[i].set_strength_factor(factor);
                    alone[i].set_strength_factor(factor);
                }
                _ => {}
            }
        }
        let spin_rad: &[f32] = if P == 1 { &[] } else { &spin };
        let motions = Motions { depth_mm: &depth, slide_x_mm: &x, slide_y_mm: &y, spin_rad, dt_s: 1e-3 };
        let mut forces = Forces::of(numbers.each_mut().map(|of_kind| &mut of_kind[..]), &mut regime, &mut status);
        let short = Motions { slide_x_mm: &x[1..], ..motions };
        let refused = model.step_batch(&mut together, short, &mut forces);
        assert_eq!(refused, Err(BatchLength { expected: COUNT, found: COUNT - 1 }));
        model.step_batch(&mut together, motions, &mut forces).unwrap();
        for i in 0..COUNT {
            let spin_increment_rad = if P == 1 { 0.0 } else { spin[i] };
            let motion =
                Motion { depth_mm: depth[i], slide_increment_mm: [x[i], y[i]], spin_increment_rad, dt_s: 1e-3 };
            let r = step(model, &mut alone[i], motion);
            let one =
                [r.normal_force_n, r.friction_n[0], r.friction_n[1], r.spin_moment_n_mm, r.slip_margin, r.stick_ratio];
            let of_all = numbers.map(|number| number[i]);
            let place = format!("seed {seed}, step {k}, contact {i}");
            assert_eq!(of_all.map(f32::to_bits), one.map(f32::to_bits), "{place}: {of_all:?} and {one:?}");
            assert_eq!((regime[i], status[i]), (r.regime, r.status), "{place}");
            assert_eq!(together[i], alone[i], "{place}");
            seen[r.regime as usize] += 1;
        }
    }
    assert!(seen.iter().all(|&n| n > COUNT), "regimes seen: {seen:?}");
}

#[test]
fn a_batch_has_the_bits_of_single_steps() {
    for (_, data) in models() {
        let model = data.model().unwrap();
        let tuned = model.tuned(Tuning { size: 1.1, stiffness: 1.4, lambda: 0.8 }).unwrap();
        for disturbed in [false, true] {
            compare::<1>(&model, disturbed);
            compare::<2>(&model, disturbed);
            compare::<1>(&tuned, disturbed);
            compare::<2>(&tuned, disturbed);
        }
    }
}
