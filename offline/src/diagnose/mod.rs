//! Where simulation and measurement disagree, which effect is missing, and how much closer the model comes with it.
//!
//! Main types: [`RunSet`] (measured runs), [`laws::Law`] (the library), [`Diagnosis`] (the verdict with its evidence).
//! The statistical unit is the run; effects are inserted into the model, never added to a force.
//! May use: `fingerpad` (model files) and nalgebra. Reads no files.

mod base;
mod brief;
mod calibrate;
mod chance;
mod check;
mod corrected;
mod covariates;
mod design;
mod diagnosis;
mod error;
mod fit;
pub mod force_only;
mod heldout;
pub mod laws;
mod mixed;
mod omnibus;
mod regions;
mod rivals;
mod runs;
mod scan;
mod select;
mod space;
mod verdict;
mod walk;

pub use base::{FREEDOM, Reference};
pub use brief::{TableRow, force_only as diagnose_forces, table as diagnose_table};
pub use calibrate::{Calibration, calibrate};
pub use check::check;
pub use corrected::corrected;
pub use covariates::{CORNEOMETER_SD_AU, CovariateError};
pub use design::{NextExperiment, PlannedRun};
pub use diagnosis::{
    Baseline, BaselineParameter, CandidateLaw, Diagnosis, Disagreement, DriverPlot, EffectFound, Evidence,
    FeConfirmation, FittedParameter, InputFile, LawTest, NoiseFound, Options, Rescale, ScatterRatio, UnexplainedFound,
    diagnose,
};
pub use error::DiagnoseError;
pub use heldout::Gap;
pub use regions::{BINS, CHANNELS, COLUMNS, Region};
pub use runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
pub use select::Settings;
pub use verdict::Verdict;
