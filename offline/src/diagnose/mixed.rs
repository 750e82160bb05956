//! Runs as the statistical unit: whitening by row noise and run-level scatter.
//!
//! A run's residual is r = J dθ + Z u + e with u ~ N(0, diag V) drawn once per run. [`Whitener`] applies S^(−1/2),
//! S = I + Z V Zᵀ (columns already divided by the row noise), so that everything after it is least squares.

use nalgebra::{SMatrix, SVector, SymmetricEigen};

/// Random effects of a run: stiffness gain, strength gain, depth zero, offsets of normal, x and y.
pub const EFFECTS: usize = 6;
/// A vector of random effects or their variances.
pub type PerRun = [f64; EFFECTS];
type Square = SMatrix<f64, EFFECTS, EFFECTS>;

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
        let gram = (0..layout.runs())
            .map(|i| {
                let range = layout.range(i);
                let mut g = Square::zeros();
                for a in 0..EFFECTS {
                    for b in a..EFFECTS {
                        let s = dot(&columns[a][range.clone()], &columns[b][range.clone()]);
                        g[(a, b)] = s;
                        g[(b, a)] = s;
                    }
                }
                g
            })
            .collect();
        Self { layout, columns, gram }
    }

    fn products(&self, run: usize, column: &[f64]) -> SVector<f64, EFFECTS> {
        let range = self.layout.range(run);
        SVector::from_fn(|k, _| dot(&self.columns[k][range.clone()], &column[range.clone()]))
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
        residual: &[f64],
        prior: &PerRun,
        weight: f64,
        lost: f64,
        rounds: usize,
    ) -> PerRun {
        let n = self.layout.runs() as f64;
        let products: Vec<_> = (0..self.layout.runs()).map(|i| self.products(i, residual)).collect();
        let mut v = v;
        for _ in 0..rounds {
            let mut sum = [0.0; EFFECTS];
            for (gram, product) in self.gram.iter().zip(&products) {
                let m = posterior_covariance(gram, &v);
                let u = m * product;
                for k in 0..EFFECTS {
                    sum[k] += u[k] * u[k] + m[(k, k)];
                }
            }
            v = std::array::from_fn(|k| ((sum[k] + weight * prior[k]) / ((n - lost).max(1.0) + weight)).max(1e-12));
        }
        v
    }

    /// What each run most likely drew, given the residual with all draws in it.
    pub fn draws(&self, v: &PerRun, residual: &[f64]) -> Vec<PerRun> {
        (0..self.layout.runs())
            .map(|i| (posterior_covariance(&self.gram[i], v) * self.products(i, residual)).into())
            .collect()
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

    /// The whitener for these variances.
    pub fn whitener(&self, v: &PerRun) -> Whitener<'_> {
        let root: PerRun = std::array::from_fn(|k| v[k].max(0.0).sqrt());
        let mut log_det = 0.0;
        let back = self
            .gram
            .iter()
            .map(|g| {
                let scaled = Square::from_fn(|a, b| root[a] * g[(a, b)] * root[b]);
                let eigen = SymmetricEigen::new(scaled);
                let middle = SVector::<f64, EFFECTS>::from_fn(|k, _| {
                    let g = eigen.eigenvalues[k].max(0.0);
                    log_det += g.ln_1p();
                    if g < 1e-9 { -0.5 } else { (1.0 / (1.0 + g).sqrt() - 1.0) / g }
                });
                let q = eigen.eigenvectors * Square::from_diagonal(&middle) * eigen.eigenvectors.transpose();
                Square::from_fn(|a, b| root[a] * q[(a, b)] * root[b])
            })
            .collect();
        Whitener { scatter: self, back, log_det }
    }
}

/// (V⁻¹ + ZᵀZ)⁻¹, also where V is 0.
fn posterior_covariance(gram: &Square, v: &PerRun) -> Square {
    let root: PerRun = std::array::from_fn(|k| v[k].max(0.0).sqrt());
    let inner = Square::from_fn(|a, b| root[a] * gram[(a, b)] * root[b] + f64::from(u8::from(a == b)));
    let inverse = inner.cholesky().map_or_else(Square::identity, |c| c.inverse());
    Square::from_fn(|a, b| root[a] * inverse[(a, b)] * root[b])
}

/// S^(−1/2) of all runs.
pub struct Whitener<'a> {
    scatter: &'a Scatter,
    back: Vec<Square>,
    /// Sum of ln |S| over runs.
    pub log_det: f64,
}

impl Whitener<'_> {
    /// Whitens a column (already divided by the row noise) in place; what lies beyond the observations stays.
    pub fn apply(&self, column: &mut [f64]) {
        for (run, back) in self.back.iter().enumerate() {
            let t = back * self.scatter.products(run, column);
            let range = self.scatter.layout.range(run);
            for (k, z) in self.scatter.columns.iter().enumerate() {
                if t[k] != 0.0 {
                    for (c, z) in column[range.clone()].iter_mut().zip(&z[range.clone()]) {
                        *c += z * t[k];
                    }
                }
            }
        }
    }
}

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let mut chunks = a.chunks_exact(4).zip(b.chunks_exact(4));
    for (x, y) in &mut chunks {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    let tail = a.len() & !3;
    let rest: f64 = a[tail..].iter().zip(&b[tail..]).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn whitening_is_the_inverse_root_of_the_covariance() {
        let layout = Layout::of([3usize, 2].into_iter());
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let columns: Vec<Vec<f64>> = (0..EFFECTS).map(|_| (0..layout.len()).map(|_| next()).collect()).collect();
        let v = [0.5, 2.0, 0.0, 0.1, 3.0, 1.0];
        let scatter = Scatter::new(layout.clone(), columns.clone());
        let whitener = scatter.whitener(&v);
        let mut log_det = 0.0;
        for run in 0..2 {
            let range = layout.range(run);
            let n = range.len();
            let z = DMatrix::from_fn(n, EFFECTS, |i, k| columns[k][range.start + i]);
            let s = DMatrix::identity(n, n) + &z * DMatrix::from_diagonal(&DVector::from_row_slice(&v)) * z.transpose();
            log_det += s.determinant().ln();
            let column: Vec<f64> = (0..layout.len()).map(|_| next()).collect();
            let mut white = column.clone();
            whitener.apply(&mut white);
            let c = DVector::from_row_slice(&column[range.clone()]);
            let expected = c.dot(&s.clone().cholesky().unwrap().solve(&c));
            let found = dot(&white[range.clone()], &white[range]);
            assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
        }
        assert!((whitener.log_det - log_det).abs() < 1e-9);
    }
}
