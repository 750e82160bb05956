//! Size of the subject's finger: stiffness × (w / 16 mm)^q.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "subject_size",
    family: "subject_size",
    kind: 15,
    place: Place::Stiffness,
    parameters: &[Parameter { name: "stiffness_exponent", unit: "", low: -12.0, high: 12.0, typical: -1.5 }],
    linear: 1,
    drivers: &[Column::Width],
    confused_with: &["stiffness_drift"],
    source: "pads of 16 to 20 mm width: Dandekar et al. 2003; spread between subjects: Gulati & Srinivasan 1997",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.stiffen((row.width_mm / 16.0).powf(p[0]));
}
