//! Laws written again, plainly, on 3x3 matrices: references for the fast ones.

use fingerpad_fe::material::{Hyperelastic, Material, SaintVenantKirchhoff, lame_from_young};
use nalgebra::{Matrix3, SymmetricEigen};

/// Energy per undeformed volume, MPa, at a homogeneous deformation gradient.
pub fn energy(material: &Material, f: &Matrix3<f64>) -> f64 {
    if let Material::Linear(law) = material {
        let (lambda, mu) = lame_from_young(law.young_mpa, law.poisson);
        let e = green_lagrange(f);
        return 0.5 * lambda * e.trace().powi(2) + mu * (e * e).trace();
    }
    let j = f.determinant();
    let stretches = SymmetricEigen::new(f * f.transpose()).eigenvalues.map(|square| square.sqrt() / j.cbrt());
    isochoric(material, stretches.into()).0 + (j - 1.0).powi(2) / d_per_mpa(material)
}

/// First Piola-Kirchhoff stress, MPa.
pub fn first_piola(material: &Material, f: &Matrix3<f64>) -> Matrix3<f64> {
    match material {
        Material::Linear(law) => f * second_piola(law, f),
        soft => kirchhoff(soft, f) * f.try_inverse().expect("det F > 0").transpose(),
    }
}

/// Kirchhoff stress of a hyperelastic law, MPa: `J dU/dJ I` and `lambda_k dU/dlambda_k` on the principal axes.
pub fn kirchhoff(material: &Material, f: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(f * f.transpose());
    let stretches: [f64; 3] = eigen.eigenvalues.map(f64::sqrt).into();
    let principal = principal_kirchhoff(material, stretches);
    eigen.eigenvectors * Matrix3::from_diagonal(&principal.into()) * eigen.eigenvectors.transpose()
}

/// Principal Kirchhoff stresses of a hyperelastic law at principal stretches, MPa.
pub fn principal_kirchhoff(material: &Material, stretches: [f64; 3]) -> [f64; 3] {
    let j: f64 = stretches.iter().product();
    let (_, slope) = isochoric(material, stretches.map(|l| l / j.cbrt()));
    let mean = slope.iter().sum::<f64>() / 3.0;
    slope.map(|t| t - mean + j * 2.0 * (j - 1.0) / d_per_mpa(material))
}

/// Isochoric energy and its derivatives over the logarithms of the isochoric principal stretches `l`, MPa.
fn isochoric(material: &Material, l: [f64; 3]) -> (f64, [f64; 3]) {
    let sum = |exponent: f64| l.iter().map(|l| l.powf(exponent)).sum::<f64>() - 3.0;
    let term = |mu: f64, alpha: f64| 2.0 * mu / alpha.powi(2) * sum(alpha);
    let slope = |mu: f64, alpha: f64, l: f64| 2.0 * mu / alpha * l.powf(alpha);
    match material {
        Material::NeoHooke(law) => (0.5 * law.mu_mpa * sum(2.0), l.map(|l| law.mu_mpa * l * l)),
        Material::MooneyRivlin(law) => (
            law.c10_mpa * sum(2.0) + law.c01_mpa * sum(-2.0),
            l.map(|l| 2.0 * (law.c10_mpa * l.powi(2) - law.c01_mpa * l.powi(-2))),
        ),
        Material::Yeoh(law) => {
            let x = sum(2.0);
            let w1 = law.c10_mpa + 2.0 * law.c20_mpa * x + 3.0 * law.c30_mpa * x * x;
            (law.c10_mpa * x + law.c20_mpa * x.powi(2) + law.c30_mpa * x.powi(3), l.map(|l| 2.0 * w1 * l * l))
        }
        Material::OgdenSeries(law) => (
            law.terms().iter().map(|t| term(t.mu_mpa, t.alpha)).sum(),
            l.map(|l| law.terms().iter().map(|t| slope(t.mu_mpa, t.alpha, l)).sum()),
        ),
        Material::Ogden(law) => (term(law.mu_mpa, law.alpha), l.map(|l| slope(law.mu_mpa, law.alpha, l))),
        Material::Linear(_) => unreachable!("no law of principal isochoric stretches"),
    }
}

fn d_per_mpa(material: &Material) -> f64 {
    match material {
        Material::NeoHooke(law) => law.d_per_mpa,
        Material::MooneyRivlin(law) => law.d_per_mpa,
        Material::Yeoh(law) => law.d_per_mpa,
        Material::OgdenSeries(law) => law.d_per_mpa(),
        Material::Ogden(law) => law.d_per_mpa,
        Material::Linear(_) => unreachable!("no separate volumetric part"),
    }
}

fn second_piola(law: &SaintVenantKirchhoff, f: &Matrix3<f64>) -> Matrix3<f64> {
    let (lambda, mu) = lame_from_young(law.young_mpa, law.poisson);
    let e = green_lagrange(f);
    Matrix3::identity() * (lambda * e.trace()) + e * (2.0 * mu)
}

fn green_lagrange(f: &Matrix3<f64>) -> Matrix3<f64> {
    (f.transpose() * f - Matrix3::identity()) * 0.5
}
