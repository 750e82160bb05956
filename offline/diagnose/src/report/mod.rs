//! What is said of a verdict: effects with sizes, where simulation and measurement disagree, the witness, the corrected model.
//!
//! Main type: [`Evidence`](evidence::Evidence). May use: verdict, plan and all below.

pub mod calibrated_range;
pub mod corrected_model;
pub mod driver_plot;
pub mod effects_found;
pub mod evidence;
pub mod exchanged;
pub mod next_step;
pub mod regions;
pub mod sections;
pub mod traces;
pub mod witness;
