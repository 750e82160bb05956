//! Tissue that relaxes: steps of no time, model files, saved states, branches that are none.

use crate::common::{shipped, shipped_pad};
use crate::relaxation::{P, POSE_DEG, disturbed, press, slow_bed, sum};
use fingerpad::build::{Data, EffectSlot, Sections};
use fingerpad::effects::Effects;
use fingerpad::pad::{Edge, PadFile, PadState, Plane, RelaxingPadState, relaxing_pad_state_bytes};
use fingerpad::{
    BRANCHES, Branch, Contact, Error, Field, File, Model, Relaxation, RelaxingState, Response, SPRINGS, State, StateOf,
    Status, Tuning, relaxing_state_bytes,
};

/// A press to 1 mm, then time steps that are none, then one of 50 ms.
///
/// * `most`: relative tolerance of an equilibrium
fn check_time_steps<S: Clone>(name: &str, state: &mut S, most: f32, step: impl Fn(&mut S, f32, f32) -> Response) {
    for k in 1..=20 {
        step(state, 0.05 * k as f32, 1e-3);
    }
    let held = step(state, 1.0, 1e-3);
    let mut moved = state.clone();
    for dt_s in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let r = step(state, 1.0, dt_s);
        assert!(r.status.contains(Status::BAD_TIME_STEP), "{name} {dt_s}");
        assert!((r.normal_force_n / held.normal_force_n - 1.0).abs() < most, "{name} {dt_s}: {r:?} {held:?}");
    }
    let [a, b] = [state, &mut moved].map(|s| step(s, 1.0, 0.05).normal_force_n);
    assert!((a / b - 1.0).abs() < most && a < 0.9 * held.normal_force_n, "{name}: {a} {b}");
}

#[test]
fn time_steps_that_are_none_are_flagged_and_freeze_the_memory() {
    let (file, data) = (shipped_pad(), shipped());
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
    check_time_steps("pad", &mut state, 1e-4, |state, depth, dt_s| {
        pad.step(state, &Plane, press(depth, dt_s), POSE_DEG)
    });
    assert!(pad.step(&mut state, &Plane, press(1.0, 1e30), POSE_DEG).status.contains(Status::BAD_TIME_STEP));
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    let mut state = RelaxingState::<1>::relaxing();
    check_time_steps("bed", &mut state, 1e-6, |state, depth, dt_s| model.step(state, press(depth, dt_s)));
    // A step without time is elastic: as stiff as the branches together, from the frozen memory on.
    let held = model.step(&mut state.clone(), press(1.0, 0.0)).normal_force_n;
    let pressed = model.step(&mut state.clone(), press(1.01, 0.0)).normal_force_n;
    let plain = slow_bed(&model)(1.01, 1.0).normal_force_n - slow_bed(&model)(1.0, 1.0).normal_force_n;
    let stiff = sum(|_| 1.0) as f32 + 1.0;
    assert!(((pressed - held) / plain / stiff - 1.0).abs() < 1e-3, "{} {plain}", pressed - held);
    // A step of any length is one, as without branches: then nothing is remembered.
    let long = model.step(&mut state, press(1.01, 1e30));
    let relaxed = model.step(&mut State::default(), press(1.01, 1.0)).normal_force_n;
    assert!(long.status == Status::OK && (long.normal_force_n / relaxed - 1.0).abs() < 2e-3, "{long:?} {relaxed}");
}

#[test]
fn a_file_and_a_saved_state_keep_branches_and_memory() {
    let file = shipped_pad();
    let plain = file.file().pad;
    let pad = plain.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut words = vec![0u64; 4096];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
    let length = pad.write_file("{}", bytes).unwrap();
    assert_eq!(length, pad.file_length("{}"));
    let read = PadFile::from_bytes(&bytes[..length]).unwrap().pad;
    assert_eq!((read.relaxation(), read.patches, read.numbers), (pad.relaxation(), pad.patches, pad.numbers));
    assert_ne!(pad.checksum(), plain.checksum());
    // A file of tissue that does not relax is that of before.
    let before = plain.write_file(file.file().meta, bytes).unwrap();
    assert_eq!(&bytes[..before], include_bytes!("../data/fingertip-pad.fpm"));

    let body = Edge::new(4.0, 20.0, 110.0).unwrap();
    let mut state = RelaxingPadState::<P>::relaxing_over(&pad, POSE_DEG).unwrap();
    for (motion, pose_deg) in disturbed(150, 5) {
        pad.step(&mut state, &body, motion, pose_deg);
    }
    let mut saved = vec![0; relaxing_pad_state_bytes(P)];
    assert_eq!(state.write_bytes(pad.checksum(), &mut saved), Ok(saved.len()));
    let mut again = RelaxingPadState::<P>::read_bytes(pad.checksum(), &saved).unwrap();
    assert_eq!(again, state);
    for (motion, pose_deg) in disturbed(20, 9) {
        let [a, b] = [&mut state, &mut again].map(|s| pad.step(s, &body, motion, pose_deg));
        assert_eq!(a, b);
    }
    assert!(PadState::<P>::read_bytes(pad.checksum(), &saved).is_err(), "a state without memory has another length");
}

#[test]
fn bad_branches_are_refused_by_name_and_value() {
    let refused = |share: f32, time_s: f32| match Relaxation::new(&[
        Branch { share: 0.5, time_s: 1.0 },
        Branch { share, time_s },
    ]) {
        Err(Error::Range { what, index: 1, value }) => (what, value.to_bits()),
        other => panic!("{other:?}"),
    };
    for share in [-0.1, f32::NAN, f32::INFINITY, 1e6] {
        assert_eq!(refused(share, 1.0), (Field::RelaxationShare, share.to_bits()));
    }
    for time_s in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(0.5, time_s), (Field::RelaxationTime, time_s.to_bits()));
    }
    assert_eq!(Relaxation::new(&[Branch::default(); 4]), Err(Error::Shape { elements: 4, nodes: 3 }));
}

