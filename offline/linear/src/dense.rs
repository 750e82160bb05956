//! Dense matrices of the contact dofs.

use faer::{
    MatMut, MatRef, Par, Spec,
    dyn_stack::{MemBuffer, MemStack},
    linalg::lu::partial_pivoting::{factor, solve},
    linalg::solvers::PartialPivLu,
    perm::PermRef,
    prelude::Solve,
};

use super::numeric::column;

/// Dense non-symmetric LU with partial pivoting, in single precision.
pub struct DenseLu {
    size: usize,
    /// Unit lower and upper triangle, column-major.
    values: Vec<f32>,
    permutation: Vec<usize>,
    inverse_permutation: Vec<usize>,
    scratch: MemBuffer,
    /// A right-hand side in single precision.
    work: Vec<f32>,
}

impl DenseLu {
    /// Factorises the column-major `matrix` of `size` rows.
    pub fn new(mut matrix: Vec<f32>, size: usize) -> Self {
        let factorisation = factor::lu_in_place_scratch::<usize, f32>(size, size, Par::Seq, Spec::default());
        let solution = solve::solve_in_place_scratch::<usize, f32>(size, 1, Par::Seq);
        let mut scratch = MemBuffer::new(factorisation.or(solution));
        let (mut permutation, mut inverse_permutation) = (vec![0; size], vec![0; size]);
        factor::lu_in_place(
            MatMut::from_column_major_slice_mut(&mut matrix, size, size),
            &mut permutation,
            &mut inverse_permutation,
            Par::Seq,
            MemStack::new(&mut scratch),
            Spec::default(),
        );
        Self { size, values: matrix, permutation, inverse_permutation, scratch, work: Vec::new() }
    }

    /// Overwrites `x` by the solution; NaN if the matrix is singular.
    pub fn solve(&mut self, x: &mut [f64]) {
        self.work.clear();
        self.work.extend(x.iter().map(|v| *v as f32));
        let lu = MatRef::from_column_major_slice(&self.values, self.size, self.size);
        let permutation = PermRef::new_checked(&self.permutation, &self.inverse_permutation, self.size);
        let stack = MemStack::new(&mut self.scratch);
        solve::solve_in_place(lu, lu, permutation, column(&mut self.work), Par::Seq, stack);
        for (x, w) in x.iter_mut().zip(&self.work) {
            *x = f64::from(*w);
        }
    }
}

/// Solution of a dense non-symmetric system of column-major `matrix` in double precision; NaN if the matrix is singular.
pub fn solve_dense(matrix: &[f64], rhs: &[f64]) -> Vec<f64> {
    faer::set_global_parallelism(Par::Seq);
    let mut x = rhs.to_vec();
    PartialPivLu::new(MatRef::from_column_major_slice(matrix, rhs.len(), rhs.len())).solve_in_place(column(&mut x));
    x
}
