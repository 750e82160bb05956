//! The paper's search run on finite elements, and the error surface that it walks on.

use super::{
    Hooks, IdentifyError, LawPoint, Region, Settings, Table,
    friction_fit::Target,
    on_rig::OnRig,
    outcome::Surface,
    settings::Simplex,
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
        let law = LawPoint::of(&law);
        match fe.coefficients(&law) {
            Ok(coefficients) => {
                let value = plain.sum_of_squares(&coefficients);
                (hooks.tell)(name, &told(count, &law, value));
                Ok(Ok(value))
            }
            Err(error) if error.is_local() => Ok(Err(error.to_string())),
            Err(error) => Err(error),
        }
    })
}

/// The best of `runs` continued in ln(strength at 5 kPa) and beta, where a tolerance means the same everywhere: how far
/// the paper's stop was from the minimum. None if no run is there or its end has no slide.
pub fn refined(
    name: &str,
    settings: &Settings,
    table: &Table,
    runs: &[simplex::SimplexRun],
    fe: &mut OnRig,
    hooks: &Hooks,
) -> Result<Option<simplex::SimplexRun>, IdentifyError> {
    let Some(best) = runs.iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares)) else { return Ok(None) };
    let base = fe.base;
    let law = |x: [f64; 2]| LawPoint { tau_ref_kpa: x[0].exp(), beta: x[1], tau0_share: 0.0 };
    let [lambda, beta] = best.end;
    let start = LawPoint::of(&RubberFriction { lambda, beta, ..base });
    let plain = Target::of(table, None, settings.region, false);
    let tight = Simplex { tolx: REFINED, tolf: REFINED, first_side: 0.1, ..settings.simplex.clone() };
    let mut count = 0;
    let run = simplex::search(&tight, [start.tau_ref_kpa.ln(), beta], &mut |x| {
        let law = law(x);
        if let Some(reason) = settings.region.leaves(&law.friction(&base)) {
            return Ok(Err(reason));
        }
        count += 1;
        match fe.coefficients(&law) {
            Ok(coefficients) => {
                let value = plain.sum_of_squares(&coefficients);
                (hooks.tell)(name, &told(count, &law, value));
                Ok(Ok(value))
            }
            Err(error) if error.is_local() => Ok(Err(error.to_string())),
            Err(error) => Err(error),
        }
    })?;
    let pair = |x: [f64; 2]| [law(x).lambda(), x[1]];
    let mut run = run;
    for visit in &mut run.visits {
        [visit.lambda, visit.beta] = pair([visit.lambda, visit.beta]);
    }
    run.path.iter_mut().for_each(|x| *x = pair(*x));
    (run.start, run.end) = (pair(run.start), pair(run.end));
    Ok(Some(run))
}

/// Tolerances of the continued search: ln strength, beta, sum of squares.
const REFINED: f64 = 1e-6;

fn told(count: i32, law: &LawPoint, value: f64) -> String {
    let (strength, beta) = (law.tau_ref_kpa, law.beta);
    format!("{count} evaluations, strength {strength:.4} kPa, beta {beta:.4}, sum of squares {value:.3e}")
}

/// Difference of a simplex run from the fast route: relative in strength at 5 kPa, absolute in beta.
pub fn routes_differ(run: &simplex::SimplexRun, law: &LawPoint) -> [f64; 2] {
    let [lambda, beta] = run.end;
    let end = LawPoint::of(&RubberFriction { lambda, beta, ..Default::default() });
    [end.tau_ref_kpa / law.tau_ref_kpa - 1.0, end.beta - law.beta]
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
