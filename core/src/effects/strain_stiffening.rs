//! Stiffening with depth beyond the baseline's.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Stiffening with depth beyond the baseline's.
pub struct StrainStiffening;

impl Effect for StrainStiffening {
    const LAW: Law = Law {
        name: "strain_stiffening",
        family: "strain_stiffening",
        formula: "stiffness × e^(rate_per_mm (d − 0.8)), d the depth in mm",
        kind: 16,
        place: Place::Stiffness,
        parameters: &[Parameter {
            name: "rate_per_mm",
            unit: "1/mm",
            low: -4.0,
            high: 6.0,
            typical: 0.5,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Depth],
        axes: &[Axis::Depth],
        confused_with: &["depth_zero_offset", "adhesion"],
        source: "force exponential in the indentation: Pawluk & Howe 1999; pulp 3.5 to 20 N/mm between 1 and 4 N: Serina et al. 1997",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[rate_per_mm, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        if at.depth_mm > T::ZERO {
            change.stiffen((rate_per_mm * (at.depth_mm - T::of(0.8))).exp());
        }
    }
}
