//! 10-node tetrahedra whose edge nodes stand in the order of another format.

use super::{Draft, ImportError};

/// Edges of the nodes 5 to 10, as corners.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// Share of its edge's length within which a node lies at the middle.
const NEAR: f64 = 0.25;

/// The refusal of tetrahedron `element` of the mesh if another order puts every edge node to the middle of its edge.
///
/// * `gmsh_edges`: whether the file's format has the last two edges in the other order
pub(super) fn refused(draft: &Draft, element: usize, gmsh_edges: bool) -> Option<ImportError> {
    let order = order(draft, element)?;
    let names = |mut order: [usize; 6]| {
        if gmsh_edges {
            order.swap(4, 5);
        }
        order.map(|edge| EDGES[edge].map(|corner| (corner + 1).to_string()).join("-")).join(", ")
    };
    let first = draft.mesh.hexes.len() + draft.mesh.tets.len();
    Some(ImportError::EdgeOrder {
        element: draft.element_labels[first + element],
        found: names(order),
        expected: names([0, 1, 2, 3, 4, 5]),
        elements: (0..draft.mesh.tets10.len()).filter(|e| self::order(draft, *e).is_some()).count(),
    })
}

/// The edge at whose middle each edge node lies, if these are all edges in another order than they should be.
fn order(draft: &Draft, element: usize) -> Option<[usize; 6]> {
    let p = draft.mesh.tets10[element].nodes.map(|n| draft.mesh.nodes[n as usize]);
    let off = |node: usize, [a, b]: [usize; 2]| (p[node] - 0.5 * (p[a] + p[b])).norm() / (p[b] - p[a]).norm();
    let mut order = [0; 6];
    for (k, edge) in order.iter_mut().enumerate() {
        *edge = (0..6).min_by(|a, b| off(4 + k, EDGES[*a]).total_cmp(&off(4 + k, EDGES[*b])))?;
        if !(off(4 + k, EDGES[*edge]) < NEAR) {
            return None;
        }
    }
    let mut sorted = order;
    sorted.sort_unstable();
    (sorted == [0, 1, 2, 3, 4, 5] && order != sorted).then_some(order)
}
