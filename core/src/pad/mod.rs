//! The pad: patches of the fingertip's skin, coupled by the finger's own compliance, on a rigid body in any pose.
//!
//! Main types: [`Pad`] (the fitted numbers, in flash), [`PadState`] (state of one contact), [`Surface`] (the rigid body); main
//! function: [`Pad::step`].
//!
//! All forces and moments follow from one stored energy. It depends on the pose of the body, on the coordinates b of the bulk, and on the
//! points q_j of the body's surface at which friction holds the patches (their anchors):
//!
//! ```text
//! E = 1/2 b.b + S(b) + sum_j [ N_j(overlap of x_j) + |P (q_j − x_j)|² / (2 c_t) ],     x_j = X_j + V_j b + second order of the bulk's rigid motion
//! ```
//!
//! S is the energy by which the bulk stiffens under compression (squash). N_j is the energy of the normal contact of a patch, which may
//! touch over a part of its area. c_t is the tangential compliance of a patch, and P the projection onto the tangent plane at q_j. Near
//! first touch the body is shifted along its normal (`touch.rs`), and the strengths grow and fall with the normal force.
//!
//! A step finds the equilibrium of b at fixed q_j. The friction of each patch is at most its strength lambda W^(1 − beta) N^beta, with its
//! normal force N and its area W in contact. A patch that reaches its strength slips: its q_j moves, and friction dissipates the work.
//! The q_j are the only history. A closed motion therefore yields no work, up to the tolerance of the equilibrium; see `docs/pad.md`.

mod body;
mod data;
mod equilibrium;
mod example;
mod file;
mod memory;
mod on;
mod orthotropy;
mod outcome;
mod patch;
mod requests;
mod save;
mod state;
mod step;
mod touch;
mod vector;

pub use body::{Body, Cylinder, Edge, LeastRadii, Plane, Sphere, Surface};
pub use data::{Effort, Law, Numbers, Pad, Patch};
pub use example::{EXAMPLE_PATCHES, ExamplePad};
pub use file::PadFile;
pub use memory::{Memory, PadMemory};
pub use on::PadOn;
pub use orthotropy::Orthotropy;
pub use save::{pad_state_bytes, relaxing_pad_state_bytes};
pub use state::{PadState, PatchState, RelaxingPadState};
pub(crate) use step::axes;
pub use touch::first_touch_terms;

/// Number of coordinates of the bulk.
pub const MODES: usize = 16;
/// Stored elements of a symmetric matrix over these coordinates.
pub const PACKED: usize = MODES * (MODES + 1) / 2;
/// Number of terms of the height of first touch, see [`first_touch_terms`].
pub const FIRST_TOUCH_TERMS: usize = 20;

#[cfg(test)]
mod tests;
