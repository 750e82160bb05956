//! The numbers of a Cholesky factor in single or double precision.

use std::ops::{AddAssign, Div, DivAssign, Mul, SubAssign};

use faer::{
    Mat, MatMut, Par, Spec,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{matmul::triangular, triangular_inverse},
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::cholesky::{
            SymbolicCholesky, SymbolicCholeskyRaw,
            supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky},
        },
    },
    traits::RealField,
};

use wide::{f32x16, f64x8};

use super::{NotPositiveDefinite, Pattern};
use faer::Side;

/// Which triangle of the factor.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Half {
    Forward,
    Backward,
}

/// Precision of a factor.
pub(super) trait Real:
    RealField + Copy + Default + AddAssign + SubAssign + DivAssign + Mul<Output = Self> + Div<Output = Self>
{
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn to_f32(self) -> f32;
    /// `self a + b`, rounded once.
    fn fused(self, a: Self, b: Self) -> Self;
    /// Scalar product.
    fn product(a: &[Self], b: &[Self]) -> Self;
}

/// Scalar product in vectors of `$width` lanes.
macro_rules! product {
    ($a:ident, $b:ident, $vector:ty, $width:literal) => {{
        let ((a, a_rest), (b, b_rest)) = ($a.as_chunks::<$width>(), $b.as_chunks::<$width>());
        let term = |k: usize, sum: $vector| <$vector>::new(a[k]).mul_add(<$vector>::new(b[k]), sum);
        let count = a.len().min(b.len());
        let mut sums = [<$vector>::ZERO; 4];
        let fours = count / 4 * 4;
        for first in (0..fours).step_by(4) {
            sums = std::array::from_fn(|k| term(first + k, sums[k]));
        }
        for k in fours..count {
            sums[0] = term(k, sums[0]);
        }
        let sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])).reduce_add();
        a_rest.iter().zip(b_rest).fold(sum, |sum, (a, b)| a.mul_add(*b, sum))
    }};
}

impl Real for f32 {
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn to_f32(self) -> f32 {
        self
    }
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
    #[inline(always)]
    fn product(a: &[Self], b: &[Self]) -> Self {
        product!(a, b, f32x16, 16)
    }
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
    fn to_f32(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
    #[inline(always)]
    fn product(a: &[Self], b: &[Self]) -> Self {
        product!(a, b, f64x8, 8)
    }
}

/// The factor's numbers.
pub(super) struct Numeric<T> {
    values: Vec<T>,
    scratch: MemBuffer,
    /// Trailing block of the factor, lower triangular, shape (contact, contact).
    trailing: Mat<T>,
    /// Compliance of the last contact dofs, shape (their number, their number).
    compliance: Mat<T>,
    /// A right-hand side in the factor's precision, and the part of it that a supernode reads and writes.
    work: Vec<T>,
    part: Vec<T>,
}

impl<T: Real> Numeric<T> {
    pub fn new(symbolic: &SymbolicCholesky<usize>, contact: usize) -> Self {
        let numeric = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default());
        Self {
            values: vec![T::from_f64(0.0); symbolic.len_val()],
            scratch: MemBuffer::new(numeric),
            trailing: Mat::zeros(contact, contact),
            compliance: Mat::new(),
            work: Vec::new(),
            part: Vec::new(),
        }
    }

    pub fn factorise(
        &mut self,
        analysis: &SymbolicCholesky<usize>,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<(), NotPositiveDefinite> {
        let values: Vec<T> = values.iter().map(|v| T::from_f64(*v)).collect();
        let matrix = SparseColMatRef::new(symbolic(pattern), values.as_slice());
        analysis
            .factorize_numeric_llt(
                &mut self.values,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Spec::default(),
            )
            .map_err(|faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index }| {
                NotPositiveDefinite { pivot: index }
            })?;
        self.extract_trailing(analysis);
        Ok(())
    }

    fn extract_trailing(&mut self, analysis: &SymbolicCholesky<usize>) {
        let first = analysis.nrows() - self.trailing.nrows();
        let llt = SupernodalLltRef::new(supernodal(analysis), &self.values);
        for s in (0..supernodal(analysis).n_supernodes()).rev() {
            let node = llt.supernode(s);
            let (start, columns) = (node.start(), node.val().ncols());
            if start + columns <= first {
                break;
            }
            for k in first.saturating_sub(start)..columns {
                let column = node.val().col(k);
                for i in k..columns {
                    self.trailing[(start + i - first, start + k - first)] = column[i];
                }
                for (i, row) in node.pattern().iter().enumerate() {
                    self.trailing[(row - first, start + k - first)] = column[columns + i];
                }
            }
        }
    }

