//! Where simulation and measurement disagree, which effect is missing, and how much closer the model comes with it.
//!
//! Main types: [`RunSet`] (measured runs), [`laws::Law`] (the library), [`Diagnosis`] (the verdict with its evidence).
//! The statistical unit is the run; effects are inserted into the model, never added to a force.
//! May use: `fingerpad` (model files), nalgebra, and slide (`confirm` alone). Reads no files.

mod bake;
pub mod base;
mod brief;
mod calibrate;
mod chance;
mod check;
mod corrected;
mod course;
mod covariates;
mod design;
mod diagnosis;
mod effects;
mod error;
pub mod evidence;
mod fit;
pub mod force_only;
mod form;
mod guess;
pub mod heldout;
pub mod laws;
mod metric;
mod mixed;
mod omnibus;
mod plans;
mod prior;
mod products;
mod regions;
mod replay;
mod rivals;
pub mod runs;
pub mod runs_csv;
mod scan;
pub mod schema;
mod select;
mod space;
mod tangents;
pub mod trace_csv;
pub mod verdict;
pub mod walk;
mod wider;

pub use base::{FREEDOM, Reference};
pub use brief::{Brief, Plot, TableRow, force_only as diagnose_forces, table as diagnose_table};
pub use calibrate::{Calibration, calibrate};
pub use check::check;
pub use corrected::{Corrected, corrected};
pub use covariates::{CORNEOMETER_SD_AU, Correction, CovariateError};
pub use design::NextExperiment;
pub use diagnosis::{Options, diagnose};
pub use error::DiagnoseError;
pub use evidence::{DriverPlot, Evidence};
pub use heldout::Gap;
pub use plans::PlannedRun;
pub use regions::{BINS, CHANNELS, COLUMNS, Region};
pub use replay::{replay, replay_all};
pub use runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
pub use schema::{
    Baseline, BaselineParameter, CandidateLaw, Diagnosis, Disagreement, EffectFound, FeConfirmation, FittedParameter,
    InputFile, LawTest, NoiseFound, Rescale, ScatterRatio, UnexplainedFound,
};
pub use select::Settings;
pub use verdict::Verdict;
