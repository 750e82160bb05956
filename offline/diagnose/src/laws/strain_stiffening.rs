//! Stiffening with depth beyond the baseline's: stiffness × e^(a (d − 0.8 mm)).

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "strain_stiffening",
    family: "strain_stiffening",
    kind: 16,
    place: Place::Stiffness,
    parameters: &[Parameter { name: "rate_per_mm", unit: "1/mm", low: -4.0, high: 6.0, typical: 0.5 }],
    linear: 1,
    drivers: &[Column::Depth],
    confused_with: &["depth_zero_offset", "adhesion"],
    source: "force exponential in the indentation: Pawluk & Howe 1999; pulp 3.5 to 20 N/mm between 1 and 4 N: Serina et al. 1997",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    if row.depth_mm > 0.0 {
        change.stiffen((p[0] * (row.depth_mm - 0.8)).exp());
    }
}
