//! The core's library of effects in the diagnosis' precision.
//!
//! Formulas, parameters and sources are in `fingerpad::effects`, one effect a file.

pub use fingerpad::effects::{Column, LAWS, Law, Place, REFERENCE_AREA_MM2, Reported, find};

/// What a law may read in one row of a run.
pub type Row = fingerpad::effects::Conditions<f64>;
/// What the laws in force do to the model in one row.
pub type Change = fingerpad::effects::Change<f64>;
