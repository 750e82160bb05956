//! Cook's membrane, nearly incompressible, large strain: the element does not lock.
//!
//! Clamped at x = 0, dead shear load 100 N per mm of thickness on the edge x = 48 mm, plane strain; neo-Hookean
//! (alpha = 2) with mu = 80.1938 MPa and bulk modulus 400 889.8 MPa, nu = 0.4999 [data of Simo & Armero 1992].
//! The references are others': OpenGeoSys's benchmark of finite strain with F-bar elements, and for small strain the limit
//! of P. Krysl's energy-sampling elements.

use crate::{equilibrium::equilibrium, problems::blocks::body_of, verify};
use fingerpad_fe::assembly::{Material, Supports};
use fingerpad_fe::element::{Constitutive, Hex8, Tangent};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::{
    Mesh,
    block::{coordinates, curved_block, into_second_order, into_tets},
    set,
};
use nalgebra::{DMatrix, DVector, Vector3};
use wide::f64x8;

const LAW: Ogden = Ogden { mu_mpa: 80.1938, alpha: 2.0, d_per_mpa: 2.0 / 400_889.8 };
const LOAD_N_PER_MM: f64 = 100.0;

fn membrane(n: usize) -> Mesh {
    let unit = coordinates(0.0, 1.0, n, 1.0);
    let map = |p: Vector3<f64>| Vector3::new(48.0 * p.x, 44.0 * p.x + p.y * (44.0 - 28.0 * p.x), p.z);
    curved_block(&unit, &unit, &[0.0, 1.0], map)
}

/// Share of the load on each node of the loaded edge.
fn shares(mesh: &Mesh, n: usize) -> Vec<(u32, f64)> {
    let edge = |node: u32| {
        let y = mesh.nodes[node as usize].y;
        !(44.0 + 1e-9..=60.0 - 1e-9).contains(&y)
    };
    mesh.node_set("x1").iter().map(|&node| (node, if edge(node) { 0.25 } else { 0.5 } / n as f64)).collect()
}

/// The upper corner of the loaded edge.
fn corner(mesh: &Mesh) -> u32 {
    *mesh.node_set("x1").iter().find(|&&n| mesh.nodes[n as usize].y > 60.0 - 1e-9).unwrap()
}

/// Vertical displacement of the corner, mm, under forces on nodes, N, in three steps.
fn corner_under(mesh: &Mesh, forces_n: &[(u32, f64)]) -> f64 {
    let supports = Supports {
        fixed: mesh.node_set("x0").to_vec(),
        fixed_components: (0..mesh.nodes.len() as u32).map(|node| (node, 2)).collect(),
        ..Default::default()
    };
    let body = body_of(mesh, Material::Ogden(LAW), &supports);
    let mut at = body.undeformed().clone();
    for part in [0.4, 0.7, 1.0] {
        let mut load = vec![0.0; body.dofs.count];
        for &(node, force_n) in forces_n {
            load[body.dofs.node_dof(node).unwrap() + 1] += force_n * part;
        }
        at = equilibrium(&body, at, &load, 1e-6).at;
    }
    at.x[corner(mesh) as usize].y - 60.0
}

/// Vertical displacement of the corner under the whole load, mm.
fn deflection(n: usize) -> f64 {
    let mesh = membrane(n);
    let forces: Vec<_> = shares(&mesh, n).into_iter().map(|(node, share)| (node, LOAD_N_PER_MM * share)).collect();
    corner_under(&mesh, &forces)
}

/// The membrane of n x n x 1 cells about as thick as they are wide, each split in six 10-node tetrahedra, and its
/// thickness, mm.
fn tet_membrane(n: usize) -> (Mesh, f64) {
    let thickness = 44.0 / n as f64;
    let mut hexes = membrane(n);
    hexes.nodes.iter_mut().for_each(|p| p.z *= thickness);
    let loaded = hexes.node_set("x1").to_vec();
    hexes.node_sets.insert(set::PAD.into(), loaded);
    (into_second_order(&into_tets(&hexes)), thickness)
}

