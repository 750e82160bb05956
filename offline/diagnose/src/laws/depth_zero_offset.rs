//! Error of the touch point: depth += delta, before anything else, only where depth > 0.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "depth_zero_offset",
    family: "depth_zero",
    kind: 11,
    place: Place::Depth,
    parameters: &[Parameter { name: "offset_mm", unit: "mm", low: -0.5, high: 0.5, typical: 0.05 }],
    linear: 1,
    drivers: &[Column::Depth],
    confused_with: &["adhesion", "strain_stiffening"],
    source: "an error of 0.05 to 0.09 mm of one depth explains the kink in the table of Yoshida et al. 2011",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], _row: &Row, change: &mut Change) {
    change.depth_mm += p[0];
}