    /// Makes the compliance `G = L^-T L^-1` of the contact dofs from `first` on.
    pub fn make_compliance(&mut self, first: usize) {
        let c = self.trailing.nrows() - first;
        if self.compliance.nrows() != c {
            self.compliance = Mat::zeros(c, c);
        }
        if c == 0 {
            return;
        }
        let mut inverse = Mat::<T>::zeros(c, c);
        let last = self.trailing.submatrix(first, first, c, c);
        triangular_inverse::invert_lower_triangular(inverse.as_mut(), last, Par::Seq);
        triangular::matmul(
            self.compliance.as_mut(),
            triangular::BlockStructure::TriangularLower,
            faer::Accum::Replace,
            inverse.as_ref().transpose(),
            triangular::BlockStructure::TriangularUpper,
            inverse.as_ref(),
            triangular::BlockStructure::TriangularLower,
            T::from_f64(1.0),
            Par::Seq,
        );
        self.mirror_compliance();
    }

    /// Copies the compliance's lower half to its upper, tile by tile, since one of them is met across its columns.
    fn mirror_compliance(&mut self) {
        const TILE: usize = 32;
        let size = self.compliance.nrows();
        for left in (0..size).step_by(TILE) {
            for top in (left..size).step_by(TILE) {
                for column in left..(left + TILE).min(size) {
                    for row in top.max(column + 1)..(top + TILE).min(size) {
                        self.compliance[(column, row)] = self.compliance[(row, column)];
                    }
                }
            }
        }
    }

    /// `out += G force`, both of all contact dofs; no dof before those of the compliance may have a force.
    pub fn add_compliance_times(&self, force: &[f64], out: &mut [f64]) {
        let first = force.len() - self.compliance.nrows();
        debug_assert!(force[..first].iter().all(|&f| f == 0.0), "a force where there is no compliance");
        let (force, out) = (&force[first..], &mut out[first..]);
        let column = |j: usize| self.compliance.col_as_slice(j);
        let loaded: Vec<usize> = (0..force.len()).filter(|&j| force[j] != 0.0).collect();
        let (fours, rest) = loaded.as_chunks::<4>();
        for four in fours {
            let [a, b, c, d] = four.map(column);
            let f = four.map(|j| force[j]);
            for (i, out) in out.iter_mut().enumerate() {
                let ab = a[i].to_f64() * f[0] + b[i].to_f64() * f[1];
                *out += ab + (c[i].to_f64() * f[2] + d[i].to_f64() * f[3]);
            }
        }
        for &j in rest {
            for (out, g) in out.iter_mut().zip(column(j)) {
                *out += g.to_f64() * force[j];
            }
        }
    }

    /// Rows and columns of G of these contact dofs, column-major.
    pub fn compliance_among(&self, dofs: &[usize]) -> Vec<f32> {
        let first = self.trailing.nrows() - self.compliance.nrows();
        let mut out = Vec::with_capacity(dofs.len() * dofs.len());
        for &j in dofs {
            let column = self.compliance.col_as_slice(j - first);
            out.extend(dofs.iter().map(|&i| column[i - first].to_f32()));
        }
        out
    }

    pub fn solve_half(&mut self, analysis: &SymbolicCholesky<usize>, x: &mut [f64], half: Half) {
        let symbolic = supernodal(analysis);
        let llt = SupernodalLltRef::new(symbolic, &self.values);
        self.work.clear();
        self.work.extend(x.iter().map(|v| T::from_f64(*v)));
        let work = &mut self.work;
        let part = &mut self.part;
        let mut through = |s: usize| {
            let node = llt.supernode(s);
            let (matrix, below) = (node.val(), node.pattern());
            let own = node.start()..node.start() + matrix.ncols();
            let column = |j: usize| &matrix.col(j).try_as_col_major().expect("contiguous columns").as_slice()[j..];
            part.clear();
            part.extend_from_slice(&work[own.clone()]);
            match half {
                Half::Forward => {
                    part.resize(matrix.nrows(), T::default());
                    forward(own.len(), column, part);
                    below.iter().zip(&part[own.len()..]).for_each(|(&row, by)| work[row] += *by);
                }
                Half::Backward => {
                    part.extend(below.iter().map(|&row| work[row]));
                    backward(own.len(), column, part);
                }
            }
            work[own.clone()].copy_from_slice(&part[..own.len()]);
        };
        match half {
            Half::Forward => (0..symbolic.n_supernodes()).for_each(&mut through),
            Half::Backward => (0..symbolic.n_supernodes()).rev().for_each(&mut through),
        }
        for (x, w) in x.iter_mut().zip(&self.work) {
            *x = w.to_f64();
        }
    }

