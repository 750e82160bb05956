//! A measured table against the finite elements: the gap cell by cell, every candidate explanation, the verdict.
//!
//! [`diagnose`] turns an [`Input`] into a [`Finding`]: the report, the corrected configuration and the corrected table.
//! The finite elements (steady slides, cached) are run on a small design over depth, law and bone clearance; candidates
//! are fitted on a regression through it and checked by finite elements at their ends. Effects of the instruments need no
//! finite elements of their own. May use: the rest of this crate, `fingerpad-fe`, `fingerpad-diagnose` (the report's form).

mod corrected;
mod decide;
mod finding_builder;
mod finite_elements;
mod fit;
mod measured;
mod outcome;
mod parameters;
#[cfg(test)]
mod planted_tables;
mod procedure;
mod reading;
mod search;
mod surface;
mod verdict;

pub use corrected::CorrectedFinger;
pub use fit::{Fitted, Model, Task};
pub use measured::{ASSUMED_DEPTH_SD_MM, ASSUMED_SD, Measured, MeasuredTable, QUANTITIES};
pub use outcome::{CandidateReport, CellGap, FiniteElementsUsed, LawConstants, Step, TableReport, TableSection};
pub use parameters::{Effect, Parameter, Prior, Values};
pub use procedure::{Finding, Input, diagnose};
pub use reading::{Elastic, ElasticPlace, Scaling, Surface, corrected, place_of, predict, read};
pub use search::{Candidate, Search};
pub use surface::FittedSurface;
pub use verdict::{APART, Answer};

use fingerpad_fe::experiment::ConfigError;

use crate::IdentifyError;

/// Why a table has no diagnosis.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The table does not suffice.
    #[error("{0}")]
    TooLittle(String),
    /// The finger is of a kind that cannot be varied.
    #[error("{0}")]
    Geometry(String),
    /// Too many of the finite elements' slides were not found.
    #[error("only {found} steady slides were found around the table's depths, too few for a regression")]
    TooFewSlides {
        /// Their number.
        found: usize,
    },
    /// The finite elements or a fit failed, or the caller requested the end.
    #[error(transparent)]
    Fe(#[from] IdentifyError),
    /// The configuration cannot be run.
    #[error(transparent)]
    Config(#[from] ConfigError),
}
