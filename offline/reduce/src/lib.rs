//! Finite-element responses become the reduced model that runs on a microcontroller.
//!
//! Main types: [`Experiment`] (a path of the design), [`Run`] (its stored response), [`Fitted`], [`Scores`].
//! May use: experiment and what it may use; the package `fingerpad`, through which every fit is replayed.

mod band;
mod curve;
mod design;
mod error;
mod export;
mod fit;
mod follow;
mod layout;
mod model;
mod replay;
mod runs;
mod score;
mod start;
mod tables;

pub use band::{Band, Coverage};
pub use curve::{CurvePoint, curve};
pub use design::{DEPTH_MAX_MM, Experiment, Kind, design, halton};
pub use error::ReduceError;
pub use export::{Format, export};
pub use fit::{Fitted, Settings, fit};
pub use follow::{Row, follow, follow_with_effects, steps};
pub use model::{Meta, Ranges, Reduced, reduce};
pub use replay::{STEP_MM, replay, replay_steps};
pub use runs::{Run, Sample, settings_hash};
pub use score::{RunScore, Scores, score, score_run, strength};
