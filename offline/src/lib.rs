//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Units everywhere: mm, N, s, MPa, mJ, tonne.
pub mod io;
pub mod mesh;
pub mod slide;
