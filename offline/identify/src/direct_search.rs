//! Searches without derivatives on finite elements: the downhill simplex of Yoshida et al. 2011 and its continuation.

use std::{collections::BTreeMap, sync::Mutex};

use super::{
    FeModel, Hooks, IdentifyError, LawPoint, Region, Settings, Table,
    fe_friction::FeFriction,
    friction_fit::Target,
    outcome::Surface,
    settings::Simplex,
    simplex,
    surrogate::{AlignedSurrogate, FrictionModel},
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_formats::in_threads;

/// The paper's procedure from every start of the settings, side by side.
///
/// * `fe_models`: fingers like that of `fe`, one for each start
///
/// # Errors
/// The first [`IdentifyError`] of a start.
pub fn searches(
    settings: &Settings,
    table: &Table,
    fe: &FeFriction,
    fe_models: &mut [FeModel<'_>],
    hooks: &Hooks,
) -> Result<Vec<simplex::SimplexRun>, IdentifyError> {
    let progress = Mutex::new(BTreeMap::new());
    let report = |start: usize, text: &str| {
        let mut lines = progress.lock().expect("no panic while locked");
        lines.insert(start, text.to_owned());
        let all: Vec<&str> = lines.values().map(String::as_str).collect();
        (hooks.report_progress)("simplex", &all.join(" | "));
    };
    let mut fingers: Vec<FeFriction> = fe_models.iter_mut().map(|fe_model| fe.beside(fe_model)).collect();
    let starts = settings.simplex.starts.iter().zip(&mut fingers).enumerate();
    in_threads(starts, settings.simplex.starts.len(), |(k, (start, fe))| {
        paper(settings, table, *start, fe, &|text| report(k, text))
    })
}

/// The paper's procedure from one start.
fn paper(
    settings: &Settings,
    table: &Table,
    start: [f64; 2],
    fe: &mut FeFriction,
    report: &dyn Fn(&str),
) -> Result<simplex::SimplexRun, IdentifyError> {
    let plain = Target::of(table, None, settings.region, false);
    let base = fe.base;
    let mut count = 0;
    simplex::search(&settings.simplex, start, &mut |[lambda, beta]| {
        let law = RubberFriction { lambda, beta, ..base };
        if let Some(reason) = settings.region.leaves(&law) {
            return Ok(Err(reason));
        }
        count += 1;
        let law = LawPoint::of(&law);
        let found = turned_back(fe.coefficients(&law).map(|c| plain.sum_of_squares(&c)))?;
        if let Ok(value) = found {
            report(&format!("{count}: beta {beta:.4}, {value:.3e}"));
        }
        Ok(found)
    })
}

/// A search from `start` in ln(strength at 5 kPa) and beta, where a tolerance means the same everywhere. It runs on a
/// finger of its own, so that the states of `fe` are unchanged.
///
/// # Errors
/// [`IdentifyError`] that is not local to a law, or [`IdentifyError::Fit`] if there is no slide at the start.
pub fn continued(
    name: &str,
    settings: &Settings,
    target: &Target,
    start: &LawPoint,
    fe: &FeFriction,
    hooks: &Hooks,
) -> Result<simplex::SimplexRun, IdentifyError> {
    let mut fe_model = fe.fe_model.beside();
    let mut fe = fe.beside(&mut fe_model);
    let base = fe.base;
    let law = |x: [f64; 2]| LawPoint { tau_ref_kpa: x[0].exp(), beta: x[1], ..*start };
    let tight = Simplex { tolx: CONTINUED, tolf: CONTINUED, first_side: FIRST_SIDE, ..settings.simplex.clone() };
    let mut count = 0;
    let run = simplex::search(&tight, [start.tau_ref_kpa.ln(), start.beta], &mut |x| {
        let law = law(x);
        if let Some(reason) = target.region.leaves(&law.friction(&base)) {
            return Ok(Err(reason));
        }
        count += 1;
        let found = turned_back(fe.coefficients(&law).map(|c| target.sum_of_squares(&c)))?;
        if let Ok(value) = found {
            let (strength, beta) = (law.tau_ref_kpa, law.beta);
            let text = format!("{count} evaluations, strength {strength:.4} kPa, beta {beta:.4}, {value:.3e}");
            (hooks.report_progress)(name, &text);
        }
        Ok(found)
    })?;
    let pair = |x: [f64; 2]| [law(x).lambda(), x[1]];
    let mut run = run;
    for visit in &mut run.visits {
        [visit.lambda, visit.beta] = pair([visit.lambda, visit.beta]);
    }
    run.path.iter_mut().for_each(|x| *x = pair(*x));
    (run.start, run.end) = (pair(run.start), pair(run.end));
    Ok(run)
}

/// Law at the end of the best of `runs`.
pub fn best(runs: &[simplex::SimplexRun]) -> Option<LawPoint> {
    let best = runs.iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    Some(end(best))
}

/// Law at the end of a run.
pub fn end(run: &simplex::SimplexRun) -> LawPoint {
    let [lambda, beta] = run.end;
    LawPoint::of(&RubberFriction { lambda, beta, tau0_mpa: 0.0, ..Default::default() })
}

/// A law at which no slide was found is one that the search is turned back from.
fn turned_back(found: Result<f64, IdentifyError>) -> Result<Result<f64, String>, IdentifyError> {
    match found {
        Ok(value) => Ok(Ok(value)),
        Err(error) if error.is_local() => Ok(Err(error.to_string())),
        Err(error) => Err(error),
    }
}

/// Tolerances of a continued search: ln strength, beta, sum of squares.
const CONTINUED: f64 = 1e-6;
/// Side of its first simplex, as a share of the start's values: more than the kinks of a mesh are wide.
const FIRST_SIDE: f64 = 0.02;

/// Difference of a simplex run from the fast route: relative in strength at 5 kPa, absolute in beta.
pub fn routes_differ(run: &simplex::SimplexRun, law: &LawPoint) -> [f64; 2] {
    let end = end(run);
    [end.tau_ref_kpa / law.tau_ref_kpa - 1.0, end.beta - law.beta]
}

/// The sum of squares around the searches' paths.
pub fn surface(table: &Table, runs: &[simplex::SimplexRun], law: &LawPoint, aligned: &mut AlignedSurrogate) -> Surface {
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
    let value = |l: f64, beta: f64, aligned: &mut AlignedSurrogate| {
        let law = LawPoint::of(&RubberFriction { lambda: l.exp(), beta, ..Default::default() });
        aligned.coefficients(&law).map_or(f64::NAN, |c| plain.sum_of_squares(&c))
    };
    let sum_of_squares = betas.iter().map(|&b| ln_lambda.iter().map(|&l| value(l, b, aligned)).collect()).collect();
    Surface { ln_lambda, beta: betas, sum_of_squares }
}
