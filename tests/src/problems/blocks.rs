//! Blocks with their bodies.

use fingerpad_fe::assembly::{Body, Joint, Material, Supports};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::{
    Mesh, Region, Tie,
    block::{block, coordinates, curved_block, distort, into_tets},
};
use nalgebra::{Rotation3, Vector3};

/// A block of 3 x 4 x 3 hexahedra, 3 x 3.2 x 2.4 mm, its inner nodes moved by up to 0.2 of the spacing.
pub fn distorted_block(seed: u64) -> Mesh {
    let mut mesh =
        block(&coordinates(-1.0, 2.0, 3, 1.2), &coordinates(0.0, 3.2, 4, 1.0), &coordinates(0.5, 2.9, 3, 0.9));
    distort(&mut mesh, 0.16, seed);
    mesh
}

/// A soft paraboloid of radius 6 mm, 4 x 4 x 2 mm, fixed at its upper face, with a rigid cell on a joint in it, turned as a
/// whole about the point of first touch.
///
/// # Panics
/// Never: the mesh is right side out.
pub fn paraboloid(turn: &Rotation3<f64>) -> (Mesh, Body) {
    let line = coordinates(-2.0, 2.0, 8, 1.0);
    let bulge = |p: Vector3<f64>| p + Vector3::z() * ((p.x * p.x + p.y * p.y) / 12.0 * (1.0 - p.z / 2.0));
    let mut mesh = curved_block(&line, &line, &coordinates(0.0, 2.0, 4, 1.3), bulge);
    let core = |p: &Vector3<f64>| p.xy().amax() < 0.6 && p.z > 0.8 && p.z < 1.7;
    let rigid: Vec<u32> = (0..mesh.nodes.len() as u32).filter(|&n| core(&mesh.nodes[n as usize])).collect();
    assert!(rigid.len() >= 8, "a cell at least");
    mesh.nodes.iter_mut().for_each(|p| *p = turn * *p);
    let supports = Supports {
        fixed: mesh.node_set("z1").to_vec(),
        contact: mesh.node_set("z0").to_vec(),
        rigid,
        ..Default::default()
    };
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let joint = Joint { translation_n_per_mm: 0.05, rotation_nmm_per_rad: 0.2 };
    let reference = turn * Vector3::new(0.1, 0.3, 1.5);
    let body = Body::new(&mesh, |_| Some(soft), &supports, reference, joint).expect("a mesh right side out");
    (mesh, body)
}

/// Nodes of the six faces of a block.
pub fn outside(mesh: &Mesh) -> Vec<u32> {
    let mut nodes: Vec<u32> =
        ["x0", "x1", "y0", "y1", "z0", "z1"].iter().flat_map(|s| mesh.node_set(s)).copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// A body of one material.
pub fn body_of(mesh: &Mesh, material: Material, supports: &Supports) -> Body {
    Body::new(mesh, |_| Some(material), supports, Vector3::zeros(), Joint::default()).expect("a mesh right side out")
}

/// All three components of every node held at its prescribed place: nothing moves.
pub fn all_held(mesh: &Mesh) -> Supports {
    let fixed_components = (0..mesh.nodes.len() as u32).flat_map(|n| (0..3).map(move |k| (n, k))).collect();
    Supports { fixed_components, ..Default::default() }
}

/// A block of hexahedra between these coordinates, and on its upper face, tied to it, tetrahedra between
/// `nail_xs`, `nail_ys` (within the block's) and over `layers` layers of `thickness` in all.
///
/// Sets: those of the block; `nail_fix` the upper face of the tetrahedra; `nail` all their nodes.
pub fn tied_block(axes: [&[f64]; 3], nail_xs: &[f64], nail_ys: &[f64], layers: usize, thickness: f64) -> Mesh {
    let [xs, ys, zs] = axes;
    let mut mesh = block(xs, ys, zs);
    let top = *zs.last().expect("a block");
    let nail = into_tets(&block(nail_xs, nail_ys, &coordinates(top, top + thickness, layers, 1.0)));
    let first = mesh.nodes.len() as u32;
    for &slave in nail.node_set("z0") {
        let p = nail.nodes[slave as usize];
        let ((i, u), (j, v)) = (cell(xs, p.x), cell(ys, p.y));
        let node = |i: usize, j: usize| ((i * ys.len() + j) * zs.len() + zs.len() - 1) as u32;
        let weights = [
            (node(i, j), (1.0 - u) * (1.0 - v)),
            (node(i + 1, j), u * (1.0 - v)),
            (node(i + 1, j + 1), u * v),
            (node(i, j + 1), (1.0 - u) * v),
        ];
        let masters = weights.into_iter().filter(|(_, w)| *w > 1e-14).collect();
        mesh.ties.push(Tie { slave: first + slave, masters });
    }
    mesh.nodes.extend(&nail.nodes);
    mesh.tets.extend(nail.tets.iter().map(|t| {
        let mut tet = *t;
        tet.nodes = t.nodes.map(|n| n + first);
        tet.region = Region::Nail;
        tet
    }));
    mesh.node_sets.insert("nail_fix".into(), nail.node_set("z1").iter().map(|n| n + first).collect());
    mesh.node_sets.insert("nail".into(), (first..mesh.nodes.len() as u32).collect());
    mesh
}

/// Cell of ascending coordinates in which `x` lies and its place there, 0 to 1.
fn cell(coordinates: &[f64], x: f64) -> (usize, f64) {
    let last = coordinates.len() - 2;
    let i = coordinates.partition_point(|c| *c <= x).saturating_sub(1).min(last);
    (i, (x - coordinates[i]) / (coordinates[i + 1] - coordinates[i]))
}
