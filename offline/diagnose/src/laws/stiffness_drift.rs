//! Drift of the tissue's stiffness: stiffness × (1 + a t), t in hours of the series.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "stiffness_drift",
    family: "stiffness_drift",
    kind: 14,
    place: Place::Stiffness,
    parameters: &[Parameter { name: "fraction_per_hour", unit: "1/h", low: -10.0, high: 10.0, typical: -0.2 }],
    linear: 1,
    drivers: &[Column::Time],
    confused_with: &["temperature", "hydration_bell", "subject_size"],
    source: "preconditioning: peak force −43 % over four cycles on the forearm",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.stiffen(1.0 + p[0] * row.t_s / 3600.0);
}
