//! The scatter's metric S⁻¹ = I − Z M Zᵀ (see [`mixed`](super::mixed)): products of columns under it.
//!
//! Main types: [`Metric`], [`Block`] (columns with their plain products, which any metric may weigh). Six by six
//! matrices are factored for eight runs at once.

use nalgebra::DMatrix;
use wide::f64x8;

use super::course::LANES;
use super::mixed::{Column, EFFECTS, PerRun, Six, Square};
use super::products::{dot, gram, products};

/// Lower triangular K with Kᵀ K = M, for eight runs, also where V is 0.
pub struct Root {
    /// K.
    pub k: Square,
    /// ln |S|.
    pub log_det: f64x8,
}

impl Root {
    /// K = L⁻¹ V^½ with L Lᵀ = I + V^½ ZᵀZ V^½.
    pub fn new(gram: &Square, v: &PerRun) -> Self {
        let root = v.map(|v| f64x8::splat(v.max(0.0).sqrt()));
        let (mut l, mut k) = ([[f64x8::ZERO; EFFECTS]; EFFECTS], [[f64x8::ZERO; EFFECTS]; EFFECTS]);
        let (mut over, mut det) = ([f64x8::ONE; EFFECTS], f64x8::ONE);
        for j in 0..EFFECTS {
            let inner = |i: usize, l: &Square| {
                let products = (0..j).fold(f64x8::ZERO, |sum, m| l[i][m].mul_add(l[j][m], sum));
                root[i] * gram[i][j] * root[j] - products
            };
            let pivot = inner(j, &l) + f64x8::ONE;
            det *= pivot;
            l[j][j] = pivot.sqrt();
            over[j] = f64x8::ONE / l[j][j];
            for i in j + 1..EFFECTS {
                l[i][j] = inner(i, &l) * over[j];
            }
        }
        for j in 0..EFFECTS {
            k[j][j] = over[j];
            for i in j + 1..EFFECTS {
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

    /// K times what is seen of a column.
    fn taken(&self, seen: &Six) -> Six {
        std::array::from_fn(|i| (0..=i).fold(f64x8::ZERO, |sum, j| self.k[i][j].mul_add(seen[j], sum)))
    }

    /// M times what is seen of a residual.
    pub fn draws(&self, seen: &Six) -> Six {
        let taken = self.taken(seen);
        std::array::from_fn(|j| (j..EFFECTS).fold(f64x8::ZERO, |sum, i| self.k[i][j].mul_add(taken[i], sum)))
    }
}

/// S⁻¹ of all runs.
pub struct Metric {
    roots: Vec<Root>,
    /// Sum of ln |S| over runs.
    pub log_det: f64,
}

impl Metric {
    /// From the roots of all runs, eight at a time.
    pub fn new(roots: Vec<Root>) -> Self {
        let log_det = roots.iter().map(|root| root.log_det.reduce_add()).sum();
        Self { roots, log_det }
    }

    /// What the draws take of a column: K Zᵀ times it, group by group, effect by effect, run by run.
    pub fn taken(&self, column: &Column) -> Vec<f64> {
        let mut out = Vec::with_capacity(EFFECTS * LANES * self.roots.len());
        for (root, seen) in self.roots.iter().zip(&column.seen) {
            root.taken(seen).iter().for_each(|taken| out.extend_from_slice(taken.as_array()));
        }
        out
    }

    /// Product of what the draws of one run take of two columns.
    pub fn taken_of(run: usize, a: &[f64], b: &[f64]) -> f64 {
        let first = EFFECTS * LANES * (run / LANES) + run % LANES;
        (0..EFFECTS).map(|k| first + LANES * k).map(|at| a[at] * b[at]).sum()
    }

    /// aᵀ S⁻¹ a.
    pub fn square(&self, column: &Column) -> f64 {
        let taken = self.taken(column);
        dot(&column.values, &column.values) - dot(&taken, &taken)
    }
}

/// Columns with their plain products.
#[derive(Clone, Debug)]
pub struct Block {
    /// The columns.
    pub columns: Vec<Column>,
    gram: DMatrix<f64>,
}

/// The products of a block under a metric, with what the draws take of each column.
pub struct Weighed {
    taken: Vec<Vec<f64>>,
    /// JᵀS⁻¹J.
    pub gram: DMatrix<f64>,
}

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

impl Block {
    /// Multiplies columns with one another.
    pub fn new(columns: Vec<Column>) -> Self {
        let values: Vec<&[f64]> = columns.iter().map(|c| c.values.as_slice()).collect();
        let gram = gram(&values);
        Self { columns, gram }
    }

    /// Under a metric.
    pub fn weighed(&self, metric: &Metric) -> Weighed {
        let taken: Vec<Vec<f64>> = self.columns.iter().map(|c| metric.taken(c)).collect();
        let gram = &self.gram - gram(&slices(&taken));
        Weighed { taken, gram }
    }

    /// JᵀS⁻¹ times other columns; `own` is this block under the metric.
    pub fn times(&self, own: &Weighed, metric: &Metric, others: &[&Column]) -> DMatrix<f64> {
        let values: Vec<&[f64]> = self.columns.iter().map(|c| c.values.as_slice()).collect();
        let right: Vec<&[f64]> = others.iter().map(|c| c.values.as_slice()).collect();
        let taken: Vec<Vec<f64>> = others.iter().map(|c| metric.taken(c)).collect();
        products(&values, &right) - products(&slices(&own.taken), &slices(&taken))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mixed::{Layout, Scatter};
    use nalgebra::DVector;

    #[test]
    fn the_metric_is_the_inverse_of_the_covariance() {
        let layout = Layout::of((0..11usize).map(|i| 3 + i % 4));
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut column = || -> Vec<f64> { (0..layout.len()).map(|_| next()).collect() };
        let columns: Vec<Vec<f64>> = (0..EFFECTS).map(|_| column()).collect();
        let v = [0.5, 2.0, 0.0, 0.1, 3.0, 1.0];
        let scatter = Scatter::new(layout.clone(), columns.clone());
        let metric = scatter.metric(&v);
        let block = Block::new((0..5).map(|_| scatter.seen(column())).collect());
        let other = scatter.seen(column());
        let weighed = block.weighed(&metric);
        let times = block.times(&weighed, &metric, &[&other]);
        let (a, b) = (metric.taken(&block.columns[0]), metric.taken(&other));
        let draws = scatter.draws(&v, &other);
        let mut log_det = 0.0;
        let (mut gram, mut by_run) = (DMatrix::zeros(5, 5), 0.0);
        for run in 0..layout.runs() {
            let range = layout.range(run);
            let n = range.len();
            let z = DMatrix::from_fn(n, EFFECTS, |i, k| columns[k][range.start + i]);
            let scaled = &z * DMatrix::from_diagonal(&DVector::from_row_slice(&v));
            let s = DMatrix::identity(n, n) + &scaled * z.transpose();
            log_det += s.determinant().ln();
            let inverse = s.cholesky().unwrap().inverse();
            let j = DMatrix::from_fn(n, 5, |i, k| block.columns[k].values[range.start + i]);
            let r = DVector::from_row_slice(&other.values[range.clone()]);
            gram += j.transpose() * &inverse * &j;
            let product = (j.column(0).transpose() * &inverse * &r)[0];
            let plain = dot(&block.columns[0].values[range.clone()], &other.values[range]);
            assert!((plain - Metric::taken_of(run, &a, &b) - product).abs() < 1e-12);
            by_run += product;
            let expected = scaled.transpose() * inverse * r;
            for k in 0..EFFECTS {
                assert!((draws[run][k] - expected[k]).abs() < 1e-12, "run {run}, effect {k}");
            }
        }
        assert!((weighed.gram - gram).amax() < 1e-12);
        assert!((times[(0, 0)] - by_run).abs() < 1e-12);
        assert!((metric.square(&other) - Block::new(vec![other]).weighed(&metric).gram[(0, 0)]).abs() < 1e-12);
        assert!((metric.log_det - log_det).abs() < 1e-9);
    }
}
