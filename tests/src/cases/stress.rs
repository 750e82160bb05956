//! Stress and strain of elements against closed forms, nodal forces, and the forces of a press.

use std::ops::ControlFlow;

use crate::{
    differences::relative_error,
    problems::{
        blocks::{all_held, body_of, distorted_block},
        fingers::{placed, problem},
    },
    random::Random,
    verify,
};
use fingerpad_fe::assembly::{Body, Configuration, Material};
use fingerpad_fe::element::ElementStress;
use fingerpad_fe::load_path::{BoneKind, Finger, Snapshot, Tissue, follow_path};
use fingerpad_fe::material::SaintVenantKirchhoff;
use fingerpad_fe::mesh::{FingertipShape, Mesh, MeshPreset, block::into_tets, fingertip, set};
use nalgebra::{Matrix3, Vector3};

use super::hyperelastic::{laws, principal_piola, pulled, root, simple_shear, unit_cube};

fn matrix([xx, yy, zz, xy, yz, xz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

fn green_lagrange(f: &Matrix3<f64>) -> Matrix3<f64> {
    (f.transpose() * f - Matrix3::identity()) * 0.5
}

/// Larger of the errors of stress and strain.
fn error(found: &ElementStress, cauchy: &Matrix3<f64>, f: &Matrix3<f64>) -> f64 {
    let stress = relative_error(matrix(found.cauchy_mpa).as_slice(), cauchy.as_slice());
    stress.max(relative_error(matrix(found.green_lagrange).as_slice(), green_lagrange(f).as_slice()))
}

pub fn a_block_under_uniaxial_load() {
    let mut worst = [0.0f64; 2];
    for (_, law) in laws() {
        for stretch in [0.6, 0.9, 1.001, 1.3, 1.8] {
            let lateral = root(0.3, 3.0, |l| principal_piola(&law, [stretch, l, l], 1));
            let axial = principal_piola(&law, [stretch, lateral, lateral], 0) / (lateral * lateral);
            let (body, at) = pulled(&law, &[("x1", 0, stretch)]);
            let found = body.stresses(&at)[0];
            let cauchy = Matrix3::from_diagonal(&Vector3::new(axial, 0.0, 0.0));
            let f = Matrix3::from_diagonal(&Vector3::new(stretch, lateral, lateral));
            worst[0] = worst[0].max(error(&found, &cauchy, &f));
            worst[1] = worst[1].max((found.von_mises_mpa() / axial.abs() - 1.0).abs());
            worst[1] = worst[1].max((found.mean_pressure_mpa() / (-axial / 3.0) - 1.0).abs());
        }
    }
    verify("stress, uniaxial", "error of Cauchy stress and Green-Lagrange strain", worst[0], 1e-8);
    verify("stress, uniaxial", "error of von Mises stress and mean pressure", worst[1], 1e-7);
}

pub fn a_block_in_simple_shear() {
    let mesh = unit_cube();
    let mut worst = 0.0f64;
    for (_, law) in laws() {
        let body = body_of(&mesh, law, &all_held(&mesh));
        for (gamma, s) in [(1e-3, 1.0), (0.7, 0.95), (2.0, 1.1)] {
            let f = Matrix3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) * s;
            let mut at = body.undeformed().clone();
            at.x.iter_mut().for_each(|x| *x = f * *x);
            let cauchy = simple_shear(&law, gamma, s) / f.determinant();
            worst = worst.max(error(&body.stresses(&at)[0], &cauchy, &f));
        }
    }
    verify("stress, simple shear", "error of Cauchy stress and Green-Lagrange strain", worst, 1e-8);
}

/// Largest error of `sum v sigma = sum f x^T` over the body, with the deformed volumes `v` of its elements.
fn mean_stress_error(body: &Body, at: &Configuration, volumes: &[f64]) -> f64 {
    let of_stress = body.stresses(at).iter().zip(volumes).map(|(s, v)| matrix(s.cauchy_mpa) * *v).sum::<Matrix3<f64>>();
    let of_forces =
        body.nodal_forces(at).iter().zip(&at.x).map(|(force, x)| force * x.transpose()).sum::<Matrix3<f64>>();
    relative_error(of_stress.as_slice(), of_forces.as_slice())
}

/// Deformed volume of each element, from its quadrature or its corners.
fn volumes(mesh: &Mesh, x: &[Vector3<f64>]) -> Vec<f64> {
    let hexes = mesh.hexes.iter().map(|h| {
        let g = fingerpad_fe::element::GAUSS_1D_2;
        let sign = |k: usize| if k == 0 { -g } else { g };
        (0..8)
            .map(|q| {
                let gradients = fingerpad_fe::element::hex8_gradient([sign(q & 1), sign(q >> 1 & 1), sign(q >> 2)]);
                let jacobian: Matrix3<f64> =
                    h.nodes.iter().zip(gradients).map(|(n, g)| x[*n as usize] * Vector3::from(g).transpose()).sum();
                jacobian.determinant()
            })
            .sum()
    });
    let tets = mesh.tets.iter().map(|t| {
        let [a, b, c, d] = t.nodes.map(|n| x[n as usize]);
        (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
    });
    hexes.chain(tets).collect()
}

/// The mean stress of a body follows from the forces on it alone [Chadwick 1976, Continuum Mechanics, ch. 3].
pub fn mean_stress_follows_from_the_forces() {
    let hexes = distorted_block(3);
    let tets = into_tets(&hexes);
    let mut random = Random::new(17);
    let mut worst = 0.0f64;
    for mesh in [&hexes, &tets] {
        for material in [laws()[0].1, Material::Linear(SaintVenantKirchhoff { young_mpa: 3.0, poisson: 0.3 })] {
            let body = body_of(mesh, material, &all_held(mesh));
            let mut at = body.undeformed().clone();
            let f = Matrix3::identity() + 0.2 * random.matrix();
            at.x.iter_mut().for_each(|x| *x = f * *x + 0.05 * random.matrix().column(0));
            worst = worst.max(mean_stress_error(&body, &at, &volumes(mesh, &at.x)));
        }
    }
    verify("stress, distorted blocks", "error of the mean stress against nodal forces", worst, 1e-12);
}

/// Force that the held section exerts on the finger by the stress of the elements behind it, N.
fn section_force(mesh: &Mesh, snapshot: &Snapshot) -> Vector3<f64> {
    const FACES: [[usize; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let held = mesh.node_set(set::PROXIMAL_FIX);
    let mut force = Vector3::zeros();
    for (hex, stress) in mesh.hexes.iter().zip(&snapshot.stresses) {
        for face in FACES.map(|face| face.map(|k| hex.nodes[k])) {
            if face.iter().all(|n| held.contains(n)) {
                let [a, b, c, d] = face.map(|n| mesh.nodes[n as usize]);
                force += matrix(stress.cauchy_mpa) * (c - a).cross(&(d - b)) * 0.5;
            }
        }
    }
    force
}

/// A finger with elastic bones that is held at its proximal section alone, pressed by 1 mm and slid by 0.3 mm.
pub fn stress_over_the_held_section_balances_the_contact_force() {
    let mut tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
    tip.mesh.node_sets.remove(set::NAIL_FIX);
    let mut tissue = Tissue::default();
    tissue.bone.kind = BoneKind::Deformable;
    let finger = Finger::new(tip, &tissue).unwrap();
    let path = placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.3, 0.0]]);
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let run = follow_path(&problem, &path, &[1, 2], &mut |_| ControlFlow::Continue(())).unwrap();
    let mut worst = 0.0f64;
    for snapshot in &run.snapshots {
        let r = &snapshot.response;
        let contact = Vector3::new(r.friction_x_n, r.friction_y_n, r.normal_force_n);
        let section = section_force(&finger.mesh, snapshot);
        worst = worst.max((section + contact).norm() / contact.norm());
    }
    verify("stress, coarse finger", "held section's force against the contact force", worst, 0.01);
}
