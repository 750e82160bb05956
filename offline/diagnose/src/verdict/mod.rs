//! From the selection to a verdict and its report: what may be claimed, how well held-out runs are predicted, where
//! simulation and measurement disagree, what to measure next.
//!
//! Main types: [`Decision`](decision::Decision), [`Evidence`](evidence::Evidence); main function:
//! [`diagnose`](diagnosis::diagnose). May use: all other rooms but reduced_input and confirm.

mod calibrated;
mod calibrated_range;
pub mod candidate_designs;
mod checked;
mod cleaning;
mod concluded;
pub mod corrected_model;
pub mod cross_validation;
pub mod decision;
pub mod diagnosis;
pub mod driver_plot;
pub mod dry_run;
mod effects_found;
pub mod evidence;
pub mod exchanged;
pub mod group;
mod in_air;
mod instrument;
mod next_experiment;
pub mod next_step;
pub mod options;
pub mod power;
pub mod redecision;
pub mod regions;
mod report_sections;
mod selected;
pub mod stability;
pub mod survey;
pub mod traces;
mod witness;
