//! The tie of the tetrahedral nail to hexahedral tissue: its own patch-test error.
//!
//! A node of the nail follows the face that it lies on. Linear fields pass the tie exactly; forces go to the nodes of
//! that face only, so that a uniform stress does not: this test measures the error.

use std::collections::{BTreeMap, BTreeSet};

use crate::{equilibrium::equilibrium, problems::blocks::tied_block, reference, verify};
use fingerpad_fe::assembly::{Body, Configuration, Joint, Material, Supports};
use fingerpad_fe::element::hex8_gradient;
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{
    Divisions, FingertipShape, HEX_FACES, Mesh, MeshPreset, Region, TET_FACES, block::coordinates, fingertip, set,
};
use nalgebra::{Matrix3, RowVector3, Vector3};

/// Deformation gradients at the middle of hexahedra, then of tetrahedra.
pub fn gradients(mesh: &Mesh, at: &Configuration) -> Vec<(Region, Matrix3<f64>)> {
    let gradient = |nodes: &[u32], shape: &[[f64; 3]]| {
        let (mut reference, mut current) = (Matrix3::zeros(), Matrix3::zeros());
        for (&n, g) in nodes.iter().zip(shape) {
            reference += mesh.nodes[n as usize] * RowVector3::from(*g);
            current += at.x[n as usize] * RowVector3::from(*g);
        }
        current * reference.try_inverse().unwrap()
    };
    let tet = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let hexes = mesh.hexes.iter().map(|e| (e.region, gradient(&e.nodes, &hex8_gradient([0.0; 3]))));
    hexes.chain(mesh.tets.iter().map(|e| (e.region, gradient(&e.nodes, &tet)))).collect()
}

/// A column 3 x 3 mm, hexahedra below (2 mm), tetrahedra above (1 mm), between rollers on all sides, compressed by
/// 2 %: each half is strained uniformly. Errors of displacement (over the top's), stress per element, total force.
fn column(nail_divisions: usize, materials: [Material; 2]) -> [f64; 3] {
    let (line, depth) = (coordinates(0.0, 3.0, 4, 1.0), coordinates(0.0, 2.0, 3, 1.0));
    let nail = coordinates(0.0, 3.0, nail_divisions, 1.0);
    let mesh = tied_block([&line, &line, &depth], &nail, &nail, 2, 1.0);
    let material = |region| if region == Region::Nail { materials[1] } else { materials[0] };
    let mut fixed_components = Vec::new();
    for (n, p) in mesh.nodes.iter().enumerate() {
        for (axis, ends) in [[0.0, 3.0], [0.0, 3.0], [0.0, 3.0]].iter().enumerate() {
            if ends.contains(&p[axis]) {
                fixed_components.push((n as u32, axis));
            }
        }
    }
    let supports = Supports { fixed_components, ..Default::default() };
    let body = Body::new(&mesh, |r| Some(material(r)), &supports, Vector3::zeros(), Joint::default()).unwrap();

    // Stretches of the two halves with equal stress: 2 a + b = 3 (1 − 0.02), by bisection.
    let piola =
        |m: &Material, l: f64| reference::first_piola(m, &Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, l)))[(2, 2)];
    let height = 3.0 * 0.98;
    let (mut low, mut high) = (0.9, 1.0);
    for _ in 0..100 {
        let a = 0.5 * (low + high);
        if piola(&materials[0], a) < piola(&materials[1], height - 2.0 * a) { low = a } else { high = a }
    }
    let (a, b) = (low, height - 2.0 * low);
    let exact = |p: &Vector3<f64>| if p.z <= 2.0 { p.z * a } else { 2.0 * a + (p.z - 2.0) * b };
    let stress = piola(&materials[0], a);
    let mut start = body.undeformed().clone();
    start.x.iter_mut().zip(&mesh.nodes).for_each(|(x, p)| x.z = exact(p));
    let at = equilibrium(&body, start, &vec![0.0; body.dofs.count], 1e-10).at;

    let top = 3.0 - height;
    let place = |p: &Vector3<f64>| Vector3::new(p.x, p.y, exact(p));
    let displacement = at.x.iter().zip(&mesh.nodes).map(|(x, p)| (x - place(p)).norm()).fold(0.0, f64::max) / top;
    let worst = gradients(&mesh, &at)
        .iter()
        .map(|(region, f)| (reference::first_piola(&material(*region), f)[(2, 2)] / stress - 1.0).abs())
        .fold(0.0, f64::max);
    let forces = body.nodal_forces(&at);
    let total: f64 = mesh.node_set("nail_fix").iter().map(|&n| forces[n as usize].z).sum();
    [displacement, worst, (total / (9.0 * stress) - 1.0).abs()]
}

pub fn column_of_tied_blocks() {
    let skin = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let nail = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let alike = Material::Linear(SaintVenantKirchhoff { young_mpa: 1.0, poisson: 0.3 });
    // Triangles on quadrilaterals: with nodes on nodes (4, as on the finger) the forces do not match at the rim.
    for (divisions, bounds) in [(4, [0.15, 0.4, 0.01]), (8, [0.03, 0.15, 1e-3]), (12, [0.02, 0.1, 1e-3])] {
        for (case, materials) in [("one material", [alike, alike]), ("nail on skin", [skin, nail])] {
            let case = format!("tie, column, {case}, {divisions} on 4 divisions");
            let [displacement, stress, force] = column(divisions, materials);
            verify(&case, "displacement error over the top's", displacement, bounds[0]);
            verify(&case, "stress error of the worst element", stress, bounds[1]);
            verify(&case, "total force error", force, bounds[2]);
        }
    }
}

