//! Predictions of the identified law at loads that were not fitted: depths left out, and F/N over the normal force.

use super::{
    Evaluator, FeModel, FingerPoint, IdentifyError, LawPoint, Query, Steady, Table,
    bounded_least_squares::Stop,
    fe_friction::FeFriction,
    friction_fit::{Target, fit},
    outcome::{Curve, CurvePoint, LeftOut},
    settings::Prediction,
    surrogate::FrictionModel,
    table::line,
};
use fingerpad_fe::contact::RubberFriction;

/// Leaves out one depth after another: the law is fitted to the other rows on `surrogate`, then run by finite
/// elements.
///
/// # Errors
/// [`IdentifyError`] of a fit or a slide.
pub fn leave_one_out(
    table: &Table,
    target: &Target,
    best: &LawPoint,
    surrogate: &mut dyn FrictionModel,
    fe: &mut FeFriction,
) -> Result<Vec<LeftOut>, IdentifyError> {
    let mut out = Vec::new();
    for (slot, &depth_mm) in table.depths_mm.iter().enumerate() {
        let rows = table.without(slot);
        let distinct: std::collections::BTreeSet<_> = rows.iter().map(|&i| table.slot[i]).collect();
        if distinct.len() < 2 {
            continue;
        }
        let others = Target { free_tau0: false, ..target.only(&rows) };
        let stop = Stop { tolerance: 1e-9, evaluations: 200 };
        let (law, _) = fit("leave one out", surrogate, &others, best, &[], stop)?;
        let states = match fe.states(&law) {
            Ok(states) => Some(states),
            Err(error) if error.is_local() => None,
            Err(error) => return Err(error),
        };
        let points = |i: usize| [table.points[i].normal_force_n.ln(), table.points[i].friction_n().ln()];
        let logs: Vec<[f64; 2]> = rows.iter().map(|&i| points(i)).collect();
        let constant = logs.iter().map(|[n, f]| f - 2.0 / 3.0 * n).sum::<f64>() / logs.len() as f64;
        let power = line(&logs);
        for point in table.points.iter().zip(&table.slot).filter(|(_, of)| **of == slot).map(|(point, _)| point) {
            let n = point.normal_force_n;
            let measured = point.friction_coefficient;
            let predicted = [
                states.as_ref().map(|s| s[slot].friction_coefficient()),
                states.as_ref().map(|s| at_force(s, n)),
                Some((constant + 2.0 / 3.0 * n.ln()).exp() / n),
                power.map(|(slope, c)| (c + slope * n.ln()).exp() / n),
            ];
            out.push(LeftOut {
                depth_mm,
                normal_force_n: n,
                measured,
                law,
                predicted,
                differences_percent: predicted.map(|v| v.map(|v| 100.0 * (v / measured - 1.0))),
            });
        }
    }
    Ok(out)
}

/// F/N at a normal force, along straight lines between states in ln N and ln(F/N), continued beyond them.
pub fn at_force(states: &[Steady], normal_force_n: f64) -> f64 {
    let mut points: Vec<[f64; 2]> =
        states.iter().map(|s| [s.normal_force_n.ln(), s.friction_coefficient().ln()]).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let x = normal_force_n.ln();
    let upper = points.iter().position(|p| p[0] >= x).unwrap_or(points.len() - 1).clamp(1, points.len() - 1);
    let ([x0, y0], [x1, y1]) = (points[upper - 1], points[upper]);
    let slope = (y1 - y0) / (x1 - x0);
    f64::exp(y0 + slope * (x - x0))
}

/// Share of the pad's candidate height beyond which a slide may touch with faces that are not candidates.
const PAD_SHARE: f64 = 0.75;

