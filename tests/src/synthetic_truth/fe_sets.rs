//! The stored sets of the finite-element finger (`tests/data/fe_sets`), and their confirmation by the finite elements.
//!
//! Main types: [`FeSet`] (a set with its truth), functions [`sets`] and [`confirm`].

use std::io::Read as _;
use std::ops::ControlFlow;
use std::path::PathBuf;

use fingerpad_diagnose::confirm::{FeStroke, Prepared, Ran};
use fingerpad_diagnose::runs_csv;
use fingerpad_diagnose::{Evidence, FeConfirmation, RunSet};
use fingerpad_fe::experiment::{Config, Shape};
use fingerpad_fe::load_path::LoadPathError;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_formats::in_threads;

/// A stored set.
pub struct FeSet {
    /// Its file.
    pub file: String,
    /// Shape of the finger that made it.
    pub shape: String,
    /// The hidden law; empty for none.
    pub law: String,
    /// Its amplitude.
    pub amplitude: f64,
    calibration: String,
}

/// The sets with their truth.
pub fn sets() -> Vec<FeSet> {
    let truth: serde_json::Value =
        serde_json::from_str(include_str!("../../data/fe_sets/truth.json")).expect("it is stored");
    let list = truth["sets"].as_array().expect("a list of sets");
    let text = |set: &serde_json::Value, key: &str| set[key].as_str().expect("a text").to_owned();
    list.iter()
        .map(|set| FeSet {
            file: text(set, "file"),
            shape: text(set, "shape"),
            law: text(set, "law"),
            amplitude: set["amplitude"].as_f64().expect("a number"),
            calibration: text(set, "calibration"),
        })
        .collect()
}

impl FeSet {
    /// The measured runs.
    pub fn measured(&self) -> RunSet {
        read(&self.file)
    }

    /// The calibration runs of its finger.
    pub fn calibration(&self) -> RunSet {
        read(&self.calibration)
    }
}

fn read(name: &str) -> RunSet {
    let packed = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data/fe_sets").join(name);
    let mut text = String::new();
    let file = std::fs::File::open(packed).expect("it is stored");
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("it was packed");
    let dir = tempfile::tempdir().expect("a place for a file");
    let path = dir.path().join(name.trim_end_matches(".gz"));
    std::fs::write(&path, text).expect("a place for a file");
    runs_csv::read(&path, &mut |_| true).expect("measured runs")
}

/// The finite-element finger of a shape on the coarse mesh.
pub fn config(shape: &str) -> Config {
    Config { shape: Shape(shape.into()), mesh_preset: MeshPreset::Coarse, ..Config::default() }
}

/// The finite elements of a shape on some strokes of a diagnosis, as `--confirm-fe` runs them.
pub fn confirm(evidence: &Evidence, shape: &str, strokes: usize, threads: usize) -> FeConfirmation {
    let config = config(shape);
    let (finger, _) = config.finger().expect("a shape of the program");
    let problem = config.problem(&finger);
    let reference = super::score::reference();
    let prepared = Prepared::new(&reference, evidence, config.friction, strokes);
    let mut run = |_: &str, list: &[FeStroke<'_>]| -> Result<Ran, LoadPathError> {
        in_threads(list, threads, |stroke| {
            Ok(stroke.follow(&problem, &mut |_| ControlFlow::Continue(())).expect("a sound path"))
        })
    };
    prepared.confirm("coarse", shape, &mut run).expect("no stroke fails").report
}
