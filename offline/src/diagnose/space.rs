//! The linear picture at a fit: whitened residual, nuisance directions, and scores of further columns.
//!
//! Main type: [`Space`]. Everything that the selection asks of a candidate (gain, sign flips, separation from a
//! rival) is a product of columns here.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::base::FREEDOMS;
use super::chance::Score;
use super::fit::{Fit, Tangents, Task};
use super::mixed::{Whitener, dot};

/// Whitened residual and nuisance at a fit.
pub struct Space<'a> {
    task: &'a Task<'a>,
    whitener: Whitener<'a>,
    /// Whitened residual followed by the prior's.
    residual: Vec<f64>,
    nuisance: Vec<Vec<f64>>,
    solver: Cholesky<f64, Dyn>,
}

/// A whitened column with the nuisance taken out, prior rows last.
pub type Clean = Vec<f64>;

impl<'a> Space<'a> {
    /// At a fit. `law_columns`: columns of the laws in force, over the row noise.
    pub fn new(task: &'a Task<'a>, fit: &Fit, tangents: &'a Tangents, law_columns: Vec<Vec<f64>>) -> Self {
        let whitener = tangents.scatter.whitener(&fit.variances);
        let extend = |mut column: Vec<f64>, prior: &[f64]| {
            whitener.apply(&mut column);
            column.extend_from_slice(prior);
            column
        };
        let scaled: Vec<f64> = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
        let pull = &task.prior.root
            * DVector::from_iterator(FREEDOMS, (0..FREEDOMS).map(|k| task.prior.mean[k] - fit.theta[k]));
        let residual = extend(scaled, pull.as_slice());
        let mut nuisance = Vec::with_capacity(FREEDOMS + law_columns.len());
        for (k, column) in tangents.freedoms.iter().enumerate() {
            nuisance.push(extend(column.clone(), task.prior.root.column(k).as_slice()));
        }
        for column in law_columns {
            nuisance.push(extend(column, &[0.0; FREEDOMS]));
        }
        let n = nuisance.len();
        let mut gram = DMatrix::zeros(n, n);
        for a in 0..n {
            for b in a..n {
                let s = dot(&nuisance[a], &nuisance[b]);
                gram[(a, b)] = s;
                gram[(b, a)] = s;
            }
        }
        for k in 0..n {
            gram[(k, k)] = gram[(k, k)] * (1.0 + 1e-9) + 1e-12;
        }
        let solver = gram.cholesky().expect("ridged");
        let mut space = Self { task, whitener, residual: Vec::new(), nuisance, solver };
        space.residual = space.without_nuisance(residual);
        space
    }

    fn without_nuisance(&self, mut column: Vec<f64>) -> Vec<f64> {
        let products = DVector::from_iterator(self.nuisance.len(), self.nuisance.iter().map(|n| dot(n, &column)));
        let x = self.solver.solve(&products);
        for (n, x) in self.nuisance.iter().zip(x.iter()) {
            for (c, n) in column.iter_mut().zip(n) {
                *c -= n * x;
            }
        }
        column
    }

    /// Whitens a column (over the row noise) and takes the nuisance out.
    pub fn clean(&self, column: &[f64]) -> Clean {
        let mut c = column.to_vec();
        self.whitener.apply(&mut c);
        c.resize(self.residual.len(), 0.0);
        self.without_nuisance(c)
    }

    /// Information of clean columns.
    fn information(columns: &[&Clean]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |a, b| dot(columns[a], columns[b]))
    }

    /// The score of a group of clean columns; `None` if they carry nothing beyond the nuisance.
    pub fn score(&self, columns: &[&Clean], raw_size: f64) -> Option<Score> {
        // Columns that the protocol cannot see (one axis of an anisotropy, say) leave the rest of the group testable.
        let columns: Vec<&Clean> = columns.iter().copied().filter(|c| dot(c, c) > 1e-5 * raw_size + 1e-9).collect();
        let k = columns.len();
        if k == 0 {
            return None;
        }
        let mut ridged = Self::information(&columns);
        for i in 0..k {
            ridged[(i, i)] *= 1.0 + 1e-6;
        }
        let inverse = ridged.cholesky()?.inverse();
        let layout = &self.task.layout;
        let mut per_run = Vec::with_capacity(k * layout.runs());
        for run in 0..layout.runs() {
            let range = layout.range(run);
            for c in &columns {
                per_run.push(dot(&c[range.clone()], &self.residual[range.clone()]));
            }
        }
        let end = layout.len();
        let fixed = columns.iter().map(|c| dot(&c[end..], &self.residual[end..])).collect();
        Some(Score::new(per_run, fixed, inverse))
    }

    /// How far the runs disagree on the size of a column that was fitted for all: the variance between runs of its
    /// coefficient and how surprising that is, in standard deviations.
    pub fn dispersion(&self, column: &[f64]) -> (f64, f64) {
        let mut c = column.to_vec();
        self.whitener.apply(&mut c);
        let (mut q, mut excess, mut squares, mut runs) = (0.0, 0.0, 0.0, 0.0);
        for run in 0..self.task.layout.runs() {
            let range = self.task.layout.range(run);
            let information = dot(&c[range.clone()], &c[range.clone()]);
            if information > 0.0 {
                let g = dot(&c[range.clone()], &self.residual[range]);
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
        dot(column, column)
    }

    /// How much of a clean column a group of clean columns explains.
    pub fn explained(column: &Clean, by: &[&Clean]) -> f64 {
        let mut information = Self::information(by);
        for i in 0..by.len() {
            information[(i, i)] = information[(i, i)] * (1.0 + 1e-9) + 1e-12;
        }
        let products = DVector::from_iterator(by.len(), by.iter().map(|b| dot(b, column)));
        information.cholesky().map_or(0.0, |c| products.dot(&c.solve(&products)))
    }
}
