//! Cross-talk of the force sensor.

use super::{Axis, Change, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Cross-talk of the force sensor.
pub struct CrossTalk;

impl Effect for CrossTalk {
    const LAW: Law = Law {
        name: "cross_talk",
        family: "cross_talk",
        formula: "x += normal_to_x N, y += normal_to_y N, N the normal force",
        kind: 13,
        place: Place::Reading,
        parameters: &[
            Parameter { name: "normal_to_x", unit: "", low: -1.0, high: 1.0, typical: 0.02, positive: false },
            Parameter { name: "normal_to_y", unit: "", low: -1.0, high: 1.0, typical: 0.02, positive: false },
        ],
        linear: 2,
        reported: Reported::AsFitted,
        drivers: &[],
        axes: &[Axis::Direction],
        confused_with: &["tare_bias", "anisotropy"],
        source: "cross-talk of multi-axis force sensors, 1 to 3 % of full scale by their data sheets",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[x, y, ..]: &[T; VALUES], _: &Conditions<T>, change: &mut Change<T>) {
        change.cross[0] += x;
        change.cross[1] += y;
    }
}
