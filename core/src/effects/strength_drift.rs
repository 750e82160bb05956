//! Drift of the strength over a session.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Drift of the strength over a session: wear, sebum on the plate, a finger that dries.
pub struct StrengthDrift;

impl Effect for StrengthDrift {
    const LAW: Law = Law {
        name: "strength_drift",
        family: "strength_drift",
        formula: "strength × (1 + fraction_per_hour t), t the clock of the session in hours",
        kind: 18,
        place: Place::Strength,
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
        confused_with: &["hydration_bell", "temperature", "occlusion_growth", "strength_run_in"],
        source: "wear, lipids on the plate and drying change friction over a session; a fifth per hour is assumed",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[per_hour, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + per_hour * at.t_s / T::of(3600.0));
    }
}
