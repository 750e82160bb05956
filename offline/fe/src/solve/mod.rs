//! Equilibrium of body and contact: Newton with a frozen bulk factor, the contact solved exactly on its dense
//! compliance, every axis of the plane driven by displacement or by force.
//!
//! Main types: [`Solver`], [`State`], [`Target`], [`SolverSettings`], [`Stats`], [`SolveError`],
//! [`RestCompliance`].
//! May use: `fingerpad-linear`, assembly, contact, element, material, mesh.

mod compliance;
mod contact_subproblem;
mod contact_system;
mod equilibrium;
mod increment;
mod near;
mod solver;
mod stiffness;

pub use compliance::RestCompliance;
pub use increment::{Axis, Damping, Guess, SolveError, SolverSettings, State, Stats, Target, Watch, unwatched};
pub use solver::{FactorRecord, PadFaces, Solver};

pub use fingerpad_linear as linear;
