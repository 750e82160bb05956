#![no_std]
#![doc = include_str!("../README.md")]

#[cfg(any(feature = "std", test))]
extern crate std;

#[cfg(feature = "serde")]
mod array;
mod blob;
mod check;
mod drive;
mod effect;
mod error;
pub mod events;
mod example;
mod frame;
mod gradient;
mod grip;
mod math;
mod model;
mod params;
mod regime;
mod save;
mod table;
mod tune;

pub use blob::{EffectSlot, File, FileOf, MAGIC, VERSION};
pub use drive::{Drive, Driven, Normal, Tangential};
pub use effect::{Contact, Effects, Surroundings};
pub use error::{Error, Field};
pub use frame::ContactFrame;
pub use gradient::Gradient;
pub use grip::Grip;
pub use model::{
    Data, DataOf, ELEMENTS, Element, Model, ModelOf, Motion, NODES, Response, State, StateOf, Tuned, step,
};
pub use params::{Node, Params, ParamsOf, Slider};
pub use regime::{Regime, Status};
pub use save::STATE_BYTES;
pub use table::{Line, Row};
pub use tune::{Fitted, Scaled, Scaling, Tuning};
