//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Units everywhere: mm, N, s, MPa, mJ, tonne.
pub mod mesh;
pub mod report;
pub mod slide;
