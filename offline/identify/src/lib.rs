//! Identification of a friction law: from a measured table (depth, normal force, friction coefficient, contact area)
//! to the constants lambda and beta of rubber friction, with their uncertainty and predictions.
//!
//! [`identify`] does it all from an [`Input`]: it calibrates the finger's stiffness and depth offset on normal force and
//! area, searches the law's constants by space mapping and Gauss–Newton and by the downhill simplex of Yoshida et al.
//! 2011, and returns an [`Outcome`]. Its tools: [`Evaluator`] and [`FeModel`] compute steady slides by finite elements
//! and keep them in a [`StateCache`]; [`FingerPoint`] and [`LawPoint`] are points of the two parameter spaces;
//! [`population`] compares subjects. [`table_diagnosis`] looks for the effect that closes the gap between a table and the
//! finite elements.
//! May use: the crates fe, formats and least-squares; `table_diagnosis` also diagnose.

pub mod bounded_least_squares;
mod calibrate;
mod calibration_parameter;
mod comparison;
pub mod confidence;
mod direct_search;
mod error;
mod evaluator;
pub mod fe_friction;
pub mod finger_fit;
mod force_zero;
pub mod friction_fit;
mod history;
pub mod hold;
mod law;
pub mod law_uncertainty;
pub mod outcome;
pub mod population;
mod predict;
mod procedure;
mod published;
mod sensitivity;
mod settings;
pub mod simplex;
mod state_cache;
mod steady;
pub mod surrogate;
mod table;
pub mod table_csv;
pub mod table_diagnosis;
mod tau0;

pub use calibration_parameter::{CalibrationParameter, FingerPoint};
pub use error::IdentifyError;
pub use evaluator::{Evaluator, FeModel, Hooks, Query};
pub use friction_fit::Mapping;
pub use law::{LawPoint, REFERENCE_MPA, Region};
pub use outcome::Outcome;
pub use procedure::{Input, identify, settings_hash};
pub use settings::{Calibration, Compared, Fast, Joint, Prediction, Settings, Simplex, VariedParameter};
pub use simplex::SimplexRun;
pub use state_cache::{Key, StateCache, key_of};
pub use steady::{Effort, Limits, Place, Slider, Start, Steady};
pub use table::{Point, Table};
