//! Gain of the force sensor, of all three axes.

use super::{Change, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Gain of the force sensor.
pub struct ForceGain;

impl Effect for ForceGain {
    const LAW: Law = Law {
        name: "force_gain",
        family: "force_gain",
        formula: "reading × (1 + gain)",
        kind: 20,
        place: Place::Reading,
        parameters: &[Parameter { name: "gain", unit: "", low: -0.95, high: 20.0, typical: 0.1, positive: false }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[],
        axes: &[],
        confused_with: &["subject_size", "stiffness_drift"],
        source: "an amplifier on another range, or a calibration matrix of another sensor; a tenth is assumed",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[gain, ..]: &[T; VALUES], _: &Conditions<T>, change: &mut Change<T>) {
        change.gain += gain;
    }
}
