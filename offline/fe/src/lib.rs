//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Rooms: [`mesh`] (nodes, elements, named sets), [`element`], [`material`], [`contact`] (gap, pressure, friction law),
//! [`assembly`], [`solve`] (equilibrium), [`load_path`] (a path of the plane becomes a
//! trajectory of responses), [`experiment`] (press to depths and slide), [`compare_ccx`] (the same problem for
//! CalculiX). Main types: [`mesh::Fingertip`], [`load_path::Finger`], [`load_path::Path`], [`load_path::Trajectory`].
//! Units everywhere: mm, N, s, MPa, mJ, tonne.
//! May use: `fingerpad-formats`, `fingerpad-linear`, `fingerpad-mesh`; `fingerpad` for the spellings of regime and status.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(x > 0.0)` refuses NaN by its shape")]

pub mod assembly;
#[cfg(unix)]
pub mod compare_ccx;
pub mod contact;
pub mod element;
pub mod experiment;
pub mod load_path;
pub mod material;
mod rounded;
pub mod solve;

pub use fingerpad_mesh as mesh;
pub use rounded::Rounded;
