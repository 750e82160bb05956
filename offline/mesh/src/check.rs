//! Refuses meshes that cannot be computed with; the error names the defect.

use std::collections::HashMap;

use super::boundary::{Hanging, boundary, faces_of, sorted};
use super::quality::{hex_scaled_jacobian, tet_scaled_jacobian, tet10_scaled_jacobian};
use super::{Mesh, MeshError, Region};

/// Faces of a hexahedron, counter-clockwise seen from outside.
pub const HEX_FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// Faces of a tetrahedron, counter-clockwise seen from outside.
pub const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

/// Faces of a 10-node tetrahedron, counter-clockwise seen from outside: corners, then the nodes between the first and
/// second, second and third, third and first.
pub const TET10_FACES: [[usize; 6]; 4] =
    [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [2, 0, 3, 6, 7, 9]];

/// The linear triangles of such a face, turned as it is.
pub const FACE_TRIANGLES: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// Two nodes closer than this are one node twice, mm.
const DUPLICATE_MM: f64 = 1e-6;

/// Checks a mesh: node numbers; element shapes; hexahedra and tetrahedra of each order one closed body without voids
/// or tunnels; no node twice or unused; ties that hold rigid motions, whose masters are free to move; pad faces on the
/// boundary; sets sorted. Hexahedra of two sizes may meet where the nodes in the middle of the larger faces and edges
/// are tied to those of the larger hexahedron.
pub fn check(mesh: &Mesh) -> Result<(), MeshError> {
    indices(mesh)?;
    shapes(mesh)?;
    let kinds = node_kinds(mesh);
    let hanging = Hanging::of(mesh.ties.iter().filter(|tie| kinds[tie.slave as usize].hex));
    let hexes = boundary("hex", hanging.faces_of_hexes(&mesh.hexes), &hanging)?;
    boundary("tet", faces_of(mesh.tets.iter().map(|e| e.nodes), &TET_FACES), &Hanging::default())?;
    let corners = mesh.tets10.iter().map(|e| [0, 1, 2, 3].map(|n| e.nodes[n]));
    let tets10 = boundary("tet10", faces_of(corners, &TET_FACES), &Hanging::default())?;
    let middles = middles(mesh)?;
    if let Some(node) = kinds.iter().position(|k| !k.hex && !k.tet && !k.tet10) {
        return Err(MeshError::UnusedNode { node });
    }
    if let Some(node) = kinds.iter().position(|k| k.tet10 && (k.hex || k.tet)) {
        return Err(MeshError::MixedOrders { node });
    }
    duplicates(mesh, &kinds)?;
    ties(mesh, &kinds)?;
    for (index, face) in mesh.pad_faces.iter().enumerate() {
        match hexes.get(&sorted(*face)) {
            None => {
                return Err(MeshError::PadFace { face: index, reason: "not a face of the hexahedra's boundary" });
            }
            Some(outward) if !same_cycle(outward, face) => {
                return Err(MeshError::PadFace { face: index, reason: "not counter-clockwise seen from outside" });
            }
            Some(_) => {}
        }
    }
    let triangles: HashMap<[u32; 3], [u32; 3]> = tets10
        .values()
        .flat_map(|&[a, b, c]| {
            let middle = |m, n| middles[&sorted([m, n])];
            let face = [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
            FACE_TRIANGLES.map(|t| t.map(|n| face[n])).map(|t| (sorted(t), t))
        })
        .collect();
    for (index, triangle) in mesh.pad_triangles.iter().enumerate() {
        let refuse = |reason| Err(MeshError::PadFace { face: mesh.pad_faces.len() + index, reason });
        match triangles.get(&sorted(*triangle)) {
            None => return refuse("not a quarter of a face of the 10-node tetrahedra's boundary"),
            Some(outward) if !same_cycle(outward, triangle) => {
                return refuse("not counter-clockwise seen from outside");
            }
            Some(_) => {}
        }
    }
    Ok(())
}

/// The node of every edge of the 10-node tetrahedra.
fn middles(mesh: &Mesh) -> Result<HashMap<[u32; 2], u32>, MeshError> {
    let mut middles = HashMap::new();
    for (element, tet) in mesh.tets10.iter().enumerate() {
        for (edge, [a, b]) in [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
            let (ends, node) = (sorted([tet.nodes[a], tet.nodes[b]]), tet.nodes[4 + edge]);
            if *middles.entry(ends).or_insert(node) != node {
                return Err(MeshError::EdgeNodes { element, region: tet.region, nodes: ends });
            }
        }
    }
    Ok(middles)
}

fn indices(mesh: &Mesh) -> Result<(), MeshError> {
    if let Some(node) = mesh.nodes.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(MeshError::NotFinite { node });
    }
    let nodes = mesh.nodes.len();
    let known = |kind, element, region: Option<Region>, list: &[u32]| match list.iter().find(|&&n| n as usize >= nodes)
    {
        Some(&node) => Err(MeshError::NoSuchNode { kind, element, region, node, nodes }),
        None => Ok(()),
    };
    for (i, e) in mesh.hexes.iter().enumerate() {
        known("hex", i, Some(e.region), &e.nodes)?;
    }
    for (i, e) in mesh.tets.iter().enumerate() {
        known("tet", i, Some(e.region), &e.nodes)?;
    }
    for (i, e) in mesh.tets10.iter().enumerate() {
        known("tet10", i, Some(e.region), &e.nodes)?;
    }
    for (i, face) in mesh.pad_faces.iter().enumerate() {
        known("pad face", i, None, face)?;
    }
    for (i, face) in mesh.pad_triangles.iter().enumerate() {
        known("pad triangle", i, None, face)?;
    }
    for (i, tie) in mesh.ties.iter().enumerate() {
        known("tie", i, None, &[tie.slave])?;
        known("tie", i, None, &tie.masters.iter().map(|m| m.0).collect::<Vec<_>>())?;
    }
    for (i, (name, list)) in mesh.node_sets.iter().enumerate() {
        known("node set", i, None, list)?;
        if !list.is_sorted_by(|a, b| a < b) {
            return Err(MeshError::NodeSet { name: name.clone() });
        }
    }
    Ok(())
}

