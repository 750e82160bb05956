//! The pad with whatever bits come in: bounded, flagged, and the same on host and target.

use fingerpad::pad::{EXAMPLE_PATCHES, Edge, ExamplePad, Pad, PadState, Plane, Surface};
use fingerpad::{Motion, Status};
use proptest::prelude::*;

use crate::common::golden_pad::{DIGEST, STEPS, digest};

#[test]
fn the_digest_is_that_of_the_target() {
    let found = digest(&ExamplePad::new().pad(), STEPS);
    assert_eq!(found, DIGEST, "{found:#010x}: host and target must agree on the constant");
}

fn answers(body: &impl Surface<f32>, words: &[[u32; 8]]) -> Result<(), TestCaseError> {
    let example = ExamplePad::new();
    let pad = example.pad();
    let mut state = PadState::<EXAMPLE_PATCHES>::new(&pad).unwrap();
    let float = f32::from_bits;
    for w in words {
        // Every other step is an ordinary one, so that what comes in meets a contact.
        let ordinary = Motion { depth_mm: 0.7, slide_increment_mm: [0.01, 0.0], spin_increment_rad: 0.0, dt_s: 1e-3 };
        pad.step(&mut state, body, ordinary, [30.0, 0.0]);
        let motion = Motion {
            depth_mm: float(w[0]),
            slide_increment_mm: [float(w[1]), float(w[2])],
            spin_increment_rad: float(w[3]),
            dt_s: float(w[4]),
        };
        state.set_strength_factor(float(w[7]));
        let r = pad.step(&mut state, body, motion, [float(w[5]), float(w[6])]);
        let numbers = [
            r.normal_force_n,
            r.friction_n[0],
            r.friction_n[1],
            r.friction_limit_n,
            r.spin_moment_n_mm,
            r.pressure_centre_mm[0],
            r.pressure_centre_mm[1],
            r.contact_area_mm2,
        ];
        prop_assert!(numbers.iter().all(|x| x.is_finite()), "{motion:?}: {r:?}");
        prop_assert!((0.0..=1.0 + 1e-6).contains(&r.stick_ratio) && (0.0..=1.0).contains(&r.slip_margin), "{r:?}");
        let nonsense = [motion.depth_mm, motion.slide_increment_mm[0], motion.slide_increment_mm[1]];
        if nonsense.iter().any(|x| !x.is_finite()) && r.regime != fingerpad::Regime::NoContact {
            prop_assert!(r.status.contains(Status::BAD_INPUT), "{motion:?}: {}", r.status);
        }
    }
    // It goes on as if nothing had been.
    let calm = Motion { depth_mm: 0.8, dt_s: 1e-3, ..Motion::default() };
    for _ in 0..50 {
        pad.step(&mut state, body, calm, [30.0, 0.0]);
    }
    let r = pad.step(&mut state, body, calm, [30.0, 0.0]);
    // What is nonsense may have moved a body away; a plane is there for ever.
    let [least, most] = if body.is_plane() { [0.05, 50.0] } else { [-1.0, 200.0] };
    prop_assert!(r.normal_force_n > least && (r.normal_force_n < most || r.status != Status::OK), "{r:?}");
    // Far from its apex a body may be as steep as it likes.
    prop_assert!(!body.is_plane() || r.status == Status::OK, "{r:?}");
    Ok(())
}

#[test]
fn a_state_of_a_pad_with_another_number_of_patches_is_refused_and_starts_again() {
    let example = ExamplePad::new();
    let (pad, half) = (example.pad(), Pad::new(&example.patches[..12], &example.numbers));
    let motion = Motion { depth_mm: 0.7, dt_s: 1e-3, ..Motion::default() };
    let mut state = PadState::<EXAMPLE_PATCHES>::new(&half).unwrap();
    assert_eq!(half.step(&mut state, &Plane, motion, [30.0, 0.0]).status, Status::OK);
    assert_eq!(pad.step(&mut state, &Plane, motion, [30.0, 0.0]).status, Status::MEMORY_LOST);
    let mut fresh = PadState::<EXAMPLE_PATCHES>::new(&pad).unwrap();
    let [again, first] = [&mut state, &mut fresh].map(|state| pad.step(state, &Plane, motion, [30.0, 0.0]));
    assert_eq!(again, first);
    let mut small = PadState::<12>::new(&half).unwrap();
    for _ in 0..3 {
        assert_eq!(pad.step(&mut small, &Plane, motion, [30.0, 0.0]).status, Status::MEMORY_LOST);
    }
    assert_eq!(pad.full_slip(&small, &Plane, [1.0, 0.0, 0.0]), [0.0; 3]);
}

#[test]
fn only_the_direction_of_full_slip_counts() {
    let example = ExamplePad::new();
    let pad = example.pad();
    let mut state = PadState::<EXAMPLE_PATCHES>::new(&pad).unwrap();
    pad.step(&mut state, &Plane, Motion { depth_mm: 0.7, dt_s: 1e-3, ..Motion::default() }, [30.0, 0.0]);
    let limit = |size: f32| pad.full_slip(&state, &Plane, [0.6 * size, -0.8 * size, 0.1 * size]);
    let usual = limit(1.0);
    assert!(usual[0] > 0.01, "{usual:?}");
    for size in [1e-30, 1e-3, 1e20, 3e38] {
        let other = limit(size);
        assert!(usual.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-5), "{size}: {other:?} {usual:?}");
    }
    assert_eq!(limit(f32::NAN), [0.0; 3]);
}

/// Numbers that a file may have within their ranges.
#[test]
fn bands_are_never_negative() {
    let mut example = ExamplePad::new();
    example.numbers.band_normal = [[-1.0, 0.5, -3.0]; 2];
    example.numbers.band_friction = [[-10.0; 3]; 2];
    example.numbers.band_light_n = [[-5.0; 2]; 2];
    let mut state = PadState::<EXAMPLE_PATCHES>::new(&example.pad()).unwrap();
    let motion = Motion { depth_mm: 0.7, slide_increment_mm: [0.1, 0.0], dt_s: 1e-3, ..Motion::default() };
    let r = example.pad().step(&mut state, &Plane, motion, [40.0, 5.0]);
    assert!(r.normal_force_n > 0.1 && r.band_normal_n == 0.0 && r.band_friction_n == 0.0, "{r:?}");
}

proptest! {
    #[test]
    fn any_bits_are_answered(words in prop::collection::vec(any::<[u32; 8]>(), 1..12)) {
        answers(&Plane, &words)?;
        answers(&Edge::new(3.0, 53.0, 106.0).unwrap(), &words)?;
    }
}
