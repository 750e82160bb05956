//! Confirmation of a diagnosis by finite elements: the named effect is switched on inside their law of friction,
//! measured strokes are run again, and the residuals before and after are reported.
//!
//! Main types: [`Confirmation`] (the strokes and their results), [`FeStroke`] (a run as input of the finite elements),
//! [`FingerScale`] (scales that make it another finger). A stiffness factor s is exact: the law tau_crit(s sigma)/s
//! acts on the unchanged tissue and all forces are multiplied by s. May use: verdict (evidence), model, data, laws, schema,
//! `fingerpad-smooth`, `fingerpad-fe` (load path, contact). Reads and writes no files.

mod choice;
mod confirmation;
mod scale;
mod stroke;

pub use confirmation::{Confirmation, Prepared, Ran};
pub use scale::FingerScale;
pub use stroke::{FeRow, FeStroke};
