//! The boundary surface of a body of elements, and whether it is one closed sphere.

use std::collections::BTreeMap;

use super::MeshError;

/// The boundary faces by their sorted nodes, outward; `Err` unless they are one closed sphere.
pub(super) fn boundary<const E: usize, const F: usize, const N: usize>(
    kind: &'static str,
    elements: &[[u32; E]],
    faces: &[[usize; F]; N],
) -> Result<BTreeMap<[u32; F], [u32; F]>, MeshError> {
    let mut all: Vec<([u32; F], [u32; F])> = Vec::with_capacity(N * elements.len());
    for element in elements {
        all.extend(faces.iter().map(|f| f.map(|n| element[n])).map(|face| (sorted(face), face)));
    }
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
    if elements.is_empty() {
        return Ok(outside);
    }
    let mut edges: Vec<[u32; 2]> =
        outside.values().flat_map(|f| (0..F).map(|i| sorted([f[i], f[(i + 1) % F]]))).collect();
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
