//! The paper's search: downhill simplex [Nelder & Mead 1965] on (lambda, beta), with the first simplex and the stop of MATLAB's
//! `fminsearch`: the simplex' diameter and the spread of its values at once.

use serde::{Deserialize, Serialize};

use super::{IdentifyError, settings::Simplex};

/// One evaluation of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// beta.
    pub beta: f64,
    /// Sum of squared differences of the friction coefficients; none if it was turned back.
    pub sum_of_squares: Option<f64>,
    /// Why it was turned back.
    pub turned_back: Option<String>,
}

/// A search from one start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimplexRun {
    /// lambda and beta of the start.
    pub start: [f64; 2],
    /// lambda and beta of the best vertex at the stop.
    pub end: [f64; 2],
    /// Sum of squares there.
    pub sum_of_squares: f64,
    /// Evaluations in their order.
    pub visits: Vec<Visit>,
    /// Best vertex after every iteration: lambda, beta.
    pub path: Vec<[f64; 2]>,
    /// Evaluations that were turned back.
    pub turned_back: usize,
    /// Why it stopped.
    pub stopped: String,
}

/// Sum of squares at (lambda, beta), or the reason why the search is turned back from there.
pub type Objective<'a> = dyn FnMut([f64; 2]) -> Result<Result<f64, String>, IdentifyError> + 'a;

/// A vertex and its sum of squares: infinite if the search is turned back from there, so that the simplex contracts away.
type Vertex = ([f64; 2], f64);

/// The point at `share` of the way from one point to another, or beyond.
fn between(from: [f64; 2], to: [f64; 2], share: f64) -> [f64; 2] {
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share)
}

/// Largest distance of a vertex from the best, per coordinate, and of its value.
fn extent([(best, least), rest @ ..]: &[Vertex; 3]) -> (f64, f64) {
    rest.iter().fold((0.0, 0.0), |(diameter, spread), (x, value)| {
        let distance = (0..2).map(|k| (x[k] - best[k]).abs()).fold(diameter, f64::max);
        (distance, f64::max(spread, (value - least).abs()))
    })
}

/// Searches from `start` for the least of `value`.
///
/// `value` gives the sum of squares, or why the search is turned back from there.
///
/// # Errors
/// The first error of `value`, or [`IdentifyError::Fit`] if the start itself is turned back.
pub fn search(settings: &Simplex, start: [f64; 2], value: &mut Objective) -> Result<SimplexRun, IdentifyError> {
    let mut visits = Vec::new();
    let mut evaluate = |x: [f64; 2], visits: &mut Vec<Visit>| -> Result<Vertex, IdentifyError> {
        let found = value(x)?;
        let sum_of_squares = found.as_ref().ok().copied();
        visits.push(Visit { lambda: x[0], beta: x[1], sum_of_squares, turned_back: found.err() });
        Ok((x, sum_of_squares.unwrap_or(f64::INFINITY)))
    };
    let mut simplex = [(start, f64::INFINITY); 3];
    for (k, vertex) in simplex.iter_mut().enumerate() {
        if let Some(side) = k.checked_sub(1) {
            // MATLAB's first step where a coordinate is zero.
            vertex.0[side] += if start[side] == 0.0 { 0.00025 } else { settings.first_side * start[side] };
        }
        *vertex = evaluate(vertex.0, &mut visits)?;
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut path = vec![start];
    let stopped = loop {
        let (diameter, spread) = extent(&simplex);
        if diameter <= settings.tolx && spread <= settings.tolf {
            break format!("diameter <= {:e} and spread <= {:e}", settings.tolx, settings.tolf);
        }
        if visits.len() >= settings.max_evaluations {
            break "largest number of evaluations".to_owned();
        }
        let [best, second, worst] = simplex;
        let centre = [0, 1].map(|k| (best.0[k] + second.0[k]) * 0.5);
        let reflected = evaluate(between(centre, worst.0, -1.0), &mut visits)?;
        let replaced = if reflected.1 < best.1 {
            let expanded = evaluate(between(centre, reflected.0, 2.0), &mut visits)?;
            Some(if expanded.1 < reflected.1 { expanded } else { reflected })
        } else if reflected.1 < second.1 {
            Some(reflected)
        } else if reflected.1 < worst.1 {
            let outside = evaluate(between(centre, reflected.0, 0.5), &mut visits)?;
            Some(outside).filter(|outside| outside.1 <= reflected.1)
        } else {
            let inside = evaluate(between(centre, worst.0, 0.5), &mut visits)?;
            Some(inside).filter(|inside| inside.1 < worst.1)
        };
        match replaced {
            Some(vertex) => simplex[2] = vertex,
            None => {
                for vertex in &mut simplex[1..] {
                    *vertex = evaluate(between(best.0, vertex.0, 0.5), &mut visits)?;
                }
            }
        }
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        path.push(simplex[0].0);
    };
    let (end, sum_of_squares) = simplex[0];
    if !sum_of_squares.is_finite() {
        let reasons = visits.iter().find_map(|v| v.turned_back.clone()).unwrap_or_default();
        return Err(IdentifyError::Fit {
            what: format!("simplex from lambda {}, beta {}", start[0], start[1]),
            problem: format!("every vertex was turned back ({reasons})"),
            evaluations: visits.len(),
            residual: f64::NAN,
        });
    }
    let turned_back = visits.iter().filter(|v| v.turned_back.is_some()).count();
    Ok(SimplexRun { start, end, sum_of_squares, turned_back, visits, path, stopped })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_a_minimum_and_stops_where_both_tolerances_hold() {
        let value = |x: [f64; 2]| (x[0] - 0.3).powi(2) + 4.0 * (x[1] - 0.5).powi(2);
        for (tolerance, error) in [(1e-3, 3e-3), (1e-8, 1e-7)] {
            let settings = Simplex { tolx: tolerance, tolf: tolerance, ..Simplex::default() };
            let run = search(&settings, [0.086, 0.46], &mut |x| Ok(Ok(value(x)))).unwrap();
            assert!((run.end[0] - 0.3).abs() < error && (run.end[1] - 0.5).abs() < error, "{run:?}");
            assert_eq!(run.turned_back, 0);
            assert!(run.stopped.contains("diameter"));
        }
    }

    #[test]
    fn it_is_turned_back_from_where_it_may_not_go_and_says_so() {
        let settings = Simplex { tolx: 1e-6, tolf: 1e-6, ..Simplex::default() };
        let mut value = |x: [f64; 2]| {
            Ok(if x[0] > 0.2 {
                Err(format!("lambda {} is too large", x[0]))
            } else {
                Ok((x[0] - 0.3).powi(2) + x[1].powi(2))
            })
        };
        let run = search(&settings, [0.086, 0.46], &mut value).unwrap();
        assert!(run.turned_back > 0 && run.end[0] <= 0.2 && run.end[0] > 0.19, "{run:?}");
        assert!(run.visits.iter().any(|v| v.turned_back.as_deref().is_some_and(|r| r.contains("too large"))));
    }

    #[test]
    fn a_failure_ends_it() {
        let result = search(&Simplex::default(), [0.086, 0.46], &mut |_| Err(IdentifyError::Interrupted));
        assert!(matches!(result, Err(IdentifyError::Interrupted)));
        let result = search(&Simplex::default(), [0.086, 0.46], &mut |_| Ok(Err("no".into())));
        assert!(result.unwrap_err().to_string().contains("every vertex"));
    }
}
