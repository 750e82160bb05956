//! Friction over moisture of the skin.

use super::{Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Friction over moisture of the skin.
pub struct HydrationBell;

impl Effect for HydrationBell {
    const LAW: Law = Law {
        name: "hydration_bell",
        family: "moisture",
        formula: "strength × (1 + amplitude [g(h) − g(35)]), g(h) = exp(−½ ((h − peak_au)/width_au)²), h the moisture in a.u.",
        kind: 1,
        place: Place::Strength,
        parameters: &[
            Parameter { name: "amplitude", unit: "", low: 0.0, high: 20.0, typical: 0.3, positive: false },
            Parameter { name: "peak_au", unit: "a.u.", low: 15.0, high: 95.0, typical: 55.0, positive: false },
            Parameter { name: "width_au", unit: "a.u.", low: 5.0, high: 60.0, typical: 15.0, positive: true },
        ],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Hydration],
        axes: &[],
        confused_with: &["temperature", "occlusion_growth", "stiffness_drift", "strength_drift"],
        source: "moist skin has at least twice the friction of dry skin: Derler & Gerhardt 2012; largest at intermediate moisture: Pasumarty et al. 2011, Tomlinson et al. 2011",
        shapes: &[
            &[25.0, 10.0],
            &[25.0, 18.0],
            &[25.0, 32.0],
            &[40.0, 10.0],
            &[40.0, 18.0],
            &[40.0, 32.0],
            &[55.0, 10.0],
            &[55.0, 18.0],
            &[55.0, 32.0],
            &[70.0, 10.0],
            &[70.0, 18.0],
            &[70.0, 32.0],
            &[85.0, 10.0],
            &[85.0, 18.0],
            &[85.0, 32.0],
        ],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[amplitude, peak_au, width_au, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        let bell = |h: T| {
            let z = (h - peak_au) / width_au;
            (T::of(-0.5) * (z * z)).exp()
        };
        change.strengthen(T::ONE + amplitude * (bell(at.hydration_au) - bell(T::of(35.0))));
    }
}
