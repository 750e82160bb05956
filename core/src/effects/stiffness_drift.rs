//! Drift of the tissue's stiffness.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Drift of the tissue's stiffness.
pub struct StiffnessDrift;

impl Effect for StiffnessDrift {
    const LAW: Law = Law {
        name: "stiffness_drift",
        family: "stiffness_drift",
        formula: "stiffness × (1 + fraction_per_hour t), t the clock of the session in hours",
        kind: 14,
        place: Place::Stiffness,
        parameters: &[Parameter {
            name: "fraction_per_hour",
            unit: "1/h",
            low: -10.0,
            high: 10.0,
            typical: -0.2,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Time],
        axes: &[],
        confused_with: &["temperature", "hydration_bell", "subject_size"],
        source: "preconditioning: peak force −43 % over four cycles on the forearm",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[per_hour, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.stiffen(T::ONE + per_hour * at.t_s / T::of(3600.0));
    }
}
