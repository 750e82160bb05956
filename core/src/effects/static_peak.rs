//! Static peak.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Static peak.
pub struct StaticPeak;

impl Effect for StaticPeak {
    const LAW: Law = Law {
        name: "static_peak",
        family: "static_peak",
        formula: "strength × (1 + amplitude e^(−s/slip_mm)), s the path since touch in mm",
        kind: 8,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: 0.0, high: 60.0, typical: 0.2, positive: false },
            Parameter { name: "slip_mm", unit: "mm", low: 0.08, high: 6.0, typical: 0.8, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Slide],
        axes: &[Axis::Stroke],
        confused_with: &["contact_ageing", "normal_relaxation"],
        source: "real contact area falls by up to 30 % under shear before sliding: Sahli et al. 2018",
        shapes: &[&[0.2], &[0.4], &[0.8], &[1.6], &[3.5]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, slip_mm, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + amplitude * (-at.path_mm / slip_mm).exp());
    }
}
