//! Laws written once more, plainly, on 3x3 matrices: what the fast ones are compared with.

use fingerpad_fe::assembly::Material;
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff, lame_from_young};
use nalgebra::{Matrix3, SymmetricEigen};

/// Energy per undeformed volume, MPa, at a homogeneous deformation gradient.
pub fn energy(material: &Material, f: &Matrix3<f64>) -> f64 {
    match material {
        Material::Ogden(law) => {
            let j = f.determinant();
            let stretches = SymmetricEigen::new(f * f.transpose()).eigenvalues.map(f64::sqrt);
            let sum: f64 = stretches.iter().map(|l| (l / j.cbrt()).powf(law.alpha)).sum();
            2.0 * law.mu_mpa / law.alpha.powi(2) * (sum - 3.0) + (j - 1.0).powi(2) / law.d_per_mpa
        }
        Material::Linear(law) => {
            let (lambda, mu) = lame_from_young(law.young_mpa, law.poisson);
            let e = green_lagrange(f);
            0.5 * lambda * e.trace().powi(2) + mu * (e * e).trace()
        }
    }
}

/// First Piola-Kirchhoff stress, MPa.
pub fn first_piola(material: &Material, f: &Matrix3<f64>) -> Matrix3<f64> {
    match material {
        Material::Ogden(law) => ogden_kirchhoff(law, f) * f.try_inverse().expect("det F > 0").transpose(),
        Material::Linear(law) => f * second_piola(law, f),
    }
}

/// Kirchhoff stress of the Ogden law, MPa: `J dU/dJ I` and `lambda_k dU/dlambda_k` on the principal axes.
pub fn ogden_kirchhoff(law: &Ogden, f: &Matrix3<f64>) -> Matrix3<f64> {
    let j = f.determinant();
    let eigen = SymmetricEigen::new(f * f.transpose());
    let power = eigen.eigenvalues.map(|square| (square.sqrt() / j.cbrt()).powf(law.alpha));
    let principal = power.map(|p| {
        2.0 * law.mu_mpa / law.alpha * (p - (power[0] + power[1] + power[2]) / 3.0)
            + j * 2.0 * (j - 1.0) / law.d_per_mpa
    });
    eigen.eigenvectors * Matrix3::from_diagonal(&principal) * eigen.eigenvectors.transpose()
}

fn second_piola(law: &SaintVenantKirchhoff, f: &Matrix3<f64>) -> Matrix3<f64> {
    let (lambda, mu) = lame_from_young(law.young_mpa, law.poisson);
    let e = green_lagrange(f);
    Matrix3::identity() * (lambda * e.trace()) + e * (2.0 * mu)
}

fn green_lagrange(f: &Matrix3<f64>) -> Matrix3<f64> {
    (f.transpose() * f - Matrix3::identity()) * 0.5
}
