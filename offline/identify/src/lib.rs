//! From a measured table to constants: calibration of the finger, then identification of the friction law.
//!
//! Main types: [`Settings`], [`Table`], [`Outcome`]; [`identify`] does it all. Below: [`Bench`] gives steady slides
//! of fingers, [`LawPoint`] and [`FingerPoint`] say what is searched for.
//! May use: experiment, slide, solve, assembly, contact, material, element, mesh.

mod against;
mod bench;
pub mod bounded_least_squares;
mod calibrate;
pub mod certainty;
mod error;
pub mod finger_fit;
pub mod friction_fit;
mod history;
mod knobs;
mod law;
mod memo;
pub mod on_rig;
pub mod outcome;
pub mod population;
mod predict;
mod procedure;
mod published;
mod search;
mod sensitivity;
mod settings;
pub mod simplex;
mod steady;
pub mod surrogate;
mod table;
pub mod table_csv;
mod tau0;
pub mod uncertainty;

pub use bench::{Bench, Hooks, Query, Rig};
pub use error::IdentifyError;
pub use friction_fit::Mapping;
pub use knobs::{FingerPoint, KnobKind};
pub use law::{LawPoint, REFERENCE_MPA, Region};
pub use memo::Memo;
pub use outcome::Outcome;
pub use procedure::{Input, identify, settings_hash};
pub use settings::{Calibration, Compared, Fast, Joint, Knob, Prediction, Settings, Simplex};
pub use simplex::SimplexRun;
pub use steady::{Effort, Limits, Place, Slider, Start, Steady};
pub use table::{Point, Table};