/// Vertical displacement of the corner of a membrane of tetrahedra, mm.
fn tet_deflection(n: usize) -> f64 {
    let (mesh, thickness) = tet_membrane(n);
    let forces = mesh.pad_triangles.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.map(|n| mesh.nodes[n as usize]);
        let share = (b - a).cross(&(c - a)).norm() / 2.0 / (16.0 * thickness) / 3.0;
        triangle.map(|node| (node, LOAD_N_PER_MM * thickness * share))
    });
    corner_under(&mesh, &forces.collect::<Vec<_>>())
}

pub fn cooks_membrane_does_not_lock() {
    let sizes = [4, 8, 16, 32, 64];
    let tips = sizes.map(deflection);
    for (n, tip) in sizes.iter().zip(tips) {
        println!("Cook's membrane {n} x {n}: corner displacement {tip:.5} mm");
    }
    assert!(tips.windows(2).all(|w| w[0] < w[1]), "convergence from below must be monotone: {tips:?}");
    for (n, theirs) in OPENGEOSYS {
        let ours = deflection(n);
        println!("Cook's membrane {n} x {n}: {ours:.5} mm, F-bar elements of OpenGeoSys {theirs:.5} mm");
    }
    let [.., (n, theirs)] = OPENGEOSYS;
    verify(
        &format!("Cook's membrane {n} x {n}"),
        "difference from OpenGeoSys",
        (deflection(n) / theirs - 1.0).abs(),
        5e-3,
    );
    let theirs = limit(OPENGEOSYS[0], OPENGEOSYS[2]);
    let ours = limit((32, tips[3]), (64, tips[4]));
    println!("Cook's membrane: extrapolated {ours:.5} mm, OpenGeoSys extrapolated {theirs:.5} mm");
    verify("Cook's membrane, extrapolated", "difference from OpenGeoSys", (ours / theirs - 1.0).abs(), 5e-3);
    verify("Cook's membrane 16 x 16", "error of the corner displacement", (tips[2] / theirs - 1.0).abs(), 0.025);
    verify("Cook's membrane 64 x 64", "error of the corner displacement", (tips[4] / theirs - 1.0).abs(), 0.01);
    // Tetrahedra have a node between: n of them across are compared with 2n hexahedra.
    for (n, bound) in [(8, 0.025), (16, 0.015)] {
        let tip = tet_deflection(n);
        println!("Cook's membrane {n} x {n} of 10-node tetrahedra: {tip:.5} mm");
        let case = format!("Cook's membrane {n} x {n} of tetrahedra");
        verify(&case, "error of the corner displacement", (tip / theirs - 1.0).abs(), bound);
    }
}

/// Corner displacement (mm) over elements along an edge: OpenGeoSys, benchmark `LargeDeformation/CooksMembrane`, total
/// Lagrangian F-bar quadrilaterals [Wang & Nagel 2024], the same law and load.
const OPENGEOSYS: [(usize, f64); 3] = [(10, 6.746284), (20, 6.858936), (30, 6.891409)];

/// Limit of two values whose error falls with the element's size.
fn limit((n, coarse): (usize, f64), (m, fine): (usize, f64)) -> f64 {
    fine + (fine - coarse) / (m as f64 / n as f64 - 1.0)
}

pub fn small_strain_agrees_with_a_published_limit() {
    // lambda = 7500, mu = 0.375, load 1 per thickness, middle of the edge: 16.432584 in the limit [Krysl, FAESOR,
    // Cook_3D_strain].
    let law = Ogden { mu_mpa: 0.375, alpha: 2.0, d_per_mpa: 2.0 / (7500.0 + 2.0 / 3.0 * 0.375) };
    let tips = [8, 16, 32].map(|n| linear_deflection(&law, n, 52.0) / LOAD_N_PER_MM);
    println!("Cook's membrane, small strain, 8, 16, 32 elements: {tips:.4?} mm");
    assert!(tips[0] < tips[1] && tips[1] < tips[2]);
    // Richardson's extrapolation with the rate that the three show.
    let steps = [tips[1] - tips[0], tips[2] - tips[1]];
    let extrapolated = tips[2] + steps[1] * steps[1] / (steps[0] - steps[1]);
    let off = |tip: f64| (tip / 16.432584 - 1.0).abs();
    verify("Cook's membrane 32 x 32, small strain", "difference from the limit", off(tips[2]), 6e-3);
    verify("Cook's membrane, small strain, extrapolated", "difference from the limit", off(extrapolated), 1e-3);
}

