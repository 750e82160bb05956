//! A contact in a real control loop: strengths that change, depth that vibrates, noise, forces that are held, objects at rest.

use crate::common::{Noise, example, models, motion};
use fingerpad::build::{Data, Params};
use fingerpad::events::{Change, Queue, Watch};
use fingerpad::{Drive, Model, Normal, Response, State, Status, Tangential, step};

/// A contact pressed to `depth` and slid along x in steps of 10 um.
fn slid(model: &Model<'_>, depth: f32, slide: f32) -> (State, Response) {
    let mut state = State::default();
    let mut r = step(model, &mut state, motion(depth, 0.0, 0.0));
    let steps = (slide.abs() / 0.01).ceil();
    for _ in 0..steps as u32 {
        r = step(model, &mut state, motion(depth, slide / steps, 0.0));
    }
    (state, r)
}

/// Runs a case on every model in use.
fn on_each(case: impl Fn(&str, &Data, &Model<'_>)) {
    for (name, data) in models() {
        case(name, &data, &data.model().unwrap());
    }
}

#[test]
fn a_strength_that_falls_in_full_slip_leaves_friction_of_the_right_sign() {
    on_each(|name, _, model| {
        for depth in [1.0, 1.5, 2.0, 2.5] {
            let (full, r) = slid(model, depth, -30.0);
            for share in 1..100 {
                let (mut state, factor) = (full, 0.01 * share as f32);
                let factor = state.set_strength_factor(factor);
                let after = step(model, &mut state, motion(depth, 0.0, 0.0));
                assert_eq!(after.status, Status::OK, "{name} {depth} {factor}");
                let left = after.friction_n[0] / r.friction_n[0];
                assert!((left - factor).abs() < 1e-4, "{name} {depth} {factor}: {after:?}");
            }
        }
    });
}

#[test]
fn depth_cycles_shake_down_after_one() {
    on_each(|name, _, model| {
        let (mut state, before) = slid(model, 1.0, 0.5);
        let mut kept = vec![];
        for _ in 0..10_000 {
            step(model, &mut state, motion(0.9, 0.0, 0.0));
            kept.push(step(model, &mut state, motion(1.0, 0.0, 0.0)).friction_n[0] / before.friction_n[0]);
        }
        assert!(kept[0] > 0.85 && kept[0] <= 1.0, "{name} {}", kept[0]);
        assert_eq!(kept[1], kept[9_999], "{name}");
    });
}

#[test]
fn a_held_load_stays_under_noise_of_a_micrometre_on_depth() {
    on_each(|name, _, model| {
        let (mut state, before) = slid(model, 1.0, 0.5);
        let mut noise = Noise(3);
        for _ in 0..1_000_000 {
            step(model, &mut state, motion(1.0 + 0.001 * noise.next(), 0.0, 0.0));
        }
        let after = step(model, &mut state, motion(1.0, 0.0, 0.0));
        assert!(
            (after.friction_n[0] - before.friction_n[0]).abs() < 0.005 * before.friction_limit_n,
            "{name} {after:?}"
        );
    });
}

#[test]
fn a_load_held_by_force_under_noise_on_the_normal_force_does_not_walk() {
    on_each(|name, _, model| {
        let mut state = State::default();
        let drive = |normal, friction| Drive {
            normal: Normal::ForceN(normal),
            tangential: Tangential::FrictionN([friction, 0.0]),
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        // Friction up to 60 % of its limit.
        let full = slid(model, 1.0, 20.0).1;
        let (normal, load) = (full.normal_force_n, 0.6 * full.friction_limit_n);
        for i in 0..=100 {
            model.step_driven(&mut state, drive(normal, 0.01 * i as f32 * load));
        }
        let start = state;
        for (percent, bound_mm, later_mm) in [(1.0, 0.01, 2e-4), (5.0, 0.04, 8e-4)] {
            let (mut state, mut noise, mut way, mut way_at_half) = (start, Noise(5), 0.0, 0.0);
            for i in 0..200_000 {
                let force = normal * (1.0 + 0.01 * percent * noise.next());
                // In the middle and at the end the mean force is back.
                let force = if i % 100_000 == 99_999 { normal } else { force };
                let driven = model.step_driven(&mut state, drive(force, load));
                way += f64::from(driven.motion.slide_increment_mm[0]);
                way_at_half = if i < 100_000 { way } else { way_at_half };
            }
            assert!(way.abs() < bound_mm, "{name}, {percent} %: {way} mm");
            assert!((way - way_at_half).abs() < later_mm, "{name}, {percent} %: {way_at_half} {way} mm");
        }
        // Gaussian noise (sum of twelve uniform numbers), whose least force falls on and on: the plane slides as at the least forces alone.
        for percent in [1.0, 5.0] {
            let (mut noisy, mut replay, mut noise) = (start, start, Noise(12));
            let (mut ways, mut least) = ([0.0f64; 2], normal);
            let slide = |state: &mut State, force: f32, way: &mut f64| {
                *way += f64::from(model.step_driven(state, drive(force, load)).motion.slide_increment_mm[0]);
            };
            for _ in 0..100_000 {
                let gaussian: f32 = (0..12).map(|_| 0.5 * noise.next()).sum();
                let force = normal * (1.0 + 0.01 * percent * gaussian).max(0.1);
                slide(&mut noisy, force, &mut ways[0]);
                if force < least {
                    least = force;
                    slide(&mut replay, least, &mut ways[1]);
                    slide(&mut replay, normal, &mut ways[1]);
                }
            }
            slide(&mut noisy, normal, &mut ways[0]);
            // Rounding adds up to less than a nanometre.
            assert!(ways[0] < 1.05 * ways[1] + 1e-6, "{name}, Gaussian {percent} %: {ways:?} mm");
        }
    });
}

#[test]
fn the_last_bit_of_depth_does_not_change_the_stick_ratio() {
    on_each(|name, _, model| {
        let (mut state, before) = slid(model, 1.0, 0.5);
        let deeper = 1.0f32.next_up();
        let after = step(model, &mut state, motion(deeper, 0.0, 0.0));
        assert!((after.stick_ratio - before.stick_ratio).abs() < 1e-4, "{name} {before:?} {after:?}");
        let mut on = after;
        for _ in 0..5 {
            on = step(model, &mut state, motion(deeper, 0.01, 0.0));
        }
        let plain = slid(model, 1.0, 0.55).1;
        assert!((on.stick_ratio - plain.stick_ratio).abs() < 0.01, "{name} {on:?} {plain:?}");
    });
}

#[test]
fn first_slip_is_told_through_noise_where_it_is_told_without() {
    on_each(|name, _, model| {
        let first_slip = |size: f32| {
            let mut queue: Queue<64> = Queue::new();
            let (mut producer, mut consumer) = queue.split();
            let (mut watch, mut state, mut noise) = (Watch::new(0), State::default(), Noise(11));
            for i in 0..3000 {
                let slide = if i < 10 { 0.0 } else { 0.001 };
                let r = step(model, &mut state, motion(1.0 + size * noise.next(), slide + size * noise.next(), 0.0));
                watch.look(&r, &mut producer);
            }
            let mut events = vec![];
            while let Some(event) = consumer.dequeue() {
                events.push(event);
            }
            let first = events.iter().find(|e| e.change == Change::FirstSlip).unwrap().tick - 10;
            (f64::from(first), events.iter().filter(|e| !matches!(e.change, Change::Touch)).count())
        };
        let ((still, _), (noisy, changes)) = (first_slip(0.0), first_slip(0.001));
        assert!((noisy / still - 1.0).abs() < 0.1, "{name}: {still} {noisy} um");
        assert!(changes <= 4, "{name}: {changes}");
    });
}

#[test]
fn an_object_between_two_fingers_comes_to_rest() {
    on_each(|name, _, model| {
        for dt in [1e-4f64, 1e-3, 5e-3] {
            let (mass_kg, mut fingers) = (0.045, [State::default(); 2]);
            for finger in &mut fingers {
                step(model, finger, motion(1.5, 0.0, 0.0));
            }
            let (mut velocity, mut place, mut rested) = (0.0f64, 0.0f64, 0.0f64);
            let steps = (20.0 / dt) as u32;
            for i in 0..steps {
                let by = (velocity * dt) as f32;
                place += f64::from(by);
                let friction: f64 =
                    fingers.iter_mut().map(|f| f64::from(step(model, f, motion(1.5, by, 0.0)).friction_n[0])).sum();
                velocity += dt * (9810.0 - 1e3 * friction / mass_kg - 22.0 * velocity);
                rested = if i == steps / 2 { place } else { rested };
            }
            let drift_um_s = 1e3 * (place - rested).abs() / 10.0;
            assert!(drift_um_s < 1e-3, "{name} {dt} s: {drift_um_s} um/s");
        }
    });
}

/// A solver that tries steps on a copy and keeps one of them has no other contact than one that tried nothing.
#[test]
fn steps_that_were_tried_and_rejected_leave_nothing() {
    on_each(|_, _, model| {
        let (mut tried, _) = slid(model, 1.0, 0.4);
        let mut plain = tried;
        let mut noise = Noise(17);
        for _ in 0..1000 {
            let kept = motion(1.0 + 0.01 * noise.next(), 1e-3 * noise.next(), 1e-3 * noise.next());
            for _ in 0..3 {
                let mut copy = tried;
                step(model, &mut copy, motion(1.0 + noise.next(), noise.next(), noise.next()));
            }
            assert_eq!(step(model, &mut tried, kept), step(model, &mut plain, kept));
        }
        assert_eq!(tried, plain);
    });
}

#[test]
fn a_state_of_another_finger_is_refused() {
    let data = example();
    let other = Params { pressure_exponent: 0.5, ..Params::example() }.try_build().unwrap();
    let (state, _) = slid(&data.model().unwrap(), 1.0, 0.4);
    assert!(State::from_bytes(&other, &state.to_bytes(&data)).is_err());
    assert_eq!(State::from_bytes(&data, &state.to_bytes(&data)), Ok(state));
}
