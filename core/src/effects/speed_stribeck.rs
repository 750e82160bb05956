//! Friction over speed, lubricated; no change while the plate does not move.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Friction over speed, lubricated.
pub struct SpeedStribeck;

impl Effect for SpeedStribeck {
    const LAW: Law = Law {
        name: "speed_stribeck",
        family: "speed",
        formula: "strength × (1 + amplitude [e^(−v/decay_mm_s) − e^(−2/decay_mm_s)]), v the speed in mm/s",
        kind: 3,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: -5.0, high: 20.0, typical: 0.4, positive: false },
            Parameter { name: "decay_mm_s", unit: "mm/s", low: 0.5, high: 60.0, typical: 5.0, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Speed],
        axes: &[Axis::Speed],
        confused_with: &["contact_ageing", "viscous_drag"],
        source: "wet skin, mixed lubrication, friction falls with speed: Derler & Rotaru 2013",
        shapes: &[&[1.0], &[2.5], &[5.0], &[10.0], &[25.0]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, decay_mm_s, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        if at.speed_mm_s > T::ZERO {
            let more = (-at.speed_mm_s / decay_mm_s).exp() - (T::of(-2.0) / decay_mm_s).exp();
            change.strengthen(T::ONE + amplitude * more);
        }
    }
}
