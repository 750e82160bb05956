//! Dense matrices of the contact dofs.

use faer::{
    MatMut, MatRef, Par,
    linalg::{matmul::matmul, solvers::PartialPivLu},
    prelude::Solve,
};

use super::numeric::column;

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
