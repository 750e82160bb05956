//! Materials as elements ask for them.

use nalgebra::Vector3;
use wide::f64x8;

use crate::element::{Batch, Constitutive, Forces, Tangent};
use crate::material::{Hyperelastic, Material, SaintVenantKirchhoff};

/// The law of a material, as a batch of elements uses it; the one place of the solver that tells laws apart.
pub(super) fn law<const N: usize, const Q: usize>(material: &Material) -> &dyn BatchLaw<N, Q> {
    match material {
        Material::NeoHooke(law) => law,
        Material::MooneyRivlin(law) => law,
        Material::Yeoh(law) => law,
        Material::OgdenSeries(law) => law,
        Material::Linear(law) => law,
        Material::Ogden(law) => law,
    }
}

/// Forces, stiffness and energies of a batch of elements whose material is `self`.
pub(super) trait BatchLaw<const N: usize, const Q: usize> {
    /// Forces and smallest det F at the positions `x`, mm.
    fn forces(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>]) -> Forces<N>;
    /// Derivative of the forces over positions, N/mm.
    fn tangent(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], out: &mut Tangent<N>);
    /// Energy of each element, mJ.
    fn energies(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>]) -> [f64; 8];
}

impl<L: Constitutive, const N: usize, const Q: usize> BatchLaw<N, Q> for L {
    fn forces(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>]) -> Forces<N> {
        batch.forces(self, x)
    }
    fn tangent(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], out: &mut Tangent<N>) {
        batch.tangent(self, x, out);
    }
    fn energies(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>]) -> [f64; 8] {
        batch.energies(self, x)
    }
}

impl<L: Hyperelastic> Constitutive for L {
    fn energy(&self, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        Hyperelastic::energy(self, b, j)
    }
    fn stress(&self, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        Hyperelastic::stress(self, b, j)
    }
    fn moduli(&self, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        let moduli = Hyperelastic::moduli(self, b, j);
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
