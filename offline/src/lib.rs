//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Units everywhere: mm, N, s, MPa, mJ, tonne.
pub mod io;
pub mod mesh;
#[cfg(unix)]
pub mod peer;
pub mod slide;
