//! The paper's search run on finite elements, and the error surface that it walks on.

use super::{
    Hooks, IdentifyError, LawPoint, Region, Settings, Table,
    friction_fit::Target,
    on_rig::OnRig,
    outcome::Surface,
    simplex,
    surrogate::{Aligned, Friction},
};
use crate::contact::RubberFriction;

/// The paper's procedure from one start.
pub fn search(
    name: &str,
    settings: &Settings,
    table: &Table,
    base: &RubberFriction,
    start: [f64; 2],
    fe: &mut OnRig,
    hooks: &Hooks,
) -> Result<simplex::SimplexRun, IdentifyError> {
    let plain = Target::of(table, None, settings.region, false);
    let mut count = 0;
    simplex::search(&settings.simplex, start, &mut |[lambda, beta]| {
        let law = RubberFriction { lambda, beta, ..*base };
        if let Some(reason) = settings.region.leaves(&law) {
            return Ok(Err(reason));
        }
        count += 1;
        match fe.coefficients(&LawPoint::of(&law)) {
            Ok(coefficients) => {
                let value = plain.sum_of_squares(&coefficients);
                (hooks.tell)(name, &format!("{count} evaluations, sum of squares {value:.3e}"));
                Ok(Ok(value))
            }
            Err(error) if error.is_local() => Ok(Err(error.to_string())),
            Err(error) => Err(error),
        }
    })
}

/// Difference of the best simplex run from the fast route: relative in strength at 5 kPa, absolute in beta.
pub fn routes_differ(runs: &[simplex::SimplexRun], law: &LawPoint) -> Option<[f64; 2]> {
    let best = runs.iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    let [lambda, beta] = best.end;
    let end = LawPoint::of(&RubberFriction { lambda, beta, ..Default::default() });
    Some([end.tau_ref_kpa / law.tau_ref_kpa - 1.0, end.beta - law.beta])
}

/// The sum of squares around the searches' paths.
pub fn surface(table: &Table, runs: &[simplex::SimplexRun], law: &LawPoint, aligned: &mut Aligned) -> Surface {
    let plain = Target::of(table, None, Region::default(), false);
    let visited = runs.iter().flat_map(|r| r.visits.iter().filter(|v| v.turned_back.is_none()));
    let mut points: Vec<[f64; 2]> = visited.map(|v| [v.lambda.ln(), v.beta]).collect();
    points.extend([[law.lambda().ln(), law.beta], [0.086f64.ln(), 0.46]]);
    let along = |k: usize, margin: f64| -> Vec<f64> {
        let low = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - margin;
        let high = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + margin;
        (0..81).map(|i| low + (high - low) * f64::from(i) / 80.0).collect()
    };
    let (ln_lambda, betas) = (along(0, 0.6), along(1, 0.15));
    let value = |l: f64, beta: f64, aligned: &mut Aligned| {
        let law = LawPoint::of(&RubberFriction { lambda: l.exp(), beta, ..Default::default() });
        aligned.coefficients(&law).map_or(f64::NAN, |c| plain.sum_of_squares(&c))
    };
    let sum_of_squares = betas.iter().map(|&b| ln_lambda.iter().map(|&l| value(l, b, aligned)).collect()).collect();
    Surface { ln_lambda, beta: betas, sum_of_squares }
}