fn shapes(mesh: &Mesh) -> Result<(), MeshError> {
    let hexes = mesh.hexes.iter().enumerate().map(|(i, e)| ("hex", i, e.region, hex_scaled_jacobian(mesh, e)));
    let tets = mesh.tets.iter().enumerate().map(|(i, e)| ("tet", i, e.region, tet_scaled_jacobian(mesh, e)));
    let tets10 = mesh.tets10.iter().enumerate().map(|(i, e)| ("tet10", i, e.region, tet10_scaled_jacobian(mesh, e)));
    for (kind, element, region, scaled_jacobian) in hexes.chain(tets).chain(tets10) {
        if !(scaled_jacobian > 1e-9) {
            return Err(MeshError::Inverted { kind, element, region, scaled_jacobian });
        }
    }
    Ok(())
}

/// Which elements a node belongs to.
#[derive(Clone, Copy, Default)]
struct Kind {
    hex: bool,
    tet: bool,
    tet10: bool,
    bone: bool,
}

fn node_kinds(mesh: &Mesh) -> Vec<Kind> {
    let mut kinds = vec![Kind::default(); mesh.nodes.len()];
    mesh.hexes.iter().flat_map(|e| e.nodes).for_each(|n| kinds[n as usize].hex = true);
    mesh.tets.iter().flat_map(|e| e.nodes).for_each(|n| kinds[n as usize].tet = true);
    mesh.tets10.iter().flat_map(|e| e.nodes).for_each(|n| kinds[n as usize].tet10 = true);
    let bones = mesh.hexes.iter().filter(|e| matches!(e.region, Region::DistalBone | Region::ProximalBone));
    bones.flat_map(|e| e.nodes).for_each(|n| kinds[n as usize].bone = true);
    kinds
}

