//! Occlusion: strength × (1 + a (1 − e^(−occ/tau))), occ the contact time since the last rest.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "occlusion_growth",
    family: "occlusion",
    kind: 9,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude", unit: "", low: -0.95, high: 20.0, typical: 0.5 },
        Parameter { name: "tau_s", unit: "s", low: 2.0, high: 250.0, typical: 20.0 },
    ],
    linear: 1,
    drivers: &[Column::Occlusion],
    confused_with: &["hydration_bell", "stiffness_drift", "temperature"],
    source: "first-order growth with about 20 s, up to tenfold: Dzidek et al. 2014; Adams et al. 2013",
    shapes: &[&[5.0], &[12.0], &[25.0], &[60.0], &[150.0]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.strengthen(1.0 - p[0] * (-row.occlusion_s / p[1]).exp_m1());
}
