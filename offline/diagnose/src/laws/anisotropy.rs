//! Friction over direction: strength × (1 + a cos 2(theta − axis)).
//!
//! Fitted as a cos 2 axis and a sin 2 axis, in which it is linear.

use super::{Change, Column, Law, Parameter, Place, Row};

/// The law.
pub static LAW: Law = Law {
    name: "anisotropy",
    family: "direction",
    kind: 5,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude", unit: "", low: -20.0, high: 20.0, typical: 0.15 },
        Parameter { name: "axis_deg", unit: "degree", low: -90.0, high: 90.0, typical: 0.15 },
    ],
    linear: 2,
    drivers: &[Column::Direction],
    confused_with: &["cross_talk", "tare_bias"],
    source: "a ratio between directions of 1.1 to 1.4 is assumed, none was found published; the skin's deformation differs by direction: Delhaye et al. 2014",
    shapes: &[&[]],
    apply,
    report: polar,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.strengthen(1.0 + p[0] * row.double_angle[0] + p[1] * row.double_angle[1]);
}

fn polar(p: &[f64]) -> Vec<f64> {
    let axis = 0.5 * p[1].atan2(p[0]).to_degrees();
    vec![p[0].hypot(p[1]), if axis < 0.0 { axis + 180.0 } else { axis }]
}
