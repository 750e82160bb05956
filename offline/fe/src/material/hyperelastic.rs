//! Common parts of the laws of nearly incompressible solids.

use wide::f64x8;

use super::{Moduli, Sym};

/// A law `U = W(l1, l2, l3) + (J − 1)²/D` of the isochoric principal stretches `l_k = J^(-1/3) lambda_k`; the
/// volumetric part is kept apart because the element averages it (mean dilatation).
pub trait Hyperelastic: Copy + Sync {
    /// Isochoric strain energy per undeformed volume, MPa; `b = F F^T`, `j = det F`.
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8;

    /// Isochoric Kirchhoff stress, MPa (traceless).
    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8>;

    /// Isochoric Kirchhoff stress with its moduli.
    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli;

    /// Shear modulus at small strain, MPa.
    fn shear_mpa(&self) -> f64;

    /// Compressibility D, 1/MPa; the bulk modulus is 2/D.
    fn d_per_mpa(&self) -> f64;

    /// The law all of whose stresses are `factor` (> 0) times as large at the same deformation.
    fn stiffened(self, factor: f64) -> Self;

    /// Volumetric pressure-like derivative `dU/dJ = 2 (J − 1)/D`, MPa, tension positive.
    fn volumetric_slope(&self, j: f64x8) -> f64x8 {
        (j - f64x8::ONE) * f64x8::splat(2.0 / self.d_per_mpa())
    }

    /// `d²U/dJ²`, MPa.
    fn volumetric_curvature(&self) -> f64 {
        2.0 / self.d_per_mpa()
    }

    /// Poisson's ratio at small strain.
    fn poisson(&self) -> f64 {
        let (bulk, shear) = (2.0 / self.d_per_mpa(), self.shear_mpa());
        (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)
    }
}

/// Compressibility D (1/MPa) that gives Poisson's ratio `poisson` (0 to 0.5) with a shear modulus at small strain.
pub(super) fn d_of_poisson(shear_mpa: f64, poisson: f64) -> f64 {
    3.0 * (1.0 - 2.0 * poisson) / (shear_mpa * (1.0 + poisson))
}
