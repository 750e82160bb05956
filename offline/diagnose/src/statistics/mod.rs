//! Statistics of runs: the mixed model and its fit, derivatives, precision, projections, tail probabilities, sign flips,
//! and the calibration.
//!
//! Main types: [`Task`](task::Task) (runs with priors), [`Fit`](fit::Fit), [`Projection`](projection::Projection)
//! (the linear picture at a fit), [`Score`](sign_flips::Score), [`Calibration`](calibration::Calibration).
//! May use: model, data, laws, `fingerpad-smooth`.

pub mod calibration;
pub mod damped_steps;
pub mod derivatives;
pub mod fit;
pub mod lag;
pub mod precision;
pub mod products;
pub mod projection;
pub mod random_effects;
pub mod sign_flips;
pub mod tails;
pub mod task;
