//! Linear algebra; the only file that names faer.
//!
//! The bulk stiffness is factorised with the contact dofs last, so that one factorisation also gives the
//! dense compliance of the contact dofs, `G = (K^-1)_CC`. Everything runs on the calling thread.

use faer::{
    Conj, Mat, MatMut, MatRef, Par, Side, Spec,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{matmul::matmul, matmul::triangular, solvers::PartialPivLu, triangular_inverse, triangular_solve},
    prelude::Solve,
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            SupernodalThreshold,
            cholesky::{
                CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
                factorize_symbolic_cholesky,
                supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky},
            },
        },
    },
};

use crate::assembly::Pattern;

/// The matrix is not positive definite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the stiffness is not positive definite at pivot {pivot}")]
pub struct NotPositiveDefinite {
    /// Index of the first pivot that failed.
    pub pivot: usize,
}

/// Cholesky factor of the bulk stiffness with its contact compliance.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    scratch: MemBuffer,
    contact: usize,
    /// Trailing block of the factor, lower triangular, shape (contact, contact).
    trailing: Mat<f64>,
    compliance: Mat<f64>,
}

impl Factor {
    /// Symbolic analysis of a matrix that is already in elimination order, its last `contact` rows being the
    /// contact dofs.
    pub fn analyse(pattern: &Pattern, contact: usize) -> Self {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        // Without a permutation the analysis reads the upper triangle, whatever side it is told.
        let upper = pattern.transposed();
        let symbolic = factorize_symbolic_cholesky(symbolic(&upper), Side::Upper, SymmetricOrdering::Identity, params)
            .expect("enough memory for the symbolic factor");
        let numeric = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        Self {
            values: vec![0.0; symbolic.len_val()],
            scratch: MemBuffer::new(numeric.or(solve)),
            symbolic,
            contact,
            trailing: Mat::zeros(contact, contact),
            compliance: Mat::zeros(contact, contact),
        }
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Numeric factorisation of `values` on the pattern given to [`Self::analyse`].
    pub fn factorise(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), NotPositiveDefinite> {
        let matrix = SparseColMatRef::new(symbolic(pattern), values);
        self.symbolic
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
        self.extract_compliance();
        Ok(())
    }

    fn supernodal(&self) -> &SymbolicSupernodalCholesky<usize> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodal was forced"),
        }
    }

    fn extract_compliance(&mut self) {
        let c = self.contact;
        if c == 0 {
            return;
        }
        let first = self.symbolic.nrows() - c;
        let mut trailing = Mat::zeros(c, c);
        let llt = SupernodalLltRef::new(self.supernodal(), &self.values);
        for s in (0..self.supernodal().n_supernodes()).rev() {
            let node = llt.supernode(s);
            let (start, columns) = (node.start(), node.val().ncols());
            if start + columns <= first {
                break;
            }
            for k in first.saturating_sub(start)..columns {
                let column = node.val().col(k);
                for i in k..columns {
                    trailing[(start + i - first, start + k - first)] = column[i];
                }
                for (i, row) in node.pattern().iter().enumerate() {
                    trailing[(row - first, start + k - first)] = column[columns + i];
                }
            }
        }
        let mut inverse = Mat::<f64>::zeros(c, c);
        triangular_inverse::invert_lower_triangular(inverse.as_mut(), trailing.as_ref(), Par::Seq);
        triangular::matmul(
            self.compliance.as_mut(),
            triangular::BlockStructure::Rectangular,
            faer::Accum::Replace,
            inverse.as_ref().transpose(),
            triangular::BlockStructure::TriangularUpper,
            inverse.as_ref(),
            triangular::BlockStructure::TriangularLower,
            1.0,
            Par::Seq,
        );
        self.trailing = trailing;
    }

    /// Column `j` of the contact compliance G (mm/N), length `contact`.
    pub fn compliance_column(&self, j: usize) -> &[f64] {
        self.compliance.col_as_slice(j)
    }

    /// Forward half of a solve: overwrites `x` by `L^-1 x`.
    pub fn forward(&mut self, x: &mut [f64]) {
        let llt = SupernodalLltRef::new(
            match self.symbolic.raw() {
                SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
                SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodal was forced"),
            },
            &self.values,
        );
        llt.l_solve_with_conj(Conj::No, column(x), Par::Seq, MemStack::new(&mut self.scratch));
    }

    /// Backward half of a solve: overwrites `x` by `L^-T x`.
    pub fn backward(&mut self, x: &mut [f64]) {
        let llt = SupernodalLltRef::new(
            match self.symbolic.raw() {
                SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
                SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodal was forced"),
            },
            &self.values,
        );
        llt.l_transpose_solve_with_conj(Conj::No, column(x), Par::Seq, MemStack::new(&mut self.scratch));
    }

    /// Contact part of the solution from the contact part of a forward-solved right-hand side.
    pub fn contact_backward(&self, x: &mut [f64]) {
        triangular_solve::solve_upper_triangular_in_place(self.trailing.transpose(), column(x), Par::Seq);
    }

    /// Forward solve of a right-hand side that is zero but on the contact dofs.
    pub fn contact_forward(&self, x: &mut [f64]) {
        triangular_solve::solve_lower_triangular_in_place(self.trailing.as_ref(), column(x), Par::Seq);
    }
}

fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.row)
}

fn column(x: &mut [f64]) -> MatMut<'_, f64> {
    let n = x.len();
    MatMut::from_column_major_slice_mut(x, n, 1)
}

/// Dense non-symmetric LU with partial pivoting.
pub struct DenseLu(PartialPivLu<f64>);

impl DenseLu {
    /// Factorises the column-major `matrix` of `n` rows.
    pub fn new(matrix: &[f64], n: usize) -> Self {
        faer::set_global_parallelism(Par::Seq);
        Self(PartialPivLu::new(MatRef::from_column_major_slice(matrix, n, n)))
    }

    /// Overwrites `x` by the solution; NaN if the matrix is singular.
    pub fn solve(&self, x: &mut [f64]) {
        self.0.solve_in_place(column(x));
    }
}

/// `out = left * right` for column-major matrices of shapes (m, k) and (k, n).
pub fn multiply(left: &[f64], right: &[f64], out: &mut [f64], m: usize, k: usize, n: usize) {
    matmul(
        MatMut::from_column_major_slice_mut(out, m, n),
        faer::Accum::Replace,
        MatRef::from_column_major_slice(left, m, k),
        MatRef::from_column_major_slice(right, k, n),
        1.0,
        Par::Seq,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grid Laplacian plus identity on w x h vertices, lower triangle in natural order.
    fn grid(w: usize, h: usize) -> (Pattern, Vec<f64>, Vec<Vec<u32>>) {
        let n = w * h;
        let mut neighbours = vec![Vec::new(); n];
        for y in 0..h {
            for x in 0..w {
                let v = y * w + x;
                if x + 1 < w {
                    neighbours[v].push((v + 1) as u32);
                    neighbours[v + 1].push(v as u32);
                }
                if y + 1 < h {
                    neighbours[v].push((v + w) as u32);
                    neighbours[v + w].push(v as u32);
                }
            }
        }
        let mut pattern = Pattern { column_start: vec![0], row: Vec::new() };
        let mut values = Vec::new();
        for (v, list) in neighbours.iter().enumerate() {
            pattern.row.push(v);
            values.push(1.0 + list.len() as f64);
            let mut below: Vec<usize> = list.iter().map(|&u| u as usize).filter(|&u| u > v).collect();
            below.sort_unstable();
            for u in below {
                pattern.row.push(u);
                values.push(-1.0);
            }
            pattern.column_start.push(pattern.row.len());
        }
        (pattern, values, neighbours)
    }

    fn multiply_symmetric(pattern: &Pattern, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for j in 0..pattern.size() {
            for k in pattern.column_start[j]..pattern.column_start[j + 1] {
                let i = pattern.row[k];
                y[i] += values[k] * x[j];
                if i != j {
                    y[j] += values[k] * x[i];
                }
            }
        }
        y
    }

    #[test]
    fn halves_of_a_solve_make_a_solve_and_the_compliance_is_the_inverse_block() {
        let (pattern, values, _) = grid(9, 7);
        let (n, c) = (63, 11);
        let mut factor = Factor::analyse(&pattern, c);
        factor.factorise(&pattern, &values).unwrap();
        let exact: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let mut x = multiply_symmetric(&pattern, &values, &exact);
        factor.forward(&mut x);
        let mut tail = x[n - c..].to_vec();
        factor.contact_backward(&mut tail);
        factor.backward(&mut x);
        for i in 0..n {
            assert!((x[i] - exact[i]).abs() < 1e-13);
        }
        for i in 0..c {
            assert!((tail[i] - exact[n - c + i]).abs() < 1e-13);
        }
        for j in 0..c {
            let mut unit = vec![0.0; n];
            unit[n - c + j] = 1.0;
            let mut short = unit[n - c..].to_vec();
            factor.contact_forward(&mut short);
            factor.forward(&mut unit);
            for i in 0..c {
                assert!((unit[n - c + i] - short[i]).abs() < 1e-14);
            }
            factor.backward(&mut unit);
            for i in 0..c {
                assert!((unit[n - c + i] - factor.compliance_column(j)[i]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_is_an_error() {
        let (pattern, mut values, _) = grid(4, 4);
        values[0] = -1.0;
        let mut factor = Factor::analyse(&pattern, 2);
        assert_eq!(factor.factorise(&pattern, &values), Err(NotPositiveDefinite { pivot: 0 }));
    }

    #[test]
    fn dense_lu_solves_a_non_symmetric_system() {
        let lu = DenseLu::new(&[0.0, 2.0, 1.0, 1.0], 2);
        let mut x = [3.0, 4.0];
        lu.solve(&mut x);
        assert!((x[0] - 0.5).abs() < 1e-15 && (x[1] - 3.0).abs() < 1e-15);
    }
}
