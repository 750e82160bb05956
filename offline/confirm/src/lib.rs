//! The finite-element finger with the named effect inside its law: strokes re-run, its own gap before and after.
//!
//! Main types: [`Confirmation`] (what is to be run and what came of it), [`FeStroke`] (a run as the finite elements take
//! it), [`Scale`] (what of another finger the finite elements are given). A stiffness factor s is exact: the law
//! tau_crit(s sigma)/s acts on the unchanged tissue and all forces are multiplied by s.
//! May use: slide and contact, this room's runs, laws and baseline. Reads and writes no files.

mod choice;
mod confirmation;
mod scale;
mod stroke;

pub use choice::spread;
pub use confirmation::{Confirmation, Prepared, Ran};
pub use scale::Scale;
pub use stroke::{FeRow, FeStroke};
