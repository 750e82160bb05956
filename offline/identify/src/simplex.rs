//! The paper's search: downhill simplex (crate `argmin`) on (lambda, beta), stopped by the simplex' diameter and
//! the spread of its values.

use std::cell::RefCell;

use argmin::{
    core::{
        CostFunction, Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
    },
    solver::neldermead::NelderMead,
};
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

type Vertex = Vec<f64>;
type IterationState = IterState<Vertex, (), (), (), (), f64>;

/// The sum of squares; infinite if the search is turned back, so that the simplex contracts away from there.
struct Cost<'a> {
    value: RefCell<&'a mut Objective<'a>>,
    visits: &'a RefCell<Vec<Visit>>,
    failure: &'a RefCell<Option<IdentifyError>>,
}

impl CostFunction for Cost<'_> {
    type Param = Vertex;
    type Output = f64;

    fn cost(&self, x: &Vertex) -> Result<f64, Error> {
        if self.failure.borrow().is_some() {
            return Ok(f64::INFINITY);
        }
        let (sum_of_squares, turned_back) = match (self.value.borrow_mut())([x[0], x[1]]) {
            Ok(Ok(value)) => (Some(value), None),
            Ok(Err(reason)) => (None, Some(reason)),
            Err(error) => {
                *self.failure.borrow_mut() = Some(error);
                return Ok(f64::INFINITY);
            }
        };
        self.visits.borrow_mut().push(Visit { lambda: x[0], beta: x[1], sum_of_squares, turned_back });
        Ok(sum_of_squares.unwrap_or(f64::INFINITY))
    }
}

/// `argmin`'s simplex with the stop of MATLAB's `fminsearch`: both tolerances at once.
struct Stopped<'a> {
    simplex: NelderMead<Vertex, f64>,
    settings: &'a Simplex,
    visits: &'a RefCell<Vec<Visit>>,
    failure: &'a RefCell<Option<IdentifyError>>,
    path: &'a RefCell<Vec<[f64; 2]>>,
}

/// The vertices of `NelderMead`, which are private to it but can be read through its serialisation.
#[derive(Deserialize)]
struct Vertices {
    params: Vec<(Vertex, Option<f64>)>,
}

impl Stopped<'_> {
    /// Largest distance of a vertex from the best, per coordinate, and of its value.
    fn extent(&self) -> (f64, f64) {
        let text = serde_json::to_value(&self.simplex).expect("numbers");
        let Vertices { params } = serde_json::from_value(text).expect("the simplex' vertices");
        let Some(((best, best_value), rest)) = params.split_first() else { return (0.0, 0.0) };
        let best_value = best_value.unwrap_or(f64::INFINITY);
        rest.iter().fold((0.0, 0.0), |(diameter, spread), (x, value)| {
            let distance = x.iter().zip(best).map(|(a, b)| (a - b).abs()).fold(diameter, f64::max);
            (distance, f64::max(spread, (value.unwrap_or(f64::INFINITY) - best_value).abs()))
        })
    }
}

impl<'a> Solver<Cost<'a>, IterationState> for Stopped<'a> {
    fn name(&self) -> &str {
        "downhill simplex"
    }

    fn init(&mut self, p: &mut Problem<Cost<'a>>, s: IterationState) -> Result<(IterationState, Option<KV>), Error> {
        self.simplex.init(p, s)
    }

    fn next_iter(
        &mut self,
        p: &mut Problem<Cost<'a>>,
        s: IterationState,
    ) -> Result<(IterationState, Option<KV>), Error> {
        let (state, kv) = self.simplex.next_iter(p, s)?;
        if let Some(best) = state.get_param() {
            self.path.borrow_mut().push([best[0], best[1]]);
        }
        Ok((state, kv))
    }

    fn terminate(&mut self, _: &IterationState) -> TerminationStatus {
        if self.failure.borrow().is_some() {
            return TerminationStatus::Terminated(TerminationReason::SolverExit("failure".into()));
        }
        let (diameter, spread) = self.extent();
        if diameter <= self.settings.tolx && spread <= self.settings.tolf {
            return TerminationStatus::Terminated(TerminationReason::SolverConverged);
        }
        if self.visits.borrow().len() >= self.settings.max_evaluations {
            return TerminationStatus::Terminated(TerminationReason::MaxItersReached);
        }
        TerminationStatus::NotTerminated
    }
}

/// Searches from `start` for the least of `value`.
///
/// `value` gives the sum of squares, or why the search is turned back from there.
///
/// # Errors
/// The first error of `value`, or [`IdentifyError::Fit`] if the start itself is turned back.
pub fn search(settings: &Simplex, start: [f64; 2], value: &mut Objective) -> Result<SimplexRun, IdentifyError> {
    let (visits, failure, path) = (RefCell::default(), RefCell::default(), RefCell::new(vec![start]));
    let mut vertices = vec![start.to_vec()];
    for k in 0..2 {
        let mut vertex = start.to_vec();
        // MATLAB's first step where a coordinate is zero.
        vertex[k] += if start[k] == 0.0 { 0.00025 } else { settings.first_side * start[k] };
        vertices.push(vertex);
    }
    let solver =
        Stopped { simplex: NelderMead::new(vertices), settings, visits: &visits, failure: &failure, path: &path };
    let cost = Cost { value: RefCell::new(value), visits: &visits, failure: &failure };
    let ran = Executor::new(cost, solver)
        .configure(|state| state.max_iters(10 * settings.max_evaluations as u64))
        .timer(false)
        .run();
    let end = ran.map(|result| {
        let state = result.state();
        let reason = match state.get_termination_reason() {
            Some(TerminationReason::SolverConverged) => {
                format!("diameter <= {:e} and spread <= {:e}", settings.tolx, settings.tolf)
            }
            Some(TerminationReason::MaxItersReached) => "largest number of evaluations".to_owned(),
            other => format!("{other:?}"),
        };
        (state.get_best_param().cloned(), state.get_best_cost(), reason)
    });
    if let Some(error) = failure.into_inner() {
        return Err(error);
    }
    let visits = visits.into_inner();
    let fail = |problem: String, visits: &[Visit]| IdentifyError::Fit {
        what: format!("simplex from lambda {}, beta {}", start[0], start[1]),
        problem,
        evaluations: visits.len(),
        residual: f64::NAN,
    };
    let (best, sum_of_squares, stopped) = end.map_err(|e| fail(e.to_string(), &visits))?;
    let Some(best) = best.filter(|_| sum_of_squares.is_finite()) else {
        let reasons = visits.iter().find_map(|v| v.turned_back.clone()).unwrap_or_default();
        return Err(fail(format!("every vertex was turned back ({reasons})"), &visits));
    };
    let turned_back = visits.iter().filter(|v| v.turned_back.is_some()).count();
    Ok(SimplexRun {
        start,
        end: [best[0], best[1]],
        sum_of_squares,
        turned_back,
        visits,
        path: path.into_inner(),
        stopped,
    })
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
