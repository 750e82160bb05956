//! Which laws the runs ask for: a scan of the library, forward selection with refits, competing hypotheses, errors of the
//! baseline's form, and structure that no law explains.
//!
//! Main types: [`Selection`](forward::Selection), [`CompetingHypotheses`](competing::CompetingHypotheses),
//! [`ModelDiscrepancy`](discrepancy::ModelDiscrepancy), [`LackOfFit`](lack_of_fit::LackOfFit).
//! May use: statistics, model, data, laws.

pub mod acceptance;
pub mod alternative_drift;
mod bases;
pub mod competing;
pub mod discrepancy;
pub mod finger_laws;
pub mod forward;
pub mod lack_of_fit;
pub mod scan;
pub mod starts;
