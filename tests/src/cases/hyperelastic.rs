//! Soft laws against closed forms: directly, and through the equilibrium of one hexahedron.

use crate::{
    differences::relative_error,
    equilibrium::equilibrium,
    problems::blocks::{all_held, body_of},
    random::Random,
    reference, verify,
};
use fingerpad_fe::assembly::{Body, Configuration, Supports};
use fingerpad_fe::material::{
    Hyperelastic, Material, MooneyRivlin, NeoHooke, Ogden, OgdenSeries, OgdenTerm, SaintVenantKirchhoff, Sym, Yeoh,
};
use fingerpad_fe::mesh::{Mesh, block::block};
use nalgebra::{Matrix3, Vector3};
use wide::f64x8;

/// Ogden with alpha of the finger, neo-Hookean, and stiffening in compression and in tension; Ogden's three terms for
/// Treloar's rubber (Ogden 1972: m = 0.63, 0.0012, −0.01 MPa, mu = m alpha/2); a term with negative mu; neo-Hooke, Mooney-Rivlin, Yeoh.
pub fn laws() -> Vec<(&'static str, Material)> {
    let ogden = [(1.4, 1.0), (2.0, 10.0), (-2.5, 1.0), (9.0, 0.1)]
        .map(|(alpha, d_per_mpa)| ("Ogden", Material::Ogden(Ogden { mu_mpa: 0.034, alpha, d_per_mpa })));
    let terms =
        [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)].map(|(m, alpha)| OgdenTerm { mu_mpa: 0.5 * m * alpha, alpha });
    let negative = [(0.4, 1.3), (-0.02, 0.5)].map(|(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha });
    let others = [
        ("Ogden series", Material::OgdenSeries(OgdenSeries::new(&terms, 0.1).unwrap())),
        ("Ogden series", Material::OgdenSeries(OgdenSeries::new(&negative, 0.1).unwrap())),
        ("neo-Hooke", Material::NeoHooke(NeoHooke { mu_mpa: 0.4, d_per_mpa: 0.2 })),
        ("Mooney-Rivlin", Material::MooneyRivlin(MooneyRivlin { c10_mpa: 0.16, c01_mpa: 0.05, d_per_mpa: 0.2 })),
        ("Yeoh", Material::Yeoh(Yeoh { c10_mpa: 0.2, c20_mpa: -0.01, c30_mpa: 0.004, d_per_mpa: 0.2 })),
    ];
    ogden.into_iter().chain(others).collect()
}

pub fn pack(m: &Matrix3<f64>) -> Sym<f64x8> {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|at| f64x8::splat(m[at]))
}

