//! Finite-element responses become the reduced model that runs on a microcontroller.
//!
//! Main types: [`Experiment`] (a path of the design), [`Run`] (its stored response).
//! May use: experiment and what it may use; the package `fingerpad`, through which every fit is replayed.

mod design;
mod error;
mod runs;

pub use design::{DEPTH_MAX_MM, Experiment, Kind, design};
pub use error::ReduceError;
pub use runs::{Run, Sample, settings_hash};
