//! Finite-element fingertip on a rigid plane: from geometry to friction over travel.
//!
//! Units everywhere: mm, N, s, MPa, mJ, tonne.
pub mod assembly;
pub mod contact;
pub mod element;
pub mod material;
pub mod mesh;
pub mod report;
pub mod slide;
pub mod solve;
pub mod units;
