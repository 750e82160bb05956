//! Contact ageing.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Contact ageing.
pub struct ContactAgeing;

impl Effect for ContactAgeing {
    const LAW: Law = Law {
        name: "contact_ageing",
        family: "ageing",
        formula: "strength × (1 + amplitude_per_e_fold ln(1 + dwell/t0_s) e^(−s/slip_mm)), s the path since touch in mm",
        kind: 7,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude_per_e_fold", unit: "", low: 0.0, high: 30.0, typical: 0.05, positive: false },
            Parameter { name: "t0_s", unit: "s", low: 0.02, high: 20.0, typical: 0.3, positive: true },
            Parameter { name: "slip_mm", unit: "mm", low: 0.08, high: 6.0, typical: 0.8, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Dwell, Column::Slide],
        axes: &[Axis::Stroke, Axis::Hold],
        confused_with: &["static_peak", "occlusion_growth", "normal_relaxation"],
        source: "real contact area grows with the time of pressing: Dzidek et al. 2017; Nam et al. 2020",
        shapes: &[
            &[0.08, 0.25],
            &[0.08, 0.6],
            &[0.08, 1.5],
            &[0.08, 3.5],
            &[0.4, 0.25],
            &[0.4, 0.6],
            &[0.4, 1.5],
            &[0.4, 3.5],
            &[2.5, 0.25],
            &[2.5, 0.6],
            &[2.5, 1.5],
            &[2.5, 3.5],
        ],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, t0_s, slip_mm, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE + amplitude * (at.dwell_s / t0_s).ln_1p() * (-at.path_mm / slip_mm).exp());
    }
}
