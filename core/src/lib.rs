#![no_std]
#![doc = include_str!("../README.md")]

#[cfg(any(feature = "std", test))]
extern crate std;

#[cfg(feature = "serde")]
mod array;
mod blob;
mod check;
mod data;
mod drive;
mod effect;
mod error;
pub mod events;
mod example;
mod frame;
mod gradient;
mod grip;
mod math;
#[cfg(feature = "std")]
mod owned;
mod params;
mod regime;
mod response;
mod save;
mod state;
mod step;
mod stick;
mod table;
mod tune;
mod yielding;

pub use blob::{EffectSlot, File, FileOf, MAGIC, VERSION};
pub use check::SLIP_LENGTH_RATIO_MAX;
pub use data::{Data, DataOf, ELEMENTS, Element, Model, ModelOf, NODES, Tuned};
pub use drive::{Drive, Driven, Normal, Tangential};
pub use effect::{Contact, Effects, Surroundings};
pub use error::{Error, Field};
pub use frame::ContactFrame;
pub use gradient::Gradient;
pub use grip::Grip;
#[cfg(feature = "std")]
pub use owned::ModelFile;
pub use params::{Node, Params, ParamsOf, Slider};
pub use regime::{Regime, Status};
pub use response::{Motion, Response};
pub use save::STATE_BYTES;
pub use state::{State, StateOf};
pub use step::step;
pub use table::{Line, Row};
pub use tune::{Fitted, Scaled, Scaling, Tuning};