/// No two nodes of the hexahedra, or of the tetrahedra, in one place (tied nodes may lie on their masters).
fn duplicates(mesh: &Mesh, kinds: &[Kind]) -> Result<(), MeshError> {
    let mut order: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    order.sort_unstable_by(|a, b| mesh.nodes[*a as usize].x.total_cmp(&mesh.nodes[*b as usize].x).then(a.cmp(b)));
    for (place, &a) in order.iter().enumerate() {
        for &b in &order[place + 1..] {
            let step = mesh.nodes[b as usize] - mesh.nodes[a as usize];
            if step.x > DUPLICATE_MM {
                break;
            }
            let (ka, kb) = (kinds[a as usize], kinds[b as usize]);
            let one_body = ka.hex && kb.hex || ka.tet && kb.tet || ka.tet10 && kb.tet10;
            if step.norm() < DUPLICATE_MM && one_body {
                return Err(MeshError::DuplicateNodes { first: a.min(b), second: a.max(b), distance_mm: step.norm() });
            }
        }
    }
    Ok(())
}

fn ties(mesh: &Mesh, kinds: &[Kind]) -> Result<(), MeshError> {
    let mut slaves: Vec<u32> = mesh.ties.iter().map(|t| t.slave).collect();
    slaves.sort_unstable();
    for (index, tie) in mesh.ties.iter().enumerate() {
        let refuse = |reason, value| Err(MeshError::Tie { tie: index, slave: tie.slave, reason, value });
        let hangs = matches!(tie.masters.len(), 2 | 4) && tie.masters.iter().all(|m| m.1 == tie.masters[0].1);
        if kinds[tie.slave as usize].hex && !hangs {
            let reason = "a slave that belongs to hexahedra must hang in the middle of an edge or a face";
            return refuse(reason, f64::from(tie.slave));
        }
        if slaves.partition_point(|&s| s <= tie.slave) - slaves.partition_point(|&s| s < tie.slave) > 1 {
            return refuse("the slave is tied twice", f64::from(tie.slave));
        }
        if let Some(&(node, _)) = tie.masters.iter().find(|(n, _)| !kinds[*n as usize].hex) {
            return refuse("a master belongs to no hexahedron", f64::from(node));
        }
        if let Some(&(node, _)) = tie.masters.iter().find(|(n, _)| slaves.binary_search(n).is_ok()) {
            return refuse("a master is tied itself", f64::from(node));
        }
        if let Some(&(node, _)) = tie.masters.iter().find(|(n, _)| kinds[*n as usize].bone) {
            return refuse("a master belongs to a bone, which may be rigid", f64::from(node));
        }
        let sum: f64 = tie.masters.iter().map(|m| m.1).sum();
        if !((sum - 1.0).abs() < 1e-12) {
            return refuse("the weights must sum to 1", sum);
        }
        let closest: nalgebra::Vector3<f64> = tie.masters.iter().map(|&(n, w)| mesh.nodes[n as usize] * w).sum();
        let offset = (closest - mesh.nodes[tie.slave as usize]).norm();
        if !(offset < 1e-9) {
            return refuse("the slave must lie at the weighted mean of its masters; offset in mm", offset);
        }
    }
    Ok(())
}

