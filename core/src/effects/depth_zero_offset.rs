//! Error of the touch point, before anything else.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Error of the touch point.
pub struct DepthZeroOffset;

impl Effect for DepthZeroOffset {
    const LAW: Law = Law {
        name: "depth_zero_offset",
        family: "depth_zero",
        formula: "depth += offset_mm where depth > 0",
        kind: 11,
        place: Place::Depth,
        parameters: &[Parameter {
            name: "offset_mm",
            unit: "mm",
            low: -0.5,
            high: 0.5,
            typical: 0.05,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Depth],
        axes: &[Axis::Depth],
        confused_with: &["adhesion", "strain_stiffening"],
        source: "an error of 0.05 to 0.09 mm of one depth explains the kink in the table of Yoshida et al. 2011",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[offset_mm, ..]: &[T; VALUES], _: &Conditions<T>, change: &mut Change<T>) {
        change.depth_mm += offset_mm;
    }
}
