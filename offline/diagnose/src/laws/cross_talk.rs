//! Cross-talk of the force sensor: reading_x += c_x N, reading_y += c_y N.

use super::{Change, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "cross_talk",
    family: "cross_talk",
    kind: 13,
    place: Place::Reading,
    parameters: &[
        Parameter { name: "normal_to_x", unit: "", low: -1.0, high: 1.0, typical: 0.02 },
        Parameter { name: "normal_to_y", unit: "", low: -1.0, high: 1.0, typical: 0.02 },
    ],
    linear: 2,
    drivers: &[],
    confused_with: &["tare_bias", "anisotropy"],
    source: "cross-talk of multi-axis force sensors, 1 to 3 % of full scale by their data sheets",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], _row: &Row, change: &mut Change) {
    change.cross[0] += p[0];
    change.cross[1] += p[1];
}
