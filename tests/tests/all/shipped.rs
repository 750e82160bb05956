//! The shipped model against the stored runs it was fitted to and those that were held out.

use std::path::{Path, PathBuf};

use fingerpad::host::ModelFile;
use fingerpad_reduce::{Coverage, DesignSettings, Meta, Run, Scores, design, pressure_centre, replay, score};

fn data(below: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data").join(below)
}

/// The errors that the file states are those of its numbers along the stored runs, and the runs are the design's.
#[test]
fn the_models_errors_come_out_of_the_stored_runs_again() {
    let bytes = std::fs::read(data("models/fingertip.fpm")).unwrap();
    let file = ModelFile::new(&bytes).unwrap();
    let meta: Meta = serde_json::from_str(file.file().meta).unwrap();
    let mut runs = Vec::new();
    for experiment in design(&DesignSettings::default()).unwrap() {
        let path = data("runs").join(Run::file_name(&experiment, &meta.settings_hash));
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let run = Run::from_bytes(&bytes, &path).unwrap();
        assert_eq!((&run.name, run.held_out, &run.path), (&experiment.name, experiment.held_out, &experiment.path));
        if run.is_representable() {
            runs.push(run);
        }
    }
    let held_out: Vec<&Run> = runs.iter().filter(|run| run.held_out).collect();
    assert_eq!(meta.paths, [runs.len() - held_out.len(), held_out.len()]);
    let model = file.file().model;
    let scores = score(&model, &runs);
    let again = Scores::of(&scores, |s| s.held_out);
    println!("{again:?}");
    let stated = &meta.held_out;
    for (name, found, stated) in [
        ("normal force", again.normal_of_range, stated.normal_of_range),
        ("friction", again.friction_of_limit, stated.friction_of_limit),
        ("stick ratio, straight", again.stick_straight, stated.stick_straight),
        ("stick ratio, turned", again.stick_turned, stated.stick_turned),
        ("area", again.area_of_largest, stated.area_of_largest),
        ("regime", again.regime_right, stated.regime_right),
    ] {
        let mend = "cargo xtask model --scores";
        assert!((found - stated).abs() <= 1e-9, "{name}: the file states {stated}, the runs give {found}: {mend}");
    }
    // Friction shifts the pressure in its direction, along y as along x: by up to 2 mm.
    let (mut squares, mut largest, mut rows) = ([0.0; 2], [0.0; 2], 0.0);
    for run in &held_out {
        for (sample, r) in run.samples.iter().zip(replay(&model, run)) {
            let Some(centre) = pressure_centre(sample).filter(|_| sample.normal_force_n > 0.02) else { continue };
            rows += 1.0;
            for k in 0..2 {
                squares[k] += (f64::from(r.pressure_centre_mm[k]) - centre[k]).powi(2);
                largest[k] = f64::max(largest[k], centre[k].abs());
            }
        }
    }
    let rms = squares.map(|sum| (sum / rows).sqrt());
    println!("centre of pressure along x and y: error {rms:?} mm (RMS), largest {largest:?} mm");
    assert!(rms.iter().all(|e| *e < 0.12) && largest[1] > 1.0, "{rms:?} {largest:?}");
    // The band in the file is made from all held-out paths; its target is 95.5 %.
    let [all, ..] = Coverage::of(&model, &held_out);
    println!("band: {all:?}");
    assert!((0.93..=0.98).contains(&all.normal) && (0.93..=0.98).contains(&all.friction), "{all:?}");
}
