//! A mesh as a file gives it: labels, elements, sets; nothing checked but the file's own grammar.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// Kind of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawKind {
    /// 8-node hexahedron, VTK order.
    Hex,
    /// 4-node tetrahedron, VTK order.
    Tet,
    /// 10-node tetrahedron, VTK order.
    Tet10,
    /// Face of four corners, which its further nodes follow.
    Quad,
    /// Face of three corners, which its further nodes follow.
    Tri,
}

impl RawKind {
    /// Whether it has a volume; faces only carry sets.
    pub fn is_solid(self) -> bool {
        matches!(self, Self::Hex | Self::Tet | Self::Tet10)
    }
}

/// An element of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct RawElement {
    /// Its number in the file.
    pub label: u64,
    /// Its kind.
    pub kind: RawKind,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
}

/// The displacement of `slave` is the weighted sum of its masters'.
#[derive(Clone, Debug, PartialEq)]
pub struct RawTie {
    /// Number of the constrained node.
    pub slave: u64,
    /// Numbers of the masters with their weights.
    pub masters: Vec<(u64, f64)>,
}

/// A mesh of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawMesh {
    /// Nodes: number and position in the file's unit.
    pub nodes: Vec<(u64, Vector3<f64>)>,
    /// Elements.
    pub elements: Vec<RawElement>,
    /// Numbers of elements by the name of their set or physical group.
    pub element_sets: BTreeMap<String, Vec<u64>>,
    /// Numbers of nodes by the name of their set.
    pub node_sets: BTreeMap<String, Vec<u64>>,
    /// Faces by the name of their surface: numbers of the corners, in any turn.
    pub surfaces: BTreeMap<String, Vec<Vec<u64>>>,
    /// Constraints.
    pub ties: Vec<RawTie>,
    /// Contents of the file that a mesh cannot represent, for a remark.
    pub ignored: Vec<String>,
    /// Whether the file's format has the last two edge nodes of 10-node tetrahedra in the other order.
    pub gmsh_edges: bool,
    /// Changes of the file's numbers, as sentences.
    pub renumbered: Vec<String>,
}

impl RawMesh {
    /// An empty one to be filled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names of all element sets, node sets and surfaces, for messages.
    pub fn names(&self) -> String {
        let list = |kind: &str, names: Vec<&String>| {
            let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
            format!("{kind} {}", if names.is_empty() { "none".into() } else { names.join(", ") })
        };
        [
            list("element sets:", self.element_sets.keys().collect()),
            list("node sets:", self.node_sets.keys().collect()),
            list("surfaces:", self.surfaces.keys().collect()),
        ]
        .join("; ")
    }
}
