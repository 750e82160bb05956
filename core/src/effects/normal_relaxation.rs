//! Stress relaxation of the tissue.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Stress relaxation of the tissue.
pub struct NormalRelaxation;

impl Effect for NormalRelaxation {
    const LAW: Law = Law {
        name: "normal_relaxation",
        family: "normal_relaxation",
        formula: "stiffness × (1 − fraction (1 − e^(−t/tau_s))), t the time since touch in s",
        kind: 6,
        place: Place::Stiffness,
        parameters: &[
            Parameter { name: "fraction", unit: "", low: 0.0, high: 0.89, typical: 0.2, positive: false },
            Parameter { name: "tau_s", unit: "s", low: 0.03, high: 80.0, typical: 1.4, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::ContactTime],
        axes: &[Axis::Stroke],
        confused_with: &["stiffness_drift", "depth_zero_offset", "strain_stiffening"],
        source: "time constants 4 ms, 70 ms, 1.4 s: Pawluk & Howe 1999; 40 % in 60 s on the forearm",
        shapes: &[&[0.1], &[0.35], &[1.0], &[2.5], &[6.0], &[15.0]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[fraction, tau_s, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.stiffen(T::ONE + fraction * (-at.contact_time_s.at_least(T::ZERO) / tau_s).exp_m1());
    }
}
