//! The model of the inference and its priors: the smooth model along measured runs, laws in force, random effects, row noise,
//! and distributions of the parameters before the measurement.
//!
//! Main types: [`ActiveLaw`](active_law::ActiveLaw), [`RandomEffect`](random_effects::RandomEffect),
//! [`RowNoise`](row_noise::RowNoise), [`Prior`](prior::Prior). May use: data, laws, `fingerpad-smooth`, `fingerpad`.

pub mod active_law;
pub mod core_replay;
pub mod finger_law;
pub mod prediction;
pub mod prior;
pub mod random_effects;
pub mod relaxation;
pub mod residual_sums;
pub mod row_noise;
pub mod starting_point;
