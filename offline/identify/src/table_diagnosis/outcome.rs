//! Result of a diagnosis of a table, as plain data: section `table` of `report.json`.

use serde::{Deserialize, Serialize};

use fingerpad_diagnose::{Diagnosis, FittedParameter};

/// Report of a diagnosis of a table: the fields of every diagnosis, and those of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableReport {
    /// Verdict, effects, next experiment, provenance.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
    /// The table.
    pub table: TableSection,
}

/// The finite elements beside the table, cell by cell, and every candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableSection {
    /// The finite elements.
    pub finite_elements: FiniteElementsUsed,
    /// Constants before anything is added.
    pub published: LawConstants,
    /// Factor on the finger's stiffness by the calibration on normal force and area.
    pub calibrated_stiffness: f64,
    /// Depth offset by the calibration, mm.
    pub calibrated_depth_offset_mm: f64,
    /// Constants of the corrected model.
    pub corrected: LawConstants,
    /// Factor on the finger's stiffness in the corrected model.
    pub corrected_stiffness: f64,
    /// Depth offset in the corrected model, mm.
    pub corrected_depth_offset_mm: f64,
    /// Root mean square gap of all numbers, step by step.
    pub steps: Vec<Step>,
    /// Every number of the table.
    pub cells: Vec<CellGap>,
    /// Every effect alone and every pair.
    pub candidates: Vec<CandidateReport>,
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

/// Constants of a friction law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawConstants {
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// Exponent.
    pub beta: f64,
    /// Strength at zero pressure, MPa.
    pub tau0_mpa: f64,
}

/// One step from the model as it was to the corrected one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// `as_given`, `calibrated`, `constants`, `four_constants` or `corrected`.
    pub name: String,
    /// The free parameters, in words.
    pub words: String,
    /// Numbers that were fitted.
    pub freedoms: usize,
    /// Root mean square gap, %.
    pub rms_percent: f64,
}

/// One number of the table with the models' predictions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellGap {
    /// Row of the table, from 1.
    pub row: usize,
    /// Depth as measured, mm.
    pub depth_mm: f64,
    /// Depth that the corrected model takes, mm.
    pub corrected_depth_mm: f64,
    /// Column.
    pub quantity: String,
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

/// A candidate beside the finger's constants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateReport {
    /// Name; of a pair both names joined by `+`, of the finger's constants alone `constants`.
    pub name: String,
    /// The effects.
    pub effects: Vec<String>,
    /// Values with their 95 % intervals.
    pub parameters: Vec<FittedParameter>,
    /// Numbers that were fitted, the finger's constants included.
    pub freedoms: usize,
    /// Root mean square gap after, all numbers of the table, %.
    pub rms_percent: f64,
    /// The same with free effects and the calibrated finger, %.
    pub alone_rms_percent: f64,
    /// Root mean square error at depths that were left out and predicted, %.
    pub left_out_rms_percent: Option<f64>,
    /// −2 log evidence above that of the best candidate.
    pub delta_2le: f64,
    /// Names of the other candidates that explain the table as well: evidence within odds of 20 to 1.
    pub explains_as_much: Vec<String>,
    /// Whether the numbers are those of finite elements at the fit's end; otherwise of the regression.
    pub by_finite_elements: bool,
}
