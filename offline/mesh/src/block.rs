//! Simple meshes for verification: a structured block, curved or distorted, of hexahedra or tetrahedra.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::nail::BOX_TO_TETS;
use super::{FACE_TRIANGLES, Hex, Mesh, Region, TET10_FACES, Tet, Tet10, set};

/// A block of hexahedra between these coordinates (each ascending), mm.
///
/// Node sets `x0`, `x1`, `y0`, `y1`, `z0`, `z1` are its six faces; the pad is the lower face, z0, counter-clockwise
/// seen from below. All of it is [`Region::Skin`].
pub fn block(xs: &[f64], ys: &[f64], zs: &[f64]) -> Mesh {
    let [nx, ny, nz] = [xs.len(), ys.len(), zs.len()].map(|n| n - 1);
    let node = |i: usize, j: usize, k: usize| ((i * (ny + 1) + j) * (nz + 1) + k) as u32;
    let mut mesh = Mesh::default();
    let mut sets: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for (i, &x) in xs.iter().enumerate() {
        for (j, &y) in ys.iter().enumerate() {
            for (k, &z) in zs.iter().enumerate() {
                mesh.nodes.push(Vector3::new(x, y, z));
                for (name, at, last) in [("x", i, nx), ("y", j, ny), ("z", k, nz)] {
                    for (end, place) in [("0", 0), ("1", last)] {
                        if at == place {
                            sets.entry(format!("{name}{end}")).or_default().push(node(i, j, k));
                        }
                    }
                }
            }
        }
    }
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let level = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (level(k), level(k + 1));
                mesh.hexes.push(Hex { nodes: [a, b, c, d, e, f, g, h], region: Region::Skin });
                if k == 0 {
                    mesh.pad_faces.push([a, d, c, b]);
                }
            }
        }
    }
    sets.insert(set::PAD.into(), sets["z0"].clone());
    sets.insert(set::SKIN.into(), (0..mesh.nodes.len() as u32).collect());
    mesh.node_sets = sets;
    mesh
}

