//! The linear picture at a fit: residual, nuisance directions, and scores of further columns.
//!
//! Main types: [`Space`], [`Clean`]. Everything that the selection asks of a candidate (gain, sign flips, separation
//! from a rival) is a product of columns here.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::base::FREEDOMS;
use super::chance::Score;
use super::fit::{Fit, Task};
use super::metric::{Block, Metric};
use super::mixed::Column;
use super::products::{dot, products, take_off};
use super::tangents::Tangents;

/// Residual and nuisance at a fit.
pub struct Space<'a> {
    task: &'a Task<'a>,
    tangents: &'a Tangents,
    metric: Metric,
    residual: Clean,
    nuisance: Vec<Clean>,
    solver: Cholesky<f64, Dyn>,
}

/// A column of which the nuisance is taken off.
#[derive(Clone, Debug)]
pub struct Clean {
    /// Observations, then the prior's rows.
    values: Vec<f64>,
    /// What the draws take of it.
    taken: Vec<f64>,
}

impl Clean {
    fn new(column: Column, prior: &[f64], metric: &Metric) -> Self {
        let taken = metric.taken(&column);
        let mut values = column.values;
        values.extend_from_slice(prior);
        Self { values, taken }
    }

    /// Product of two columns under the scatter's metric.
    pub fn product(&self, other: &Self) -> f64 {
        dot(&self.values, &other.values) - dot(&self.taken, &other.taken)
    }
}

impl<'a> Space<'a> {
    /// At a fit. `law_columns`: columns of the laws in force, over the row noise.
    pub fn new(task: &'a Task<'a>, fit: &Fit, tangents: &'a Tangents, law_columns: Vec<Vec<f64>>) -> Self {
        let scatter = &tangents.scatter;
        let metric = scatter.metric(&fit.variances);
        let scaled: Vec<f64> = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
        let root = &task.prior.root;
        let pull = root * DVector::from_iterator(FREEDOMS, (0..FREEDOMS).map(|k| task.prior.mean[k] - fit.theta[k]));
        let residual = Clean::new(scatter.seen(scaled), pull.as_slice(), &metric);
        let laws = Block::new(law_columns.into_iter().map(|c| scatter.seen(c)).collect());
        let gram = nuisance_gram(tangents, &laws, &metric, root);
        let freedoms = tangents.freedoms.columns.iter().cloned().enumerate();
        let nuisance = freedoms
            .map(|(k, column)| Clean::new(column, root.column(k).as_slice(), &metric))
            .chain(laws.columns.into_iter().map(|column| Clean::new(column, &[0.0; FREEDOMS], &metric)))
            .collect();
        let solver = gram.cholesky().expect("ridged");
        let mut space = Self { task, tangents, metric, residual, nuisance, solver };
        space.residual = space.without_nuisance(space.residual.clone());
        space
    }

    fn without_nuisance(&self, mut column: Clean) -> Clean {
        let products = DVector::from_iterator(self.nuisance.len(), self.nuisance.iter().map(|n| n.product(&column)));
        let x = self.solver.solve(&products);
        self.take_off(x.as_slice(), &mut column);
        column
    }

    fn with_prior_rows(&self, column: &[f64]) -> Clean {
        Clean::new(self.tangents.scatter.seen(column.to_vec()), &[0.0; FREEDOMS], &self.metric)
    }

    /// Takes the nuisance off a column (over the row noise).
    pub fn clean(&self, column: &[f64]) -> Clean {
        self.without_nuisance(self.with_prior_rows(column))
    }

    /// Takes the nuisance off each of some columns.
    pub fn clean_all<'c>(&self, columns: impl Iterator<Item = &'c Vec<f64>>) -> Vec<Clean> {
        let mut list: Vec<Clean> = columns.map(|c| self.with_prior_rows(c)).collect();
        let of = |list: &[Clean], of: fn(&Clean) -> &[f64]| products(&slices(&self.nuisance, of), &slices(list, of));
        let x = self.solver.solve(&(of(&list, |c| &c.values) - of(&list, |c| &c.taken)));
        list.iter_mut().zip(x.column_iter()).for_each(|(column, x)| self.take_off(x.as_slice(), column));
        list
    }

    fn take_off(&self, x: &[f64], column: &mut Clean) {
        take_off(&slices(&self.nuisance, |n| &n.values), x, &mut column.values);
        take_off(&slices(&self.nuisance, |n| &n.taken), x, &mut column.taken);
    }

    /// Information of clean columns.
    fn information(columns: &[&Clean]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |a, b| columns[a].product(columns[b]))
    }

    /// Product of the observations of one run.
    fn of_run(&self, run: usize, a: &Clean, b: &Clean) -> f64 {
        let range = self.task.layout.range(run);
        dot(&a.values[range.clone()], &b.values[range]) - Metric::taken_of(run, &a.taken, &b.taken)
    }

    /// The score of a group of clean columns; `None` if they carry nothing beyond the nuisance.
    pub fn score(&self, columns: &[&Clean], raw_size: f64) -> Option<Score> {
        // Columns that the protocol cannot see (one axis of an anisotropy, say) leave the rest of the group testable.
        let columns: Vec<&Clean> = columns.iter().copied().filter(|c| Self::size(c) > 1e-5 * raw_size + 1e-9).collect();
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

    /// How far the runs disagree on the size of a column that was fitted for all: the variance between runs of its
    /// coefficient and how surprising that is, in standard deviations.
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

    /// Squared size of a clean column.
    pub fn size(column: &Clean) -> f64 {
        column.product(column)
    }

    /// How much of a clean column a group of clean columns explains.
    pub fn explained(column: &Clean, by: &[&Clean]) -> f64 {
        let mut information = Self::information(by);
        for i in 0..by.len() {
            information[(i, i)] = information[(i, i)] * (1.0 + 1e-9) + 1e-12;
        }
        let products = DVector::from_iterator(by.len(), by.iter().map(|b| b.product(column)));
        information.cholesky().map_or(0.0, |c| products.dot(&c.solve(&products)))
    }
}

fn slices(columns: &[Clean], of: fn(&Clean) -> &[f64]) -> Vec<&[f64]> {
    columns.iter().map(of).collect()
}

/// Products of the nuisance columns, of freedoms (with their prior's rows) and laws, with a slight ridge.
fn nuisance_gram(tangents: &Tangents, laws: &Block, metric: &Metric, root: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = (FREEDOMS, laws.columns.len());
    let own = tangents.freedoms.weighed(metric);
    let mut gram = DMatrix::zeros(n + m, n + m);
    gram.view_mut((0, 0), (n, n)).copy_from(&(&own.gram + root.transpose() * root));
    if m > 0 {
        let across = tangents.freedoms.times(&own, metric, &laws.columns.iter().collect::<Vec<_>>());
        gram.view_mut((0, n), (n, m)).copy_from(&across);
        gram.view_mut((n, 0), (m, n)).copy_from(&across.transpose());
        gram.view_mut((n, n), (m, m)).copy_from(&laws.weighed(metric).gram);
    }
    for k in 0..n + m {
        gram[(k, k)] = gram[(k, k)] * (1.0 + 1e-9) + 1e-12;
    }
    gram
}
