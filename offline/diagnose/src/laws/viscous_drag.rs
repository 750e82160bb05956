//! Viscous drag: force += c v A/A0 along the motion, built up as 1 − exp(−s_turn / 0.2 mm).

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "viscous_drag",
    family: "speed",
    kind: 4,
    place: Place::Drag,
    parameters: &[Parameter { name: "coefficient_n_s_per_mm", unit: "N s/mm", low: 0.0, high: 1.0, typical: 0.002 }],
    linear: 1,
    drivers: &[Column::Speed],
    confused_with: &["speed_log"],
    source: "a viscous pad along the plane above about 100 Hz: Wiertlewski & Hayward 2012; the size is of the order of theirs",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.drag_n += p[0] * row.speed_mm_s * -(-row.turn_mm / super::DRAG_PATH_MM).exp_m1();
}
