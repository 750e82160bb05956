//! The linear picture at a fit: the residual and further columns, each with the nuisance directions projected out.
//!
//! Nuisance are the smooth model's parameters and those of the finger's own laws (with their priors), and the parameters of
//! the other laws in force. Everything that the selection computes of a candidate (gain, sign flips, separation from a competitor) is a product of projected columns.
//!
//! Main types: [`Projection`], [`ProjectedColumn`].

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use fingerpad_smooth::Parameter;

use crate::model::active_law::ActiveLaw;
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::Fit;
use crate::statistics::precision::{Block, Precision};
use crate::statistics::products::{dot, products, take_off};
use crate::statistics::random_effects::ObservationColumn;
use crate::statistics::sign_flips::Score;
use crate::statistics::task::Task;

/// Residual and nuisance directions at a fit.
pub struct Projection<'a> {
    task: &'a Task<'a>,
    derivatives: &'a Derivatives,
    precision: Precision,
    residual: ProjectedColumn,
    nuisance: Vec<ProjectedColumn>,
    solver: Cholesky<f64, Dyn>,
    /// How many rows the priors have.
    prior_rows: usize,
}

/// A column without its part along the nuisance directions.
#[derive(Clone, Debug)]
pub struct ProjectedColumn {
    /// Observations, then the rows of the priors: of the model's parameters, then of the finger's own laws.
    values: Vec<f64>,
    /// Its projection on the random effects.
    on_random_effects: Vec<f64>,
}

impl ProjectedColumn {
    fn new(column: ObservationColumn, prior: &[f64], precision: &Precision) -> Self {
        let on_random_effects = precision.projected(&column);
        let mut values = column.values;
        values.extend_from_slice(prior);
        Self { values, on_random_effects }
    }

    /// Product of two columns under the precision.
    pub fn product(&self, other: &Self) -> f64 {
        dot(&self.values, &other.values) - dot(&self.on_random_effects, &other.on_random_effects)
    }
}

impl<'a> Projection<'a> {
    /// At a fit, with its laws as nuisance.
    pub fn at(task: &'a Task<'a>, fit: &Fit, derivatives: &'a Derivatives) -> Self {
        Self::new(task, fit, derivatives, task.law_columns_of(fit))
    }

    /// At a fit. `law_columns`: columns of the laws in force, over the row noise.
    pub fn new(task: &'a Task<'a>, fit: &Fit, derivatives: &'a Derivatives, law_columns: Vec<Vec<f64>>) -> Self {
        let random_effects = &derivatives.random_effects;
        let precision = random_effects.precision(&fit.variances);
        let scaled: Vec<f64> = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
        let own_laws = &fit.laws[..task.finger_laws.len()];
        let pull = task.prior_residual(&fit.parameters, own_laws);
        let residual = ProjectedColumn::new(random_effects.observed(scaled), &pull, &precision);
        let laws = Block::new(law_columns.into_iter().map(|c| random_effects.observed(c)).collect());
        let root = prior_root(task, own_laws);
        let gram = nuisance_gram(derivatives, &laws, &precision, &root);
        let mut nuisance: Vec<ProjectedColumn> = Vec::new();
        for (k, column) in derivatives.parameters.columns.iter().cloned().chain(laws.columns).enumerate() {
            let prior = (0..pull.len()).map(|row| if k < root.ncols() { root[(row, k)] } else { 0.0 });
            nuisance.push(ProjectedColumn::new(column, &prior.collect::<Vec<f64>>(), &precision));
        }
        let solver = gram.cholesky().expect("ridged");
        let mut projection = Self { task, derivatives, precision, residual, nuisance, solver, prior_rows: pull.len() };
        projection.residual = projection.without_nuisance(projection.residual.clone());
        projection
    }

    fn without_nuisance(&self, mut column: ProjectedColumn) -> ProjectedColumn {
        let products = DVector::from_iterator(self.nuisance.len(), self.nuisance.iter().map(|n| n.product(&column)));
        let x = self.solver.solve(&products);
        self.take_off(x.as_slice(), &mut column);
        column
    }

    fn with_prior_rows(&self, column: &[f64]) -> ProjectedColumn {
        ProjectedColumn::new(
            self.derivatives.random_effects.observed(column.to_vec()),
            &vec![0.0; self.prior_rows],
            &self.precision,
        )
    }

    /// Projects the nuisance out of a column over the row noise.
    pub fn project(&self, column: &[f64]) -> ProjectedColumn {
        self.without_nuisance(self.with_prior_rows(column))
    }

