//! Friction over skin temperature.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Friction over skin temperature.
pub struct Temperature;

impl Effect for Temperature {
    const LAW: Law = Law {
        name: "temperature",
        family: "temperature",
        formula: "strength × (1 + slope_per_c (T − 32)), T the temperature of the skin in °C",
        kind: 17,
        place: Place::Strength,
        parameters: &[Parameter {
            name: "slope_per_c",
            unit: "1/°C",
            low: -0.3,
            high: 0.3,
            typical: 0.03,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Temperature],
        axes: &[],
        confused_with: &["hydration_bell", "stiffness_drift", "occlusion_growth", "strength_drift"],
        source: "a few per cent per degree, through sweat and the keratin's compliance, are assumed; no size for a fingertip was found published",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[slope_per_c, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + slope_per_c * (at.temperature_c - T::of(32.0)));
    }
}
