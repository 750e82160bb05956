//! The half of a mesh that is its own mirror image about the plane y = 0.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::{Mesh, Region};

/// Distance below which two nodes are mirror images, and a node lies on the plane of symmetry, mm.
const SAME_MM: f64 = 1e-6;

/// The half y >= 0 of a symmetric mesh, with the mirror images of the other half.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfMesh {
    /// Elements, pad faces and ties of the half, on all nodes and node sets of the whole mesh; nodes with y < 0 belong to
    /// none of its elements.
    pub mesh: Mesh,
    /// Nodes on the plane of symmetry.
    pub middle: Vec<u32>,
    /// Node of the half whose mirror image each node of the whole mesh is; itself in the half.
    pub node: Vec<u32>,
    /// Hexahedron of the half's mesh that each of the whole mesh is or mirrors.
    pub hex: Vec<u32>,
    /// Whether each hexahedron of the whole mesh is a mirror image of one of the half.
    pub hex_is_mirrored: Vec<bool>,
    /// Tetrahedron of the half's mesh that each of the whole mesh is or mirrors.
    pub tet: Vec<u32>,
    /// Whether each tetrahedron of the whole mesh is a mirror image of one of the half.
    pub tet_is_mirrored: Vec<bool>,
    /// Pad face of the half's mesh that each of the whole mesh is or mirrors.
    pub pad_face: Vec<u32>,
    /// Whether each pad face of the whole mesh is a mirror image of one of the half.
    pub pad_face_is_mirrored: Vec<bool>,
}

impl HalfMesh {
    /// The half of `mesh`; None if the mesh is not symmetric about y = 0 or has no nodes there: nodes within 1e-6 mm,
    /// elements, pad faces, ties and node sets all have their mirror images, and no element crosses the plane. None with
    /// 10-node tetrahedra.
    pub fn of(mesh: &Mesh) -> Option<Self> {
        // Gmsh's tetrahedra are not symmetric even where the finger is.
        if !mesh.tets10.is_empty() {
            return None;
        }
        let mirror = mirror_nodes(&mesh.nodes)?;
        let sides = Sides { mesh, mirror: &mirror };
        let hexes: Vec<_> = mesh.hexes.iter().map(|hex| (hex.nodes.as_slice(), Some(hex.region))).collect();
        let tets: Vec<_> = mesh.tets.iter().map(|tet| (tet.nodes.as_slice(), Some(tet.region))).collect();
        let faces: Vec<_> = mesh.pad_faces.iter().map(|face| (face.as_slice(), None)).collect();
        let (hexes, tets, faces) = (sides.halve(&hexes)?, sides.halve(&tets)?, sides.halve(&faces)?);
        if !sides.sets_are_symmetric() || !sides.ties_are_symmetric() {
            return None;
        }
        let is_left = |node: u32| mesh.nodes[node as usize].y >= -SAME_MM;
        let ties = mesh.ties.iter().filter(|tie| is_left(tie.slave)).cloned().collect();
        let half = Mesh {
            nodes: mesh.nodes.clone(),
            hexes: hexes.kept.iter().map(|&e| mesh.hexes[e]).collect(),
            tets: tets.kept.iter().map(|&e| mesh.tets[e]).collect(),
            pad_faces: faces.kept.iter().map(|&f| mesh.pad_faces[f]).collect(),
            node_sets: mesh.node_sets.clone(),
            soft_regions: mesh.soft_regions.clone(),
            ties,
            ..Mesh::default()
        };
        let all = || 0..mesh.nodes.len() as u32;
        Some(Self {
            mesh: half,
            middle: all().filter(|&n| mesh.nodes[n as usize].y.abs() <= SAME_MM).collect(),
            node: all().map(|n| if is_left(n) { n } else { mirror[n as usize] }).collect(),
            hex: hexes.place,
            hex_is_mirrored: hexes.is_mirrored,
            tet: tets.place,
            tet_is_mirrored: tets.is_mirrored,
            pad_face: faces.place,
            pad_face_is_mirrored: faces.is_mirrored,
        })
    }
}

/// Nodes on either side of the plane of symmetry.
struct Sides<'a> {
    mesh: &'a Mesh,
    mirror: &'a [u32],
}

/// Elements or faces of one kind, cut in half.
struct Halved {
    /// Those of the half.
    kept: Vec<usize>,
    /// Place of each node, or of its mirror image, among the kept ones.
    place: Vec<u32>,
    is_mirrored: Vec<bool>,
}

impl Sides<'_> {
    /// Cuts elements (nodes and region) in half; None if one crosses the plane or has no mirror image.
    fn halve(&self, elements: &[(&[u32], Option<Region>)]) -> Option<Halved> {
        let mut halved = Halved { kept: Vec::new(), place: vec![0; elements.len()], is_mirrored: Vec::new() };
        let mut of_half = HashMap::new();
        for (e, &(nodes, region)) in elements.iter().enumerate() {
            let y = || nodes.iter().map(|&n| self.mesh.nodes[n as usize].y);
            let (is_left, is_right) = (y().all(|y| y >= -SAME_MM), y().all(|y| y <= SAME_MM));
            if is_left == is_right {
                return None;
            }
            halved.is_mirrored.push(is_right);
            if is_left {
                halved.place[e] = halved.kept.len() as u32;
                of_half.insert((sorted(nodes.iter().copied()), region), halved.kept.len() as u32);
                halved.kept.push(e);
            }
        }
        for (e, &(nodes, region)) in elements.iter().enumerate().filter(|&(e, _)| halved.is_mirrored[e]) {
            halved.place[e] = of_half.remove(&(sorted(nodes.iter().map(|&n| self.mirror[n as usize])), region))?;
        }
        of_half.is_empty().then_some(halved)
    }

    fn sets_are_symmetric(&self) -> bool {
        let is_symmetric = |set: &Vec<u32>| sorted(set.iter().map(|&n| self.mirror[n as usize])) == *set;
        self.mesh.node_sets.values().all(is_symmetric)
    }

    /// Whether every tie has its mirror image and none reaches across the plane.
    fn ties_are_symmetric(&self) -> bool {
        let y = |n: u32| self.mesh.nodes[n as usize].y;
        let of_slave: HashMap<u32, &Vec<(u32, f64)>> = self.mesh.ties.iter().map(|t| (t.slave, &t.masters)).collect();
        self.mesh.ties.iter().all(|tie| {
            let Some(others) = of_slave.get(&self.mirror[tie.slave as usize]) else { return false };
            let mirrored = |&(master, weight): &(u32, f64)| {
                let wanted = self.mirror[master as usize];
                let stays = y(master).abs() <= SAME_MM || (y(master) > 0.0) == (y(tie.slave) > 0.0);
                stays && others.iter().any(|&(other, w)| other == wanted && (w - weight).abs() < SAME_MM)
            };
            others.len() == tie.masters.len() && tie.masters.iter().all(mirrored)
        })
    }
}

