//! A measured table against the finite elements: the gap cell by cell, every candidate explanation, the verdict.
//!
//! [`diagnose`] turns an [`Input`] into a [`Finding`]: the report, the corrected configuration and the corrected table.
//! The finite elements (steady slides, cached) are run on a small design over depth, law and bone clearance; candidates
//! are fitted on a regression through it and checked by finite elements at their ends. Effects of the instruments need no
//! finite elements of their own. May use: the rest of this crate, `fingerpad-fe`, `fingerpad-diagnose` (verdict and report).

mod corrected;
mod effects;
mod finite_elements;
mod fit;
mod measured;
mod plan;
#[cfg(test)]
mod planted_tables;
mod procedure;
mod reading;
mod report;
mod search;
mod section;
mod surface;

pub use corrected::CorrectedFinger;
pub use effects::{Effect, Parameter, Values};
pub use fit::Fitted;
pub use measured::{MeasuredTable, QUANTITIES};
pub use procedure::{Finding, Input, diagnose};
pub use reading::{Elastic, ElasticPlace, place_of, read};
pub use search::Candidate;
pub use section::{CellGap, FiniteElementsUsed, Step, TableReport, TableSection};

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
