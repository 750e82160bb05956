//! Friction over speed, rate-and-state form: strength × (1 + a ln(v / 2 mm/s)); 1 while the plate does not move.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "speed_log",
    family: "speed",
    kind: 2,
    place: Place::Strength,
    parameters: &[Parameter { name: "slope_per_e_fold", unit: "", low: -1.0, high: 1.0, typical: 0.05 }],
    linear: 1,
    drivers: &[Column::Speed],
    confused_with: &["contact_ageing", "viscous_drag"],
    source: "shear force and friction change with speed, the normal force does not: Liao & Srinivasan 1999; an exponent of order 0.1 is assumed",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    if row.speed_mm_s > 0.0 {
        change.strengthen(1.0 + p[0] * (row.speed_mm_s / 2.0).ln());
    }
}