    pub fn solve_trailing(&mut self, x: &mut [f64], half: Half) {
        self.work.clear();
        self.work.extend(x.iter().map(|v| T::from_f64(*v)));
        let column = |j: usize| &self.trailing.col_as_slice(j)[j..];
        match half {
            Half::Forward => forward(self.trailing.ncols(), column, &mut self.work),
            Half::Backward => backward(self.trailing.ncols(), column, &mut self.work),
        }
        for (x, w) in x.iter_mut().zip(&self.work) {
            *x = w.to_f64();
        }
    }

    /// Residual over right-hand side of a solve for an even load on the contact dofs (on all, if there are none).
    pub fn residual(&mut self, analysis: &SymbolicCholesky<usize>, pattern: &Pattern, values: &[f64]) -> f64 {
        let (n, c) = (pattern.size(), self.trailing.nrows());
        let loaded = if c > 0 { n - c } else { 0 };
        let load: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i >= loaded))).collect();
        let mut x = load.clone();
        self.solve_half(analysis, &mut x, Half::Forward);
        self.solve_half(analysis, &mut x, Half::Backward);
        let mut residual = load.clone();
        for j in 0..n {
            for k in pattern.column_start[j]..pattern.column_start[j + 1] {
                let i = pattern.row[k];
                residual[i] -= values[k] * x[j];
                if i != j {
                    residual[j] -= values[k] * x[i];
                }
            }
        }
        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        norm(&residual) / norm(&load)
    }
}

/// Columns of a factor that a solve takes at a time, so that each is read once and the right-hand side seldom.
const BLOCK: usize = 8;

/// Forward solve with the columns of a trapezoid: `x` is the right-hand side of its own `columns` rows and, after them,
/// the sums of the rows below so far. `column` gives a column from its diagonal on.
#[inline(always)]
fn forward<'a, T: Real + 'a>(columns: usize, column: impl Fn(usize) -> &'a [T], x: &mut [T]) {
    let mut first = 0;
    while first + BLOCK <= columns {
        let block: [&[T]; BLOCK] = std::array::from_fn(|k| column(first + k));
        let mut minus = [T::default(); BLOCK];
        for k in 0..BLOCK {
            let solved = x[first + k] / block[k][0];
            x[first + k] = solved;
            minus[k] -= solved;
            for i in k + 1..BLOCK {
                x[first + i] = block[k][i - k].fused(minus[k], x[first + i]);
            }
        }
        let rest = &mut x[first + BLOCK..];
        let below: [&[T]; BLOCK] = std::array::from_fn(|k| &block[k][BLOCK - k..][..rest.len()]);
        for (i, x) in rest.iter_mut().enumerate() {
            *x = (0..BLOCK).fold(*x, |sum, k| below[k][i].fused(minus[k], sum));
        }
        first += BLOCK;
    }
    for j in first..columns {
        let column = column(j);
        let solved = x[j] / column[0];
        x[j] = solved;
        let mut minus = T::default();
        minus -= solved;
        x[j + 1..].iter_mut().zip(&column[1..]).for_each(|(x, l)| *x = l.fused(minus, *x));
    }
}

/// Backward solve with the columns of a trapezoid: `x` is the right-hand side of its own `columns` rows and, after them, the
/// solution below.
#[inline(always)]
fn backward<'a, T: Real + 'a>(columns: usize, column: impl Fn(usize) -> &'a [T], x: &mut [T]) {
    for j in (0..columns).rev() {
        let column = column(j);
        let (diagonal, below) = (column[0], &column[1..]);
        x[j] -= T::product(below, &x[j + 1..]);
        x[j] /= diagonal;
    }
}

pub(super) fn supernodal(analysis: &SymbolicCholesky<usize>) -> &SymbolicSupernodalCholesky<usize> {
    match analysis.raw() {
        SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodal was forced"),
    }
}

pub(super) fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.row)
}

pub(super) fn column<T>(x: &mut [T]) -> MatMut<'_, T> {
    let n = x.len();
    MatMut::from_column_major_slice_mut(x, n, 1)
}
