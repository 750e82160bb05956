//! Constitutive laws in the form that elements evaluate.

use nalgebra::Vector3;
use wide::f64x8;

use super::relaxing::{PointSteps, Relaxing};
use crate::element::{Batch, Constitutive, ElementStress, Forces, Tangent};
use crate::material::logarithmic::Stretches;
use crate::material::{Hyperelastic, Material, SaintVenantKirchhoff};

/// Stress of the step at the points of a batch, if its tissue relaxes.
type Steps<'a> = Option<PointSteps<'a>>;

/// The law of a material for a batch of elements; the one place of the solver that distinguishes the laws.
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

/// Forces, stiffness, energies and stresses of a batch of elements whose material is `self`.
pub(super) trait BatchLaw<const N: usize, const Q: usize> {
    /// Forces and smallest det F at the positions `x`, mm.
    fn forces(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> Forces<N>;
    /// Derivative of the forces over positions, N/mm.
    fn tangent(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps, out: &mut Tangent<N>);
    /// Plane-strain modulus `E/(1 - nu²)` of the undeformed material, MPa.
    fn plane_strain_modulus_mpa(&self) -> f64;
    /// Energy of each element, mJ.
    fn energies(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> [f64; 8];
    /// Mean stress and strain of each element.
    fn stresses(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> [ElementStress; 8];
    /// Adds the stress of the undeformed frame at every point, MPa.
    fn add_relaxed(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], out: &mut Vec<[[f64; 8]; 6]>);
}

impl<L: Constitutive, const N: usize, const Q: usize> BatchLaw<N, Q> for L {
    fn forces(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> Forces<N> {
        match steps {
            None => batch.forces(self, x),
            Some(steps) => batch.forces(&Relaxing { law: *self, steps }, x),
        }
    }
    fn tangent(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps, out: &mut Tangent<N>) {
        match steps {
            None => batch.tangent(self, x, out),
            Some(steps) => batch.tangent(&Relaxing { law: *self, steps }, x, out),
        }
    }
    fn plane_strain_modulus_mpa(&self) -> f64 {
        let one = f64x8::ONE;
        let (_, c) = self.moduli(&[one, one, one, f64x8::ZERO, f64x8::ZERO, f64x8::ZERO], one);
        let [along, across] = [c[0][0].to_array()[0], c[0][1].to_array()[0]];
        let shear = 0.5 * (along - across);
        let bulk = (along + 2.0 * across) / 3.0 + self.volumetric(one).2.to_array()[0];
        4.0 * shear * (3.0 * bulk + shear) / (3.0 * bulk + 4.0 * shear)
    }
    fn energies(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> [f64; 8] {
        match steps {
            None => batch.energies(self, x),
            Some(steps) => batch.energies(&Relaxing { law: *self, steps }, x),
        }
    }
    fn stresses(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], steps: Steps) -> [ElementStress; 8] {
        match steps {
            None => batch.stresses(self, x),
            Some(steps) => batch.stresses(&Relaxing { law: *self, steps }, x),
        }
    }
    fn add_relaxed(&self, batch: &Batch<N, Q>, x: &[Vector3<f64>], out: &mut Vec<[[f64; 8]; 6]>) {
        batch.for_points(x, |_, f, b, j| {
            let stress = Stretches::new(f, b).turned_back(&self.stress(b, j));
            out.push(stress.map(f64x8::to_array));
        });
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
