//! Where simulation and measurement disagree, which effect is missing, and how much closer the model comes with it.
//!
//! The statistical unit is the run; effects are inserted into the model, never added to a force. Rooms, each of which uses
//! only those after it:
//!
//! | room | what for |
//! |---|---|
//! | `confirm` | the named effect inside the finite elements, on measured strokes |
//! | `reduced_input` | diagnoses from a trace of forces alone or a table |
//! | `verdict` | what may be claimed, its report, the next experiment, the corrected model |
//! | `selection` | which laws the runs ask for, and what competes with them |
//! | `statistics` | mixed model, fits, projections, tail probabilities, calibration |
//! | `model` | the smooth model along measured runs, priors, noise |
//! | `data` | measured runs: readers, checks, corrections of columns |
//! | `schema` | `report.json` as plain data |
//! | `laws` | the library of effects, and laws of a user's file |
//!
//! Main types: [`RunSet`] (measured runs), [`laws::Law`] (the library), [`Diagnosis`] (the report), [`Evidence`] (what
//! stands behind it). May use: `fingerpad-smooth` (the model of the inference), `fingerpad` (model files),
//! `fingerpad-formats` (errors of readers), `fingerpad-fe` (`confirm` alone).

pub mod confirm;
mod data;
mod diagnosis;
mod error;
pub mod laws;
mod model;
mod plan;
mod reduced_input;
mod repeated;
mod report;
mod schema;
mod selection;
mod statistics;
mod verdict;

pub use data::checks::check;
pub use data::column_map::ColumnMap;
pub use data::covariates::{CORNEOMETER_SD_AU, Correction, CovariateError};
pub use data::rotation::Rotation;
pub use data::runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
pub use data::runs_csv::{FilePart, SessionFile};
pub use data::suspicions::suspicions;
pub use data::yardsticks::check_units;
pub use data::{runs_csv, trace_csv};
pub use diagnosis::diagnose;
pub use error::DiagnoseError;
pub use laws::{LawsFile, OwnColumn, OwnFormula, TableSummary};
pub use model::active_law::ActiveLaw;
pub use model::core_replay::{replay, replay_all};
pub use plan::candidate_designs::PlanConstraints;
pub use reduced_input::{Plot, ReducedDiagnosis, diagnose_forces, reduced_report};
pub use repeated::dry_run::preflight_report;
pub use repeated::group::{FEWEST, FingerSets, diagnose_group};
pub use repeated::power::{PowerSettings, power};
pub use repeated::redecision::{Outcome, Redecision};
pub use repeated::stability::stability;
pub use repeated::survey::{Survey, SurveyError, survey};
pub use report::corrected_model::{CorrectedModel, corrected_model};
pub use report::driver_plot::DriverPlot;
pub use report::evidence::Evidence;
pub use report::exchanged::varied_in_calibration;
pub use report::next_step::next_step;
pub use report::regions::{BINS, CHANNELS};
pub use report::traces::ForceTrace;
pub use schema::{
    Baseline, BaselineParameter, CandidateLaw, Caution, Confidence, Confirmed, CrossValidationError, Diagnosis,
    Disagreement, EffectFound, FACTORS, Factor, FactorPrice, FeConfirmation, FingerAlone, FingerLawFound, FingerSize,
    FittedParameter, GroupDiagnosis, GroupVerdict, IMPLAUSIBLE, INDISTINGUISHABLE, InputFile, InstrumentLag, LawTest,
    LeftOut, NextExperiment, NoiseFound, NotSimulated, PlannedRun, Power, PowerCell, Rate, Region, Rescale,
    STRUCTURE_P, ScatterRatio, Seen, SharedLaw, SharedSize, Stability, UnexplainedFound, Verdict, Witness, minutes,
};
pub use selection::acceptance::SelectionSettings;
pub use statistics::calibration::{Calibration, calibrate};
pub use statistics::task::Task;
pub use verdict::options::Options;

/// A file of its own for a test, whose name ends as given; it goes with the value.
#[cfg(test)]
fn test_file(suffix: &str, bytes: &[u8]) -> tempfile::TempPath {
    let file = tempfile::Builder::new().suffix(suffix).tempfile().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    file.into_temp_path()
}
