//! Materials as elements ask for them.

use wide::f64x8;

use crate::element::Constitutive;
use crate::material::{Ogden, SaintVenantKirchhoff};

/// The law of a region.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Soft tissue: isochoric Ogden with mean dilatation.
    Ogden(Ogden),
    /// Bone, nail: linear elasticity in a total-Lagrangian frame.
    Linear(SaintVenantKirchhoff),
}

impl Constitutive for Ogden {
    fn energy(&self, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        Ogden::energy(self, b, j)
    }
    fn stress(&self, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        Ogden::stress(self, b, j)
    }
    fn moduli(&self, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        let moduli = Ogden::moduli(self, b, j);
        (moduli.tau, moduli.c)
    }
    fn volumetric(&self, ratio: f64x8) -> (f64x8, f64x8, f64x8) {
        let slope = self.volumetric_slope(ratio);
        let energy = slope * (ratio - f64x8::ONE) * f64x8::splat(0.5);
        (energy, slope, f64x8::splat(self.volumetric_curvature()))
    }
}

impl Constitutive for SaintVenantKirchhoff {
    fn energy(&self, b: &[f64x8; 6], _j: f64x8) -> f64x8 {
        SaintVenantKirchhoff::energy(self, b)
    }
    fn stress(&self, b: &[f64x8; 6], _j: f64x8) -> [f64x8; 6] {
        SaintVenantKirchhoff::stress(self, b)
    }
    fn moduli(&self, b: &[f64x8; 6], _j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        let moduli = SaintVenantKirchhoff::moduli(self, b);
        (moduli.tau, moduli.c)
    }
    fn volumetric(&self, _ratio: f64x8) -> (f64x8, f64x8, f64x8) {
        (f64x8::ZERO, f64x8::ZERO, f64x8::ZERO)
    }
}
