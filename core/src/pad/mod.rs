//! The pad: patches of the fingertip's skin, coupled by the finger's own compliance, on a rigid body in any pose.
//!
//! Main types: [`Pad`] (numbers in flash), [`PadState`] (memory of a contact), [`Surface`] (what it touches); main function:
//! [`Pad::step`].
//!
//! One stored energy gives normal force, friction and moments. It is a function of where the body is, of the bulk's coordinates b and of
//! the points q_j of the body's surface at which the patches are held:
//!
//! ```text
//! E = 1/2 b.b + S(b) + sum_j [ N_j(overlap of x_j) + |P (q_j − x_j)|² / (2 c_t) ],     x_j = X_j + V_j b + second order of the bulk's rigid motion
//! ```
//!
//! S is the stiffening under squash, N_j the energy of a patch that touches in part, P the projection on the tangent plane at q_j. A step
//! brings b to equilibrium at fixed q_j, with the friction of each patch bounded by its strength lambda W^(1 − beta) N^beta, W the area in
//! contact. Where the bound is met the point q_j then moves, against which friction does work: it dissipates. Nothing else is
//! remembered. A motion therefore yields no work, up to the tolerance of the equilibrium; see `docs/pad.md`.

mod body;
mod data;
mod equilibrium;
mod example;
mod file;
mod patch;
mod requests;
mod save;
mod state;
mod step;
mod vector;

pub use body::{Body, Cylinder, Edge, Plane, Sphere, Surface};
pub use data::{Law, Numbers, Pad, Patch, first_touch_terms};
pub use example::{EXAMPLE_PATCHES, ExamplePad};
pub use file::PadFile;
pub use save::pad_state_bytes;
pub use state::{PadState, PatchState};

/// Coordinates of the bulk.
pub const MODES: usize = 16;
/// Numbers of a symmetric matrix over them.
pub const PACKED: usize = MODES * (MODES + 1) / 2;
/// Terms of the height of first touch.
pub const FIRST_TOUCH_TERMS: usize = 20;

#[cfg(test)]
mod tests;
