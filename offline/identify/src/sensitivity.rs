//! Sensitivity of normal force N, contact area A and F/N to every input.

use super::{
    CalibrationParameter, Evaluator, FingerPoint, IdentifyError, LawPoint, Query, Steady, Table, outcome::Sensitivity,
};
use fingerpad_fe::contact::RubberFriction;

/// Changes every input by itself, less and more, at the first and the last depth of the table.
///
/// # Errors
/// [`IdentifyError`] that is not of one slide or one shape.
pub fn sensitivities(
    evaluator: &Evaluator,
    table: &Table,
    finger: &FingerPoint,
    law: &LawPoint,
    base: &RubberFriction,
) -> Result<Vec<Sensitivity>, IdentifyError> {
    let slots = [0, table.depths_mm.len() - 1];
    let run = |finger: &FingerPoint, law: &LawPoint| -> Result<Option<Vec<Steady>>, IdentifyError> {
        let query = |slot: usize| Query {
            depth_mm: table.depths_mm[slot] + finger.depth_offset_mm,
            law: law.friction(base),
            stiffness: finger.stiffness,
        };
        let queries: Vec<_> = slots.iter().map(|&slot| (slot, vec![query(slot)])).collect();
        match evaluator.on_shape(&finger.shape, &queries) {
            Ok(states) => Ok(Some(states.into_iter().flatten().collect())),
            Err(error) if error.is_local() => Ok(None),
            Err(error) => Err(error),
        }
    };
    let Some(reference) = run(finger, law)? else { return Ok(Vec::new()) };
    let mut out = Vec::new();
    let mut add = |input: &str, unit: &str, change: [f64; 2], states: [Option<Vec<Steady>>; 2]| {
        for (k, &slot) in slots.iter().enumerate() {
            let of = |pick: fn(&Steady) -> f64| {
                [0, 1].map(|side| states[side].as_ref().map(|s| 100.0 * (pick(&s[k]) / pick(&reference[k]) - 1.0)))
            };
            out.push(Sensitivity {
                input: input.into(),
                unit: unit.into(),
                change,
                depth_mm: table.depths_mm[slot],
                normal_force_percent: of(|s| s.normal_force_n),
                contact_area_percent: of(|s| s.contact_area_mm2),
                friction_coefficient_percent: of(Steady::friction_coefficient),
            });
        }
    };
    let law_at = |x: [f64; 2]| law.at(&x);
    let x = law.coordinates(false);
    let strength = [0.9f64, 1.1].map(|f| law_at([x[0] + f.ln(), x[1]]));
    add("strength at 5 kPa", "%", [-10.0, 10.0], [run(finger, &strength[0])?, run(finger, &strength[1])?]);
    let exponent = [-0.1, 0.1].map(|d| law_at([x[0], x[1] + d]));
    add("beta", "", [-0.1, 0.1], [run(finger, &exponent[0])?, run(finger, &exponent[1])?]);
    let parameters = [CalibrationParameter::Stiffness, CalibrationParameter::DepthOffsetMm]
        .into_iter()
        .chain(CalibrationParameter::SHAPE);
    for kind in parameters {
        (evaluator.hooks.report_progress)("sensitivities", kind.words());
        let value = finger.get(kind);
        let relative = kind == CalibrationParameter::Stiffness;
        let step = if relative { value * kind.spread() } else { kind.spread() };
        let side = |sign: f64| {
            let moved = finger.with(kind, value + sign * step);
            if moved.shape.validate().is_err() { Ok(None) } else { run(&moved, law) }
        };
        let change = if relative { 100.0 * kind.spread() } else { kind.spread() };
        let unit = if relative { "%" } else { kind.unit() };
        let states = [side(-1.0)?, side(1.0)?];
        add(kind.words(), unit, [-change, change], states);
    }
    Ok(out)
}
