//! Stress relaxation of the tissue: stiffness × (1 − g (1 − e^(−t/tau))), t since touch.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "normal_relaxation",
    family: "normal_relaxation",
    kind: 6,
    place: Place::Stiffness,
    parameters: &[
        Parameter { name: "fraction", unit: "", low: 0.0, high: 0.89, typical: 0.2 },
        Parameter { name: "tau_s", unit: "s", low: 0.03, high: 80.0, typical: 1.4 },
    ],
    linear: 1,
    drivers: &[Column::ContactTime],
    confused_with: &["stiffness_drift", "depth_zero_offset", "strain_stiffening"],
    source: "time constants 4 ms, 70 ms, 1.4 s: Pawluk & Howe 1999; 40 % in 60 s on the forearm",
    shapes: &[&[0.1], &[0.35], &[1.0], &[2.5], &[6.0], &[15.0]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.stiffen(1.0 + p[0] * (-row.contact_time_s.max(0.0) / p[1]).exp_m1());
}
