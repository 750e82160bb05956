//! The shipped pad: its file's own scores, its history, and no motion that yields work.

use std::path::Path;

use fingerpad::host::PadModelFile;
use fingerpad::pad::Effort;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{PadMeta, PadModel, score_runs};
use fingerpad_reduce::{Kind, Run};
use fingerpad_tests::pads::{energy_slopes, held_load, least_dissipations_f32, least_dissipations_f64};
use fingerpad_tests::verify;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn shipped() -> PadModelFile {
    PadModelFile::new(&std::fs::read(Path::new(ROOT).join("data/models/fingertip-pad.fpm")).unwrap()).unwrap()
}

/// The errors that the file states are those along the stored held-out runs, and within those of the documentation.
#[test]
fn the_errors_that_the_file_states_are_found_again() {
    let file = shipped();
    let meta: PadMeta = serde_json::from_str(file.file().meta).unwrap();
    let model = PadModel::of(&file.file().pad);
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let outline = config.finger().unwrap().0.outline.unwrap();
    let mut runs = Vec::new();
    for entry in std::fs::read_dir(Path::new(ROOT).join("data/runs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "fprun") {
            let run = Run::from_bytes(&std::fs::read(&path).unwrap(), &path).unwrap();
            if run.held_out && run.samples.len() > 3 {
                runs.push(run);
            }
        }
    }
    for (kind, normal, friction) in [
        (Kind::Straight, 2.5e-2, 3e-2),
        (Kind::Random, 2e-2, 3e-2),
        (Kind::Pose, 5e-2, 6e-2),
        (Kind::PoseChange, 5e-2, 5e-2),
        (Kind::Combined, 5e-2, 5.5e-2),
        (Kind::Deep, 6e-2, 5e-2),
        (Kind::Body, 1.2e-1, 1.3e-1),
    ] {
        let own: Vec<&Run> = runs.iter().filter(|run| run.kind == kind).collect();
        let found = score_runs(&model, &own, &outline);
        let stated = &meta.held_out[kind.as_str()];
        verify(kind.as_str(), "normal force", found.normal, normal);
        verify(kind.as_str(), "friction", found.friction, friction);
        // In single precision in the file, in double precision when it was made.
        assert!((found.friction - stated.friction).abs() < 5e-4, "{kind:?}: {} {}", found.friction, stated.friction);
        assert!((found.normal - stated.normal).abs() < 5e-4, "{kind:?}: {} {}", found.normal, stated.normal);
    }
    for (kind, scores) in &meta.held_out {
        let [normal, friction] = scores.in_band;
        assert!(normal > 0.9 && friction > 0.92, "{kind}: rows within the bands {normal} {friction}");
    }
}

/// Only the first cycle of a vibration relaxes a constant load.
#[test]
fn a_held_load_is_the_same_after_a_thousand_cycles() {
    let file = shipped();
    for (name, size) in [
        ("depth", [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
        ("spin", [0.0, 0.0, 0.0, 0.05, 0.0, 0.0]),
        ("circles of the pose", [0.0, 0.0, 0.0, 0.0, 0.035, 0.035]),
        ("all", [5e-3, 5e-3, 1e-2, 0.01, 9e-3, 9e-3]),
    ] {
        let (after, limit) = held_load(file.file().pad, size, 1000).unwrap();
        let change = (after[1000][0] - after[5][0]).hypot(after[1000][1] - after[5][1]);
        verify(name, "change from cycle 5 to 1000 over the limit", change / limit, 1e-3);
    }
}

/// With friction so strong that nothing slips and all work is stored.
#[test]
fn forces_and_moments_are_the_slopes_of_the_energy() {
    let model = PadModel::of(&shipped().file().pad);
    for (name, off) in energy_slopes(model.pad()).unwrap() {
        verify(name, "slopes of the energy from the response", off, 1e-3);
    }
}

/// In single precision as it ships, and in double precision with a small error of equilibrium.
fn closed_paths_yield_no_work(paths: usize, steps: usize) {
    let file = shipped();
    let model = PadModel::of(&file.file().pad);
    let exact = model.pad().with_effort(Effort { evaluations: 500, tolerance: 1e-8 });
    for (name, least) in least_dissipations_f64(exact, paths, steps).unwrap() {
        verify(name, "gained over exchanged work, f64", -least, 1e-5);
    }
    for (name, least) in least_dissipations_f32(file.file().pad, paths, steps).unwrap() {
        verify(name, "gained over exchanged work, f32", -least, 3e-4);
    }
}

#[test]
fn a_search_for_closed_paths_finds_none_that_yields_work() {
    closed_paths_yield_no_work(500, 20);
}

#[test]
#[ignore = "weekly: hours"]
fn a_long_search_for_closed_paths_finds_none_that_yields_work() {
    closed_paths_yield_no_work(80_000, 60);
}
