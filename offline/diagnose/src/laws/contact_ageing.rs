//! Contact ageing: strength × (1 + a ln(1 + dwell/t0) e^(−s/D)), s the path since touch.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "contact_ageing",
    family: "ageing",
    kind: 7,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude_per_e_fold", unit: "", low: 0.0, high: 30.0, typical: 0.05 },
        Parameter { name: "t0_s", unit: "s", low: 0.02, high: 20.0, typical: 0.3 },
        Parameter { name: "slip_mm", unit: "mm", low: 0.08, high: 6.0, typical: 0.8 },
    ],
    linear: 1,
    drivers: &[Column::Dwell, Column::Slide],
    confused_with: &["static_peak", "occlusion_growth", "normal_relaxation"],
    source: "real contact area grows with the time of pressing: Dzidek et al. 2017; Nam et al. 2020",
    shapes: &[
        &[0.08, 0.25],
        &[0.08, 0.6],
        &[0.08, 1.5],
        &[0.08, 3.5],
        &[0.4, 0.25],
        &[0.4, 0.6],
        &[0.4, 1.5],
        &[0.4, 3.5],
        &[2.5, 0.25],
        &[2.5, 0.6],
        &[2.5, 1.5],
        &[2.5, 3.5],
    ],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.strengthen(1.0 + p[0] * (row.dwell_s / p[1]).ln_1p() * (-row.path_mm / p[2]).exp());
}
