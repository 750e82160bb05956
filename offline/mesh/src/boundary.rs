//! The boundary surface of a body of elements, and whether it is one closed sphere.

use std::collections::BTreeMap;

use super::{HEX_FACES, Hex, MeshError, Tie};

/// Nodes that hang in the middle of an edge or a face between hexahedra, by the sorted nodes of that.
#[derive(Default)]
pub(super) struct Hanging {
    edges: BTreeMap<[u32; 2], u32>,
    faces: BTreeMap<[u32; 4], u32>,
}

impl Hanging {
    /// The ties whose slave belongs to hexahedra.
    pub(super) fn of<'a>(ties: impl Iterator<Item = &'a Tie>) -> Self {
        let mut hanging = Self::default();
        for tie in ties {
            let masters: Vec<u32> = tie.masters.iter().map(|m| m.0).collect();
            if let Ok(ends) = <[u32; 2]>::try_from(&masters[..]) {
                hanging.edges.insert(sorted(ends), tie.slave);
            } else if let Ok(corners) = <[u32; 4]>::try_from(&masters[..]) {
                hanging.faces.insert(sorted(corners), tie.slave);
            }
        }
        hanging
    }

    /// Faces of hexahedra; one with a node in its middle as the four that meet there.
    pub(super) fn faces_of_hexes(&self, hexes: &[Hex]) -> Vec<[u32; 4]> {
        let mut faces = Vec::with_capacity(6 * hexes.len());
        for face in hexes.iter().flat_map(|hex| HEX_FACES.map(|f| f.map(|n| hex.nodes[n]))) {
            let Some(&middle) = self.faces.get(&sorted(face)) else {
                faces.push(face);
                continue;
            };
            // An edge without a node in its middle leaves the border open, which is found.
            let half = |i: usize| {
                let ends = [face[i % 4], face[(i + 1) % 4]];
                self.edges.get(&sorted(ends)).copied().unwrap_or(ends[0])
            };
            faces.extend((0..4).map(|i| [face[i], half(i), middle, half(i + 3)]));
        }
        faces
    }

    /// An edge, or its halves.
    pub(super) fn parts(&self, edge: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        let [from, to] = edge;
        let middle = self.edges.get(&sorted(edge)).copied();
        let first = [from, middle.unwrap_or(to)];
        [Some(first), middle.map(|middle| [middle, to])].into_iter().flatten()
    }
}

/// Faces of elements.
pub(super) fn faces_of<const E: usize, const F: usize, const N: usize>(
    elements: impl Iterator<Item = [u32; E]>,
    faces: &[[usize; F]; N],
) -> Vec<[u32; F]> {
    elements.flat_map(|element| faces.map(|face| face.map(|n| element[n]))).collect()
}

/// The boundary faces by their sorted nodes, outward; `Err` unless they are one closed sphere.
///
/// `faces` are all faces of all elements, each seen from outside its element.
pub(super) fn boundary<const F: usize>(
    kind: &'static str,
    faces: Vec<[u32; F]>,
    hanging: &Hanging,
) -> Result<BTreeMap<[u32; F], [u32; F]>, MeshError> {
    let mut all: Vec<([u32; F], [u32; F])> = faces.into_iter().map(|face| (sorted(face), face)).collect();
    all.sort_unstable();
    let mut outside = BTreeMap::new();
    for group in all.chunk_by(|a, b| a.0 == b.0) {
        match group.len() {
            1 => drop(outside.insert(group[0].0, group[0].1)),
            2 => {}
            count => {
                return Err(MeshError::FaceShared { kind, nodes: group[0].0.to_vec(), elements: count });
            }
        }
    }
    if all.is_empty() {
        return Ok(outside);
    }
    let mut edges: Vec<[u32; 2]> =
        outside.values().flat_map(|f| (0..F).flat_map(|i| hanging.parts([f[i], f[(i + 1) % F]]))).map(sorted).collect();
    edges.sort_unstable();
    let mut edge_count = 0;
    for group in edges.chunk_by(|a, b| a == b) {
        edge_count += 1;
        if group.len() != 2 {
            return Err(MeshError::OpenBoundary { kind, nodes: group[0], faces: group.len() });
        }
    }
    let mut nodes: Vec<u32> = outside.keys().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let euler = outside.len() as i64 - edge_count + nodes.len() as i64;
    if euler == 2 { Ok(outside) } else { Err(MeshError::Hole { kind, euler }) }
}

/// The same nodes in ascending order.
pub(super) fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}
