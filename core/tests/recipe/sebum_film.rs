//! A film of sebum that settles on the plate in the course of a series.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// A film of sebum on the plate.
pub struct SebumFilm;

impl Effect for SebumFilm {
    const LAW: Law = Law {
        name: "sebum_film",
        family: "film",
        formula: "strength × (1 − fraction (1 − e^(−t/tau_s))), t the clock of the session in s",
        kind: 21,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "fraction", unit: "", low: 0.0, high: 0.89, typical: 0.2, positive: false },
            Parameter { name: "tau_s", unit: "s", low: 30.0, high: 7200.0, typical: 600.0, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Time],
        axes: &[Axis::Hold],
        confused_with: &["occlusion_growth", "stiffness_drift"],
        source: "an example, its sizes are made up; lipids of the skin and friction: Cua, Wilhelm & Maibach 1995",
        shapes: &[&[120.0], &[600.0], &[3000.0]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[fraction, tau_s, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + fraction * (-at.t_s / tau_s).exp_m1());
    }
}
