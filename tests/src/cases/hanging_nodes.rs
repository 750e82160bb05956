//! Hexahedra of two sizes side by side: a linear field passes the nodes that hang between them exactly.

use std::collections::BTreeSet;

use crate::{equilibrium::equilibrium, problems::blocks::body_of, random::Random, reference, verify};
use fingerpad_fe::assembly::{Material, Supports};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{Divisions, FingertipShape, Mesh, MeshPreset, Nail, fingertip, set};
use nalgebra::{Matrix3, Vector3};

use super::tie::gradients;

/// The coarse finger without nail, its pad halved this often.
fn finger(pad_refinement: usize) -> (Mesh, BTreeSet<u32>) {
    let shape = FingertipShape { nail: Nail::FixedPatch, ..FingertipShape::default() };
    let tip = fingertip(&shape, &Divisions { pad_refinement, ..MeshPreset::Coarse.divisions() }).unwrap();
    let mut outside: BTreeSet<u32> = tip.outer_faces.iter().flatten().copied().collect();
    outside.extend(tip.mesh.node_set(set::PROXIMAL_FIX));
    (tip.mesh, outside)
}

/// One material everywhere, a linear field prescribed outside, Newton started off the solution. Largest errors of
/// displacement (over the largest displacement) and of stress in the middle of an element (Frobenius norms).
fn errors(mesh: &Mesh, outside: &BTreeSet<u32>, material: Material, start_mm: f64, f: &Matrix3<f64>) -> [f64; 2] {
    let slaves: BTreeSet<u32> = mesh.ties.iter().map(|tie| tie.slave).collect();
    let held: Vec<u32> = outside.difference(&slaves).copied().collect();
    let fixed_components = held.iter().flat_map(|&n| (0..3).map(move |k| (n, k))).collect();
    let body = body_of(mesh, material, &Supports { fixed_components, ..Default::default() });
    let mut random = Random::new(5);
    let mut start = body.undeformed().clone();
    for (n, x) in start.x.iter_mut().enumerate() {
        *x = f * mesh.nodes[n];
        if !outside.contains(&(n as u32)) {
            *x += start_mm * random.vector();
        }
    }
    let at = equilibrium(&body, start, &vec![0.0; body.dofs.count], 1e-11).at;
    let largest = mesh.nodes.iter().map(|p| (f * p - p).norm()).fold(0.0, f64::max);
    let off = |(x, p): (&Vector3<f64>, &Vector3<f64>)| (x - f * p).norm();
    let displacement = at.x.iter().zip(&mesh.nodes).map(off).fold(0.0, f64::max) / largest;
    let exact = reference::first_piola(&material, f);
    let stress = gradients(mesh, &at)
        .iter()
        .map(|(_, f)| (reference::first_piola(&material, f) - exact).norm() / exact.norm())
        .fold(0.0, f64::max);
    [displacement, stress]
}

pub fn linear_fields_pass_hanging_nodes() {
    linear_fields_pass(1);
}

pub fn linear_fields_pass_hanging_nodes_of_three_sizes() {
    linear_fields_pass(2);
}

fn linear_fields_pass(halved: usize) {
    let shape = Matrix3::new(0.05, 0.03, -0.02, 0.01, -0.04, 0.03, 0.02, -0.03, 0.02);
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let linear = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let (mut mesh, outside) = finger(halved);
    for (name, material) in [("Ogden", soft), ("linear", linear)] {
        let [displacement, stress] = errors(&mesh, &outside, material, 1e-3, &(Matrix3::identity() + shape));
        let case = format!("hanging nodes, pad halved {halved} times, {name}");
        verify(&case, "displacement error", displacement, 1e-10);
        verify(&case, "stress error of the worst element", stress, 1e-9);
    }
    // Untied, the border is a slit whose faces carry nothing: the same measure must show it.
    mesh.ties.clear();
    let [_, stress] = errors(&mesh, &outside, linear, 0.0, &(Matrix3::identity() + shape * 0.1));
    assert!(stress > 1e-2, "{stress}");
}