/// A block whose nodes are moved by `map`, e.g. to a paraboloid: z += (x² + y²)/(2 R) times the relative distance from
/// the top. The map has to keep the elements right side out.
pub fn curved_block(xs: &[f64], ys: &[f64], zs: &[f64], map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Mesh {
    let mut mesh = block(xs, ys, zs);
    for node in &mut mesh.nodes {
        *node = map(*node);
    }
    mesh
}

/// `count` + 1 coordinates from `from` to `to`, each step `ratio` times the one before it.
pub fn coordinates(from: f64, to: f64, count: usize, ratio: f64) -> Vec<f64> {
    let part = |i: usize| {
        if (ratio - 1.0).abs() < 1e-12 {
            return i as f64 / count as f64;
        }
        (ratio.powi(i as i32) - 1.0) / (ratio.powi(count as i32) - 1.0)
    };
    (0..=count).map(|i| if i == count { to } else { from + (to - from) * part(i) }).collect()
}

/// Moves each node that is in none of the six faces' sets by up to `amplitude_mm` in each direction; the
/// same `seed` gives the same mesh.
pub fn distort(mesh: &mut Mesh, amplitude_mm: f64, seed: u64) {
    let mut inside = vec![true; mesh.nodes.len()];
    for name in ["x0", "x1", "y0", "y1", "z0", "z1"] {
        mesh.node_set(name).iter().for_each(|&n| inside[n as usize] = false);
    }
    let mut state = seed;
    let mut next = || {
        // Knuth's MMIX linear congruential generator; its upper bits.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    for (node, _) in mesh.nodes.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
        *node += amplitude_mm * Vector3::from_fn(|_, _| next());
    }
}

/// The same nodes and sets with each hexahedron split in six tetrahedra, which fit those of its neighbours in
/// a structured block. Pad faces, which are faces of hexahedra, are left out.
pub fn into_tets(mesh: &Mesh) -> Mesh {
    let split = |hex: &Hex| BOX_TO_TETS.map(|t| Tet { nodes: t.map(|n| hex.nodes[n]), region: hex.region });
    Mesh {
        nodes: mesh.nodes.clone(),
        tets: mesh.hexes.iter().flat_map(split).collect(),
        node_sets: mesh.node_sets.clone(),
        ..Mesh::default()
    }
}

/// 4-node tetrahedra with a node in the middle of every edge: the 10-node ones. A set gets the
/// middle of every edge between two of its nodes; the pad, the four triangles of every outer face all of whose nodes are in its set.
pub fn into_second_order(mesh: &Mesh) -> Mesh {
    let mut next = Mesh { nodes: mesh.nodes.clone(), ties: mesh.ties.clone(), ..Mesh::default() };
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for tet in &mesh.tets {
        let [a, b, c, d] = tet.nodes;
        let edges = [[a, b], [b, c], [a, c], [a, d], [b, d], [c, d]].map(|[m, n]| {
            *middles.entry([m.min(n), m.max(n)]).or_insert_with(|| {
                next.nodes.push((mesh.nodes[m as usize] + mesh.nodes[n as usize]) / 2.0);
                next.nodes.len() as u32 - 1
            })
        });
        let nodes = std::array::from_fn(|n| if n < 4 { tet.nodes[n] } else { edges[n - 4] });
        next.tets10.push(Tet10 { nodes, region: tet.region });
    }
    for (name, nodes) in &mesh.node_sets {
        let among = |n: &u32| nodes.binary_search(n).is_ok();
        let between = middles.iter().filter(|(ends, _)| ends.iter().all(among)).map(|(_, middle)| *middle);
        let mut all: Vec<u32> = nodes.iter().copied().chain(between).collect();
        all.sort_unstable();
        next.node_sets.insert(name.clone(), all);
    }
    let mut faces: BTreeMap<[u32; 6], Vec<[u32; 6]>> = BTreeMap::new();
    for face in next.tets10.iter().flat_map(|tet| TET10_FACES.map(|f| f.map(|n| tet.nodes[n]))) {
        let mut key = face;
        key.sort_unstable();
        faces.entry(key).or_default().push(face);
    }
    let pad = next.node_set(set::PAD);
    let of_pad = |face: &&[u32; 6]| face.iter().all(|n| pad.binary_search(n).is_ok());
    let outer = faces.values().filter(|sides| sides.len() == 1).map(|sides| &sides[0]);
    next.pad_triangles = outer.filter(of_pad).flat_map(|f| FACE_TRIANGLES.map(|t| t.map(|n| f[n]))).collect();
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check, quality};

    fn sample() -> Mesh {
        block(&[0.0, 1.0, 3.0], &coordinates(-1.0, 1.0, 3, 1.5), &coordinates(0.0, 2.0, 4, 1.0))
    }

    #[test]
    fn block_is_valid_and_has_its_volume() {
        let mesh = sample();
        check(&mesh).unwrap();
        let report = quality(&mesh);
        assert!((report.volume_mm3() - 12.0).abs() < 1e-12 && (report.worst_hex_scaled_jacobian - 1.0).abs() < 1e-12);
        assert_eq!((mesh.nodes.len(), mesh.hexes.len(), mesh.pad_faces.len()), (60, 24, 6));
        assert_eq!(mesh.node_set("x1").len(), 20);
        assert!((report.pad_area_mm2 - 6.0).abs() < 1e-12);
    }

    #[test]
    fn tets_fill_the_block() {
        let mut mesh = sample();
        distort(&mut mesh, 0.1, 7);
        let tets = into_tets(&mesh);
        check(&tets).unwrap();
        assert!((quality(&tets).volume_mm3() - 12.0).abs() < 1e-12);
    }

    #[test]
    fn second_order_keeps_volume_pad_and_sets() {
        let mesh = sample();
        let tets = into_second_order(&into_tets(&mesh));
        check(&tets).unwrap();
        let report = quality(&tets);
        assert!((report.volume_mm3() - 12.0).abs() < 1e-12 && (report.pad_area_mm2 - 6.0).abs() < 1e-12);
        assert_eq!((tets.tets10.len(), tets.pad_triangles.len()), (6 * 24, 4 * 2 * 6));
        // A grid of twice as many cells has the nodes of the set.
        assert_eq!((tets.node_set("z0").len(), tets.pad_nodes().len()), (5 * 7, 5 * 7));
    }

    #[test]
    fn distortion_repeats_and_keeps_the_outside() {
        let (mut a, mut b) = (sample(), sample());
        distort(&mut a, 0.15, 1);
        distort(&mut b, 0.15, 1);
        check(&a).unwrap();
        assert_eq!(a, b);
        let moved = a.nodes.iter().zip(&sample().nodes).filter(|(a, b)| a != b).count();
        assert_eq!(moved, 2 * 3);
        assert!(quality(&a).worst_hex_scaled_jacobian < 0.99);
    }

    #[test]
    fn paraboloid() {
        let (radius, height) = (10.0, 2.0);
        let map =
            |p: Vector3<f64>| p + Vector3::z() * ((p.x * p.x + p.y * p.y) / (2.0 * radius) * (1.0 - p.z / height));
        let grid = coordinates(-2.0, 2.0, 8, 1.0);
        let mesh = curved_block(&grid, &grid, &coordinates(0.0, height, 3, 1.2), map);
        check(&mesh).unwrap();
        let corner = mesh.nodes[mesh.node_set("x0")[0] as usize];
        assert!((corner.z - 0.4).abs() < 1e-12);
    }
}
