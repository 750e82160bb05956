//! Patch test: a linear field prescribed on the boundary of a distorted block is found exactly inside.

use crate::{
    differences::relative_error,
    equilibrium::equilibrium,
    problems::blocks::{body_of, distorted_block, outside},
    random::Random,
    reference, verify,
};
use fingerpad_fe::assembly::{Material, Supports};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{
    Mesh,
    block::{block, coordinates, distort, into_second_order, into_tets},
    check,
};
use nalgebra::Matrix3;

use super::hyperelastic::laws;

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

pub fn linear_fields_are_exact_on_distorted_meshes() {
    let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.4, -0.9, 0.6));
    let shape = Matrix3::new(0.25, 0.3, -0.1, 0.05, -0.2, 0.2, 0.1, -0.15, 0.1);
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let nearly_incompressible = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 0.01 });
    let linear = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let hexes = distorted_block(3);
    let tets = into_tets(&hexes);
    let straight = into_second_order(&tets);
    let curved = bulged(&straight, 0.03);
    // Newton starts nearer where nodes lie closer.
    let meshes = [
        ("hexes", &hexes, 1.0),
        ("tets", &tets, 1.0),
        ("10-node tets", &straight, 0.1),
        ("curved 10-node tets", &curved, 0.1),
    ];
    for (kind, mesh, nearer) in meshes {
        check(mesh).unwrap();
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
            for (w, e) in worst.iter_mut().zip(errors(mesh, material, nearer * start_mm, &f)) {
                *w = w.max(e);
            }
        }
        verify(&format!("patch test {kind}"), "displacement error", worst[0], 1e-10);
        verify(&format!("patch test {kind}"), "stress error", worst[1], 1e-10);
        verify(&format!("patch test {kind}"), "energy error", worst[2], 1e-10);
    }
}

/// Inner nodes moved at random, those between the corners included, so that edges are curved.
fn bulged(mesh: &Mesh, amplitude_mm: f64) -> Mesh {
    let mut mesh = mesh.clone();
    distort(&mut mesh, amplitude_mm, 5);
    mesh
}

/// Error of the normal stress of a block of 10-node tetrahedra under a uniform pressure on its pad.
///
/// Each node carries the integral of its linear shape function over the pad's triangles, as contact at nodes has it.
pub fn uniform_pressure_on_the_pad_gives_uniform_stress() {
    let axis = coordinates(0.0, 2.0, 3, 1.3);
    let mut hexes = block(&axis, &axis, &coordinates(0.0, 1.5, 2, 0.8));
    distort(&mut hexes, 0.08, 9);
    let mesh = into_second_order(&into_tets(&hexes));
    let law = Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 };
    // Rollers on three faces that meet: uniaxial stress.
    let roller = |name: &str, k: usize| mesh.node_set(name).iter().map(move |&n| (n, k)).collect::<Vec<_>>();
    let fixed_components = [roller("x0", 0), roller("y0", 1), roller("z1", 2)].concat();
    let body = body_of(&mesh, Material::Ogden(law), &Supports { fixed_components, ..Default::default() });
    let pressure = 0.015;
    let mut share = vec![0.0; body.dofs.count];
    for triangle in &mesh.pad_triangles {
        let [a, b, c] = triangle.map(|n| mesh.nodes[n as usize]);
        let third = (b - a).cross(&(c - a)).norm() / 6.0;
        triangle.iter().for_each(|n| share[body.dofs.node_dof(*n).unwrap() + 2] += third);
    }
    let mut at = body.undeformed().clone();
    for part in [0.25, 0.5, 0.75, 1.0] {
        let load: Vec<f64> = share.iter().map(|s| s * pressure * part).collect();
        at = equilibrium(&body, at, &load, 1e-12).at;
    }
    // A uniform stretch of any size: the corner farthest from the rollers determines the place of every node.
    let far = *mesh
        .node_set("x1")
        .iter()
        .find(|n| mesh.nodes[**n as usize] == nalgebra::Vector3::new(2.0, 2.0, 0.0))
        .unwrap();
    let moved = at.x[far as usize];
    let stretch = [moved.x / 2.0, moved.y / 2.0, (1.5 - moved.z) / 1.5];
    let f = Matrix3::from_diagonal(&nalgebra::Vector3::from(stretch));
    let worst = mesh.nodes.iter().zip(&at.x).map(|(p, x)| {
        let expected = nalgebra::Vector3::new(p.x * stretch[0], p.y * stretch[1], 1.5 - (1.5 - p.z) * stretch[2]);
        (x - expected).norm()
    });
    let stress = reference::first_piola(&Material::Ogden(law), &f);
    verify("uniform pressure, 10-node tets", "distance from a uniform stretch, mm", worst.fold(0.0, f64::max), 1e-10);
    verify("uniform pressure, 10-node tets", "error of the stress", (stress[(2, 2)] / -pressure - 1.0).abs(), 1e-9);
    verify("uniform pressure, 10-node tets", "stress along the plane", stress[(0, 0)].abs() / pressure, 1e-9);
}