/// Whether two faces have the same nodes in the same cyclic order.
fn same_cycle<const N: usize>(a: &[u32; N], b: &[u32; N]) -> bool {
    (0..N).any(|shift| (0..N).all(|i| a[i] == b[(i + shift) % N]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{block, into_second_order, into_tets};
    use crate::{Fingertip, FingertipShape, MeshPreset, Tie, fingertip};

    fn cube() -> Mesh {
        let grid = [0.0, 1.0, 2.0, 3.0];
        block(&grid, &grid, &grid)
    }

    fn finger() -> Mesh {
        let Fingertip { mesh, .. } = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
        mesh
    }

    fn refused(mut mesh: Mesh, change: impl Fn(&mut Mesh)) -> MeshError {
        check(&mesh).unwrap();
        change(&mut mesh);
        check(&mesh).unwrap_err()
    }

    #[test]
    fn inverted_and_flat_elements() {
        let error = refused(finger(), |m| m.hexes[5].nodes.swap(0, 2));
        let expected = finger().hexes[5].region;
        assert!(matches!(error, MeshError::Inverted { kind: "hex", element: 5, region, .. } if region == expected));
        assert!(error.to_string().contains("hex 5 (ProximalBone)"), "{error}");
        let error = refused(finger(), |m| m.tets[3].nodes.swap(0, 1));
        assert!(matches!(error, MeshError::Inverted { kind: "tet", element: 3, region: Region::Nail, .. }));
        let flat = refused(cube(), |m| m.nodes.iter_mut().for_each(|p| p.z = 0.0));
        assert!(matches!(flat, MeshError::Inverted { element: 0, .. }));
    }

    #[test]
    fn missing_elements() {
        // The one in the middle leaves a void.
        let void = refused(cube(), |m| _ = m.hexes.remove(13));
        assert_eq!(void, MeshError::Hole { kind: "hex", euler: 4 });
        // A tunnel: the middle row.
        let tunnel = refused(cube(), |m| {
            m.pad_faces.clear();
            m.hexes = m.hexes.iter().enumerate().filter(|(i, _)| i % 9 != 4).map(|(_, h)| *h).collect();
        });
        assert_eq!(tunnel, MeshError::Hole { kind: "hex", euler: 0 });
        // Two that share an edge only.
        let edge = refused(cube(), |m| m.hexes = vec![m.hexes[0], m.hexes[4]]);
        assert!(matches!(edge, MeshError::OpenBoundary { faces: 4, .. }), "{edge}");
        let void = refused(into_tets(&cube()), |m| drop(m.tets.drain(13 * 6..14 * 6)));
        assert_eq!(void, MeshError::Hole { kind: "tet", euler: 4 });
    }

    #[test]
    fn tetrahedra_of_second_order() {
        let cube = || into_second_order(&into_tets(&cube()));
        let bent = refused(cube(), |m| {
            let [a, b] = [0, 1].map(|n| m.nodes[m.tets10[7].nodes[n] as usize]);
            let middle = m.tets10[7].nodes[4] as usize;
            m.nodes[middle] = b + (b - a) * 0.1;
        });
        assert!(matches!(bent, MeshError::Inverted { kind: "tet10", .. }), "{bent}");
        let torn = refused(cube(), |m| {
            m.nodes.push(m.nodes[m.tets10[7].nodes[4] as usize] + nalgebra::Vector3::x() * 0.01);
            m.tets10[7].nodes[4] = m.nodes.len() as u32 - 1;
        });
        assert!(matches!(torn, MeshError::EdgeNodes { .. }), "{torn}");
        let mixed = refused(cube(), |m| {
            let first = m.tets10.pop().unwrap();
            m.pad_triangles.clear();
            m.tets.push(super::super::Tet { nodes: [0, 1, 2, 3].map(|n| first.nodes[n]), region: first.region });
            let used: std::collections::BTreeSet<u32> =
                m.tets10.iter().flat_map(|t| t.nodes).chain(m.tets[0].nodes).collect();
            assert_eq!(used.len(), m.nodes.len());
        });
        assert!(matches!(mixed, MeshError::MixedOrders { .. }), "{mixed}");
        let turned = refused(cube(), |m| m.pad_triangles[2].reverse());
        assert!(matches!(turned, MeshError::PadFace { reason, .. } if reason.contains("clockwise")), "{turned}");
        let corners = refused(cube(), |m| m.pad_triangles[2] = [0, 1, 2].map(|n| m.tets10[0].nodes[n]));
        assert!(matches!(corners, MeshError::PadFace { reason, .. } if reason.contains("quarter")), "{corners}");
        let void = refused(cube(), |m| drop(m.tets10.drain(13 * 6..14 * 6)));
        assert!(matches!(void, MeshError::Hole { kind: "tet10", euler: 4 }), "{void}");
    }

    #[test]
    fn shared_faces_and_lost_nodes() {
        let twice = refused(cube(), |m| m.hexes.push(m.hexes[0]));
        assert!(matches!(twice, MeshError::FaceShared { kind: "hex", elements: 3, .. }), "{twice}");
        let lost = refused(cube(), |m| m.nodes.push(m.nodes[0] * 2.0));
        assert_eq!(lost, MeshError::UnusedNode { node: 64 });
        let none = refused(cube(), |m| m.hexes[2].nodes[1] = 99);
        assert!(matches!(none, MeshError::NoSuchNode { kind: "hex", element: 2, node: 99, nodes: 64, .. }));
        let nan = refused(cube(), |m| m.nodes[7].y = f64::NAN);
        assert_eq!(nan, MeshError::NotFinite { node: 7 });
        let set = refused(cube(), |m| m.node_sets.get_mut("x0").unwrap().reverse());
        assert_eq!(set, MeshError::NodeSet { name: "x0".into() });
    }

    #[test]
    fn duplicate_nodes() {
        // Two cubes that touch in a face but do not share its nodes are two bodies.
        let apart = refused(cube(), |m| {
            let other = cube();
            m.nodes.extend(other.nodes.iter().map(|p| p + nalgebra::Vector3::x() * 3.0));
            m.hexes.extend(other.hexes.iter().map(|h| super::super::Hex { nodes: h.nodes.map(|n| n + 64), ..*h }));
        });
        assert_eq!(apart, MeshError::Hole { kind: "hex", euler: 4 });
        let mut mesh = cube();
        mesh.nodes[1] = mesh.nodes[0];
        let kinds = node_kinds(&mesh);
        let error = duplicates(&mesh, &kinds).unwrap_err();
        assert_eq!(error, MeshError::DuplicateNodes { first: 0, second: 1, distance_mm: 0.0 });
    }

    #[test]
    fn ties() {
        let reason = |change: fn(&mut Mesh)| match refused(finger(), change) {
            MeshError::Tie { reason, .. } => reason,
            other => panic!("{other}"),
        };
        assert!(reason(|m| m.ties[4].masters[0].1 += 1e-6).contains("sum to 1"));
        assert!(reason(|m| m.ties[4].slave = m.hexes[0].nodes[0]).contains("middle of an edge"));
        assert!(reason(|m| m.ties[4].masters[0].0 = m.hexes[0].nodes[0]).contains("bone"));
        assert!(reason(|m| m.ties[4].masters[0].0 = m.tets[0].nodes[0]).contains("no hexahedron"));
        assert!(reason(|m| m.ties.push(m.ties[0].clone())).contains("twice"));
        assert!(reason(|m| m.ties[4].masters = vec![(m.hexes[m.hexes.len() - 1].nodes[0], 1.0)]).contains("offset"));
        let missing = refused(finger(), |m| m.ties.push(Tie { slave: 0, masters: vec![(1 << 30, 1.0)] }));
        assert!(matches!(missing, MeshError::NoSuchNode { kind: "tie", .. }));
    }

    #[test]
    fn pad_faces() {
        let turned = refused(cube(), |m| m.pad_faces[2].reverse());
        assert!(matches!(turned, MeshError::PadFace { face: 2, .. }), "{turned}");
        let inside = refused(cube(), |m| m.pad_faces[1] = m.hexes[0].nodes[4..8].try_into().unwrap());
        assert!(matches!(inside, MeshError::PadFace { face: 1, .. }), "{inside}");
    }
}
