//! Ogden's law against closed forms: directly, and through the equilibrium of one hexahedron.

use fingerpad_fe::assembly::{Body, Configuration, Material, Supports};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff, Sym};
use fingerpad_fe::mesh::{Mesh, block::block};
use fingerpad_tests::{
    differences::relative_error,
    equilibrium::equilibrium,
    problems::blocks::{all_held, body_of},
    random::Random,
    verify,
};
use nalgebra::{Matrix3, Vector3};
use wide::f64x8;

/// alpha of the finger, neo-Hookean, and stiffening in compression and in tension.
pub fn laws() -> [Ogden; 4] {
    [(1.4, 1.0), (2.0, 10.0), (-2.5, 1.0), (9.0, 0.1)].map(|(alpha, d_per_mpa)| Ogden {
        mu_mpa: 0.034,
        alpha,
        d_per_mpa,
    })
}

pub fn pack(m: &Matrix3<f64>) -> Sym<f64x8> {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|at| f64x8::splat(m[at]))
}

pub fn unpack(s: &Sym<f64x8>) -> Matrix3<f64> {
    let [xx, yy, zz, xy, yz, xz] = s.map(|v| v.to_array()[0]);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Kirchhoff stress of the law with its volumetric part, MPa.
fn kirchhoff(law: &Ogden, f: &Matrix3<f64>) -> Matrix3<f64> {
    let j = f64x8::splat(f.determinant());
    let volumetric = law.volumetric_slope(j).to_array()[0] * f.determinant();
    unpack(&law.stress(&pack(&(f * f.transpose())), j)) + Matrix3::identity() * volumetric
}

/// Root of an increasing or decreasing function by bisection, to the last digit.
pub fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low).signum();
    assert!(sign != f(high).signum(), "no root between");
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == sign { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Principal first Piola-Kirchhoff stress `dU/dlambda_k` written out from the energy, MPa.
pub fn principal_piola(law: &Ogden, l: [f64; 3], k: usize) -> f64 {
    let j = l[0] * l[1] * l[2];
    let power = l.map(|l| l.powf(law.alpha) * j.powf(-law.alpha / 3.0));
    let isochoric = 2.0 * law.mu_mpa / law.alpha * (power[k] - (power[0] + power[1] + power[2]) / 3.0);
    (isochoric + 2.0 / law.d_per_mpa * (j - 1.0) * j) / l[k]
}

pub fn unit_cube() -> Mesh {
    block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0])
}

/// A unit cube on three symmetry planes whose faces x1 (and y1) are moved: its equilibrium and body.
pub fn pulled(law: &Ogden, moved: &[(&str, usize, f64)]) -> (Body, Configuration) {
    let mesh = unit_cube();
    let mut fixed_components = Vec::new();
    for (set, axis) in [("x0", 0), ("y0", 1), ("z0", 2)].into_iter().chain(moved.iter().map(|m| (m.0, m.1))) {
        fixed_components.extend(mesh.node_set(set).iter().map(|&n| (n, axis)));
    }
    let body = body_of(&mesh, Material::Ogden(*law), &Supports { fixed_components, ..Default::default() });
    let mut start = body.undeformed().clone();
    let parts = 8;
    let mut ratio_before = 1.0;
    for part in 1..=parts {
        let stretch = |s: f64| 1.0 + (s - 1.0) * f64::from(part) / f64::from(parts);
        // What is free starts at constant volume: a squeezed start would have an indefinite tangent.
        let ratio: f64 = moved.iter().map(|m| stretch(m.2)).product();
        let lateral = (ratio_before / ratio).powf(1.0 / (3 - moved.len()) as f64);
        ratio_before = ratio;
        for x in &mut start.x {
            (moved.len()..3).for_each(|axis| x[axis] *= lateral);
        }
        for &(set, axis, s) in moved {
            mesh.node_set(set).iter().for_each(|&n| start.x[n as usize][axis] = stretch(s));
        }
        start = equilibrium(&body, start, &vec![0.0; body.dofs.count], 1e-12).at;
    }
    (body, start)
}

