//! What to measure next: strokes that a laboratory can make, and those that separate the hypotheses best.
//!
//! Main function: [`propose`](next_experiment::propose). May use: data, laws, model, schema, selection, statistics.

pub mod candidate_designs;
pub mod next_experiment;
