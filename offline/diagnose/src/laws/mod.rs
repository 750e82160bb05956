//! The laws that a diagnosis tests: the core's library of effects in the diagnosis' precision, and the laws of a user's file.
//!
//! Formulas, parameters and sources of the library are in `fingerpad::effects`, one effect a file. Main types of the user's
//! laws: [`LawsFile`], [`OwnLaw`](own_law::OwnLaw), [`LawTable`](tabulation::LawTable).

pub mod drivers;
pub mod file;
pub mod formula;
pub mod own_law;
pub mod run_columns;
mod soundness;
pub mod tabulation;
pub mod units;

pub use drivers::OwnColumn;
pub use file::LawsFile;
pub use fingerpad::effects::{Column, LAWS, Law, OWN, Place, REFERENCE_AREA_MM2, Reported, find};
pub use own_law::OwnFormula;
pub use tabulation::TableSummary;

/// What a law may read in one row of a run.
pub type Row = fingerpad::effects::Conditions<f64>;
/// What the laws in force do to the model in one row.
pub type Change = fingerpad::effects::Change<f64>;
