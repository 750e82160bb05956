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
