//! Size of the subject's finger.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Size of the subject's finger.
pub struct SubjectSize;

impl Effect for SubjectSize {
    const LAW: Law = Law {
        name: "subject_size",
        family: "subject_size",
        formula: "stiffness × (w/16)^stiffness_exponent, w the width of the finger in mm",
        kind: 15,
        place: Place::Stiffness,
        parameters: &[Parameter {
            name: "stiffness_exponent",
            unit: "",
            low: -12.0,
            high: 12.0,
            typical: -1.5,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Width],
        axes: &[],
        confused_with: &["stiffness_drift"],
        source: "pads of 16 to 20 mm width: Dandekar et al. 2003; spread between subjects: Gulati & Srinivasan 1997",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[exponent, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.stiffen((at.width_mm / T::of(16.0)).powf(exponent));
    }
}
