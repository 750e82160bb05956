//! Every model that ships: it loads, presses, slides and carries what its friction allows.

use std::fs;
use std::path::Path;

use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad::{PadState, Plane};
use fingerpad::{Motion, Regime, State, Status, step};

/// Friction over normal force of the robots' tips, which have Coulomb's law.
const TIPS_MU: f32 = 0.8;

#[test]
fn every_shipped_model_presses_and_slides() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/models");
    let mut seen = [0, 0];
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "fpm") {
            continue;
        }
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let bytes = fs::read(&path).unwrap();
        let motions = |depth_mm: f32| {
            (0..2000).map(move |k| {
                let slide = if k > 100 { 0.01 } else { 0.0 };
                Motion { depth_mm, slide_increment_mm: [slide, 0.0], dt_s: 1e-3, ..Motion::default() }
            })
        };
        let last = if name.ends_with("-pad") {
            seen[0] += 1;
            let file = PadModelFile::new(&bytes).unwrap();
            let pad = &file.file().pad;
            let (mut state, pose) = (PadState::<64>::new(pad).unwrap(), [pad.numbers.neutral_pitch_deg, 0.0]);
            motions(0.4 * pad.numbers.depth_max_mm)
                .map(|motion| pad.step(&mut state, &Plane, motion, pose))
                .last()
                .unwrap()
        } else {
            seen[1] += 1;
            let file = ModelFile::new(&bytes).unwrap();
            let model = file.file().model;
            let mut state = State::default();
            motions(0.4 * model.data().depth_max).map(|motion| step(&model, &mut state, motion)).last().unwrap()
        };
        assert!(last.status == Status::OK && last.regime == Regime::Slip, "{name}: {last:?}");
        assert!(last.normal_force_n > 0.01, "{name}: {last:?}");
        if !(name.starts_with("fingertip") || name.starts_with("human")) {
            let ratio = last.friction_n[0] / last.normal_force_n;
            assert!((ratio / TIPS_MU - 1.0).abs() < 0.01, "{name}: {ratio}");
        }
    }
    assert_eq!(seen, [5, 5]);
}
