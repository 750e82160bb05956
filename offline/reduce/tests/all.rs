//! The fit, the design in shares and the runs of a pad, at their full size: with the optimised library.

use fingerpad::build::{Data, Params};
use fingerpad::host::PadModelFile;
use fingerpad::pad::{Body, PadState};
use fingerpad::{Motion, SPRINGS};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::load_path::{Drive, Turn};
use fingerpad_reduce::pad::runs_in_pose;
use fingerpad_reduce::{
    Batch, DesignSettings, FitProgress, Kind, Meta, Reduced, Run, Sample, Settings, Turned, batches, design,
    is_representable, reduce, share, simulate_path, strength,
};

/// Runs whose responses come from a known model instead of finite elements: of the whole design, or of one path in so many.
fn twin(every: usize) -> (Data, Vec<Run>) {
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let runs = design(&DesignSettings::default())
        .unwrap()
        .into_iter()
        .filter(|e| e.kind.is_for_springs() && is_representable(&e.path))
        .step_by(every)
        .map(|e| {
            let rows = simulate_path(&model, &e.path).unwrap();
            Run {
                name: e.name,
                kind: e.kind,
                held_out: e.held_out,
                settings_hash: "twin".into(),
                body: e.body,
                path: e.path,
                samples: rows.iter().map(|r| Sample::from(&r.response)).collect(),
                ended_early: None,
                cpu_s: 0.0,
            }
        })
        .collect();
    (data, runs)
}

/// The fit recovers a known model, the file reads back, and runs of other settings are refused.
#[test]
fn a_planted_model_is_found() {
    is_found(3);
}

#[test]
#[ignore = "nightly"]
fn a_planted_model_is_found_from_the_whole_design() {
    is_found(1);
}

fn is_found(every: usize) {
    let (planted, mut runs) = twin(every);
    // A finger with a steeper pitch than the shipped one; the first run does not contain its pose.
    for run in &mut runs[1..] {
        run.samples
            .iter_mut()
            .for_each(|s| s.turned = Some(Turned { pitch_deg: 45.0, ..s.turned.unwrap_or_default() }));
    }
    runs[0].samples.iter_mut().for_each(|s| s.turned = None);
    let settings = Settings { iterations: 7, ..Settings::default() };
    let reduced: Reduced = reduce(&runs, &[], &RubberFriction::default(), &settings, &FitProgress::default()).unwrap();
    let held_out = &reduced.meta.held_out;
    assert!(every * held_out.paths >= 60, "{held_out:?}");
    assert!(held_out.friction_of_limit < 0.01, "{held_out:?}");
    assert!(held_out.normal_of_range < 0.005, "{held_out:?}");
    assert!(held_out.regime_right > 0.97, "{held_out:?}");
    for depth_mm in [0.7, 1.4, 1.7] {
        let [found, there] = [&reduced.data, &planted].map(|data| strength(&data.model().unwrap(), depth_mm));
        assert!((found / there - 1.0).abs() < 0.02, "limit at {depth_mm} mm: {found} for {there}");
    }
    assert_eq!(reduced.data.pose_deg, [45.0, 0.0]);
    assert!(held_out.moment_of_limit < 0.03, "{held_out:?}");
    let bytes = reduced.file(&[]).unwrap();
    let file = fingerpad::host::ModelFile::new(&bytes).unwrap();
    assert_eq!(*file.file().model.data(), reduced.data);
    assert_eq!(serde_json::from_str::<Meta>(file.file().meta).unwrap().settings_hash, "twin");
    runs[3].settings_hash = "other".into();
    let message = reduce::<SPRINGS>(&runs, &[], &RubberFriction::default(), &settings, &FitProgress::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("has other"), "{message}");
    runs[3].settings_hash = "twin".into();
    let moment = Turn { drive: Drive::Force, values: vec![1.0; runs[3].path.waypoints.len()] };
    runs[3].path.turns.spin = Some(moment);
    let message = reduce::<SPRINGS>(&runs, &[], &RubberFriction::default(), &settings, &FitProgress::default())
        .unwrap_err()
        .to_string();
    assert!(message.starts_with(&runs[3].name) && message.contains("by a moment"), "{message}");
}

#[test]
fn paths_in_a_pose_stay_in_it_and_press_as_the_pad_does() {
    let file = PadModelFile::new(include_bytes!("../data/models/fingertip-pad.fpm")).unwrap();
    let pad = file.file().pad;
    let settings = DesignSettings::default();
    let runs = runs_in_pose(&pad, [55.0, 20.0], &settings, "hash").unwrap();
    assert!(runs.iter().any(|run| run.held_out) && runs.iter().any(|run| !run.held_out));
    for run in &runs {
        assert!(run.is_representable() && run.pose_deg() == Some([55.0, 20.0]), "{}", run.name);
    }
    let press = runs.iter().find(|run| run.kind == Kind::Press).unwrap();
    let deepest = press.samples.iter().max_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm)).unwrap();
    let mut state: PadState<64> = PadState::new(&pad).unwrap();
    let mut step = |depth_mm| {
        let motion = Motion { depth_mm, slide_increment_mm: [0.0; 2], spin_increment_rad: 0.0, dt_s: 1e-3 };
        pad.step(&mut state, &Body::Plane, motion, [55.0, 20.0]).normal_force_n
    };
    let steps = 200;
    let force = (1..=steps).map(|k| step(deepest.depth_mm * k as f32 / steps as f32)).last().unwrap();
    assert!((force / deepest.normal_force_n - 1.0).abs() < 0.01, "{force} {deepest:?}");
    let steep = runs_in_pose(&pad, [75.0, 0.0], &settings, "hash").unwrap_err();
    assert_eq!(steep.to_string(), "pitch of 75°: the pad's range is 10° to 70°");
}

#[test]
fn shares_part_the_design_and_cost_alike() {
    let all = design(&DesignSettings::default().beyond_springs()).unwrap();
    let batches = batches(&all);
    let whole: f64 = batches.iter().map(Batch::cost).sum();
    let names = |batches: &[Batch]| -> Vec<String> {
        batches.iter().flat_map(|b| &b.experiments).map(|e| e.name.clone()).collect()
    };
    let mut all_names = names(&batches);
    all_names.sort();
    assert_eq!(all_names.len(), all.len());
    for of in [1, 2, 3, 7, 40, 1000] {
        let shares: Vec<Vec<Batch>> = (1..=of).map(|k| share(&batches, k, of)).collect();
        let mut together: Vec<String> = shares.iter().flat_map(|s| names(s)).collect();
        together.sort();
        assert_eq!(together, all_names, "{of} shares");
        let largest = shares.iter().map(|s| s.iter().map(Batch::cost).sum::<f64>()).fold(0.0, f64::max);
        let batch = batches.iter().map(Batch::cost).fold(0.0, f64::max);
        // A share is at most one batch above the mean.
        assert!(largest <= whole / of as f64 + batch, "{of}: {largest} of {whole}");
        assert!(of > 7 || largest <= 1.02 * whole / of as f64, "{of}: {largest} of {whole}");
    }
}
