//! Linear algebra; with its parts the only file that names faer.
//!
//! The bulk stiffness is factorised with the contact dofs last, so that one factorisation also gives the
//! dense compliance of the contact dofs, `G = (K^-1)_CC`. Everything runs on the calling thread.

mod dense;
mod krylov;
mod numeric;

use faer::{
    Side,
    sparse::linalg::{
        SupernodalThreshold,
        cholesky::{CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky},
    },
};

use self::numeric::{Half, Numeric, symbolic};
use crate::assembly::Pattern;

pub use self::dense::{DenseLu, solve_dense};
pub use self::krylov::{KrylovSolution, gmres};

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
/// Held in single precision: half the memory, little more than half the time, and equilibrium is judged by forces that
/// are computed in double. If single precision does not solve a load on the contact dofs well enough, the factor
/// changes to double permanently. The solver requests the same if a new factor does not reduce the residual.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    numeric: Numbers,
    contact: usize,
    /// First contact dof with a compliance.
    compliant_from: usize,
}

/// In which precision a factor is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Precision {
    /// Single; whether it solves a load well enough is not tested yet.
    SingleUnproven,
    /// Single, which has solved a load well enough.
    Single,
    /// Double, permanently.
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
        // Without a permutation the analysis reads the upper triangle, for either value of its argument.
        let upper = pattern.transposed();
        let symbolic = factorize_symbolic_cholesky(symbolic(&upper), Side::Upper, SymmetricOrdering::Identity, params)
            .expect("enough memory for the symbolic factor");
        Self {
            numeric: Numbers::Single { numeric: Numeric::new(&symbolic, contact), proven: false },
            symbolic,
            contact,
            compliant_from: 0,
        }
    }

    /// First contact dof with a compliance.
    pub fn compliant_from(&self) -> usize {
        self.compliant_from
    }

    /// Future factors get a compliance of the contact dofs from `first` on.
    pub fn set_compliant_from(&mut self, first: usize) {
        self.compliant_from = first;
    }

    /// Gives this factor, and future ones, a compliance of the contact dofs from `first` on.
    pub fn make_compliance_from(&mut self, first: usize) {
        self.compliant_from = first;
        match &mut self.numeric {
            Numbers::Single { numeric, .. } => numeric.make_compliance(first),
            Numbers::Double(numeric) => numeric.make_compliance(first),
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

    /// Sets the precision that [`Self::precision`] returned for another factor of this matrix.
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
                    numeric.make_compliance(self.compliant_from);
                    return Ok(());
                }
            }
            self.use_double_precision();
        }
        let Numbers::Double(numeric) = &mut self.numeric else { unreachable!("just made double") };
        numeric.factorise(&self.symbolic, pattern, values)?;
        numeric.make_compliance(self.compliant_from);
        Ok(())
    }

    /// `out += G force` (mm, N), contact dofs; G is the contact compliance.
    pub fn add_compliance_times(&self, force: &[f64], out: &mut [f64]) {
        match &self.numeric {
            Numbers::Single { numeric, .. } => numeric.add_compliance_times(force, out),
            Numbers::Double(numeric) => numeric.add_compliance_times(force, out),
        }
    }

    /// Rows and columns of the contact compliance (mm/N) of these contact dofs, column-major, in single precision.
    pub fn compliance_among(&self, dofs: &[usize]) -> Vec<f32> {
        match &self.numeric {
            Numbers::Single { numeric, .. } => numeric.compliance_among(dofs),
            Numbers::Double(numeric) => numeric.compliance_among(dofs),
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
        let among = factor.compliance_among(&[7, 2]);
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
            let mut load = vec![0.0; c];
            load[j] = 2.0;
            let mut moved = vec![1.0; c];
            factor.add_compliance_times(&load, &mut moved);
            if j == 2 {
                assert!((among[2] as f64 - unit[n - c + 7]).abs() < 1e-6);
                assert!((among[3] as f64 - unit[n - c + 2]).abs() < 1e-6);
            }
            for i in 0..c {
                assert!((1.0 + 2.0 * unit[n - c + i] - moved[i]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_compliance_of_the_last_dofs_is_that_part_of_the_whole() {
        let (pattern, values, _) = grid(9, 7);
        let (c, first) = (11, 4);
        let mut factor = Factor::analyse(&pattern, c);
        factor.factorise(&pattern, &values).unwrap();
        let load: Vec<f64> = (0..c).map(|j| if j < first { 0.0 } else { 1.0 + j as f64 }).collect();
        let (mut whole, mut part) = (vec![0.0; c], vec![0.0; c]);
        factor.add_compliance_times(&load, &mut whole);
        let among = factor.compliance_among(&[9, 5]);
        factor.make_compliance_from(first);
        factor.add_compliance_times(&load, &mut part);
        assert_eq!(part[..first], vec![0.0; first]);
        for (whole, part) in whole[first..].iter().zip(&part[first..]) {
            assert!((whole - part).abs() < 1e-6 * whole.abs(), "{whole} {part}");
        }
        for (whole, part) in among.iter().zip(factor.compliance_among(&[9, 5])) {
            assert!((whole - part).abs() < 1e-6, "{whole} {part}");
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
        let mut lu = DenseLu::new(vec![0.0, 2.0, 1.0, 1.0], 2);
        let mut x = [3.0, 4.0];
        lu.solve(&mut x);
        assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] - 3.0).abs() < 1e-6);
    }

    /// Non-symmetric, with the factor of a matrix from which two rows differ and with none.
    #[test]
    fn a_krylov_solution_is_that_of_the_system() {
        let n = 30;
        let entry = |i: usize, j: usize| {
            let far = (i as f64 - j as f64).abs();
            (if i == j { 3.0 } else { 0.0 }) + (1.0 + 0.3 * (i as f64).sin()) / (1.0 + far)
        };
        let changed = |i: usize, j: usize| if i % 17 == 3 { -2.0 * entry(i, j) } else { entry(i, j) };
        let exact: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let apply = |x: &[f64], out: &mut [f64]| {
            for i in 0..n {
                out[i] = (0..n).map(|j| changed(i, j) * x[j]).sum();
            }
        };
        let mut b = vec![0.0; n];
        apply(&exact, &mut b);
        let matrix = (0..n * n).map(|k| entry(k % n, k / n) as f32).collect();
        let mut lu = DenseLu::new(matrix, n);
        let preconditioned = gmres(apply, |x| lu.solve(x), &b, 1e-12, n);
        let plain = gmres(apply, |_| (), &b, 1e-12, n);
        assert!(preconditioned.iterations < 8 && plain.iterations > 12, "{}", plain.iterations);
        for found in [preconditioned, plain] {
            for (x, exact) in found.x.iter().zip(&exact) {
                assert!((x - exact).abs() < 1e-10, "{x} {exact}");
            }
        }
    }
}
