//! The linear mixed model of the residuals, with the run as the statistical unit.
//!
//! A run's residual is r = J dθ + Z u + e with random effects u ~ N(0, diag V), drawn once per run, and row noise e (all
//! columns are divided by its standard deviation). Estimates are least squares under S⁻¹, S = I + Z V Zᵀ, and
//! S⁻¹ = I − Z M Zᵀ with M = (V⁻¹ + Zᵀ Z)⁻¹ [Henderson 1975]: a product of two columns under S⁻¹ is their plain product
//! less that of their projections on the random effects.
//!
//! Main types: [`RandomEffectColumns`] (Z of all runs), [`ObservationColumn`] (a column with Zᵀ times it); S⁻¹ is
//! [`Precision`].

use wide::f64x8;

use fingerpad_smooth::LANES;

use crate::model::random_effects::{PerEffect, RANDOM_EFFECTS, RandomEffect};
use crate::statistics::precision::{Precision, PrecisionRoot};
use crate::statistics::products::against;

/// A vector over the random effects for eight runs, one a SIMD lane.
pub type EffectLanes = [f64x8; RANDOM_EFFECTS];
/// A matrix over the random effects for eight runs.
pub type EffectMatrix = [EffectLanes; RANDOM_EFFECTS];

/// Which observations belong to which run: run i has `starts[i] .. starts[i + 1]`.
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

/// A column over the row noise, one entry an observation, with Zᵀ times it for each run.
#[derive(Clone, Debug)]
pub struct ObservationColumn {
    /// Its entries.
    pub values: Vec<f64>,
    /// Zᵀ times it, eight runs at a time.
    pub effect_products: Vec<EffectLanes>,
}

/// Columns of the random effects, each divided by the row noise, with their products per run.
#[derive(Clone, Debug)]
pub struct RandomEffectColumns {
    layout: Layout,
    columns: Vec<Vec<f64>>,
    gram: Vec<EffectMatrix>,
}

impl RandomEffectColumns {
    /// From the six columns, each of the layout's length.
    pub fn new(layout: Layout, columns: Vec<Vec<f64>>) -> Self {
        let mut out = Self { layout, columns, gram: Vec::new() };
        let rows: Vec<Vec<EffectLanes>> = out.columns.iter().map(|c| out.products_with(c)).collect();
        out.gram = (0..rows[0].len()).map(|group| std::array::from_fn(|k| rows[k][group])).collect();
        out
    }

    /// Zᵀ times a column, per run.
    fn products_with(&self, column: &[f64]) -> Vec<EffectLanes> {
        let mut out = vec![[f64x8::ZERO; RANDOM_EFFECTS]; self.layout.runs().div_ceil(LANES)];
        for run in 0..self.layout.runs() {
            let range = self.layout.range(run);
            let z: [&[f64]; RANDOM_EFFECTS] = std::array::from_fn(|k| &self.columns[k][range.clone()]);
            for (lanes, product) in out[run / LANES].iter_mut().zip(against(&column[range], z)) {
                lanes.as_mut_array()[run % LANES] = product;
            }
        }
        out
    }

    /// A column over the row noise with Zᵀ times it.
    pub fn observed(&self, values: Vec<f64>) -> ObservationColumn {
        ObservationColumn { effect_products: self.products_with(&values), values }
    }

    /// The columns of all random effects, over the row noise.
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// The column of a random effect, over the row noise.
    pub fn column(&self, effect: RandomEffect) -> &[f64] {
        &self.columns[effect.index()]
    }

    /// Variance of each observation over that of its row noise: 1 + Σ z² V.
    pub fn spread(&self, v: &PerEffect) -> Vec<f64> {
        (0..self.layout.len())
            .map(|i| 1.0 + self.columns.iter().zip(v).map(|(c, v)| c[i] * c[i] * v).sum::<f64>())
            .collect()
    }

    /// Variances by rounds of expectation maximisation from `v`, with a prior of `weight` runs at `prior`; the consumed
    /// degrees of freedom are taken off the number of runs.
    pub fn variances(
        &self,
        v: PerEffect,
        residual: &ObservationColumn,
        prior: &PerEffect,
        weight: f64,
        consumed_degrees_of_freedom: f64,
        rounds: usize,
    ) -> PerEffect {
        let runs = self.layout.runs();
        let mut v = v;
        for _ in 0..rounds {
            let mut sum = [f64x8::ZERO; RANDOM_EFFECTS];
            for (group, (gram, products)) in self.gram.iter().zip(&residual.effect_products).enumerate() {
                let root = PrecisionRoot::new(gram, &v);
                let u = root.best_predictions(products);
                let is_run = f64x8::new(std::array::from_fn(|l| f64::from(u8::from(LANES * group + l < runs))));
                for k in 0..RANDOM_EFFECTS {
                    let variance =
                        (k..RANDOM_EFFECTS).map(|i| root.k[i][k] * root.k[i][k]).fold(f64x8::ZERO, |a, b| a + b);
                    sum[k] += (u[k] * u[k] + variance) * is_run;
                }
            }
            let n = (runs as f64 - consumed_degrees_of_freedom).max(1.0);
            v = std::array::from_fn(|k| ((sum[k].reduce_add() + weight * prior[k]) / (n + weight)).max(1e-12));
        }
        v
    }

    /// Best linear unbiased predictions of the random effects of each run [Henderson 1975], from the residual with all
    /// random effects at 0.
    pub fn best_predictions(&self, v: &PerEffect, residual: &ObservationColumn) -> Vec<PerEffect> {
        let groups = self.gram.iter().zip(&residual.effect_products);
        let lanes: Vec<EffectLanes> =
            groups.map(|(gram, products)| PrecisionRoot::new(gram, v).best_predictions(products)).collect();
        (0..self.layout.runs()).map(|run| lanes[run / LANES].map(|u| u.as_array()[run % LANES])).collect()
    }

    /// Adds the first random effects of each run, times their columns, to a residual.
    pub fn add<const K: usize>(&self, values: &[[f64; K]], residual: &mut [f64]) {
        for (run, u) in values.iter().enumerate() {
            for i in self.layout.range(run) {
                residual[i] += (0..K).map(|k| self.columns[k][i] * u[k]).sum::<f64>();
            }
        }
    }

    /// Part of −2 log posterior that comes from the prior on the variances.
    pub fn prior_2ll(v: &PerEffect, prior: &PerEffect, weight: f64) -> f64 {
        (0..RANDOM_EFFECTS).map(|k| weight * ((v[k] / prior[k]).ln() + prior[k] / v[k] - 1.0)).sum()
    }

    /// S⁻¹ for these variances.
    pub fn precision(&self, v: &PerEffect) -> Precision {
        Precision::new(self.gram.iter().map(|gram| PrecisionRoot::new(gram, v)).collect())
    }
}
