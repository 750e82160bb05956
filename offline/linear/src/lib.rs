//! Linear algebra of the finite elements; no other package names faer, so that its generic code is compiled once.
//!
//! The bulk stiffness is factorised with the contact dofs last, so that one factorisation also gives the
//! dense compliance of the contact dofs, `G = (K^-1)_CC`. Everything runs on the calling thread.
//!
//! Main types: [`Pattern`], [`Factor`], [`DenseLu`]. Uses no other package of this workspace.

mod dense;
mod krylov;
mod numeric;
mod pattern;

use faer::{
    Side,
    sparse::linalg::{
        SupernodalThreshold,
        cholesky::{CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky},
    },
};

use self::numeric::{Half, Numeric, symbolic};

pub use self::dense::{DenseLu, solve_dense};
pub use self::krylov::{KrylovSolution, gmres};
pub use self::pattern::{Pattern, elimination_order};

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