pub fn unpack(s: &Sym<f64x8>) -> Matrix3<f64> {
    let [xx, yy, zz, xy, yz, xz] = s.map(|v| v.to_array()[0]);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Kirchhoff stress of the law with its volumetric part, MPa.
fn kirchhoff(law: &impl Hyperelastic, f: &Matrix3<f64>) -> Matrix3<f64> {
    let j = f64x8::splat(f.determinant());
    let volumetric = law.volumetric_slope(j).to_array()[0] * f.determinant();
    unpack(&law.stress(&pack(&(f * f.transpose())), j)) + Matrix3::identity() * volumetric
}

/// [`kirchhoff`] of any material.
fn stress_of(material: &Material, f: &Matrix3<f64>) -> Matrix3<f64> {
    match material {
        Material::NeoHooke(law) => kirchhoff(law, f),
        Material::MooneyRivlin(law) => kirchhoff(law, f),
        Material::Yeoh(law) => kirchhoff(law, f),
        Material::OgdenSeries(law) => kirchhoff(law, f),
        Material::Ogden(law) => kirchhoff(law, f),
        Material::Linear(_) => unreachable!("not among the laws"),
    }
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
pub fn principal_piola(law: &Material, l: [f64; 3], k: usize) -> f64 {
    reference::principal_kirchhoff(law, l)[k] / l[k]
}

/// Notes the worst error of each law.
#[derive(Default)]
struct Worst(std::collections::BTreeMap<&'static str, f64>);

impl Worst {
    fn note(&mut self, law: &'static str, error: f64) {
        let worst = self.0.entry(law).or_default();
        *worst = if error > *worst || error.is_nan() { error } else { *worst };
    }

    fn verify(&self, case: &str, quantity: &str, bound: f64) {
        assert_eq!(self.0.len(), 5, "a law is missing");
        self.0.iter().for_each(|(law, worst)| verify(&format!("{law} {case}"), quantity, *worst, bound));
    }
}

pub fn unit_cube() -> Mesh {
    block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0])
}

/// A unit cube on three symmetry planes whose faces x1 (and y1) are moved: its equilibrium and body.
pub fn pulled(law: &Material, moved: &[(&str, usize, f64)]) -> (Body, Configuration) {
    let mesh = unit_cube();
    let mut fixed_components = Vec::new();
    for (set, axis) in [("x0", 0), ("y0", 1), ("z0", 2)].into_iter().chain(moved.iter().map(|m| (m.0, m.1))) {
        fixed_components.extend(mesh.node_set(set).iter().map(|&n| (n, axis)));
    }
    let body = body_of(&mesh, *law, &Supports { fixed_components, ..Default::default() });
    let mut start = body.undeformed().clone();
    let parts = 8;
    let mut ratio_before = 1.0;
    for part in 1..=parts {
        let stretch = |s: f64| 1.0 + (s - 1.0) * f64::from(part) / f64::from(parts);
        // Free dofs start at constant volume: a squeezed start would have an indefinite tangent.
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

pub fn uniaxial_stretch() {
    let mut worst = [Worst::default(), Worst::default()];
    for (name, law) in laws() {
        for stretch in [0.6, 0.9, 1.001, 1.3, 1.8] {
            let lateral = root(0.3, 3.0, |l| principal_piola(&law, [stretch, l, l], 1));
            let exact = principal_piola(&law, [stretch, lateral, lateral], 0);
            let f = Matrix3::from_diagonal(&Vector3::new(stretch, lateral, lateral));
            let direct = stress_of(&law, &f) / stretch;
            let mut expected = Matrix3::zeros();
            expected[(0, 0)] = exact;
            worst[0].note(name, relative_error(direct.as_slice(), expected.as_slice()));
            let (body, at) = pulled(&law, &[("x1", 0, stretch)]);
            let top = at.x[7];
            worst[1].note(name, relative_error(&face_forces(&body, &at), &[exact, 0.0, 0.0]));
            worst[1].note(name, relative_error(top.as_slice(), &[stretch, lateral, lateral]));
        }
    }
    worst[0].verify("uniaxial", "error of the law", 1e-8);
    worst[1].verify("uniaxial", "error of one hexahedron (force, lateral stretch)", 1e-8);
}

pub fn equibiaxial_stretch() {
    let mut worst = [Worst::default(), Worst::default()];
    for (name, law) in laws() {
        for stretch in [0.75, 1.001, 1.2, 1.5] {
            let thickness = root(0.1, 4.0, |l| principal_piola(&law, [stretch, stretch, l], 2));
            let exact = principal_piola(&law, [stretch, stretch, thickness], 0);
            let f = Matrix3::from_diagonal(&Vector3::new(stretch, stretch, thickness));
            let direct = stress_of(&law, &f) / stretch;
            let expected = Matrix3::from_diagonal(&Vector3::new(exact, exact, 0.0));
            worst[0].note(name, relative_error(direct.as_slice(), expected.as_slice()));
            let (body, at) = pulled(&law, &[("x1", 0, stretch), ("y1", 1, stretch)]);
            worst[1].note(name, relative_error(&face_forces(&body, &at), &[exact, exact, 0.0]));
            worst[1].note(name, relative_error(at.x[7].as_slice(), &[stretch, stretch, thickness]));
        }
    }
    worst[0].verify("equibiaxial", "error of the law", 1e-8);
    worst[1].verify("equibiaxial", "error of one hexahedron (force, thickness)", 1e-8);
}

/// Kirchhoff stress in simple shear `gamma` after a dilatation `s`, MPa.
///
/// With the larger stretch `l`, `l − 1/l = gamma`, and the principal stresses t_1, t_2, t_3 at l, 1, 1/l:
/// tau_xy = (t_1 − t_3)/(l + 1/l), tau_xx − tau_yy = gamma tau_xy (universal for isotropic solids), tau_zz = t_2.
pub fn simple_shear(law: &Material, gamma: f64, s: f64) -> Matrix3<f64> {
    let l = 0.5 * gamma + (1.0 + 0.25 * gamma * gamma).sqrt();
    let [first, zz, third] = reference::principal_kirchhoff(law, [s * l, s, s / l]);
    let xy = (first - third) / (l + 1.0 / l);
    let (sum, difference) = (first + third, gamma * xy);
    Matrix3::new(0.5 * (sum + difference), xy, 0.0, xy, 0.5 * (sum - difference), 0.0, 0.0, 0.0, zz)
}

pub fn simple_shear_with_dilatation() {
    let mesh = unit_cube();
    let mut worst = [Worst::default(), Worst::default()];
    for (name, law) in laws() {
        let body = body_of(&mesh, law, &all_held(&mesh));
        for gamma in [1e-3, 0.1, 0.7, 2.0] {
            for s in [1.0, 0.95, 1.1] {
                let f = Matrix3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) * s;
                let exact = simple_shear(&law, gamma, s);
                worst[0].note(name, relative_error(stress_of(&law, &f).as_slice(), exact.as_slice()));
                let mut at = body.undeformed().clone();
                at.x.iter_mut().for_each(|x| *x = f * *x);
                let mut stress = Matrix3::zeros();
                for (force, x) in body.nodal_forces(&at).iter().zip(&at.x) {
                    stress += force * x.transpose();
                }
                worst[1].note(name, relative_error(stress.as_slice(), exact.as_slice()));
            }
        }
    }
    worst[0].verify("simple shear", "error of the law", 1e-8);
    worst[1].verify("simple shear", "error of one hexahedron", 1e-8);
}

pub fn alpha_two_is_neo_hookean() {
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

/// Stress differences of incompressible rubber as textbooks have them [Treloar 1975, chapters 4 and 10; Yeoh 1993]:
/// uniaxial 2 (l² − 1/l)(W_1 + W_2/l), equibiaxial 2 (l² − l^−4)(W_1 + W_2 l²), simple shear 2 gamma (W_1 + W_2).
pub fn textbook_forms_in_invariants() {
    let w = |law: &Material, i1: f64| match law {
        Material::NeoHooke(law) => [0.5 * law.mu_mpa, 0.0],
        Material::MooneyRivlin(law) => [law.c10_mpa, law.c01_mpa],
        Material::Yeoh(law) => {
            [law.c10_mpa + 2.0 * law.c20_mpa * (i1 - 3.0) + 3.0 * law.c30_mpa * (i1 - 3.0).powi(2), 0.0]
        }
        _ => unreachable!("no law of invariants"),
    };
    let mut count = 0;
    for (name, law) in laws().into_iter().filter(|(name, _)| !name.starts_with("Ogden")) {
        let mut worst = 0.0f64;
        let mut compare = |value: f64, exact: f64| worst = worst.max((value / exact - 1.0).abs());
        for l in [0.55f64, 0.9, 1.2, 1.9] {
            let f = Matrix3::from_diagonal(&Vector3::new(l, l.powf(-0.5), l.powf(-0.5)));
            let [w1, w2] = w(&law, l * l + 2.0 / l);
            let tau = stress_of(&law, &f);
            compare(tau[(0, 0)] - tau[(1, 1)], 2.0 * (l * l - 1.0 / l) * (w1 + w2 / l));
            let f = Matrix3::from_diagonal(&Vector3::new(l, l, l.powi(-2)));
            let [w1, w2] = w(&law, 2.0 * l * l + l.powi(-4));
            let tau = stress_of(&law, &f);
            compare(tau[(0, 0)] - tau[(2, 2)], 2.0 * (l * l - l.powi(-4)) * (w1 + w2 * l * l));
            let gamma = l;
            let [w1, w2] = w(&law, 3.0 + gamma * gamma);
            let f = Matrix3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
            compare(stress_of(&law, &f)[(0, 1)], 2.0 * gamma * (w1 + w2));
        }
        verify(name, "error against the textbook's stress differences", worst, 1e-12);
        count += 1;
    }
    assert_eq!(count, 3);
}

pub fn small_strain_moduli_are_those_reported() {
    let (mut shear, mut bulk) = (Worst::default(), Worst::default());
    for (name, law) in laws() {
        let g = 1e-5;
        let f = Matrix3::new(1.0, g, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        shear.note(name, (stress_of(&law, &f)[(0, 1)] / g / law.shear_mpa() - 1.0).abs());
        let f = Matrix3::identity() * (1.0 + g);
        let k = stress_of(&law, &f).trace() / 3.0 / (3.0 * g);
        let d_per_mpa = match law {
            Material::OgdenSeries(law) => law.d_per_mpa(),
            Material::Ogden(law) => law.d_per_mpa,
            _ => 0.2,
        };
        bulk.note(name, (k * d_per_mpa / 2.0 - 1.0).abs());
    }
    shear.verify("small strain", "shear modulus error", 1e-8);
    bulk.verify("small strain", "bulk modulus error (order of the strain, 1e-5)", 1e-4);
}

pub fn elastic_constants_are_those_of_a_pulled_bar() {
    let (mut young, mut lateral) = (0.0f64, 0.0f64);
    for (young_mpa, poisson) in [(0.6, 0.49), (2.0, 0.3), (0.05, 0.1), (1.0, 0.4999)] {
        let law = NeoHooke::from_young(young_mpa, poisson);
        verify("elastic constants", "error of Poisson's ratio", (law.poisson() - poisson).abs(), 1e-12);
        let strain = 1e-3;
        let (body, at) = pulled(&Material::NeoHooke(law), &[("x1", 0, 1.0 + strain)]);
        // Of first order in the strain.
        young = young.max((face_forces(&body, &at)[0] / strain / young_mpa - 1.0).abs());
        lateral = lateral.max(((1.0 - at.x[7].y) / strain - poisson).abs());
    }
    verify("elastic constants", "error of Young's modulus (order of the strain, 1e-3)", young, 3e-3);
    verify("elastic constants", "error of the lateral strain (order of the strain, 1e-3)", lateral, 3e-3);
}

pub fn saint_venant_kirchhoff_uniaxial() {
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
