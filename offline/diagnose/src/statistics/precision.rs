//! The precision S⁻¹ = I − Z M Zᵀ of the mixed model (see [`random_effects`](super::random_effects)), and products of
//! columns under it.
//!
//! Main types: [`Precision`], [`PrecisionRoot`] (of eight runs), [`Block`] (columns with their plain products, which serve
//! any precision). Matrices over the six random effects are factored for eight runs at once.

use nalgebra::DMatrix;
use wide::f64x8;

use fingerpad_smooth::LANES;

use crate::model::random_effects::{PerEffect, RANDOM_EFFECTS};
use crate::statistics::products::{dot, gram, products};
use crate::statistics::random_effects::{EffectLanes, EffectMatrix, ObservationColumn};

/// Lower triangular K with Kᵀ K = M, for eight runs, also where V is 0.
pub struct PrecisionRoot {
    /// K.
    pub k: EffectMatrix,
    /// ln |S|.
    pub log_det: f64x8,
}

impl PrecisionRoot {
    /// K = L⁻¹ V^½ with L Lᵀ = I + V^½ ZᵀZ V^½.
    pub fn new(gram: &EffectMatrix, v: &PerEffect) -> Self {
        let root = v.map(|v| f64x8::splat(v.max(0.0).sqrt()));
        let (mut l, mut k) =
            ([[f64x8::ZERO; RANDOM_EFFECTS]; RANDOM_EFFECTS], [[f64x8::ZERO; RANDOM_EFFECTS]; RANDOM_EFFECTS]);
        let (mut over, mut det) = ([f64x8::ONE; RANDOM_EFFECTS], f64x8::ONE);
        for j in 0..RANDOM_EFFECTS {
            let inner = |i: usize, l: &EffectMatrix| {
                let products = (0..j).fold(f64x8::ZERO, |sum, m| l[i][m].mul_add(l[j][m], sum));
                root[i] * gram[i][j] * root[j] - products
            };
            let pivot = inner(j, &l) + f64x8::ONE;
            det *= pivot;
            l[j][j] = pivot.sqrt();
            over[j] = f64x8::ONE / l[j][j];
            for i in j + 1..RANDOM_EFFECTS {
                l[i][j] = inner(i, &l) * over[j];
            }
        }
        for j in 0..RANDOM_EFFECTS {
            k[j][j] = over[j];
            for i in j + 1..RANDOM_EFFECTS {
                let sum = (j..i).fold(f64x8::ZERO, |sum, m| l[i][m].mul_add(k[m][j], sum));
                k[i][j] = -(sum * over[i]);
            }
        }
        for row in &mut k {
            for (k, root) in row.iter_mut().zip(root) {
                *k *= root;
            }
        }
        Self { k, log_det: det.ln() }
    }

    /// Projection of a column on the random effects: K times its products with them, Zᵀ c.
    fn projected(&self, products: &EffectLanes) -> EffectLanes {
        std::array::from_fn(|i| (0..=i).fold(f64x8::ZERO, |sum, j| self.k[i][j].mul_add(products[j], sum)))
    }

    /// Best linear unbiased predictions of the random effects: M times the residual's products with them, Zᵀ r.
    pub fn best_predictions(&self, products: &EffectLanes) -> EffectLanes {
        let projected = self.projected(products);
        std::array::from_fn(|j| (j..RANDOM_EFFECTS).fold(f64x8::ZERO, |sum, i| self.k[i][j].mul_add(projected[i], sum)))
    }
}

/// S⁻¹ of all runs.
pub struct Precision {
    roots: Vec<PrecisionRoot>,
    /// Sum of ln |S| over runs.
    pub log_det: f64,
}

impl Precision {
    /// From the roots of all runs, eight at a time.
    pub fn new(roots: Vec<PrecisionRoot>) -> Self {
        let log_det = roots.iter().map(|root| root.log_det.reduce_add()).sum();
        Self { roots, log_det }
    }

    /// Projection of a column on the random effects, K Zᵀ times it: by batch of eight runs, then effect, then run.
    pub fn projected(&self, column: &ObservationColumn) -> Vec<f64> {
        let mut out = Vec::with_capacity(RANDOM_EFFECTS * LANES * self.roots.len());
        for (root, products) in self.roots.iter().zip(&column.effect_products) {
            root.projected(products).iter().for_each(|projected| out.extend_from_slice(projected.as_array()));
        }
        out
    }

    /// The part of one run in the product of two projections.
    pub fn projected_product(run: usize, a: &[f64], b: &[f64]) -> f64 {
        let first = RANDOM_EFFECTS * LANES * (run / LANES) + run % LANES;
        (0..RANDOM_EFFECTS).map(|k| first + LANES * k).map(|at| a[at] * b[at]).sum()
    }

