//! From a measured table to constants: calibration of the finger, then identification of the friction law.
//!
//! Main types: [`Settings`], [`Table`], [`Outcome`]; [`identify`] does it all. Below: [`Evaluator`] gives steady slides
//! of fingers, [`LawPoint`] and [`FingerPoint`] say what is searched for.
//! May use: experiment, slide, solve, assembly, contact, material, element, mesh.

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
pub mod friction_fit;
mod history;
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
pub use state_cache::StateCache;
pub use steady::{Effort, Limits, Place, Slider, Start, Steady};
pub use table::{Point, Table};