/// The same law with its volumetric part at every point: full integration.
#[derive(Clone, Copy)]
struct FullyIntegrated(Ogden);

impl Constitutive for FullyIntegrated {
    fn energy(&self, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        Constitutive::energy(&self.0, b, j) + Constitutive::volumetric(&self.0, j).0
    }
    fn stress(&self, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        self.moduli(b, j).0
    }
    fn moduli(&self, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        let (mut tau, mut c) = Constitutive::moduli(&self.0, b, j);
        let (_, slope, curvature) = Constitutive::volumetric(&self.0, j);
        // tau = J p I; c = J (p + J dp/dJ) I x I − 2 J p (symmetric identity).
        for i in 0..3 {
            tau[i] += j * slope;
            for k in 0..3 {
                c[i][k] += j * (slope + j * curvature);
            }
            c[i][i] -= f64x8::splat(2.0) * j * slope;
            c[3 + i][3 + i] -= j * slope;
        }
        (tau, c)
    }
    fn volumetric(&self, _ratio: f64x8) -> (f64x8, f64x8, f64x8) {
        (f64x8::ZERO, f64x8::ZERO, f64x8::ZERO)
    }
}

/// Vertical displacement of the loaded edge at height `y_mm` in the linear problem (stiffness of the undeformed membrane), mm.
fn linear_deflection(law: &impl Constitutive, n: usize, y_mm: f64) -> f64 {
    let mesh = membrane(n);
    // Plane strain: both nodes through the thickness share two dofs.
    let dof = |node: u32| (mesh.nodes[node as usize].x > 0.0).then_some(2 * (node as usize / 2));
    let size = mesh.nodes.len();
    let mut k: DMatrix<f64> = DMatrix::identity(size, size);
    let mut load: DVector<f64> = DVector::zeros(size);
    for (node, share) in shares(&mesh, n) {
        load[dof(node).unwrap() + 1] += LOAD_N_PER_MM * share;
    }
    let free: Vec<usize> = (0..mesh.nodes.len() as u32).filter_map(dof).collect();
    free.iter().for_each(|&d| (0..2).for_each(|i| k[(d + i, d + i)] = 0.0));
    let mut tangent = Tangent::new();
    for hexes in mesh.hexes.chunks(8) {
        let nodes: Vec<[u32; 8]> = hexes.iter().map(|h| h.nodes).collect();
        Hex8::new(&nodes, &mesh.nodes).unwrap().tangent(law, &mesh.nodes, &mut tangent);
        for (lane, nodes) in nodes.iter().enumerate() {
            for (a, b) in (0..8).flat_map(|a| (0..8).map(move |b| (a, b))) {
                let (Some(row), Some(column)) = (dof(nodes[a]), dof(nodes[b])) else { continue };
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let block = if a >= b { tangent.block[a][b][i][j] } else { tangent.block[b][a][j][i] };
                    k[(row + i, column + j)] += block.to_array()[lane];
                }
            }
        }
    }
    let at = *mesh.node_set("x1").iter().find(|&&n| (mesh.nodes[n as usize].y - y_mm).abs() < 1e-9).unwrap();
    k.cholesky().expect("a positive definite stiffness").solve(&load)[dof(at).unwrap() + 1]
}

pub fn full_integration_would_lock() {
    let mean = linear_deflection(&LAW, 16, 60.0);
    let full = linear_deflection(&FullyIntegrated(LAW), 16, 60.0);
    println!("Cook's membrane 16 x 16, linear: mean dilatation {mean:.4} mm, full integration {full:.4} mm");
    verify("Cook's membrane 16 x 16, linear", "full integration over mean dilatation", full / mean, 0.7);
}
