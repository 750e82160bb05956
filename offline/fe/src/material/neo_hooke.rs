//! Isochoric neo-Hookean law.

use wide::f64x8;

use super::hyperelastic::d_of_poisson;
use super::invariants::{Isochoric, Slopes};
use super::{Hyperelastic, Moduli, Sym, lame_from_young};

/// Neo-Hooke (Rivlin 1948; the isochoric form of Flory 1961): `U = mu/2 (I1 − 3) + (J − 1)²/D`.
///
/// Equals the Ogden law of one term with `alpha = 2`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NeoHooke {
    /// Shear modulus, MPa, > 0.
    pub mu_mpa: f64,
    /// Compressibility, 1/MPa, > 0.
    pub d_per_mpa: f64,
}

impl NeoHooke {
    /// The law whose constants at small strain are Young's modulus (MPa, > 0) and Poisson's ratio (0 to 0.5).
    pub fn from_young(young_mpa: f64, poisson: f64) -> Self {
        let (_, mu_mpa) = lame_from_young(young_mpa, poisson);
        Self { mu_mpa, d_per_mpa: d_of_poisson(mu_mpa, poisson) }
    }

    fn slopes(&self) -> Slopes {
        Slopes { w1: f64x8::splat(0.5 * self.mu_mpa), w2: f64x8::ZERO, w11: f64x8::ZERO }
    }
}

impl Hyperelastic for NeoHooke {
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        (Isochoric::new(b, j).i1 - f64x8::splat(3.0)) * f64x8::splat(0.5 * self.mu_mpa)
    }

    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        Isochoric::new(b, j).stress(&self.slopes())
    }

    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        Isochoric::new(b, j).moduli(&self.slopes())
    }

    fn shear_mpa(&self) -> f64 {
        self.mu_mpa
    }

    fn d_per_mpa(&self) -> f64 {
        self.d_per_mpa
    }

    fn stiffened(self, factor: f64) -> Self {
        Self { mu_mpa: self.mu_mpa * factor, d_per_mpa: self.d_per_mpa / factor }
    }
}