/// Forces on the faces x1, y1 and z1 along their normals, N.
fn face_forces(body: &Body, at: &Configuration) -> [f64; 3] {
    let (mesh, forces) = (unit_cube(), body.nodal_forces(at));
    let sum = |set: &str, axis: usize| mesh.node_set(set).iter().map(|&n| forces[n as usize][axis]).sum();
    [sum("x1", 0), sum("y1", 1), sum("z1", 2)]
}

#[test]
fn uniaxial() {
    let mut worst = [0.0f64; 2];
    for law in laws() {
        for stretch in [0.6, 0.9, 1.001, 1.3, 1.8] {
            let lateral = root(0.3, 3.0, |l| principal_piola(&law, [stretch, l, l], 1));
            let exact = principal_piola(&law, [stretch, lateral, lateral], 0);
            let f = Matrix3::from_diagonal(&Vector3::new(stretch, lateral, lateral));
            let direct = kirchhoff(&law, &f) / stretch;
            let mut expected = Matrix3::zeros();
            expected[(0, 0)] = exact;
            worst[0] = worst[0].max(relative_error(direct.as_slice(), expected.as_slice()));
            let (body, at) = pulled(&law, &[("x1", 0, stretch)]);
            let top = at.x[7];
            worst[1] = worst[1].max(relative_error(&face_forces(&body, &at), &[exact, 0.0, 0.0]));
            worst[1] = worst[1].max(relative_error(top.as_slice(), &[stretch, lateral, lateral]));
        }
    }
    verify("Ogden uniaxial", "error of the law", worst[0], 1e-8);
    verify("Ogden uniaxial", "error of one hexahedron (force, lateral stretch)", worst[1], 1e-8);
}

#[test]
fn equibiaxial() {
    let mut worst = [0.0f64; 2];
    for law in laws() {
        for stretch in [0.75, 1.001, 1.2, 1.5] {
            let thickness = root(0.1, 4.0, |l| principal_piola(&law, [stretch, stretch, l], 2));
            let exact = principal_piola(&law, [stretch, stretch, thickness], 0);
            let f = Matrix3::from_diagonal(&Vector3::new(stretch, stretch, thickness));
            let direct = kirchhoff(&law, &f) / stretch;
            let expected = Matrix3::from_diagonal(&Vector3::new(exact, exact, 0.0));
            worst[0] = worst[0].max(relative_error(direct.as_slice(), expected.as_slice()));
            let (body, at) = pulled(&law, &[("x1", 0, stretch), ("y1", 1, stretch)]);
            worst[1] = worst[1].max(relative_error(&face_forces(&body, &at), &[exact, exact, 0.0]));
            worst[1] = worst[1].max(relative_error(at.x[7].as_slice(), &[stretch, stretch, thickness]));
        }
    }
    verify("Ogden equibiaxial", "error of the law", worst[0], 1e-8);
    verify("Ogden equibiaxial", "error of one hexahedron (force, thickness)", worst[1], 1e-8);
}

/// Kirchhoff stress in simple shear `gamma` after a dilatation `s`, MPa.
///
/// With the larger stretch `l`, `l − 1/l = gamma`: tau_xy = (2 mu/alpha)(l^alpha − l^−alpha)/(l + 1/l),
/// tau_xx − tau_yy = gamma tau_xy (universal for isotropic solids), tau_zz from the unit stretch, all with the
/// pressure `J dU/dJ` at `J = s³`.
pub fn simple_shear(law: &Ogden, gamma: f64, s: f64) -> Matrix3<f64> {
    let l = 0.5 * gamma + (1.0 + 0.25 * gamma * gamma).sqrt();
    let (up, down) = (l.powf(law.alpha), l.powf(-law.alpha));
    let factor = 2.0 * law.mu_mpa / law.alpha;
    let xy = factor * (up - down) / (l + 1.0 / l);
    let zz = factor * (1.0 - (up + down + 1.0) / 3.0);
    let (sum, difference) = (-zz, gamma * xy);
    let p = 2.0 / law.d_per_mpa * (s.powi(3) - 1.0) * s.powi(3);
    Matrix3::new(0.5 * (sum + difference) + p, xy, 0.0, xy, 0.5 * (sum - difference) + p, 0.0, 0.0, 0.0, zz + p)
}

