//! A finger that pitches and rolls against the plane, in contact and under noise.

mod common;

use common::{Noise, models, motion};
use fingerpad::{Data, Motion, Pose, Response, SpinState, State, step};

/// The shipped model, which knows poses.
fn shipped() -> Data {
    models().into_iter().find(|(name, _)| *name == "shipped").expect("the shipped file reads").1
}

/// A contact in the fitted pose, pressed to 1 mm and slid along x, away from full slip.
fn slid(data: &Data) -> (State, Response) {
    let model = data.model().unwrap();
    let posed = model.posed(fitted(data)).unwrap();
    let mut state = State::default();
    let mut r = step(&posed, &mut state, motion(1.0, 0.0, 0.0));
    for _ in 0..100 {
        r = step(&posed, &mut state, motion(1.0, 0.006, 0.0));
    }
    (state, r)
}

fn fitted(data: &Data) -> Pose {
    Pose { pitch_deg: data.pose.pitch_deg, roll_deg: 0.0 }
}

#[test]
fn the_fitted_pose_is_the_plain_model() {
    let data = shipped();
    let (plain, posed) = (data.model().unwrap(), data.model().unwrap().posed(fitted(&data)).unwrap());
    let (mut a, mut b) = (SpinState::default(), SpinState::default());
    let mut noise = Noise(11);
    for i in 0..5000 {
        let motion = Motion {
            spin_increment_rad: 1e-3 * noise.next(),
            ..motion(1.0 + 0.9 * (0.01 * i as f32).sin(), 0.02 * noise.next(), 0.01)
        };
        let [a, b] = [step(&plain, &mut a, motion), step(&posed, &mut b, motion)];
        let close = |a: f32, b: f32| (a - b).abs() <= 2e-5 * (1.0 + a.abs());
        assert!(
            close(a.normal_force_n, b.normal_force_n) && close(a.friction_limit_n, b.friction_limit_n),
            "{a:?} {b:?}"
        );
        assert!(close(a.friction_n[0], b.friction_n[0]) && close(a.friction_n[1], b.friction_n[1]), "{a:?} {b:?}");
    }
}

/// Rolling takes part of a load along; the same cycle again takes nothing more.
#[test]
fn rolling_to_and_fro_costs_once() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut state, before) = slid(&data);
    let mut kept = vec![];
    for _ in 0..50 {
        for k in 1..=400i32 {
            let roll_deg = 0.1 * (100 - (k % 400 - 200).abs()) as f32;
            let posed = model.posed(Pose { roll_deg, ..fitted(&data) }).unwrap();
            let r = step(&posed, &mut state, motion(1.0, 0.0, 0.0));
            if k == 400 || k == 100 {
                kept.push(r.friction_n[0] / before.friction_n[0]);
            }
        }
    }
    assert!(kept[1] > 0.3 && kept[1] < 0.95, "{kept:?}");
    assert_eq!(kept[3], kept[99]);
}

/// Noise of a tenth of a degree with vibration of 1 um in depth and slide: the load stays.
#[test]
fn a_held_load_stays_under_noise_on_the_pose() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut state, before) = slid(&data);
    let mut noise = Noise(5);
    let mut share = vec![];
    for i in 1..=200_000 {
        let pose = Pose { pitch_deg: data.pose.pitch_deg + 0.1 * noise.next(), roll_deg: 0.1 * noise.next() };
        let r = step(&model.posed(pose).unwrap(), &mut state, motion(1.0 + 1e-3 * noise.next(), 0.0, 0.0));
        if i == 2_000 || i == 200_000 {
            share.push(r.friction_n[0] / before.friction_n[0]);
        }
    }
    let r = step(&model.posed(fitted(&data)).unwrap(), &mut state, motion(1.0, 0.0, 0.0));
    share.push(r.friction_n[0] / before.friction_n[0]);
    println!("friction kept after 2000 and 200 000 steps, and at rest: {share:?}");
    assert!((share[0] - share[1]).abs() < 0.01, "{share:?}");
    assert!(share[2] > 0.95, "{share:?}");
}

/// The gradient of a posed and retuned model against small steps both ways: the mean of what it says at both ends.
#[test]
fn the_gradient_knows_the_pose() {
    let data = shipped().cast::<f64>();
    let plain = data.model_unchecked();
    let tuned = plain.tuned(fingerpad::Tuning { tau0_mpa: 0.003, size: 1.1, ..Default::default() }).unwrap();
    for pose in [Pose { pitch_deg: 45.0, roll_deg: -12.0 }, Pose { pitch_deg: 20.0, roll_deg: 8.0 }] {
        let model = tuned.posed(pose).unwrap();
        for slide in [0.3, 4.0] {
            let mut state = fingerpad::StateOf::<4, 2, f64>::default();
            let at = |depth_mm: f64, x: f64| Motion {
                depth_mm,
                slide_increment_mm: [x, 0.5 * x],
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            model.step(&mut state, at(1.012, 0.0));
            for _ in 0..100 {
                model.step(&mut state, at(1.012, 0.01 * slide));
            }
            for direction in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.2, 0.8]] {
                let h = 1e-4;
                let by = |depth_mm: f64| Motion {
                    slide_increment_mm: [h * direction[1], h * direction[2]],
                    ..at(depth_mm + h * direction[0], 0.0)
                };
                // A first step brings springs that slip to the end of the slack that their limit has.
                let mut moved = state;
                let before = model.step(&mut moved, by(1.012));
                let g = model.gradient(&moved, direction);
                let depth_mm = moved.depth_mm();
                let after = model.step(&mut moved, by(depth_mm));
                let rate = |row: [f64; 3]| row.iter().zip(direction).map(|(g, d)| g * d).sum::<f64>();
                let is = [
                    after.normal_force_n - before.normal_force_n,
                    after.friction_n[0] - before.friction_n[0],
                    after.friction_n[1] - before.friction_n[1],
                ]
                .map(|d| d / h);
                let said = [rate(g.normal_n_mm), rate(g.friction_n_mm[0]), rate(g.friction_n_mm[1])];
                for (is, said) in is.into_iter().zip(said) {
                    assert!((is - said).abs() < 2e-3 + 0.01 * is.abs(), "{pose:?} {slide} {direction:?}: {is} {said}");
                }
            }
        }
    }
}
