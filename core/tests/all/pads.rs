//! The pad with whatever bits come in: bounded, flagged, and the same on host and target.

use fingerpad::pad::{EXAMPLE_PATCHES, Edge, ExamplePad, PadState, Plane, Surface};
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

proptest! {
    #[test]
    fn any_bits_are_answered(words in prop::collection::vec(any::<[u32; 8]>(), 1..12)) {
        answers(&Plane, &words)?;
        answers(&Edge::new(3.0, 53.0, 106.0).unwrap(), &words)?;
    }
}