/// F/N over the requested normal forces, as far as the finite elements converge.
///
/// # Errors
/// [`IdentifyError`] that is not of one slide.
pub fn curve(
    evaluator: &Evaluator,
    finger: &FingerPoint,
    law: &RubberFriction,
    wanted: &Prediction,
    fe_model: &mut FeModel,
    known: &[Steady],
) -> Result<Curve, IdentifyError> {
    /// Slots separate from the table's: one for rising, one for falling forces.
    const SLOT: [usize; 2] = [1_000, 1_001];
    let [least, most] = wanted.normal_force_n;
    let mut points: Vec<CurvePoint> = known.iter().map(CurvePoint::of).collect();
    let mut ends = vec![String::new(), String::new()];
    let middle = known.len() / 2;
    let ratio = (most / least).powf(1.0 / (wanted.points.max(2) - 1) as f64);
    for (side, slot) in SLOT.into_iter().enumerate() {
        // The next depth for the next force on the grid, from the local power of N over depth.
        let mut last = CurvePoint::of(&known[if side == 0 { 0 } else { known.len() - 1 }]);
        let near = CurvePoint::of(&known[middle.clamp(1, known.len() - 1) - usize::from(side == 1)]);
        let mut power = (last.normal_force_n / near.normal_force_n).ln() / (last.depth_mm / near.depth_mm).ln();
        loop {
            let reached = last.normal_force_n;
            if if side == 0 { reached <= least } else { reached >= most } {
                ends[side] = "as far as requested".into();
                break;
            }
            let factor = if side == 0 { (1.0 / ratio).max(least / reached) } else { ratio.min(most / reached) };
            if !(power > 0.5 && power < 8.0) {
                power = 2.0;
            }
            let depth_mm = last.depth_mm * factor.powf(1.0 / power);
            let deepest = PAD_SHARE * finger.shape.pad_height_mm;
            if depth_mm > deepest {
                ends[side] = format!("the pad's contact candidates end: depth {depth_mm:.2} mm of {deepest:.2} mm");
                break;
            }
            let query = Query { depth_mm, law: *law, stiffness: finger.stiffness };
            (evaluator.hooks.report_progress)("curve", &format!("depth {depth_mm:.3} mm"));
            match fe_model.steady(&[(slot, vec![query])]) {
                Ok(states) => {
                    let next = CurvePoint::of(&states[0][0]);
                    power = (next.normal_force_n / last.normal_force_n).ln() / (next.depth_mm / last.depth_mm).ln();
                    points.push(next);
                    last = next;
                }
                Err(error) if error.is_local() => {
                    ends[side] = format!("the finite elements found no steady slide: {error}");
                    break;
                }
                Err(error) => return Err(error),
            }
        }
    }
    points.sort_by(|a, b| a.normal_force_n.total_cmp(&b.normal_force_n));
    let local = |a: &CurvePoint, b: &CurvePoint| {
        (b.friction_coefficient / a.friction_coefficient).ln() / (b.normal_force_n / a.normal_force_n).ln()
    };
    let n = points.len();
    let exponents = [local(&points[0], &points[2.min(n - 1)]), local(&points[n.saturating_sub(3)], &points[n - 1])];
    let mut continued = Vec::new();
    for (end, exponent, to) in [(&points[0], exponents[0], least), (&points[n - 1], exponents[1], most)] {
        let beyond = if to == least { end.normal_force_n > 1.01 * to } else { end.normal_force_n < 0.99 * to };
        if beyond {
            continued.push([to, end.friction_coefficient * (to / end.normal_force_n).powf(exponent)]);
        }
    }
    Ok(Curve { points, exponents, continued, ends })
}

impl CurvePoint {
    /// A state as a point of the curve.
    pub fn of(state: &Steady) -> Self {
        Self {
            depth_mm: state.depth_mm,
            normal_force_n: state.normal_force_n,
            friction_coefficient: state.friction_coefficient(),
            contact_area_mm2: state.contact_area_mm2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_and_beyond_states_a_power_law_is_exact() {
        let states: Vec<Steady> = [0.1f64, 0.3, 0.9]
            .iter()
            .map(|&n| Steady { normal_force_n: n, friction_x_n: 1.1 * n.powf(0.6), ..Default::default() })
            .collect();
        for n in [0.05, 0.2, 0.5, 2.0] {
            assert!((at_force(&states, n) - 1.1 * n.powf(-0.4)).abs() < 1e-12, "{n}");
        }
    }
}
