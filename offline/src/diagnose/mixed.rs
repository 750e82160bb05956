//! Runs as the statistical unit: products of columns under row noise and run-level scatter.
//!
//! A run's residual is r = J dθ + Z u + e with u ~ N(0, diag V) drawn once per run (columns already divided by the row
//! noise). Everything is least squares under S⁻¹, S = I + Z V Zᵀ, and S⁻¹ = I − Z M Zᵀ with M = (V⁻¹ + Zᵀ Z)⁻¹: a product
//! of columns is their plain one less the product of what the draws take of them.
//!
//! Main types: [`Scatter`] (Z of all runs), [`Column`] (with what the random effects see of it), [`Metric`] (S⁻¹).
//! Six by six matrices are factored for eight runs at once, a run to a lane.

use nalgebra::DMatrix;
use wide::f64x8;

use super::course::LANES;
use super::products::{dot, gram, products};

/// Random effects of a run: stiffness gain, strength gain, depth zero, offsets of normal, x and y.
pub const EFFECTS: usize = 6;
/// A vector of random effects or their variances.
pub type PerRun = [f64; EFFECTS];
/// The same for eight runs.
type Six = [f64x8; EFFECTS];
type Square = [Six; EFFECTS];

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
    seen: Vec<Six>,
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
            for (seen, z) in out[run / LANES].iter_mut().zip(&self.columns) {
                seen.as_mut_array()[run % LANES] = dot(&z[range.clone()], &column[range.clone()]);
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
        let roots: Vec<Root> = self.gram.iter().map(|gram| Root::new(gram, v)).collect();
        let log_det = roots.iter().map(|root| root.log_det.reduce_add()).sum();
        Metric { roots, log_det }
    }
}

/// Lower triangular K with Kᵀ K = M, for eight runs, also where V is 0.
struct Root {
    k: Square,
    /// ln |S|.
    log_det: f64x8,
}

impl Root {
    /// K = L⁻¹ V^½ with L Lᵀ = I + V^½ ZᵀZ V^½.
    fn new(gram: &Square, v: &PerRun) -> Self {
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
    fn draws(&self, seen: &Six) -> Six {
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
    use nalgebra::{DMatrix, DVector};

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
