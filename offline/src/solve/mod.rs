//! Equilibrium of body and contact: Newton with a frozen bulk factor, the contact solved exactly on its dense
//! compliance, every axis of the plane driven by displacement or by force.
//!
//! Main types: [`Solver`], [`State`], [`Target`], [`Settings`], [`Stats`], [`SolveError`].
//! May use: assembly, contact, element, material, mesh.

mod inner;
pub mod linear;
mod newton;

pub use newton::{Axis, Damping, Settings, SolveError, Solver, State, Stats, Target};
