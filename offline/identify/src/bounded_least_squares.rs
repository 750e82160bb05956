//! Least squares with bounds: Levenberg–Marquardt (crate `levenberg-marquardt`, MINPACK's algorithm) on variables
//! that a sine holds inside their bounds [James & Roos 1975, MINUIT].

use fingerpad_least_squares::{self as least_squares, LevenbergMarquardt, Problem, TerminationReason};

use super::IdentifyError;

/// One variable of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Value at the start.
    pub value: f64,
    /// Bounds.
    pub bounds: [f64; 2],
}

/// Criteria of a fit's end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative change of the sum of squares and of the variables.
    pub tolerance: f64,
    /// Evaluations of all residuals, Jacobians not counted.
    pub evaluations: usize,
}

/// The end of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Variables.
    pub values: Vec<f64>,
    /// Residuals there.
    pub residuals: Vec<f64>,
    /// Columns of their derivatives over the variables there.
    pub jacobian: Vec<Vec<f64>>,
    /// Evaluations of all residuals.
    pub evaluations: usize,
    /// The minimiser's end in words.
    pub ended: String,
}

/// Residuals and derivatives of a fit.
pub trait Model {
    /// Residuals at `x`; a local failure ([`IdentifyError::is_local`]) turns the fit back from `x`.
    ///
    /// # Errors
    /// [`IdentifyError`].
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError>;
    /// Columns of their derivatives at `x`.
    ///
    /// # Errors
    /// [`IdentifyError`].
    fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError>;
}

/// Size of the residuals of a failed evaluation.
const TURNED_BACK: f64 = 1e3;

/// The model's variables as sines of unbounded angles; counts evaluations and keeps the model's failure.
struct Bounded<'a> {
    model: &'a mut dyn Model,
    bounds: Vec<[f64; 2]>,
    /// Number of residuals.
    count: usize,
    evaluations: usize,
    failure: Option<IdentifyError>,
}

impl Bounded<'_> {
    /// Variables at the unbounded angles `angles`.
    fn variables(&self, angles: &[f64]) -> Vec<f64> {
        angles.iter().zip(&self.bounds).map(|(u, [a, b])| a + 0.5 * (b - a) * (u.sin() + 1.0)).collect()
    }
}

impl Problem for Bounded<'_> {
    fn residuals(&mut self, angles: &[f64]) -> Option<Vec<f64>> {
        self.evaluations += 1;
        match self.model.residuals(&self.variables(angles)) {
            Ok(residuals) => Some(residuals),
            Err(error) if error.is_local() && self.evaluations > 1 => Some(vec![TURNED_BACK; self.count]),
            Err(error) => {
                self.failure = Some(error);
                None
            }
        }
    }

    fn jacobian(&mut self, angles: &[f64]) -> Option<Vec<Vec<f64>>> {
        match self.model.jacobian(&self.variables(angles)) {
            Ok(mut columns) => {
                for ((column, [a, b]), angle) in columns.iter_mut().zip(&self.bounds).zip(angles) {
                    let chain = 0.5 * (b - a) * angle.cos();
                    column.iter_mut().for_each(|v| *v *= chain);
                }
                Some(columns)
            }
            Err(error) => {
                self.failure = Some(error);
                None
            }
        }
    }
}

/// Minimises the sum of squared residuals.
///
/// # Errors
/// The model's first failure that is not local (at the start: any), or [`IdentifyError::Fit`].
pub fn minimise(
    what: &str,
    model: &mut dyn Model,
    variables: &[Variable],
    stop: Stop,
) -> Result<Solution, IdentifyError> {
    let start = variables.iter().map(|v| {
        let [a, b] = v.bounds;
        // On a bound the sine's slope is zero and the variable could not leave it.
        (2.0 * (v.value - a) / (b - a) - 1.0).clamp(-0.999, 0.999).asin()
    });
    let angles: Vec<f64> = start.collect();
    let bounds = variables.iter().map(|v| v.bounds).collect();
    let mut problem = Bounded { model, bounds, count: 0, evaluations: 0, failure: None };
    let outset = problem.variables(&angles);
    problem.count = problem.model.residuals(&outset)?.len();
    let minimiser = LevenbergMarquardt::new()
        .with_ftol(stop.tolerance)
        .with_xtol(stop.tolerance)
        .with_gtol(stop.tolerance)
        .with_patience((stop.evaluations / (variables.len() + 1)).max(2))
        // MINPACK's cautious end of the usual range: a finger may not survive a bold first step.
        .with_stepbound(0.5);
    let (angles, report) = least_squares::minimise(&mut problem, &angles, &minimiser);
    let evaluations = problem.evaluations;
    let ended = match report.termination {
        TerminationReason::Converged { .. }
        | TerminationReason::Orthogonal
        | TerminationReason::ResidualsZero
        | TerminationReason::NoImprovementPossible(_) => "converged",
        TerminationReason::LostPatience => "stopped at the largest number of evaluations",
        other => {
            if let Some(error) = problem.failure {
                return Err(error);
            }
            return Err(IdentifyError::Fit {
                what: what.to_owned(),
                problem: format!("{other:?}"),
                evaluations,
                residual: (2.0 * report.objective_function).sqrt(),
            });
        }
    };
    let values = problem.variables(&angles);
    let residuals = problem.model.residuals(&values)?;
    let jacobian = problem.model.jacobian(&values)?;
    Ok(Solution { values, residuals, jacobian, evaluations, ended: ended.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An exponential through points.
    struct Decay(Vec<[f64; 2]>);

    impl Model for Decay {
        fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError> {
            if x[1] > 4.0 {
                return Err(IdentifyError::Mesh(fingerpad_fe::mesh::MeshError::Shape {
                    field: "x",
                    value: x[1],
                    rule: String::new(),
                }));
            }
            Ok(self.0.iter().map(|[t, y]| x[0] * (-x[1] * t).exp() - y).collect())
        }

        fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
            let e = |t: f64| (-x[1] * t).exp();
            Ok(vec![
                self.0.iter().map(|[t, _]| e(*t)).collect(),
                self.0.iter().map(|[t, _]| -x[0] * t * e(*t)).collect(),
            ])
        }
    }

    #[test]
    fn planted_values_come_back_also_past_a_failing_region_and_bounds_hold() {
        let points = |rate: f64| (0..8).map(move |i| [0.2 * f64::from(i), 3.0 * (-rate * 0.2 * f64::from(i)).exp()]);
        let variables =
            |high| [Variable { value: 1.0, bounds: [0.0, 10.0] }, Variable { value: 0.3, bounds: [0.0, high] }];
        let stop = Stop { tolerance: 1e-12, evaluations: 300 };
        let fit = minimise("decay", &mut Decay(points(1.7).collect()), &variables(20.0), stop).unwrap();
        assert!((fit.values[0] - 3.0).abs() < 1e-8 && (fit.values[1] - 1.7).abs() < 1e-8, "{fit:?}");
        let fit = minimise("decay", &mut Decay(points(1.7).collect()), &variables(1.0), stop).unwrap();
        assert!(fit.values[1] > 0.99 && fit.values[1] <= 1.0, "{fit:?}");
    }
}
