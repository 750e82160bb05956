//! Patch test: a linear field prescribed on the boundary of a distorted block is found exactly inside.

use fingerpad_fe::assembly::{Material, Supports};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{Mesh, block::into_tets, check};
use fingerpad_tests::{
    differences::relative_error,
    equilibrium::equilibrium,
    problems::blocks::{body_of, distorted_block, outside},
    random::Random,
    reference, verify,
};
use nalgebra::Matrix3;

use crate::hyperelastic::laws;

/// Errors of displacement, stress and energy, each relative; Newton starts `start_mm` away from the solution.
fn errors(mesh: &Mesh, material: Material, start_mm: f64, f: &Matrix3<f64>) -> [f64; 3] {
    // Held by components, so that elements with all nodes on the boundary are kept.
    let fixed_components = outside(mesh).into_iter().flat_map(|n| (0..3).map(move |k| (n, k))).collect();
    let body = body_of(mesh, material, &Supports { fixed_components, ..Default::default() });
    let inside = |n: usize| body.dofs.node_dof(n as u32).is_some_and(|dof| !body.dofs.held.contains(&dof));
    let mut random = Random::new(11);
    let mut start = body.undeformed().clone();
    for (n, x) in start.x.iter_mut().enumerate() {
        *x = f * mesh.nodes[n];
        if inside(n) {
            *x += start_mm * random.vector();
        }
    }
    let solution = equilibrium(&body, start, &vec![0.0; body.dofs.count], 1e-12);
    let largest = mesh.nodes.iter().map(|p| (f * p - p).norm()).fold(0.0, f64::max);
    let displacement = mesh.nodes.iter().zip(&solution.at.x).map(|(p, x)| (x - f * p).norm()).fold(0.0, f64::max);

    // Mean stress from the forces on the boundary.
    let volume = 3.0 * 3.2 * 2.4;
    let forces = body.nodal_forces(&solution.at);
    let mut stress = Matrix3::zeros();
    for (force, p) in forces.iter().zip(&mesh.nodes) {
        stress += force * p.transpose() / volume;
    }
    let expected = reference::first_piola(&material, f);
    let energy = volume * reference::energy(&material, f);
    [
        displacement / largest,
        relative_error(stress.as_slice(), expected.as_slice()),
        (body.energy(&solution.at).0 / energy - 1.0).abs(),
    ]
}

#[test]
fn linear_fields_are_exact_on_distorted_meshes() {
    let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.4, -0.9, 0.6));
    let shape = Matrix3::new(0.25, 0.3, -0.1, 0.05, -0.2, 0.2, 0.1, -0.15, 0.1);
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let nearly_incompressible = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 0.01 });
    let linear = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let hexes = distorted_block(3);
    let tets = into_tets(&hexes);
    check(&hexes).unwrap();
    check(&tets).unwrap();
    for (kind, mesh) in [("hexes", &hexes), ("tets", &tets)] {
        let mut worst = [0.0f64; 3];
        let laws = laws().into_iter().map(|(_, law)| (law, 0.005, 0.6));
        for (material, start_mm, scale) in laws.chain([
            (soft, 0.05, 1.0),
            (soft, 0.05, 0.01),
            (nearly_incompressible, 5e-4, 1.0),
            (linear, 0.05, 0.3),
            (linear, 0.05, 0.01),
        ]) {
            let f = turn * (Matrix3::identity() + shape * scale);
            for (w, e) in worst.iter_mut().zip(errors(mesh, material, start_mm, &f)) {
                *w = w.max(e);
            }
        }
        verify(&format!("patch test {kind}"), "displacement error", worst[0], 1e-10);
        verify(&format!("patch test {kind}"), "stress error", worst[1], 1e-10);
        verify(&format!("patch test {kind}"), "energy error", worst[2], 1e-10);
    }
}
