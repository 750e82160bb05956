//! Run-in of the strength over a session.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Change of the strength over a session that comes to rest: run-in, a film that settles, a finger that dries.
pub struct StrengthRunIn;

impl Effect for StrengthRunIn {
    const LAW: Law = Law {
        name: "strength_run_in",
        family: "strength_drift",
        formula: "strength × (1 + amplitude (1 − e^(−t/tau_s))), t the clock of the session in s",
        kind: 19,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: -0.89, high: 4.0, typical: -0.2, positive: false },
            Parameter { name: "tau_s", unit: "s", low: 30.0, high: 14400.0, typical: 900.0, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Time],
        axes: &[],
        confused_with: &["hydration_bell", "temperature", "occlusion_growth", "strength_drift"],
        source: "run-in and films come to rest within a session; a fifth within a quarter of an hour is assumed",
        shapes: &[&[150.0], &[600.0], &[2400.0]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, tau_s, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE - amplitude * (-at.t_s / tau_s).exp_m1());
    }
}
