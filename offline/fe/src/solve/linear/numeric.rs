//! The numbers of a Cholesky factor in single or double precision.

use faer::{
    Conj, Mat, MatMut, Par, Spec,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{matmul::triangular, triangular_inverse, triangular_solve},
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::cholesky::{
            SymbolicCholesky, SymbolicCholeskyRaw,
            supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky},
        },
    },
    traits::RealField,
};

use super::NotPositiveDefinite;
use crate::assembly::Pattern;
use faer::Side;

/// Which triangle of the factor.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Half {
    Forward,
    Backward,
}

/// Precision of a factor.
pub(super) trait Real: RealField + Copy {
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn to_f32(self) -> f32;
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
}

/// The factor's numbers.
pub(super) struct Numeric<T> {
    values: Vec<T>,
    scratch: MemBuffer,
    /// Trailing block of the factor, lower triangular, shape (contact, contact).
    trailing: Mat<T>,
    /// Compliance of the last contact dofs, shape (their number, their number).
    compliance: Mat<T>,
    /// A right-hand side in the factor's precision.
    work: Vec<T>,
}

impl<T: Real> Numeric<T> {
    pub fn new(symbolic: &SymbolicCholesky<usize>, contact: usize) -> Self {
        let numeric = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default());
        let solve = symbolic.solve_in_place_scratch::<T>(1, Par::Seq);
        Self {
            values: vec![T::from_f64(0.0); symbolic.len_val()],
            scratch: MemBuffer::new(numeric.or(solve)),
            trailing: Mat::zeros(contact, contact),
            compliance: Mat::new(),
            work: Vec::new(),
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
            triangular::BlockStructure::Rectangular,
            faer::Accum::Replace,
            inverse.as_ref().transpose(),
            triangular::BlockStructure::TriangularUpper,
            inverse.as_ref(),
            triangular::BlockStructure::TriangularLower,
            T::from_f64(1.0),
            Par::Seq,
        );
    }

    /// `out += G force`, both of all contact dofs, none of which bears a force before those of the compliance.
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
        let llt = SupernodalLltRef::new(supernodal(analysis), &self.values);
        self.work.clear();
        self.work.extend(x.iter().map(|v| T::from_f64(*v)));
        let stack = MemStack::new(&mut self.scratch);
        match half {
            Half::Forward => llt.l_solve_with_conj(Conj::No, column(&mut self.work), Par::Seq, stack),
            Half::Backward => llt.l_transpose_solve_with_conj(Conj::No, column(&mut self.work), Par::Seq, stack),
        }
        for (x, w) in x.iter_mut().zip(&self.work) {
            *x = w.to_f64();
        }
    }

    pub fn solve_trailing(&mut self, x: &mut [f64], half: Half) {
        self.work.clear();
        self.work.extend(x.iter().map(|v| T::from_f64(*v)));
        let lower = self.trailing.as_ref();
        match half {
            Half::Forward => triangular_solve::solve_lower_triangular_in_place(lower, column(&mut self.work), Par::Seq),
            Half::Backward => {
                triangular_solve::solve_upper_triangular_in_place(lower.transpose(), column(&mut self.work), Par::Seq);
            }
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
