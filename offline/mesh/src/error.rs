//! Errors of shapes, divisions and meshes.

use thiserror::Error;

use super::Region;

/// Why a shape or a mesh was refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    /// A shape parameter is out of its range.
    #[error("shape: {field} = {value}: {rule}")]
    Shape {
        /// Name of the parameter, with its unit.
        field: &'static str,
        /// Its value, in that unit.
        value: f64,
        /// The required condition.
        rule: String,
    },
    /// A shape file could not be read.
    #[error("shape `{name}`: {message}")]
    ShapeFile {
        /// Name of the shape or of its file.
        name: String,
        /// The parser's message, with line and column.
        message: String,
    },
    /// A number of divisions is out of its range.
    #[error("divisions: {field} = {value}: must be at least {least}")]
    Divisions {
        /// Name of the number.
        field: &'static str,
        /// Its value.
        value: usize,
        /// The least that makes a mesh.
        least: usize,
    },
    /// The refined zone cannot be made.
    #[error("divisions: {field} = {value}: {rule}")]
    Refinement {
        /// Name of the number.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The required condition.
        rule: String,
    },
    /// An element refers to a node that does not exist.
    #[error("{kind} {element} ({region:?}) refers to node {node}, but there are {nodes} nodes")]
    NoSuchNode {
        /// `hex`, `tet`, `tie`, `pad face` or `node set`.
        kind: &'static str,
        /// Index of the element in its list.
        element: usize,
        /// Its region, if it has one.
        region: Option<Region>,
        /// The missing node.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A node's position is not a number.
    #[error("node {node}: position is not finite")]
    NotFinite {
        /// Index of the node.
        node: usize,
    },
    /// An element is turned inside out or has no volume.
    #[error("{kind} {element} ({region:?}) is inverted or flat: scaled Jacobian {scaled_jacobian:.3e}")]
    Inverted {
        /// `hex` or `tet`.
        kind: &'static str,
        /// Index of the element in its list.
        element: usize,
        /// Its region.
        region: Region,
        /// Worst scaled Jacobian of the element; <= 0.
        scaled_jacobian: f64,
    },
    /// Two 10-node tetrahedra have different nodes on the same edge: they are torn apart there.
    #[error("tet10 {element} ({region:?}): another has another node on the edge between nodes {nodes:?}")]
    EdgeNodes {
        /// Index of the element in its list.
        element: usize,
        /// Its region.
        region: Region,
        /// Ends of the edge.
        nodes: [u32; 2],
    },
    /// A node of 10-node tetrahedra and of elements of first order, whose edges part between their ends.
    #[error("node {node} belongs to 10-node tetrahedra and to elements of first order")]
    MixedOrders {
        /// Index of the node.
        node: usize,
    },
    /// A face belongs to more than two elements.
    #[error("{kind} face of nodes {nodes:?} belongs to {elements} elements")]
    FaceShared {
        /// `hex` or `tet`.
        kind: &'static str,
        /// Sorted nodes of the face.
        nodes: Vec<u32>,
        /// Number of elements that have it.
        elements: usize,
    },
    /// The boundary is not a closed surface: an edge of it belongs to other than two faces.
    #[error("{kind} boundary: edge {nodes:?} belongs to {faces} boundary faces, not 2")]
    OpenBoundary {
        /// `hex` or `tet`.
        kind: &'static str,
        /// Nodes of the edge.
        nodes: [u32; 2],
        /// Number of boundary faces that have it.
        faces: usize,
    },
    /// The boundary is closed, but not one sphere: a void, a tunnel or a second piece.
    #[error("{kind} boundary has Euler characteristic {euler}, not 2: missing elements, a tunnel or several pieces")]
    Hole {
        /// `hex` or `tet`.
        kind: &'static str,
        /// Faces - edges + nodes of the boundary.
        euler: i64,
    },
    /// Two nodes of the same body lie in the same place.
    #[error("nodes {first} and {second} are {distance_mm:.3e} mm apart")]
    DuplicateNodes {
        /// The lower index.
        first: u32,
        /// The higher index.
        second: u32,
        /// Their distance, mm.
        distance_mm: f64,
    },
    /// A node that belongs to no element.
    #[error("node {node} belongs to no element")]
    UnusedNode {
        /// Index of the node.
        node: usize,
    },
    /// A tie that cannot be right.
    #[error("tie {tie} of node {slave}: {reason} ({value:.6e})")]
    Tie {
        /// Index of the tie.
        tie: usize,
        /// The constrained node.
        slave: u32,
        /// The reason.
        reason: &'static str,
        /// The number that shows it.
        value: f64,
    },
    /// A pad face that is not a face of the boundary seen from outside.
    #[error("pad face {face}: {reason}")]
    PadFace {
        /// Index of the face.
        face: usize,
        /// The reason.
        reason: &'static str,
    },
    /// A node set that is not sorted or has a node twice.
    #[error("node set `{name}`: not sorted or with duplicates")]
    NodeSet {
        /// Name of the set.
        name: String,
    },
}