    /// Projects the nuisance out of each of some columns.
    pub fn project_all<'c>(&self, columns: impl Iterator<Item = &'c Vec<f64>>) -> Vec<ProjectedColumn> {
        let mut list: Vec<ProjectedColumn> = columns.map(|c| self.with_prior_rows(c)).collect();
        let of = |list: &[ProjectedColumn], of: fn(&ProjectedColumn) -> &[f64]| {
            products(&slices(&self.nuisance, of), &slices(list, of))
        };
        let x = self.solver.solve(&(of(&list, |c| &c.values) - of(&list, |c| &c.on_random_effects)));
        list.iter_mut().zip(x.column_iter()).for_each(|(column, x)| self.take_off(x.as_slice(), column));
        list
    }

    fn take_off(&self, x: &[f64], column: &mut ProjectedColumn) {
        take_off(&slices(&self.nuisance, |n| &n.values), x, &mut column.values);
        take_off(&slices(&self.nuisance, |n| &n.on_random_effects), x, &mut column.on_random_effects);
    }

    /// Fisher information of projected columns.
    fn information(columns: &[&ProjectedColumn]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |a, b| columns[a].product(columns[b]))
    }

    /// Product of the observations of one run.
    fn of_run(&self, run: usize, a: &ProjectedColumn, b: &ProjectedColumn) -> f64 {
        let range = self.task.layout.range(run);
        dot(&a.values[range.clone()], &b.values[range])
            - Precision::projected_product(run, &a.on_random_effects, &b.on_random_effects)
    }

    /// The score of a group of projected columns; `None` if they carry nothing beyond the nuisance.
    ///
    /// `raw_size`: largest squared size of the columns before the projection
    pub fn score(&self, columns: &[&ProjectedColumn], raw_size: f64) -> Option<Score> {
        // Columns that the protocol cannot see (one axis of an anisotropy, say) leave the rest of the group testable.
        let columns: Vec<&ProjectedColumn> = columns.iter().copied().filter(|c| Self::is_seen(c, raw_size)).collect();
        let k = columns.len();
        if k == 0 {
            return None;
        }
        let mut ridged = Self::information(&columns);
        for i in 0..k {
            ridged[(i, i)] *= 1.0 + 1e-6;
        }
        let inverse = ridged.cholesky()?.inverse();
        let runs = self.task.layout.runs();
        let per_run =
            (0..runs).flat_map(|run| columns.iter().map(move |c| self.of_run(run, c, &self.residual))).collect();
        let end = self.task.layout.len();
        let fixed = columns.iter().map(|c| dot(&c.values[end..], &self.residual.values[end..])).collect();
        Some(Score::new(per_run, fixed, inverse))
    }

    /// Whether the protocol sees a projected column.
    pub fn is_seen(column: &ProjectedColumn, raw_size: f64) -> bool {
        Self::size(column) > 1e-5 * raw_size + 1e-9
    }

    /// Product of a projected column with the residual.
    pub fn residual_product(&self, column: &ProjectedColumn) -> f64 {
        column.product(&self.residual)
    }

    /// Products of a projected column with the residual and with itself in each run.
    pub fn scores_by_run(&self, column: &ProjectedColumn) -> Vec<(f64, f64)> {
        let of = |run| (self.of_run(run, column, &self.residual), self.of_run(run, column, column));
        (0..self.task.layout.runs()).map(of).collect()
    }

    /// How far the runs disagree on the coefficient of a column that was fitted for all runs: its variance between runs,
    /// and by how many standard deviations that variance exceeds what the rows' noise gives.
    pub fn dispersion(&self, column: &[f64]) -> (f64, f64) {
        let c = self.with_prior_rows(column);
        let (mut q, mut excess, mut squares, mut runs) = (0.0, 0.0, 0.0, 0.0);
        for run in 0..self.task.layout.runs() {
            let information = self.of_run(run, &c, &c);
            if information > 0.0 {
                let g = self.of_run(run, &c, &self.residual);
                q += g * g / information;
                excess += g * g - information;
                squares += information * information;
                runs += 1.0;
            }
        }
        (excess / f64::max(squares, 1e-300), (q - runs) / f64::sqrt(2.0 * f64::max(runs, 1.0)))
    }

    /// Squared size of a projected column.
    pub fn size(column: &ProjectedColumn) -> f64 {
        column.product(column)
    }

    /// The part of a projected column's squared size that a group of projected columns explains.
    pub fn explained(column: &ProjectedColumn, by: &[&ProjectedColumn]) -> f64 {
        let mut information = Self::information(by);
        for i in 0..by.len() {
            information[(i, i)] = information[(i, i)] * (1.0 + 1e-9) + 1e-12;
        }
        let products = DVector::from_iterator(by.len(), by.iter().map(|b| b.product(column)));
        information.cholesky().map_or(0.0, |c| products.dot(&c.solve(&products)))
    }
}

fn slices(columns: &[ProjectedColumn], of: fn(&ProjectedColumn) -> &[f64]) -> Vec<&[f64]> {
    columns.iter().map(of).collect()
}

/// R with RᵀR = covariance⁻¹ of the priors: of the model's parameters, then of the finger's own laws.
fn prior_root(task: &Task<'_>, own_laws: &[ActiveLaw]) -> DMatrix<f64> {
    let sds: Vec<f64> = task.sds_of_laws(own_laws).collect();
    let (n, all) = (Parameter::COUNT, Parameter::COUNT + sds.len());
    let mut out = DMatrix::zeros(all, all);
    out.view_mut((0, 0), (n, n)).copy_from(&task.prior.root);
    for (i, sd) in sds.into_iter().enumerate() {
        out[(n + i, n + i)] = 1.0 / sd;
    }
    out
}

/// Products of the nuisance columns, of parameters and laws, with those of their priors' rows and a slight ridge.
fn nuisance_gram(derivatives: &Derivatives, laws: &Block, precision: &Precision, root: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = (Parameter::COUNT, laws.columns.len());
    let own = derivatives.parameters.weighed(precision);
    let mut gram = DMatrix::zeros(n + m, n + m);
    gram.view_mut((0, 0), (n, n)).copy_from(&own.gram);
    if m > 0 {
        let across = derivatives.parameters.times(&own, precision, &laws.columns.iter().collect::<Vec<_>>());
        gram.view_mut((0, n), (n, m)).copy_from(&across);
        gram.view_mut((n, 0), (m, n)).copy_from(&across.transpose());
        gram.view_mut((n, n), (m, m)).copy_from(&laws.weighed(precision).gram);
    }
    let mut with_prior = gram.view_mut((0, 0), root.shape());
    with_prior += root.transpose() * root;
    for k in 0..n + m {
        gram[(k, k)] = gram[(k, k)] * (1.0 + 1e-9) + 1e-12;
    }
    gram
}
