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
    traits::RealField,
};

use crate::assembly::Pattern;

/// The matrix is not positive definite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the stiffness is not positive definite at pivot {pivot}")]
pub struct NotPositiveDefinite {
    /// Index of the first pivot that failed.
    pub pivot: usize,
}

/// Largest residual of a solve with the single-precision factor, over its right-hand side, that is good enough.
///
/// Equilibrium iterations correct the factor's error; at this size it adds nothing to their number.
const SINGLE_RESIDUAL: f64 = 1e-2;

/// Cholesky factor of the bulk stiffness with its contact compliance.
///
/// Held in single precision: half the memory, little more than half the time, and equilibrium is judged by forces
/// that are computed in double. Where single precision does not solve a load on the contact dofs well enough, the
/// factor turns to double for good; the solver asks for the same where a new factor brings it no nearer to equilibrium.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    numeric: Numbers,
    contact: usize,
    compliance: Mat<f64>,
}

/// In which precision a factor is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Precision {
    /// Single; it remains to be seen whether it solves a load well enough.
    SingleUnproven,
    /// Single, which has solved a load well enough.
    Single,
    /// Double, for good.
    Double,
}

enum Numbers {
    Single { numeric: Numeric<f32>, proven: bool },
    Double(Numeric<f64>),
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
        Self {
            numeric: Numbers::Single { numeric: Numeric::new(&symbolic, contact), proven: false },
            symbolic,
            contact,
            compliance: Mat::zeros(contact, contact),
        }
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Whether the factor is held in single precision.
    pub fn is_single(&self) -> bool {
        matches!(self.numeric, Numbers::Single { .. })
    }

    /// In which precision the factor is held.
    pub fn precision(&self) -> Precision {
        match self.numeric {
            Numbers::Single { proven: false, .. } => Precision::SingleUnproven,
            Numbers::Single { proven: true, .. } => Precision::Single,
            Numbers::Double(_) => Precision::Double,
        }
    }

    /// Takes up the precision that [`Self::precision`] told of another factor of this matrix.
    pub fn set_precision(&mut self, precision: Precision) {
        match (precision, &mut self.numeric) {
            (Precision::Double, _) => self.use_double_precision(),
            (Precision::Single, Numbers::Single { proven, .. }) => *proven = true,
            _ => {}
        }
    }

    /// Factors from the next one on are held in double precision.
    pub fn use_double_precision(&mut self) {
        if self.is_single() {
            self.numeric = Numbers::Double(Numeric::new(&self.symbolic, self.contact));
        }
    }

    /// Numeric factorisation of `values` on the pattern given to [`Self::analyse`].
    ///
    /// # Errors
    /// [`NotPositiveDefinite`].
    pub fn factorise(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), NotPositiveDefinite> {
        if let Numbers::Single { numeric, proven } = &mut self.numeric {
            if numeric.factorise(&self.symbolic, pattern, values).is_ok() {
                *proven = *proven || numeric.residual(&self.symbolic, pattern, values) <= SINGLE_RESIDUAL;
                if *proven {
                    numeric.compliance(self.compliance.as_mut());
                    return Ok(());
                }
            }
            self.use_double_precision();
        }
        let Numbers::Double(numeric) = &mut self.numeric else { unreachable!("just made double") };
        numeric.factorise(&self.symbolic, pattern, values)?;
        numeric.compliance(self.compliance.as_mut());
        Ok(())
    }

    /// Column `j` of the contact compliance G (mm/N), length `contact`.
    pub fn compliance_column(&self, j: usize) -> &[f64] {
        self.compliance.col_as_slice(j)
    }

    /// `out += G force` (mm, N), contact dofs.
    pub fn add_compliance_times(&self, force: &[f64], out: &mut [f64]) {
        for (j, f) in force.iter().enumerate().filter(|(_, f)| **f != 0.0) {
            for (out, g) in out.iter_mut().zip(self.compliance_column(j)) {
                *out += g * f;
            }
        }
    }

    /// Forward half of a solve: overwrites `x` by `L^-1 x`.
    pub fn forward(&mut self, x: &mut [f64]) {
        match &mut self.numeric {
            Numbers::Single { numeric, .. } => numeric.solve_half(&self.symbolic, x, Half::Forward),
            Numbers::Double(numeric) => numeric.solve_half(&self.symbolic, x, Half::Forward),
        }
    }

    /// Backward half of a solve: overwrites `x` by `L^-T x`.
    pub fn backward(&mut self, x: &mut [f64]) {
        match &mut self.numeric {
            Numbers::Single { numeric, .. } => numeric.solve_half(&self.symbolic, x, Half::Backward),
            Numbers::Double(numeric) => numeric.solve_half(&self.symbolic, x, Half::Backward),
        }
    }

    /// Contact part of the solution from the contact part of a forward-solved right-hand side.
    pub fn contact_backward(&mut self, x: &mut [f64]) {
        match &mut self.numeric {
            Numbers::Single { numeric, .. } => numeric.solve_trailing(x, Half::Backward),
            Numbers::Double(numeric) => numeric.solve_trailing(x, Half::Backward),
        }
    }