/// Boundary faces of elements, as their nodes.
pub fn boundary<const E: usize, const F: usize>(elements: &[[u32; E]], faces: &[[usize; F]]) -> Vec<[u32; F]> {
    let mut seen: BTreeMap<[u32; F], (u32, [u32; F])> = BTreeMap::new();
    for element in elements {
        for face in faces.iter().map(|face| face.map(|n| element[n])) {
            let mut key = face;
            key.sort_unstable();
            seen.entry(key).or_insert((0, face)).0 += 1;
        }
    }
    seen.into_values().filter(|(count, _)| *count == 1).map(|(_, face)| face).collect()
}

/// The finger's own tie: one material everywhere, a linear field prescribed on the boundary but for the
/// interface. Errors of displacement and of stress in hexahedra and tetrahedra (Frobenius norms).
fn finger(divisions: &Divisions) -> [f64; 3] {
    let mesh = fingertip(&FingertipShape::default(), divisions).unwrap().mesh;
    let material = Material::Linear(SaintVenantKirchhoff { young_mpa: 1.0, poisson: 0.3 });
    let skin_faces = boundary(&mesh.hexes.iter().map(|e| e.nodes).collect::<Vec<_>>(), &HEX_FACES);
    let nail_faces = boundary(&mesh.tets.iter().map(|e| e.nodes).collect::<Vec<_>>(), &TET_FACES);
    // Free are the masters well inside the nail's outline: a face that the nail covers in part would need
    // a traction on the rest of it.
    let inner = |nodes: &BTreeSet<u32>| -> BTreeSet<u32> {
        let rim: BTreeSet<u32> =
            skin_faces.iter().filter(|f| f.iter().any(|n| !nodes.contains(n))).flatten().copied().collect();
        nodes.difference(&rim).copied().collect()
    };
    let masters: BTreeSet<u32> = mesh.ties.iter().flat_map(|t| t.masters.iter().map(|m| m.0)).collect();
    let free = inner(&inner(&masters));
    let slaves: BTreeSet<u32> = mesh.ties.iter().map(|t| t.slave).collect();
    println!("tie, finger: {} slaves, {} masters, {} of them free", slaves.len(), masters.len(), free.len());
    assert!(!free.is_empty());
    let mut fixed: BTreeSet<u32> = skin_faces.iter().flatten().chain(nail_faces.iter().flatten()).copied().collect();
    fixed.retain(|n| !free.contains(n) && !slaves.contains(n));
    let fixed_components = fixed.iter().flat_map(|&n| (0..3).map(move |k| (n, k))).collect();
    let supports = Supports { fixed_components, ..Default::default() };
    let body = Body::new(&mesh, |_| Some(material), &supports, Vector3::zeros(), Joint::default()).unwrap();
    let f = Matrix3::identity() + Matrix3::new(0.01, 0.004, 0.002, -0.003, -0.008, 0.006, 0.001, 0.002, -0.012);
    let mut start = body.undeformed().clone();
    start.x.iter_mut().for_each(|x| *x = f * *x);
    let at = equilibrium(&body, start, &vec![0.0; body.dofs.count], 1e-9).at;
    let center = mesh.ties.iter().map(|t| mesh.nodes[t.slave as usize]).sum::<Vector3<f64>>() / mesh.ties.len() as f64;
    // Displacements that matter: those of the nail against its middle.
    let scale = mesh
        .node_set(set::NAIL)
        .iter()
        .map(|&n| ((f - Matrix3::identity()) * (mesh.nodes[n as usize] - center)).norm());
    let scale = scale.fold(0.0, f64::max);
    let displacement = at.x.iter().zip(&mesh.nodes).map(|(x, p)| (x - f * p).norm()).fold(0.0, f64::max) / scale;
    let exact = reference::first_piola(&material, &f);
    let errors: Vec<f64> = gradients(&mesh, &at)
        .iter()
        .map(|(_, f)| (reference::first_piola(&material, f) - exact).norm() / exact.norm())
        .collect();
    let worst = |errors: &[f64]| errors.iter().fold(0.0f64, |m, e| m.max(*e));
    [displacement, worst(&errors[..mesh.hexes.len()]), worst(&errors[mesh.hexes.len()..])]
}

pub fn nail_of_the_finger() {
    for (preset, label) in [(MeshPreset::Coarse, "coarse"), (MeshPreset::Medium, "medium")] {
        // With a column of faces in the middle all boxes are cut alike; else the halves are mirrored, and along y = 0
        // triangles share a uniform pressure among nodes of uneven faces in another way than the faces do.
        let mirrored = preset.divisions();
        let alike = Divisions { columns: mirrored.columns + 1, ..mirrored };
        for (cut, divisions, bounds) in
            [("cut alike", alike, [1e-3, 1.5e-2, 1e-2]), ("cut mirrored", mirrored, [4e-3, 1.5e-2, 8e-2])]
        {
            let errors = finger(&divisions);
            let names = [
                "displacement error over the nail's",
                "stress error of the worst hexahedron",
                "stress error of the worst tetrahedron",
            ];
            for ((name, error), bound) in names.into_iter().zip(errors).zip(bounds) {
                verify(&format!("tie, finger {label}, {cut}"), name, error, bound);
            }
        }
    }
}
