//! Friction over speed, lubricated: strength × (1 + a [e^(−v/vs) − e^(−2/vs)]); 1 while the plate does not move.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "speed_stribeck",
    family: "speed",
    kind: 3,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude", unit: "", low: -5.0, high: 20.0, typical: 0.4 },
        Parameter { name: "decay_mm_s", unit: "mm/s", low: 0.5, high: 60.0, typical: 5.0 },
    ],
    linear: 1,
    drivers: &[Column::Speed],
    confused_with: &["contact_ageing", "viscous_drag"],
    source: "wet skin, mixed lubrication, friction falls with speed: Derler & Rotaru 2013",
    shapes: &[&[1.0], &[2.5], &[5.0], &[10.0], &[25.0]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    if row.speed_mm_s > 0.0 {
        change.strengthen(1.0 + p[0] * ((-row.speed_mm_s / p[1]).exp() - (-2.0 / p[1]).exp()));
    }
}
