//! Confirmation of a diagnosis by finite elements: the named effect is switched on inside their law of friction, measured
//! strokes are run again, and what is left of them before and after is told.
//!
//! Main types: [`Confirmation`] (what is to be run and what came of it), [`FeStroke`] (a run as the finite elements take
//! it), [`FingerScale`] (scales that make it another finger). A stiffness factor s is exact: the law
//! tau_crit(s sigma)/s acts on the unchanged tissue and all forces are multiplied by s.
//! May use: diagnose (runs, laws, evidence), smooth, fe (load path, contact). Reads and writes no files.

mod choice;
mod confirmation;
mod scale;
mod stroke;

pub use choice::spread;
pub use confirmation::{Confirmation, Prepared, Ran};
pub use scale::FingerScale;
pub use stroke::{FeRow, FeStroke};
