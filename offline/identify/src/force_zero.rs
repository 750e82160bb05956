//! The exponent against the zero of the normal force: the effect on beta of a sensor that does not read zero in the
//! air.

use fingerpad_fe::Rounded;

use super::{
    Evaluator, FeModel, FingerPoint, IdentifyError, LawPoint, Point, Steady, Table,
    calibrate::calibrate,
    fe_friction::FeFriction,
    friction_fit::{Target, space_mapping},
    outcome::{ForceZeroOutcome, ForceZeroPoint},
};

/// Zeros that are tried, as shares of the table's least normal force.
const SHARES: [f64; 7] = [-0.75, -0.6, -0.45, -0.3, -0.15, 0.0, 0.15];

/// The table without a zero of the normal force: load less the zero, friction as it was.
///
/// # Errors
/// [`IdentifyError::Table`] if the zero exceeds a load.
pub fn without_zero(table: &Table, normal_force_offset_n: f64) -> Result<Table, IdentifyError> {
    let take = |p: &Point| {
        let normal_force_n = p.normal_force_n - normal_force_offset_n;
        Point { normal_force_n, friction_coefficient: p.friction_n() / normal_force_n, ..*p }
    };
    match table.points.iter().find(|p| !(p.normal_force_n > normal_force_offset_n)) {
        Some(p) => Err(IdentifyError::Table(format!(
            "a zero of {} N leaves nothing of the normal force {} N at {} mm",
            Rounded(normal_force_offset_n),
            Rounded(p.normal_force_n),
            Rounded(p.depth_mm)
        ))),
        None => Ok(Table { points: table.points.iter().map(take).collect(), ..table.clone() }),
    }
}

/// Calibrates the finger and fits the law to the table without each of several zeros.
///
/// A zero at which no fit is found is left out.
///
/// # Errors
/// [`IdentifyError`] that is not of one slide.
pub fn against_force_zero(
    evaluator: &Evaluator,
    fe_model: &mut FeModel,
    table: &Table,
    given: &FingerPoint,
) -> Result<ForceZeroOutcome, IdentifyError> {
    let least = table.points.iter().map(|p| p.normal_force_n).fold(f64::INFINITY, f64::min);
    let mut points = Vec::new();
    for share in SHARES {
        let zero_n = share * least;
        (evaluator.hooks.report_progress)("force zero", &format!("{:+.1} mN", 1e3 * zero_n));
        match at_zero(evaluator, fe_model, table, given, zero_n) {
            Ok(point) => points.push(point),
            Err(error) if error.is_local() => {}
            Err(error) => return Err(error),
        }
    }
    let sentence = sentence(&points);
    Ok(ForceZeroOutcome { points, sentence })
}

fn at_zero(
    evaluator: &Evaluator,
    fe_model: &mut FeModel,
    table: &Table,
    given: &FingerPoint,
    zero_n: f64,
) -> Result<ForceZeroPoint, IdentifyError> {
    let (settings, base) = (evaluator.settings, evaluator.config.friction);
    let corrected = without_zero(table, zero_n)?;
    let first = corrected.mean_field(&settings.region, &base).unwrap_or(LawPoint::of(&base));
    let finger = if settings.calibration.enabled && !settings.calibration.vary.is_empty() {
        calibrate(evaluator, fe_model, &corrected, given, &first)?.finger
    } else {
        given.clone()
    };
    let depths_mm = corrected.depths_mm.iter().map(|d| d + finger.depth_offset_mm).collect();
    // A shape that the calibration changed is a finger of its own.
    let (found, states) = if finger.shape == given.shape {
        fit_law(evaluator, fe_model, &corrected, &finger, depths_mm, &first)?
    } else {
        let made = evaluator.finger(&finger.shape, evaluator.deepest_mm(&table.depths_mm))?;
        let problem = evaluator.config.problem(&made);
        let mut model = FeModel::new(evaluator, &finger.shape, &problem);
        fit_law(evaluator, &mut model, &corrected, &finger, depths_mm, &first)?
    };
    let friction = found.friction(&base);
    Ok(ForceZeroPoint {
        normal_force_offset_n: zero_n,
        stiffness: finger.stiffness,
        depth_offset_mm: finger.depth_offset_mm,
        tau_ref_kpa: found.tau_ref_kpa,
        lambda: friction.lambda,
        beta: found.beta,
        rms_percent: rms_percent(table, zero_n, &states),
    })
}

