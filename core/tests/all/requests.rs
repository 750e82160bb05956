//! Requests of a controller besides a step: gradients, driven steps, the least grip, events.

use crate::common::{Noise, closed_path, example, motion, shipped};
use fingerpad::build::Data;
use fingerpad::events::{Change, Queue, Watch};
use fingerpad::host::{Forces, Motions};
use fingerpad::{
    Contact, Drive, Effects, Model, Motion, Normal, Regime, Response, SPRINGS, SpinState, State, Status, Surroundings,
    Tangential, step,
};
use proptest::prelude::*;

/// A contact somewhere in the middle of a path.
fn somewhere(data: &Data, path: &crate::common::Path, at: f64) -> Option<State> {
    let stop = ((path.len() - 1) as f64 * at) as usize;
    let state = crate::common::run(data, &path[..=stop], |_, _| {});
    (state.depth_mm() > 0.15).then_some(state)
}

proptest! {
    /// The gradient against a small step in the direction it was asked for.
    #[test]
    fn gradient_predicts_a_small_step(path in closed_path(), at in 0.05f64..0.95, dir in prop::array::uniform3(-1.0f32..1.0)) {
        let data = example();
        let model = data.model().unwrap();
        let Some(state) = somewhere(&data, &path, at) else { return Ok(()) };
        // Not across a node of the tables, where the lines have kinks.
        let cell = state.depth_mm() * data.cells_per_mm;
        prop_assume!((cell - cell.round()).abs() > 0.05 && state.depth_mm() < 2.4);
        let h = 2e-3;
        let mut rest = state;
        let before = step(&model, &mut rest, motion(state.depth_mm(), 0.0, 0.0));
        let g = model.gradient(&rest, dir);
        let mut moved = rest;
        let after = step(&model, &mut moved, motion(state.depth_mm() + h * dir[0], h * dir[1], h * dir[2]));
        // On the way an element may reach its limit and a falling contact its reference: then the change lies between
        // what the gradients at both ends say.
        let end = model.gradient(&moved, dir);
        let predict = |row: [f32; 3]| h * (row[0] * dir[0] + row[1] * dir[1] + row[2] * dir[2]);
        let pairs = [
            (after.normal_force_n - before.normal_force_n, g.normal_n_mm, end.normal_n_mm),
            (after.friction_n[0] - before.friction_n[0], g.friction_n_mm[0], end.friction_n_mm[0]),
            (after.friction_n[1] - before.friction_n[1], g.friction_n_mm[1], end.friction_n_mm[1]),
        ];
        for (i, (is, start, end)) in pairs.into_iter().enumerate() {
            let (a, b) = (predict(start), predict(end));
            let apart = (a.min(b) - is).max(is - a.max(b));
            prop_assert!(apart <= 2e-6 + 0.05 * h, "{i}: {is} {a} {b}");
        }
    }

    /// Anywhere, above all where the finger just does not touch: numbers, and a state that can be saved.
    #[test]
    fn at_the_edge_of_contact(exponent in -9.0f32..0.0, x in -1.0f32..1.0, far in -1e30f32..1e30) {
        let data = example();
        let model = data.model().unwrap();
        let mut state = State::default();
        step(&model, &mut state, motion(1.0, x, 0.1));
        step(&model, &mut state, motion(10.0f32.powf(exponent), x, 0.1));
        for direction in [[x, 1.0, 0.0], [far, x, -far]] {
            let g = model.gradient(&state, direction);
            let all = g.normal_n_mm.iter().chain(g.friction_n_mm.as_flattened());
            prop_assert!(all.into_iter().all(|s| s.is_finite()), "{g:?}");
        }
        prop_assert_eq!(State::from_bytes(&data, &state.to_bytes(&data)), Ok(state));
    }

    #[test]
    fn driven_steps_reach_their_forces(force in 0.02f32..2.5, share in 0.0f32..0.9, angle in 0.0f32..6.3) {
        let data = example();
        let model = data.model().unwrap();
        let mut state = State::default();
        let press = Drive {
            normal: Normal::ForceN(force),
            tangential: Tangential::SlideIncrementMm([0.0; 2]),
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        let pressed = model.step_driven(&mut state, press);
        prop_assert!((pressed.response.normal_force_n / force - 1.0).abs() < 1e-5, "{pressed:?}");
        // The limit depends on the direction: that of a long slide.
        let mut far = state;
        let slid = step(&model, &mut far, motion(state.depth_mm(), 20.0 * angle.cos(), 20.0 * angle.sin()));
        let friction = slid.friction_n.map(|f| share * f);
        let mut driven = pressed;
        for k in 1..=20 {
            let part = k as f32 / 20.0;
            let hold = Drive { tangential: Tangential::FrictionN(friction.map(|f| f * part)), ..press };
            driven = model.step_driven(&mut state, hold);
            prop_assert_eq!(driven.response.status, Status::OK, "{:?}", driven);
        }
        let r = driven.response;
        let limit = r.friction_limit_n;
        prop_assert!((r.friction_n[0] - friction[0]).abs() < 1e-4 * limit, "{r:?} {friction:?}");
        prop_assert!((r.friction_n[1] - friction[1]).abs() < 1e-4 * limit, "{r:?} {friction:?}");
        prop_assert!((r.normal_force_n / force - 1.0).abs() < 1e-4, "{r:?}");
        // Held: not a bit moves.
        let hold = Drive { tangential: Tangential::FrictionN(friction), ..press };
        model.step_driven(&mut state, hold);
        let before = state;
        for _ in 0..100 {
            let again = model.step_driven(&mut state, hold);
            prop_assert_eq!(again.motion.slide_increment_mm, [0.0; 2]);
        }
        prop_assert_eq!(state, before);
    }

    #[test]
    fn least_grip_holds_and_is_least(load in 0.01f32..1.5, angle in 0.0f32..6.3, margin in 0.0f32..0.5, factor in 0.5f32..2.0) {
        let data = example();
        let model = data.model().unwrap();
        let loads = [load * angle.cos(), load * angle.sin()];
        let grip = model.least_grip(loads, margin, factor);
        if grip.status.contains(Status::LOAD_NOT_REACHED) {
            return Ok(());
        }
        let mut state = State::default();
        state.set_strength_factor(factor);
        step(&model, &mut state, motion(grip.depth_mm, 0.0, 0.0));
        let mut driven = fingerpad::Driven::default();
        for k in 1..=50 {
            let drive = Drive {
                normal: Normal::DepthMm(grip.depth_mm),
                tangential: Tangential::FrictionN(loads.map(|l| l * k as f32 / 50.0)),
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            driven = model.step_driven(&mut state, drive);
        }
        let r = driven.response;
        // Near the limit itself friction is only reached after a long slide.
        prop_assume!(margin > 0.1);
        prop_assert_eq!(r.status, Status::OK);
        // With the band of full slip off the limit the margin is what was asked for.
        let band = data.band_friction[0] * model.step(&mut State::default(), motion(grip.depth_mm, 0.0, 0.0)).friction_limit_n;
        let left = 1.0 - load / (r.friction_limit_n - band * factor);
        prop_assert!((left - margin).abs() < 3e-3, "{left} {r:?} {grip:?}");
        prop_assert!(r.slip_margin > margin + 0.01, "{r:?} {grip:?}");
        let apart = (r.normal_force_n - grip.normal_force_n).abs();
        prop_assert!(apart <= 0.02 * grip.normal_force_n + 2e-4, "{r:?} {grip:?}");
    }
}

#[test]
fn bad_drives_are_flagged() {
    let data = example();
    let model = data.model().unwrap();
    let mut state = State::default();
    let drive = |normal, tangential| Drive { normal, tangential, spin_increment_rad: 0.0, dt_s: 1e-3 };
    let still = Tangential::SlideIncrementMm([0.0; 2]);
    let r = model.step_driven(&mut state, drive(Normal::ForceN(100.0), still)).response;
    assert!(r.status.contains(Status::LOAD_NOT_REACHED), "{r:?}");
    let r = model.step_driven(&mut state, drive(Normal::ForceN(1.0), Tangential::FrictionN([50.0, 0.0]))).response;
    assert!(r.status.contains(Status::LOAD_NOT_REACHED), "{r:?}");
    // Without end is out of reach like any other: the largest depth, the limit.
    let r = model.step_driven(&mut state, drive(Normal::ForceN(f32::INFINITY), still));
    assert!(r.response.status.contains(Status::LOAD_NOT_REACHED), "{r:?}");
    assert!(r.motion.depth_mm > 0.999 * model.depth_max_mm(), "{r:?}");
    let r = model.step_driven(&mut state, drive(Normal::ForceN(1.0), Tangential::FrictionN([3e38, 0.0]))).response;
    assert!(r.status.contains(Status::LOAD_NOT_REACHED) && r.normal_force_n > 0.5, "{r:?}");
    let before = state;
    let r = model.step_driven(&mut state, drive(Normal::ForceN(f32::NAN), Tangential::FrictionN([f32::NAN, 0.0])));
    assert!(r.response.status.contains(Status::BAD_INPUT));
    assert_eq!(state, before);
    let r = model.step_driven(&mut state, drive(Normal::ForceN(-1.0), still)).response;
    assert_eq!(r.regime, Regime::NoContact);
    for bits in 0..4096u32 {
        let f = f32::from_bits(bits << 20);
        let r = model.step_driven(&mut state, drive(Normal::ForceN(f), Tangential::FrictionN([f, -f]))).response;
        assert!(r.normal_force_n.is_finite() && r.friction_n[0].is_finite() && r.friction_n[1].is_finite());
    }
}

#[test]
fn events_in_their_order() {
    let data = example();
    let model: Model<'_> = data.model().unwrap();
    let mut state = State::default();
    let mut queue: Queue<16> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    let mut watch = Watch::new(3);
    let mut go = |m: Motion| {
        let r: Response = step(&model, &mut state, m);
        watch.look(&r, &mut producer);
    };
    go(motion(-0.1, 0.0, 0.0));
    for _ in 0..10 {
        go(motion(1.0, 0.0, 0.0));
    }
    for _ in 0..2000 {
        go(motion(1.0, 0.01, 0.0));
    }
    for _ in 0..10 {
        go(motion(1.0, -0.05, 0.0));
    }
    for _ in 0..10 {
        go(motion(0.0, 0.0, 0.0));
    }
    let mut seen = vec![];
    while let Some(event) = consumer.dequeue() {
        assert_eq!(event.finger, 3);
        seen.push(event.change);
    }
    use Change::{FirstSlip, FullSlip, LiftOff, Restick, Touch};
    assert_eq!(seen, [Touch, FirstSlip, FullSlip, Restick, LiftOff]);
    assert_eq!(watch.lost(), 0);
}

#[cfg(feature = "serde")]
#[test]
fn serde_round_trips() {
    use fingerpad::build::{EffectSlot, Params};
    use fingerpad::{Contact, SpinState};

    fn again<T: serde::Serialize + serde::de::DeserializeOwned + PartialEq + core::fmt::Debug>(value: &T) {
        assert_eq!(serde_json::from_str::<T>(&serde_json::to_string(value).unwrap()).unwrap(), *value);
    }
    let data = example();
    let model = data.model().unwrap();
    let (mut state, mut spun) = (State::default(), SpinState::default());
    let turned = Motion { spin_increment_rad: 0.01, ..motion(1.0, 1.0, 0.3) };
    step(&model, &mut state, motion(1.0, 1.0, 0.3));
    let r = step(&model, &mut spun, turned);
    again(&Params::example());
    again(&data);
    again(&state);
    again(&spun);
    again(&r);
    let mut contact = Contact::<SPRINGS>::default();
    contact.state = state;
    again(&contact);
    again(&EffectSlot { kind: 3, reserved: 0, values: [0.5; 6] });
    again(&Watch::new(2));
    let text = serde_json::to_string(&state).unwrap();
    assert!(
        serde_json::from_str::<State>(&text.replace("\"strength_factor\":1.0", "\"strength_factor\":100.0")).is_err()
    );
}

/// Without contact nothing is held: the slip margin is 0, never that of a safe grip. Fingers that bounce, by noise on the depth, with
/// slides that turn back: plain, with spin, tuned by effects, driven by force, and in a batch.
#[test]
fn the_margin_is_zero_without_contact() {
    let data = shipped();
    let model = data.model().unwrap();
    let effects = Effects::new(&[]).unwrap();
    let (mut plain, mut spun, mut driven) = (State::default(), SpinState::default(), State::default());
    let mut contact: Contact<SPRINGS> = Contact::default();
    let mut many = [State::default(); 16];
    let (mut noise, mut lifted) = (Noise(5), 0);
    for i in 0..2000 {
        let depth = 0.3 * noise.next();
        let x = if i % 100 < 50 { 0.02 } else { -0.02 } + 0.005 * noise.next();
        let mut drive = Drive {
            normal: Normal::ForceN(0.1 * noise.next()),
            tangential: Tangential::SlideIncrementMm([x, 0.0]),
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        let (mut numbers, mut regime, mut status) = ([[0.5f32; 16]; 6], [Regime::Slip; 16], [Status::OK; 16]);
        let mut forces = Forces::of(numbers.each_mut().map(|of_kind| &mut of_kind[..]), &mut regime, &mut status);
        let depths = [depth; 16];
        let motions =
            Motions { depth_mm: &depths, slide_x_mm: &[x; 16], slide_y_mm: &[0.0; 16], spin_rad: &[], dt_s: 1e-3 };
        model.step_batch(&mut many, motions, &mut forces).unwrap();
        let batch = (regime[3], numbers[4][3]);
        let by_force = model.step_driven(&mut driven, drive).response;
        drive.normal = Normal::DepthMm(depth);
        let responses = [
            step(&model, &mut plain, motion(depth, x, 0.0)),
            step(&model, &mut spun, motion(depth, x, 0.0)),
            effects.step(&model, &mut contact, Surroundings::default(), motion(depth, x, 0.0)),
            model.step_driven(&mut State::default(), drive).response,
            by_force,
        ];
        for (regime, margin) in responses.map(|r| (r.regime, r.slip_margin)).into_iter().chain([batch]) {
            lifted += u32::from(regime == Regime::NoContact);
            assert!(regime != Regime::NoContact || margin == 0.0, "{i}: {margin}");
        }
    }
    assert!(
        lifted > 5000 && Response::IN_THE_AIR.slip_margin == 0.0 && Response::<f32>::default() == Response::IN_THE_AIR
    );
}
