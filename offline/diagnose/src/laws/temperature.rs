//! Friction over skin temperature: strength × (1 + a (T − 32 °C)).

use super::{Change, Column, Law, Parameter, Place, Row, as_fitted};

/// The law.
pub static LAW: Law = Law {
    name: "temperature",
    family: "temperature",
    kind: 17,
    place: Place::Strength,
    parameters: &[Parameter { name: "slope_per_c", unit: "1/°C", low: -0.3, high: 0.3, typical: 0.03 }],
    linear: 1,
    drivers: &[Column::Temperature],
    confused_with: &["hydration_bell", "stiffness_drift", "occlusion_growth"],
    source: "a few per cent per degree, through sweat and the keratin's compliance, are assumed; no size for a fingertip was found published",
    shapes: &[&[]],
    apply,
    report: as_fitted,
};

fn apply(p: &[f64], row: &Row, change: &mut Change) {
    change.strengthen(1.0 + p[0] * (row.temperature_c - 32.0));
}
