//! Tare of the force sensor, in air too.

use super::{Change, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Tare of the force sensor.
pub struct TareBias;

impl Effect for TareBias {
    const LAW: Law = Law {
        name: "tare_bias",
        family: "tare",
        formula: "normal += normal_n, x += x_n, y += y_n",
        kind: 12,
        place: Place::Reading,
        parameters: &[
            Parameter { name: "normal_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02, positive: false },
            Parameter { name: "x_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02, positive: false },
            Parameter { name: "y_n", unit: "N", low: -3.0, high: 3.0, typical: 0.02, positive: false },
        ],
        linear: 3,
        reported: Reported::AsFitted,
        drivers: &[],
        axes: &[],
        confused_with: &["adhesion", "anisotropy"],
        source: "0.2 to 0.4 N per axis, once 1.2 N, in the traces of Li & Ward-Cherrier 2023",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[normal_n, x_n, y_n, ..]: &[T; VALUES], _: &Conditions<T>, change: &mut Change<T>) {
        for (sum, bias) in change.reading_n.iter_mut().zip([normal_n, x_n, y_n]) {
            *sum += bias;
        }
    }
}
