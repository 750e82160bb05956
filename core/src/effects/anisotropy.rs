//! Friction over direction.
//!
//! Fitted as a cos 2 axis and a sin 2 axis, in which it is linear.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Friction over direction.
pub struct Anisotropy;

impl Effect for Anisotropy {
    const LAW: Law = Law {
        name: "anisotropy",
        family: "direction",
        formula: "strength × (1 + amplitude cos 2(theta − axis_deg)), theta the direction",
        kind: 5,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: -20.0, high: 20.0, typical: 0.15, positive: false },
            Parameter { name: "axis_deg", unit: "degree", low: -90.0, high: 90.0, typical: 0.15, positive: false },
        ],
        linear: 2,
        reported: Reported::AmplitudeAndAxis,
        drivers: &[Column::Direction],
        axes: &[Axis::Direction],
        confused_with: &["cross_talk", "tare_bias"],
        source: "a ratio between directions of 1.1 to 1.4 is assumed, none was found published; the skin's deformation differs by direction: Delhaye et al. 2014",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[cos, sin, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + cos * at.double_angle[0] + sin * at.double_angle[1]);
    }
}