fn fit_law(
    evaluator: &Evaluator,
    fe_model: &mut FeModel,
    table: &Table,
    finger: &FingerPoint,
    depths_mm: Vec<f64>,
    first: &LawPoint,
) -> Result<(LawPoint, Vec<Steady>), IdentifyError> {
    let (settings, base) = (evaluator.settings, evaluator.config.friction);
    let target = Target::of(table, settings.friction_coefficient_percent, settings.region, false);
    let mut fe = FeFriction { fe_model, depths_mm, stiffness: finger.stiffness, base, evaluations: 0 };
    let fast = &settings.fast;
    let mut states = |law: &LawPoint| fe.states(law);
    let (path, found) = space_mapping(&mut states, base, &target, first, fast.tolerance, fast.max_mappings)?;
    Ok((path.last().expect("at least the start").law, found))
}

/// Root mean square difference of all numbers of the table, as it was read, %.
fn rms_percent(table: &Table, zero_n: f64, states: &[Steady]) -> f64 {
    let mut differences = Vec::new();
    for (point, &slot) in table.points.iter().zip(&table.slot) {
        let state = &states[slot];
        let reading_n = state.normal_force_n + zero_n;
        differences.push(reading_n / point.normal_force_n - 1.0);
        if point.friction_coefficient > 0.0 {
            differences.push(state.friction_x_n / reading_n / point.friction_coefficient - 1.0);
        }
        differences.extend(point.contact_area_mm2.map(|area| state.contact_area_mm2 / area - 1.0));
    }
    100.0 * (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt()
}

fn sentence(points: &[ForceZeroPoint]) -> String {
    let best = points.iter().min_by(|a, b| a.rms_percent.total_cmp(&b.rms_percent));
    let none = points.iter().find(|p| p.normal_force_offset_n == 0.0);
    match (best, none) {
        (Some(best), Some(none)) => format!(
            "beta is {:.2} if the normal force was read from a right zero (all numbers of the table then err by {:.1} %), and \
             {:.2} if the sensor read {:+.0} mN without load, which fits best of the zeros tried ({:.1} %): an exponent from a \
             table without unloaded readings is an exponent and a zero.",
            none.beta,
            none.rms_percent,
            best.beta,
            1e3 * best.normal_force_offset_n,
            best.rms_percent
        ),
        _ => "No law was found without a zero of the normal force.".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::table_1;
    use super::*;

    #[test]
    fn a_zero_moves_load_and_keeps_friction() {
        let table = table_1();
        let corrected = without_zero(&table, -0.054).unwrap();
        for (a, b) in table.points.iter().zip(&corrected.points) {
            assert!((b.normal_force_n - a.normal_force_n - 0.054).abs() < 1e-12);
            assert!((b.friction_n() - a.friction_n()).abs() < 1e-12);
        }
        let message = without_zero(&table, 0.15).unwrap_err().to_string();
        assert!(message.contains("0.12 N at 0.75 mm"), "{message}");
    }

    #[test]
    fn the_difference_is_of_what_was_read() {
        let table = table_1();
        let state = |p: &Point| Steady {
            normal_force_n: p.normal_force_n + 0.05,
            friction_x_n: p.friction_n(),
            contact_area_mm2: p.contact_area_mm2.unwrap(),
            ..Steady::default()
        };
        let states: Vec<Steady> = table.points.iter().map(state).collect();
        assert!(rms_percent(&table, -0.05, &states) < 1e-9);
        assert!(rms_percent(&table, 0.0, &states) > 10.0);
    }
}