#[test]
fn simple_shear_with_dilatation() {
    let mesh = unit_cube();
    let mut worst = [0.0f64; 2];
    for law in laws() {
        let body = body_of(&mesh, Material::Ogden(law), &all_held(&mesh));
        for gamma in [1e-3, 0.1, 0.7, 2.0] {
            for s in [1.0, 0.95, 1.1] {
                let f = Matrix3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) * s;
                let exact = simple_shear(&law, gamma, s);
                worst[0] = worst[0].max(relative_error(kirchhoff(&law, &f).as_slice(), exact.as_slice()));
                let mut at = body.undeformed().clone();
                at.x.iter_mut().for_each(|x| *x = f * *x);
                let mut stress = Matrix3::zeros();
                for (force, x) in body.nodal_forces(&at).iter().zip(&at.x) {
                    stress += force * x.transpose();
                }
                worst[1] = worst[1].max(relative_error(stress.as_slice(), exact.as_slice()));
            }
        }
    }
    verify("Ogden simple shear", "error of the law", worst[0], 1e-8);
    verify("Ogden simple shear", "error of one hexahedron", worst[1], 1e-8);
}

#[test]
fn alpha_two_is_neo_hookean() {
    let law = Ogden { mu_mpa: 0.7, alpha: 2.0, d_per_mpa: 0.5 };
    let (mut stress, mut energy) = (0.0f64, 0.0f64);
    let mut random = Random::new(5);
    for _ in 0..20 {
        let f = Matrix3::identity() + 0.5 * random.matrix();
        let j = f.determinant();
        if j < 0.1 {
            continue;
        }
        let b = f * f.transpose();
        let bar = b * j.powf(-2.0 / 3.0);
        let exact =
            (bar - Matrix3::identity() * (bar.trace() / 3.0)) * 0.7 + Matrix3::identity() * (2.0 / 0.5 * (j - 1.0) * j);
        stress = stress.max(relative_error(kirchhoff(&law, &f).as_slice(), exact.as_slice()));
        let value = law.energy(&pack(&b), f64x8::splat(j)).to_array()[0];
        energy = energy.max((value / (0.35 * (bar.trace() - 3.0)) - 1.0).abs());
    }
    verify("Ogden alpha = 2", "stress error against neo-Hookean with the same mu", stress, 1e-8);
    verify("Ogden alpha = 2", "energy error against neo-Hookean with the same mu", energy, 1e-8);
}

#[test]
fn small_strain_moduli_are_mu_and_two_over_d() {
    let (mut shear, mut bulk) = (0.0f64, 0.0f64);
    for law in laws() {
        let g = 1e-5;
        let f = Matrix3::new(1.0, g, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        shear = shear.max((kirchhoff(&law, &f)[(0, 1)] / g / law.mu_mpa - 1.0).abs());
        let f = Matrix3::identity() * (1.0 + g);
        let k = kirchhoff(&law, &f).trace() / 3.0 / (3.0 * g);
        bulk = bulk.max((k * law.d_per_mpa / 2.0 - 1.0).abs());
    }
    verify("Ogden small strain", "shear modulus error", shear, 1e-8);
    verify("Ogden small strain", "bulk modulus error (order of the strain, 1e-5)", bulk, 1e-4);
}

#[test]
fn saint_venant_kirchhoff_uniaxial() {
    // S = E_young E along the axis when the lateral faces are free: P = lambda E_young (lambda² − 1)/2.
    let law = SaintVenantKirchhoff { young_mpa: 3.0, poisson: 0.3 };
    let mut worst = 0.0f64;
    for stretch in [0.95f64, 1.0001, 1.2] {
        let axial = 0.5 * (stretch * stretch - 1.0);
        let lateral = (1.0 - 2.0 * 0.3 * axial).sqrt();
        let f = Matrix3::from_diagonal(&Vector3::new(stretch, lateral, lateral));
        let tau = unpack(&law.stress(&pack(&(f * f.transpose()))));
        let mut exact = Matrix3::zeros();
        exact[(0, 0)] = stretch * stretch * 3.0 * axial;
        worst = worst.max(relative_error(tau.as_slice(), exact.as_slice()));
    }
    verify("Saint Venant-Kirchhoff uniaxial", "error of the law", worst, 1e-8);
}
