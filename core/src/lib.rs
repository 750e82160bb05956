#![no_std]
#![doc = include_str!("../README.md")]

mod regime;

pub use regime::{Regime, Status};
