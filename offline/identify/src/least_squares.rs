//! Least squares with bounds: Levenberg–Marquardt (crate `levenberg-marquardt`, MINPACK's algorithm) on variables
//! that a sine holds inside their bounds [James & Roos 1975, MINUIT].

use std::cell::RefCell;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra_lm::{DMatrix, DVector, Dyn, storage::Owned};

use super::IdentifyError;

/// One variable of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Where to begin.
    pub value: f64,
    /// Bounds.
    pub bounds: [f64; 2],
}

/// When a fit is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative change of the sum of squares and of the variables.
    pub tolerance: f64,
    /// Evaluations of all residuals, Jacobians not counted.
    pub evaluations: usize,
}

/// Where a fit ended.
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
    /// How it ended.
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

/// Size of the residuals that stand for a failed evaluation.
const TURNED_BACK: f64 = 1e3;

struct Bounded<'a> {
    model: RefCell<&'a mut dyn Model>,
    bounds: Vec<[f64; 2]>,
    inner: DVector<f64>,
    count: usize,
    evaluations: RefCell<usize>,
    failure: RefCell<Option<IdentifyError>>,
}

impl Bounded<'_> {
    fn outer(&self) -> Vec<f64> {
        self.inner.iter().zip(&self.bounds).map(|(u, [a, b])| a + 0.5 * (b - a) * (u.sin() + 1.0)).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Bounded<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.inner.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.inner.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        *self.evaluations.borrow_mut() += 1;
        match self.model.borrow_mut().residuals(&self.outer()) {
            Ok(residuals) => Some(DVector::from_vec(residuals)),
            Err(error) if error.is_local() && *self.evaluations.borrow() > 1 => {
                Some(DVector::from_element(self.count, TURNED_BACK))
            }
            Err(error) => {
                *self.failure.borrow_mut() = Some(error);
                None
            }
        }
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        match self.model.borrow_mut().jacobian(&self.outer()) {
            Ok(columns) => {
                let chain = |k: usize| 0.5 * (self.bounds[k][1] - self.bounds[k][0]) * self.inner[k].cos();
                Some(DMatrix::from_fn(self.count, columns.len(), |i, k| columns[k][i] * chain(k)))
            }
            Err(error) => {
                *self.failure.borrow_mut() = Some(error);
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
    let inner = DVector::from_iterator(variables.len(), start);
    let bounds: Vec<_> = variables.iter().map(|v| v.bounds).collect();
    let count = {
        let outer: Vec<f64> =
            inner.iter().zip(&bounds).map(|(u, [a, b])| a + 0.5 * (b - a) * (u.sin() + 1.0)).collect();
        model.residuals(&outer)?.len()
    };
    let problem = Bounded {
        model: RefCell::new(model),
        bounds,
        inner,
        count,
        evaluations: RefCell::new(0),
        failure: RefCell::new(None),
    };
    let patience = (stop.evaluations / (variables.len() + 1)).max(2);
    let (problem, report) = LevenbergMarquardt::new()
        .with_ftol(stop.tolerance)
        .with_xtol(stop.tolerance)
        .with_gtol(stop.tolerance)
        .with_patience(patience)
        // MINPACK's cautious end of the usual range: a finger may not survive a bold first step.
        .with_stepbound(0.5)
        .minimize(problem);
    let evaluations = *problem.evaluations.borrow();
    let ended = match report.termination {
        TerminationReason::Converged { .. }
        | TerminationReason::Orthogonal
        | TerminationReason::ResidualsZero
        | TerminationReason::NoImprovementPossible(_) => "converged",
        TerminationReason::LostPatience => "stopped at the largest number of evaluations",
        other => {
            if let Some(error) = problem.failure.into_inner() {
                return Err(error);
            }
            let residual = (2.0 * report.objective_function).sqrt();
            return Err(IdentifyError::Fit {
                what: what.to_owned(),
                problem: format!("{other:?}"),
                evaluations,
                residual,
            });
        }
    };
    let values = problem.outer();
    let model = problem.model.into_inner();
    let residuals = model.residuals(&values)?;
    let jacobian = model.jacobian(&values)?;
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
