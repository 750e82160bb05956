//! Adhesion as a line tension at the rim.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Adhesion as a line tension at the rim.
pub struct Adhesion;

impl Effect for Adhesion {
    const LAW: Law = Law {
        name: "adhesion",
        family: "adhesion",
        formula: "normal −= pull_off_n sqrt(A/A0), friction keeps the elastic load",
        kind: 10,
        place: Place::Rim,
        parameters: &[Parameter {
            name: "pull_off_n",
            unit: "N",
            low: 0.0,
            high: 1.0,
            typical: 0.015,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Depth],
        axes: &[Axis::Depth],
        confused_with: &["depth_zero_offset", "tare_bias", "strain_stiffening"],
        source: "pull-off of a fingertip at most 15 mN: Spinner, Wiechert & Gorb 2016",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[pull_off_n, ..]: &[T; VALUES], _: &Conditions<T>, change: &mut Change<T>) {
        change.adhesion_n += pull_off_n;
    }
}