#[test]
fn a_file_and_a_saved_state_of_a_bed_keep_branches_and_memory() {
    let data = shipped();
    let relaxation = Relaxation::HUMAN_ASSUMED;
    let sections = Sections { relaxation: Some(&relaxation), ..Sections::default() };
    let mut words = vec![0u64; 2048];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
    let length = data.write_file_with(&[], sections, "{}", bytes).unwrap();
    assert_eq!(length, Data::file_length_with(&[], sections, "{}"));
    let file = File::relaxing(&bytes[..length]).unwrap();
    assert_eq!((file.model.relaxation(), *file.model.data()), (Some(&relaxation), data));
    // A reader that does not follow the tissue refuses the file by the name of the section.
    let refused = Some(Error::Section { id: *b"RELX" });
    assert_eq!(
        (File::from_bytes(&bytes[..length]).err(), Model::from_bytes(&bytes[..length]).err()),
        (refused, refused)
    );
    assert_eq!(fingerpad::host::ModelFile::new(&bytes[..length]).err(), refused);

    let mut state = RelaxingState::<2>::relaxing();
    for (motion, _) in disturbed(150, 5) {
        file.model.step(&mut state, motion);
    }
    let model = data.checksum();
    let mut saved = vec![0; relaxing_state_bytes(SPRINGS, 2)];
    assert_eq!(state.write_bytes(model, &mut saved), Ok(saved.len()));
    let mut again = RelaxingState::<2>::read_bytes(model, &saved).unwrap();
    assert_eq!(again, state);
    for (motion, _) in disturbed(20, 9) {
        let [a, b] = [&mut state, &mut again].map(|s| file.model.step(s, motion));
        assert_eq!(a, b);
    }
    assert!(StateOf::<SPRINGS, 2>::read_bytes(model, &saved).is_err(), "a state without memory has another length");
    for at in 0..saved.len() {
        saved[at] ^= 0x10;
        assert!(RelaxingState::<2>::read_bytes(model, &saved).is_err(), "{at}");
        saved[at] ^= 0x10;
    }
    assert_eq!(size_of::<RelaxingState>(), 240);

    let slot = |kind| [EffectSlot { kind, reserved: 0, values: [0.2, 1.4, 0.0, 0.0, 0.0, 0.0] }];
    for (kind, refused) in [(6, Some(Error::RelaxesTwice)), (2, None)] {
        let length = data.write_file_with(&slot(kind), sections, "{}", bytes).unwrap();
        assert_eq!(File::relaxing(&bytes[..length]).err(), refused);
    }
    assert!(Error::RelaxesTwice.to_string().contains("normal_relaxation"));
    for (branch, what) in [
        (Branch { share: -1.0, time_s: 1.0 }, Field::RelaxationShare),
        (Branch { share: 1.0, time_s: 0.0 }, Field::RelaxationTime),
        // Limits rise with the pressure of a fast press, up to where the force of a spring would fall.
        (Branch { share: 20.0, time_s: 1.0 }, Field::OddStiffness),
    ] {
        let mut branches = [Branch { share: 0.0, time_s: 1.0 }; BRANCHES];
        branches[1] = branch;
        let relaxation: Relaxation = bytemuck::cast(branches);
        let sections = Sections { relaxation: Some(&relaxation), ..sections };
        let length = data.write_file_with(&[], sections, "{}", bytes).unwrap();
        let Err(Error::Range { what: found, .. }) = File::relaxing(&bytes[..length]) else { panic!("{branch:?}") };
        assert_eq!(found, what);
    }
    for exponent in [-0.1, 1.1] {
        let data = Data { pressure_exponent: exponent, ..data };
        let refused = Error::Range { what: Field::PressureExponent, index: 0, value: exponent };
        assert_eq!(data.model().unwrap().with_relaxation(&relaxation).err(), Some(refused));
    }
}

/// The law that a diagnosis finds is a branch whose clock starts at the touch: pressed in no time and held, both are one.
#[test]
fn the_effect_of_relaxation_is_a_branch_for_a_press_in_no_time() {
    let data = shipped();
    let model = data.model().unwrap();
    let (fraction, tau_s) = (0.2f32, 1.4);
    let slot = EffectSlot { kind: 6, reserved: 0, values: [fraction, tau_s, 0.0, 0.0, 0.0, 0.0] };
    let slots = [slot];
    let effects = Effects::new(&slots).unwrap();
    let relaxation = Relaxation::new(&[Branch { share: fraction / (1.0 - fraction), time_s: tau_s }]).unwrap();
    let soft = model.tuned(Tuning { stiffness: 1.0 - fraction, ..Default::default() }).unwrap();
    let soft = soft.with_relaxation(&relaxation).unwrap();
    for depth_mm in [0.4f32, 1.5] {
        let (mut contact, mut state) = (Contact::<SPRINGS>::default(), RelaxingState::<1>::relaxing());
        for dt_s in [1e-6f32, 0.01, 0.3, 1.0, 20.0] {
            let motion = press(depth_mm, dt_s);
            let law = effects.step(&model, &mut contact, Default::default(), motion);
            let branch = soft.step(&mut state, motion);
            for (a, b) in [(law.normal_force_n, branch.normal_force_n), (law.friction_limit_n, branch.friction_limit_n)]
            {
                assert!((a / b - 1.0).abs() < 1e-4, "{depth_mm} mm, {dt_s} s: {a} {b}");
            }
        }
    }
}