    /// Forward solve of a right-hand side that is zero but on the contact dofs.
    pub fn contact_forward(&mut self, x: &mut [f64]) {
        match &mut self.numeric {
            Numbers::Single { numeric, .. } => numeric.solve_trailing(x, Half::Forward),
            Numbers::Double(numeric) => numeric.solve_trailing(x, Half::Forward),
        }
    }
}

/// Which triangle of the factor.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Half {
    Forward,
    Backward,
}

/// Precision of a factor.
trait Real: RealField + Copy {
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl Real for f32 {
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}

/// The factor's numbers.
struct Numeric<T> {
    values: Vec<T>,
    scratch: MemBuffer,
    /// Trailing block of the factor, lower triangular, shape (contact, contact).
    trailing: Mat<T>,
    /// A right-hand side in the factor's precision.
    work: Vec<T>,
}

impl<T: Real> Numeric<T> {
    fn new(symbolic: &SymbolicCholesky<usize>, contact: usize) -> Self {
        let numeric = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default());
        let solve = symbolic.solve_in_place_scratch::<T>(1, Par::Seq);
        Self {
            values: vec![T::from_f64(0.0); symbolic.len_val()],
            scratch: MemBuffer::new(numeric.or(solve)),
            trailing: Mat::zeros(contact, contact),
            work: Vec::new(),
        }
    }

    fn factorise(
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

    /// `G = L^-T L^-1` of the trailing block.
    fn compliance(&self, mut out: MatMut<'_, f64>) {
        let c = self.trailing.nrows();
        if c == 0 {
            return;
        }
        let mut inverse = Mat::<T>::zeros(c, c);
        triangular_inverse::invert_lower_triangular(inverse.as_mut(), self.trailing.as_ref(), Par::Seq);
        let mut product = Mat::<T>::zeros(c, c);
        triangular::matmul(
            product.as_mut(),
            triangular::BlockStructure::Rectangular,
            faer::Accum::Replace,
            inverse.as_ref().transpose(),
            triangular::BlockStructure::TriangularUpper,
            inverse.as_ref(),
            triangular::BlockStructure::TriangularLower,
            T::from_f64(1.0),
            Par::Seq,
        );
        for j in 0..c {
            for i in 0..c {
                out[(i, j)] = product[(i, j)].to_f64();
            }
        }
    }

    fn solve_half(&mut self, analysis: &SymbolicCholesky<usize>, x: &mut [f64], half: Half) {
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

    fn solve_trailing(&mut self, x: &mut [f64], half: Half) {
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
    fn residual(&mut self, analysis: &SymbolicCholesky<usize>, pattern: &Pattern, values: &[f64]) -> f64 {
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

fn supernodal(analysis: &SymbolicCholesky<usize>) -> &SymbolicSupernodalCholesky<usize> {
    match analysis.raw() {
        SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodal was forced"),
    }
}

fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.row)
}

fn column<T>(x: &mut [T]) -> MatMut<'_, T> {
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
        assert!(factor.is_single());
        for i in 0..n {
            assert!((x[i] - exact[i]).abs() < 1e-5);
        }
        for i in 0..c {
            assert!((tail[i] - exact[n - c + i]).abs() < 1e-5);
        }
        for j in 0..c {
            let mut unit = vec![0.0; n];
            unit[n - c + j] = 1.0;
            let mut short = unit[n - c..].to_vec();
            factor.contact_forward(&mut short);
            factor.forward(&mut unit);
            for i in 0..c {
                assert!((unit[n - c + i] - short[i]).abs() < 1e-6);
            }
            factor.backward(&mut unit);
            for i in 0..c {
                assert!((unit[n - c + i] - factor.compliance_column(j)[i]).abs() < 1e-6);
            }
        }
    }

    /// A stiff square inside a soft sheet, 1e10 apart: single precision cannot solve for a load on the soft edge.
    #[test]
    fn a_factor_that_single_precision_cannot_hold_is_double() {
        let (w, h) = (9, 7);
        let (pattern, mut values, _) = grid(w, h);
        let stiff = |v: usize| v / w < 3;
        for j in 0..w * h {
            for k in pattern.column_start[j]..pattern.column_start[j + 1] {
                let i = pattern.row[k];
                if i == j {
                    // Links without the ground: only the first vertex is held.
                    let links = [j % w > 0, j % w + 1 < w, j / w > 0, j / w + 1 < h];
                    let weight = |there: usize| if stiff(j) && stiff(there) { 1e10 } else { 1.0 };
                    let places = [j.wrapping_sub(1), j + 1, j.wrapping_sub(w), j + w];
                    values[k] = links.iter().zip(places).filter(|(l, _)| **l).map(|(_, p)| weight(p)).sum();
                    values[k] += if j == 0 { 1.0 } else { 0.0 };
                } else if stiff(i) && stiff(j) {
                    values[k] = -1e10;
                }
            }
        }
        let mut factor = Factor::analyse(&pattern, 11);
        factor.factorise(&pattern, &values).unwrap();
        assert!(!factor.is_single());
        let exact: Vec<f64> = (0..w * h).map(|i| if stiff(i) { 1.0 } else { (i as f64 * 0.7).sin() }).collect();
        let mut x = multiply_symmetric(&pattern, &values, &exact);
        factor.forward(&mut x);
        factor.backward(&mut x);
        for (x, exact) in x.iter().zip(&exact) {
            assert!((x - exact).abs() < 1e-3, "{x} {exact}");
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