fn sorted(nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    nodes.sort_unstable();
    nodes
}

/// The mirror image of every node; None if one has none. Nodes at one place (tied ones) are distinguished by their
/// order.
fn mirror_nodes(nodes: &[Vector3<f64>]) -> Option<Vec<u32>> {
    let mut by_x: Vec<u32> = (0..nodes.len() as u32).collect();
    by_x.sort_by(|&a, &b| nodes[a as usize].x.total_cmp(&nodes[b as usize].x));
    let at = |place: Vector3<f64>| -> Vec<u32> {
        let first = by_x.partition_point(|&n| nodes[n as usize].x < place.x - SAME_MM);
        let near = by_x[first..].iter().copied().take_while(|&n| nodes[n as usize].x <= place.x + SAME_MM);
        sorted(near.filter(|&n| (nodes[n as usize] - place).amax() <= SAME_MM))
    };
    let image = |n: usize| {
        let (here, there) = (at(nodes[n]), at(Vector3::new(nodes[n].x, -nodes[n].y, nodes[n].z)));
        let rank = here.iter().position(|&other| other as usize == n)?;
        (here.len() == there.len()).then(|| there[rank])
    };
    (0..nodes.len()).map(image).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Divisions, FingertipShape, MeshPreset, fingertip, set};

    #[test]
    fn parametric_fingers_of_even_columns_are_symmetric_and_others_are_left_whole() {
        for name in FingertipShape::NAMES {
            for preset in [MeshPreset::Coarse, MeshPreset::Default] {
                let shape = FingertipShape::named(name).unwrap();
                let mesh = fingertip(&shape, &preset.divisions()).unwrap().mesh;
                let half = HalfMesh::of(&mesh).unwrap_or_else(|| panic!("{name} {preset:?}"));
                assert_eq!(2 * half.mesh.hexes.len(), mesh.hexes.len());
                assert_eq!(2 * half.mesh.tets.len(), mesh.tets.len());
                assert_eq!(2 * half.mesh.pad_faces.len(), mesh.pad_faces.len());
                assert!(half.middle.iter().any(|n| mesh.node_set(set::PAD).contains(n)));
                for (n, &m) in half.node.iter().enumerate() {
                    let (p, q) = (mesh.nodes[n], mesh.nodes[m as usize]);
                    assert!((q - Vector3::new(p.x, p.y.abs(), p.z)).norm() < SAME_MM);
                }
                for (e, &h) in half.hex.iter().enumerate() {
                    let middle = |nodes: [u32; 8]| nodes.iter().map(|&n| mesh.nodes[n as usize]).sum::<Vector3<f64>>();
                    let (p, q) = (middle(mesh.hexes[e].nodes), middle(half.mesh.hexes[h as usize].nodes));
                    assert!((q - Vector3::new(p.x, p.y.abs(), p.z)).norm() < 1e-5);
                }
            }
        }
        let odd = Divisions { columns: 7, ..MeshPreset::Coarse.divisions() };
        assert_eq!(HalfMesh::of(&fingertip(&FingertipShape::default(), &odd).unwrap().mesh), None);
    }

    #[test]
    fn a_mesh_that_differs_anywhere_is_not_symmetric() {
        let mesh = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap().mesh;
        let right = |nodes: &[u32]| nodes.iter().map(|&n| mesh.nodes[n as usize].y).sum::<f64>() < -1.0;
        let changes: [(&str, &dyn Fn(&mut Mesh)); 5] = [
            ("a node moved", &|m| m.nodes[m.pad_faces[0][0] as usize].y += 1e-4),
            ("another region", &|m| {
                let e = m.hexes.iter().position(|h| h.region == Region::Skin && right(&h.nodes)).unwrap();
                m.hexes[e].region = Region::Subcutaneous;
            }),
            ("no pad there", &|m| {
                let f = m.pad_faces.iter().position(|f| right(f)).unwrap();
                m.pad_faces.remove(f);
            }),
            ("not tied there", &|m| {
                let t = m.ties.iter().position(|t| right(&[t.slave])).unwrap();
                m.ties.remove(t);
            }),
            ("not held there", &|m| {
                let held = m.node_sets.get_mut(set::PROXIMAL_FIX).unwrap();
                held.retain(|&n| mesh.nodes[n as usize].y > -3.0);
            }),
        ];
        for (what, change) in changes {
            let mut changed = mesh.clone();
            change(&mut changed);
            assert_eq!(HalfMesh::of(&changed), None, "{what}");
        }
    }
}
