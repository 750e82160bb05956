//! Occlusion.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Occlusion.
pub struct OcclusionGrowth;

impl Effect for OcclusionGrowth {
    const LAW: Law = Law {
        name: "occlusion_growth",
        family: "occlusion",
        formula: "strength × (1 + amplitude (1 − e^(−occ/tau_s))), occ the contact time since the last rest in s",
        kind: 9,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: -0.95, high: 20.0, typical: 0.5, positive: false },
            Parameter { name: "tau_s", unit: "s", low: 2.0, high: 250.0, typical: 20.0, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Occlusion],
        axes: &[Axis::Hold],
        confused_with: &["hydration_bell", "stiffness_drift", "temperature", "strength_drift"],
        source: "first-order growth with about 20 s, up to tenfold: Dzidek et al. 2014; Adams et al. 2013",
        shapes: &[&[5.0], &[12.0], &[25.0], &[60.0], &[150.0]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, tau_s, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        change.strengthen(T::ONE - amplitude * (-at.occlusion_s / tau_s).exp_m1());
    }
}
