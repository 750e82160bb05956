//! Equilibrium of body and contact: Newton with a frozen bulk factor, the contact solved exactly on its dense
//! compliance, every axis of the plane driven by displacement or by force.
//!
//! Main types: [`Solver`], [`State`], [`Target`], [`Settings`], [`Stats`], [`SolveError`].
//! May use: assembly, contact, element, material, mesh.

mod increment;
mod inner;
pub mod linear;
mod newton;
mod stiffness;

pub use increment::{Axis, Damping, Settings, SolveError, State, Stats, Target};
pub use newton::Solver;
