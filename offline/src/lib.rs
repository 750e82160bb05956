//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Units everywhere: mm, N, s, MPa, mJ, tonne.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(x > 0.0)` refuses NaN by its shape")]

pub mod assembly;
pub mod contact;
pub mod diagnose;
pub mod element;
pub mod experiment;
pub mod identify;
pub mod io;
pub mod material;
pub mod mesh;
#[cfg(unix)]
pub mod peer;
pub mod reduce;
pub mod report;
pub mod slide;
pub mod solve;
pub mod units;
