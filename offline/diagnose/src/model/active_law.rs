//! A law of the library that is switched on, and the scale on which its parameters are fitted.
//!
//! Main type: [`ActiveLaw`]. Sizes are fitted as they are, positive shape parameters (times, lengths) as logarithms.

use crate::laws::{Law, Reported};

/// A law in force with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ActiveLaw {
    /// The law.
    pub law: &'static Law,
    /// Its parameters in the order of the law, in their own units.
    pub values: Vec<f64>,
}

/// Whether a parameter of a law is fitted by its logarithm.
pub fn is_log(active: &ActiveLaw, index: usize) -> bool {
    active.law.parameters[index].positive
}

/// Mean and standard deviation of a parameter's weak prior, on the scale on which it is fitted. For sizes it only keeps a
/// direction that the protocol cannot see from running away.
pub fn weak_prior(active: &ActiveLaw, index: usize) -> (f64, f64) {
    let p = &active.law.parameters[index];
    if index < active.law.linear {
        (0.0, 20.0 * p.typical.abs())
    } else if is_log(active, index) {
        (p.typical.ln(), 1.5)
    } else {
        (p.typical, 0.375 * (p.high - p.low))
    }
}

/// A parameter of a law on the scale on which it is fitted.
pub fn to_fitted(active: &ActiveLaw, index: usize) -> f64 {
    if is_log(active, index) { active.values[index].ln() } else { active.values[index] }
}

/// Sets a parameter from its fitted scale, within its bounds.
pub fn set_fitted(active: &mut ActiveLaw, index: usize, q: f64) {
    let p = &active.law.parameters[index];
    let bounds = match active.law.reported {
        Reported::AsFitted => p,
        Reported::AmplitudeAndAxis => &active.law.parameters[0],
    };
    let value = if is_log(active, index) { q.exp() } else { q };
    debug_assert!(p.low < p.high);
    active.values[index] = value.clamp(bounds.low, bounds.high);
}

/// Largest change of a parameter in one Gauss–Newton step, on the scale on which it is fitted.
pub fn largest_step(active: &ActiveLaw, index: usize) -> f64 {
    if is_log(active, index) {
        0.8
    } else if index >= active.law.linear {
        let p = &active.law.parameters[index];
        0.1875 * (p.high - p.low)
    } else {
        f64::INFINITY
    }
}
