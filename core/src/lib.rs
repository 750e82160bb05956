#![no_std]
#![doc = include_str!("../README.md")]

#[cfg(any(feature = "std", test))]
extern crate std;

mod check;
mod error;
mod example;
mod math;
mod model;
mod params;
mod regime;
mod table;
mod tune;

pub use error::{Error, Field};
pub use model::{
    Data, DataOf, ELEMENTS, Element, Model, ModelOf, Motion, NODES, Response, State, StateOf, step,
};
pub use params::{Node, Params, ParamsOf, Slider};
pub use regime::{Regime, Status};
pub use table::{Line, Row};
pub use tune::Tuning;
