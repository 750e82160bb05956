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
#[cfg(feature = "frame")]
mod frame;
mod gradient;
mod grip;
mod math;
mod model_file;
#[cfg(feature = "std")]
mod owned;
pub mod pad;
mod params;
mod plane;
mod regime;
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

pub use batch::{BatchLength, Forces, Motions};
pub use data::{Data, DataOf, Model, ModelOf, NODES, SPRINGS, Spring};
pub use drive::{Drive, Driven, Normal, Tangential};
pub use effects::{Contact, Effects, Surroundings};
pub use error::{Error, Field};
#[cfg(feature = "frame")]
pub use frame::ContactFrame;
pub use gradient::Gradient;
pub use grip::Grip;
pub use math::{Elementary, Scalar};
pub use model_file::{File, FileOf, MAGIC, VERSION};
#[cfg(feature = "std")]
pub use owned::{ModelFile, PadModelFile};
pub use params::{Node, Params, ParamsOf, SpringParams};
pub use regime::{Regime, Status};
pub use response::{Motion, Response};
pub use save::{STATE_BYTES, state_bytes};
pub use sections::{EffectSlot, TableColumn, Tables};
pub use state::{SpinState, State, StateOf};
pub use step::step;
pub use table::{Line, Parabola, Row};
pub use tuning::Tuning;
