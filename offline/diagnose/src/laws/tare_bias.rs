//! Tare of the force sensor: reading += b, in air too.

use super::{Change, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "tare_bias",
    family: "tare",
    kind: 12,
    place: Place::Reading,
    parameters: &[
        Parameter { name: "normal_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02 },
        Parameter { name: "x_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02 },
        Parameter { name: "y_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02 },
    ],
    linear: 3,
    drivers: &[],
    confused_with: &["adhesion", "anisotropy"],
    source: "0.2 to 0.4 N per axis, once 1.2 N, in the traces of Li & Ward-Cherrier 2023",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], _row: &Row, change: &mut Change) {
    for (sum, bias) in change.reading_n.iter_mut().zip(p) {
        *sum += bias;
    }
}
