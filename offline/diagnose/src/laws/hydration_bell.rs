//! Friction over moisture of the skin: strength × (1 + a [g(h) − g(35)]), g(h) = exp(−½ ((h − peak)/width)²).

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "hydration_bell",
    family: "moisture",
    kind: 1,
    place: Place::Strength,
    parameters: &[
        Parameter { name: "amplitude", unit: "", low: 0.0, high: 20.0, typical: 0.3 },
        Parameter { name: "peak_au", unit: "a.u.", low: 15.0, high: 95.0, typical: 55.0 },
        Parameter { name: "width_au", unit: "a.u.", low: 5.0, high: 60.0, typical: 15.0 },
    ],
    linear: 1,
    drivers: &[Column::Hydration],
    confused_with: &["temperature", "occlusion_growth", "stiffness_drift"],
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
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    let bell = |h: f64| (-0.5 * ((h - p[1]) / p[2]).powi(2)).exp();
    change.strengthen(1.0 + p[0] * (bell(row.hydration_au) - bell(35.0)));
}
