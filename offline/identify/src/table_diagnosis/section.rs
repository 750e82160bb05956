//! Result of a diagnosis of a table, as plain data: section `table` of `report.json`.

use fingerpad_diagnose::Diagnosis;
use fingerpad_fe::contact::RubberFriction;
use serde::Serialize;

use super::search::Candidate;

/// Report of a diagnosis of a table: the fields of every diagnosis, and those of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableReport {
    /// Verdict, effects, next experiment, provenance.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
    /// The table.
    pub table: TableSection,
}

/// The finite elements beside the table, cell by cell, and every candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableSection {
    /// The finite elements.
    pub finite_elements: FiniteElementsUsed,
    /// The law before anything is added.
    pub published: RubberFriction,
    /// Factor on the finger's stiffness by the calibration on normal force and area.
    pub calibrated_stiffness: f64,
    /// Depth offset by the calibration, mm.
    pub calibrated_depth_offset_mm: f64,
    /// The law of the corrected model.
    pub corrected: RubberFriction,
    /// Factor on the finger's stiffness in the corrected model.
    pub corrected_stiffness: f64,
    /// Depth offset in the corrected model, mm.
    pub corrected_depth_offset_mm: f64,
    /// Root mean square gap of all numbers, step by step.
    pub steps: Vec<Step>,
    /// Every number of the table.
    pub cells: Vec<CellGap>,
    /// Every effect alone and every pair.
    pub candidates: Vec<Candidate>,
    /// Names of the candidates that the table cannot distinguish, the best one first.
    pub contenders: Vec<String>,
    /// Factor on the stated errors that was fitted with the corrected model.
    pub noise_factor: f64,
    /// Whether every cell has its own spread; otherwise 5 % are assumed.
    pub spread_given: bool,
    /// Constants and effects that the table does not determine, in sentences.
    pub cannot_tell: Vec<String>,
    /// The experiment that would decide, in sentences.
    pub decides: Vec<String>,
}

/// The finite elements of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FiniteElementsUsed {
    /// Shape of the finger.
    pub shape: String,
    /// Mesh preset.
    pub mesh_preset: String,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Steady slides that were computed, without those found before.
    pub computed: u32,
    /// Root mean square difference of the regression from them: normal force, area, friction, %.
    pub regression_percent: [f64; 3],
}

/// One step from the model as it was to the corrected one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// `as_given`, `calibrated`, `constants`, `four_constants` or `corrected`.
    pub name: &'static str,
    /// The free parameters, in words.
    pub words: String,
    /// Numbers that were fitted.
    pub freedoms: usize,
    /// Root mean square gap, %.
    pub rms_percent: f64,
}

/// One number of the table with the models' predictions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellGap {
    /// Row of the table, from 1.
    pub row: usize,
    /// Depth as measured, mm.
    pub depth_mm: f64,
    /// Depth that the corrected model takes, mm.
    pub corrected_depth_mm: f64,
    /// Column.
    pub quantity: &'static str,
    /// As measured.
    pub measured: f64,
    /// Standard deviation as a share of the value, as given or assumed.
    pub relative_sd: f64,
    /// Published constants, finger as given.
    pub as_given: f64,
    /// Its gap to the measurement, %.
    pub as_given_percent: f64,
    /// Published constants, finger calibrated.
    pub calibrated: f64,
    /// Its gap, %.
    pub calibrated_percent: f64,
    /// Reading that the corrected model gives.
    pub corrected: f64,
    /// Its gap, %.
    pub corrected_percent: f64,
    /// The measurement without the effects of the instruments.
    pub measured_corrected: f64,
}