    /// aᵀ S⁻¹ a.
    pub fn square(&self, column: &ObservationColumn) -> f64 {
        let projected = self.projected(column);
        dot(&column.values, &column.values) - dot(&projected, &projected)
    }
}

/// Columns with their plain products.
#[derive(Clone, Debug)]
pub struct Block {
    /// The columns.
    pub columns: Vec<ObservationColumn>,
    gram: DMatrix<f64>,
}

/// The products of a block's columns under a precision, with the projection of each column on the random effects.
pub struct BlockProducts {
    projected: Vec<Vec<f64>>,
    /// JᵀS⁻¹J.
    pub gram: DMatrix<f64>,
}

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

impl Block {
    /// Multiplies columns with one another.
    pub fn new(columns: Vec<ObservationColumn>) -> Self {
        let values: Vec<&[f64]> = columns.iter().map(|c| c.values.as_slice()).collect();
        let gram = gram(&values);
        Self { columns, gram }
    }

    /// The block's products under a precision.
    pub fn weighed(&self, precision: &Precision) -> BlockProducts {
        let projected: Vec<Vec<f64>> = self.columns.iter().map(|c| precision.projected(c)).collect();
        let gram = &self.gram - gram(&slices(&projected));
        BlockProducts { projected, gram }
    }

    /// JᵀS⁻¹ times other columns; `own`: the products of this block under that precision.
    pub fn times(&self, own: &BlockProducts, precision: &Precision, others: &[&ObservationColumn]) -> DMatrix<f64> {
        let values: Vec<&[f64]> = self.columns.iter().map(|c| c.values.as_slice()).collect();
        let right: Vec<&[f64]> = others.iter().map(|c| c.values.as_slice()).collect();
        let projected: Vec<Vec<f64>> = others.iter().map(|c| precision.projected(c)).collect();
        products(&values, &right) - products(&slices(&own.projected), &slices(&projected))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::random_effects::{Layout, RandomEffectColumns};
    use nalgebra::DVector;

    #[test]
    fn the_precision_is_the_inverse_of_the_covariance() {
        let layout = Layout::of((0..11usize).map(|i| 3 + i % 4));
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut column = || -> Vec<f64> { (0..layout.len()).map(|_| next()).collect() };
        let columns: Vec<Vec<f64>> = (0..RANDOM_EFFECTS).map(|_| column()).collect();
        let v = [0.5, 2.0, 0.0, 0.1, 3.0, 1.0];
        let random_effects = RandomEffectColumns::new(layout.clone(), columns.clone());
        let precision = random_effects.precision(&v);
        let block = Block::new((0..5).map(|_| random_effects.observed(column())).collect());
        let other = random_effects.observed(column());
        let weighed = block.weighed(&precision);
        let times = block.times(&weighed, &precision, &[&other]);
        let (a, b) = (precision.projected(&block.columns[0]), precision.projected(&other));
        let predicted = random_effects.best_predictions(&v, &other);
        let mut log_det = 0.0;
        let (mut gram, mut by_run) = (DMatrix::zeros(5, 5), 0.0);
        for run in 0..layout.runs() {
            let range = layout.range(run);
            let n = range.len();
            let z = DMatrix::from_fn(n, RANDOM_EFFECTS, |i, k| columns[k][range.start + i]);
            let scaled = &z * DMatrix::from_diagonal(&DVector::from_row_slice(&v));
            let s = DMatrix::identity(n, n) + &scaled * z.transpose();
            log_det += s.determinant().ln();
            let inverse = s.cholesky().unwrap().inverse();
            let j = DMatrix::from_fn(n, 5, |i, k| block.columns[k].values[range.start + i]);
            let r = DVector::from_row_slice(&other.values[range.clone()]);
            gram += j.transpose() * &inverse * &j;
            let product = (j.column(0).transpose() * &inverse * &r)[0];
            let plain = dot(&block.columns[0].values[range.clone()], &other.values[range]);
            assert!((plain - Precision::projected_product(run, &a, &b) - product).abs() < 1e-12);
            by_run += product;
            let expected = scaled.transpose() * inverse * r;
            for k in 0..RANDOM_EFFECTS {
                assert!((predicted[run][k] - expected[k]).abs() < 1e-12, "run {run}, effect {k}");
            }
        }
        assert!((weighed.gram - gram).amax() < 1e-12);
        assert!((times[(0, 0)] - by_run).abs() < 1e-12);
        assert!((precision.square(&other) - Block::new(vec![other]).weighed(&precision).gram[(0, 0)]).abs() < 1e-12);
        assert!((precision.log_det - log_det).abs() < 1e-9);
    }
}
