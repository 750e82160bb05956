#![no_std]
#![doc = include_str!("../README.md")]

#[cfg(any(feature = "std", test))]
extern crate std;

#[cfg(feature = "serde")]
mod array;
mod at_depth;
mod batch;
pub mod calibration;
mod check;
mod data;
mod drive;
pub mod effects;
mod error;
pub mod events;
mod example;
pub mod frames;
mod gradient;
mod grip;
pub mod haptics;
pub mod margin;
mod math;
mod memory;
mod model;
mod model_file;
#[cfg(feature = "std")]
mod owned;
pub mod pad;
mod params;
mod plane;
mod regime;
mod relaxation;
mod response;
mod save;
mod sections;
mod spring;
mod springs;
mod state;
mod step;
mod stick_ratio;
mod table;
mod tuning;

/// For programs that make or inspect models: parameters, the numbers in flash, the sections of a file.
pub mod build {
    pub use crate::data::{Data, DataOf, Spring};
    pub use crate::model_file::{MAGIC, VERSION};
    pub use crate::params::{Node, Params, ParamsOf, SpringParams};
    pub use crate::sections::{EffectSlot, Sections, TableColumn};
    pub use crate::table::{Line, Parabola, Row};
}
/// For programs on a host: batches of contacts, and model files that own their bytes.
pub mod host {
    pub use crate::batch::{BatchLength, Forces, Motions};
    #[cfg(feature = "std")]
    pub use crate::owned::{ModelFile, PadModelFile};
}

/// Its vectors are those of [`pad::Surface`].
pub use nalgebra;

pub use data::{Model, ModelOf, NODES, SPRINGS};
pub use drive::{Drive, Driven, Normal, Tangential};
pub use effects::{Contact, Effects, Surroundings};
pub use error::{Error, Field};
pub use gradient::Gradient;
pub use grip::Grip;
pub use math::{Elementary, Scalar};
pub use memory::{BedMemory, Memory};
pub use model::{Drivable, FingerModel};
pub use model_file::{File, FileOf};
pub use regime::{Regime, Status};
pub use relaxation::{BRANCHES, Branch, Relaxation};
pub use response::{ForceResponse, Motion, Response};
pub use save::{STATE_BYTES, relaxing_state_bytes, state_bytes};
pub use state::{ForceState, ForceStateOf, RelaxingState, RelaxingStateOf, SpinState, State, StateOf};
pub use step::step;
pub use tuning::Tuning;
