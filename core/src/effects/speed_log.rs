//! Friction over speed, rate-and-state form; no change while the plate does not move.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Friction over speed, rate-and-state form.
pub struct SpeedLog;

impl Effect for SpeedLog {
    const LAW: Law = Law {
        name: "speed_log",
        family: "speed",
        formula: "strength × (1 + slope_per_e_fold ln(v/2)), v the speed in mm/s",
        kind: 2,
        place: Place::Strength,
        parameters: &[Parameter {
            name: "slope_per_e_fold",
            unit: "",
            low: -1.0,
            high: 1.0,
            typical: 0.05,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Speed],
        axes: &[Axis::Speed],
        confused_with: &["contact_ageing", "viscous_drag"],
        source: "shear force and friction change with speed, the normal force does not: Liao & Srinivasan 1999; an exponent of order 0.1 is assumed",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[slope, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        if at.speed_mm_s > T::ZERO {
            change.strengthen(T::ONE + slope * (at.speed_mm_s / T::of(2.0)).ln());
        }
    }
}
