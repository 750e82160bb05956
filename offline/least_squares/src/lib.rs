//! Nonlinear least squares on plain slices, for every crate that fits parameters.
//!
//! The minimiser is Levenberg–Marquardt as in MINPACK (crate `levenberg-marquardt`); no other crate uses its matrix
//! types. Main types: [`Problem`], the input of a fit; [`minimise`] runs it. May use: no other crate of the project.

use std::cell::RefCell;

use levenberg_marquardt::LeastSquaresProblem;
pub use levenberg_marquardt::{LevenbergMarquardt, MinimizationReport, TerminationReason};
use nalgebra::{DMatrix, DVector, DVectorView, Dyn, Owned};

/// Residuals and their derivatives over the parameters of a fit.
pub trait Problem {
    /// Residuals at the parameters `at`; `None` ends the minimisation.
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>>;

    /// Derivatives of all residuals at `at`, one column for each parameter; `None` ends the minimisation.
    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>>;
}

/// Minimises the sum of squared residuals of `problem` from `start`.
///
/// * `minimiser`: tolerances, patience and step bound, as the crate `levenberg-marquardt` documents them
///
/// Returns the parameters at the end and the minimiser's report; its `objective_function` is half the sum of squares.
pub fn minimise(
    problem: &mut dyn Problem,
    start: &[f64],
    minimiser: &LevenbergMarquardt<f64>,
) -> (Vec<f64>, MinimizationReport<f64>) {
    let adapter = Adapter { problem: RefCell::new(problem), at: DVector::from_column_slice(start) };
    let (ended, report) = minimiser.minimize(adapter);
    (ended.at.as_slice().to_vec(), report)
}

/// Half the sum of squared `residuals`, added up in the minimiser's order.
pub fn objective(residuals: &[f64]) -> f64 {
    0.5 * DVectorView::from_slice(residuals, residuals.len()).norm_squared()
}

/// A [`Problem`] in the minimiser's own types, whose residuals are computed from a shared reference.
struct Adapter<'a> {
    problem: RefCell<&'a mut dyn Problem>,
    at: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Adapter<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.copy_from(at);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.problem.borrow_mut().residuals(self.at.as_slice()).map(DVector::from_vec)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let columns = self.problem.borrow_mut().jacobian(self.at.as_slice())?;
        let rows = columns.first().map_or(0, Vec::len);
        Some(DMatrix::from_iterator(rows, columns.len(), columns.into_iter().flatten()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as two residuals; refuses parameters beyond `most`.
    struct Valley {
        most: f64,
        evaluations: usize,
    }

    impl Problem for Valley {
        fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
            self.evaluations += 1;
            (at[0] < self.most).then(|| vec![10.0 * (at[1] - at[0] * at[0]), 1.0 - at[0]])
        }

        fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
            Some(vec![vec![-20.0 * at[0], -1.0], vec![10.0, 0.0]])
        }
    }

    #[test]
    fn the_valley_ends_at_its_minimum_and_a_refusal_ends_the_search() {
        let mut valley = Valley { most: 2.0, evaluations: 0 };
        let (end, report) = minimise(&mut valley, &[-1.2, 1.0], &LevenbergMarquardt::new());
        assert!(report.termination.was_successful(), "{report:?}");
        assert!((end[0] - 1.0).abs() < 1e-9 && (end[1] - 1.0).abs() < 1e-9, "{end:?}");
        assert_eq!(report.number_of_evaluations, valley.evaluations);
        assert_eq!(report.objective_function, objective(&valley.residuals(&end).unwrap()));
        let mut refused = Valley { most: -1.0, evaluations: 0 };
        let (_, report) = minimise(&mut refused, &[-1.2, 1.0], &LevenbergMarquardt::new());
        assert!(matches!(report.termination, TerminationReason::User(_)), "{report:?}");
    }
}
