//! Static peak: strength × (1 + a e^(−s/D)), s the path of the plate since touch.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "static_peak",
    family: "static_peak",
    kind: 8,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude", unit: "", low: 0.0, high: 60.0, typical: 0.2 },
        Parameter { name: "slip_mm", unit: "mm", low: 0.08, high: 6.0, typical: 0.8 },
    ],
    linear: 1,
    drivers: &[Column::Slide],
    confused_with: &["contact_ageing", "normal_relaxation"],
    source: "real contact area falls by up to 30 % under shear before sliding: Sahli et al. 2018",
    shapes: &[&[0.2], &[0.4], &[0.8], &[1.6], &[3.5]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.strengthen(1.0 + p[0] * (-row.path_mm / p[1]).exp());
}
