//! Adhesion as a line tension at the rim: normal −= W sqrt(A/A0); friction keeps the elastic load.

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "adhesion",
    family: "adhesion",
    kind: 10,
    place: Place::Rim,
    parameters: &[Parameter { name: "pull_off_n", unit: "N", low: 0.0, high: 1.0, typical: 0.015 }],
    linear: 1,
    drivers: &[Column::Depth],
    confused_with: &["depth_zero_offset", "tare_bias", "strain_stiffening"],
    source: "pull-off of a fingertip at most 15 mN: Spinner, Wiechert & Gorb 2016",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], _row: &Row, change: &mut Change) {
    change.adhesion_n += p[0];
}
