//! Runs as the statistical unit: products of columns under row noise and run-level scatter.
//!
//! A run's residual is r = J dθ + Z u + e with u ~ N(0, diag V) drawn once per run (columns already divided by the row
//! noise). Everything is least squares under S⁻¹, S = I + Z V Zᵀ, and S⁻¹ = I − Z M Zᵀ with M = (V⁻¹ + Zᵀ Z)⁻¹: a product
//! of columns is their plain one less the product of what the draws take of them.
//!
//! Main types: [`Scatter`] (Z of all runs), [`Column`] (with what the random effects see of it); S⁻¹ is [`Metric`].

use wide::f64x8;

use super::course::LANES;
use super::metric::{Metric, Root};
use super::products::against;

/// Random effects of a run: stiffness gain, strength gain, depth zero, offsets of normal, x and y.
pub const EFFECTS: usize = 6;
/// A vector of random effects or their variances.
pub type PerRun = [f64; EFFECTS];
/// The same for eight runs, a run to a lane.
pub type Six = [f64x8; EFFECTS];
/// A matrix for eight runs.
pub type Square = [Six; EFFECTS];

/// Where each run's observations lie: run i has `starts[i] .. starts[i + 1]`.
#[derive(Clone, Debug)]
pub struct Layout {
    /// First observation of each run, then the number of all.
    pub starts: Vec<usize>,
}

impl Layout {
    /// The layout of runs with so many rows, three observations a row.
    pub fn of(rows: impl Iterator<Item = usize>) -> Self {
        let mut starts = vec![0];
        for n in rows {
            starts.push(starts[starts.len() - 1] + 3 * n);
        }
        Self { starts }
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of observations.
    pub fn len(&self) -> usize {
        self.starts[self.runs()]
    }

    /// Observations of a run.
    pub fn range(&self, run: usize) -> std::ops::Range<usize> {
        self.starts[run]..self.starts[run + 1]
    }
}

/// A column, over the row noise, with Zᵀ times it for each run.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its values.
    pub values: Vec<f64>,
    /// Zᵀ times it, eight runs at a time.
    pub seen: Vec<Six>,
}

/// Columns of the random effects, each divided by the row noise, with their products per run.
#[derive(Clone, Debug)]
pub struct Scatter {
    layout: Layout,
    columns: Vec<Vec<f64>>,
    gram: Vec<Square>,
}

impl Scatter {
    /// From the six columns, each of the layout's length.
    pub fn new(layout: Layout, columns: Vec<Vec<f64>>) -> Self {
        let mut scatter = Self { layout, columns, gram: Vec::new() };
        let rows: Vec<Vec<Six>> = scatter.columns.iter().map(|c| scatter.see(c)).collect();
        scatter.gram = (0..rows[0].len()).map(|group| std::array::from_fn(|k| rows[k][group])).collect();
        scatter
    }

    /// Zᵀ times a column, per run.
    fn see(&self, column: &[f64]) -> Vec<Six> {
        let mut out = vec![[f64x8::ZERO; EFFECTS]; self.layout.runs().div_ceil(LANES)];
        for run in 0..self.layout.runs() {
            let range = self.layout.range(run);
            let z: [&[f64]; EFFECTS] = std::array::from_fn(|k| &self.columns[k][range.clone()]);
            for (seen, product) in out[run / LANES].iter_mut().zip(against(&column[range], z)) {
                seen.as_mut_array()[run % LANES] = product;
            }
        }
        out
    }

    /// A column with what the random effects see of it.
    pub fn seen(&self, values: Vec<f64>) -> Column {
        Column { seen: self.see(&values), values }
    }

    /// The column of a random effect, over the row noise.
    pub fn column(&self, effect: usize) -> &[f64] {
        &self.columns[effect]
    }

    /// Variance of each observation over that of its row noise: 1 + Σ z² V.
    pub fn spread(&self, v: &PerRun) -> Vec<f64> {
        (0..self.layout.len())
            .map(|i| 1.0 + self.columns.iter().zip(v).map(|(c, v)| c[i] * c[i] * v).sum::<f64>())
            .collect()
    }

    /// Variances by expectation maximisation from `v`, with a prior of `weight` runs at `prior`; `lost` degrees of
    /// freedom are taken off the number of runs.
    pub fn variances(
        &self,
        v: PerRun,
        residual: &Column,
        prior: &PerRun,
        weight: f64,
        lost: f64,
        rounds: usize,
    ) -> PerRun {
        let runs = self.layout.runs();
        let mut v = v;
        for _ in 0..rounds {
            let mut sum = [f64x8::ZERO; EFFECTS];
            for (group, (gram, seen)) in self.gram.iter().zip(&residual.seen).enumerate() {
                let root = Root::new(gram, &v);
                let draws = root.draws(seen);
                let there = f64x8::new(std::array::from_fn(|l| f64::from(u8::from(LANES * group + l < runs))));
                for k in 0..EFFECTS {
                    let variance = (k..EFFECTS).map(|i| root.k[i][k] * root.k[i][k]).fold(f64x8::ZERO, |a, b| a + b);
                    sum[k] += (draws[k] * draws[k] + variance) * there;
                }
            }
            let n = (runs as f64 - lost).max(1.0);
            v = std::array::from_fn(|k| ((sum[k].reduce_add() + weight * prior[k]) / (n + weight)).max(1e-12));
        }
        v
    }

    /// What each run most likely drew, given the residual with all draws in it.
    pub fn draws(&self, v: &PerRun, residual: &Column) -> Vec<PerRun> {
        let groups = self.gram.iter().zip(&residual.seen);
        let draws: Vec<Six> = groups.map(|(gram, seen)| Root::new(gram, v).draws(seen)).collect();
        (0..self.layout.runs()).map(|run| draws[run / LANES].map(|u| u.as_array()[run % LANES])).collect()
    }

    /// Adds the first effects of each run, times their columns, to a residual.
    pub fn add<const K: usize>(&self, draws: &[[f64; K]], residual: &mut [f64]) {
        for (run, u) in draws.iter().enumerate() {
            for i in self.layout.range(run) {
                residual[i] += (0..K).map(|k| self.columns[k][i] * u[k]).sum::<f64>();
            }
        }
    }

    /// What the prior on the variances adds to −2 log likelihood.
    pub fn prior_2ll(v: &PerRun, prior: &PerRun, weight: f64) -> f64 {
        (0..EFFECTS).map(|k| weight * ((v[k] / prior[k]).ln() + prior[k] / v[k] - 1.0)).sum()
    }

    /// S⁻¹ for these variances.
    pub fn metric(&self, v: &PerRun) -> Metric {
        Metric::new(self.gram.iter().map(|gram| Root::new(gram, v)).collect())
    }
}
