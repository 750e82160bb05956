//! Why a mesh of another program cannot be used.

use thiserror::Error;

use super::super::MeshError;

/// Why a mesh of another program cannot be used. Numbers of nodes and elements are the file's.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ImportError {
    /// A setting is out of its range.
    #[error("imported.{field} = {value}: {rule}")]
    Setting {
        /// Its key.
        field: &'static str,
        /// Its value.
        value: String,
        /// The required condition.
        rule: &'static str,
    },
    /// Two nodes or two elements with the same number, or two elements on the same nodes.
    #[error("{kind} {first} and {second}: {problem}")]
    Duplicate {
        /// `nodes` or `elements`.
        kind: &'static str,
        /// One of them.
        first: u64,
        /// The other.
        second: u64,
        /// The shared property.
        problem: &'static str,
    },
    /// Something refers to a node that the file does not have.
    #[error("{what} refers to node {node}, which the file does not have")]
    NoSuchNode {
        /// The referring entity.
        what: String,
        /// The number.
        node: u64,
    },
    /// A set or group that the settings name and the file does not have.
    #[error("{key}: the file has no `{name}`; {known}")]
    NoSuchSet {
        /// Key of the configuration.
        key: String,
        /// The name looked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// An element in no region or in two.
    #[error("element {element} is in {regions}; every hexahedron and tetrahedron must be in one region; {known}")]
    Region {
        /// Its number.
        element: u64,
        /// `no region`, or the regions.
        regions: String,
        /// The sets that exist.
        known: String,
    },
    /// An element that is turned inside out in part, or flat.
    #[error("element {element} is twisted or flat: scaled Jacobian {scaled_jacobian:.3e} however it is numbered")]
    Twisted {
        /// Its number.
        element: u64,
        /// The better of its two orientations.
        scaled_jacobian: f64,
    },
    /// A 10-node tetrahedron with its edge nodes in another order than the file's format has.
    #[error(
        "element {element}: its mid-side nodes are in another order: by their places they belong to the edges {found} of its \
         corners, and the format has {expected}; {elements} elements of the file have such an order. Write the mid-side nodes in \
         the order of the format"
    )]
    EdgeOrder {
        /// Its number.
        element: u64,
        /// Edges on which its nodes 5 to 10 lie.
        found: String,
        /// Edges of the format.
        expected: String,
        /// How many such elements there are.
        elements: usize,
    },
    /// The mesh is far larger or smaller than a fingertip, and another unit explains it.
    #[error(
        "the mesh is {size} mm with imported.unit_mm = {unit_mm}, which no fingertip is: is the file in {name}? Set unit_mm = {proposed}"
    )]
    Unit {
        /// Its extent along x, y and z.
        size: String,
        /// The unit as it is set.
        unit_mm: f64,
        /// The unit that the file probably has.
        name: &'static str,
        /// Its length, mm.
        proposed: f64,
    },
    /// Soft tissue of tetrahedra that lock.
    #[error(
        "element {element} ({region}) is a 4-node tetrahedron, which locks in nearly incompressible tissue: write the \
         mesh with second order (Gmsh: Mesh.ElementOrder = 2; Abaqus: C3D10)"
    )]
    Locking {
        /// Its number.
        element: u64,
        /// Its region.
        region: String,
    },
    /// Elements of both orders at one node: the middles of the edges of the one hang free on the other.
    #[error(
        "element {second_order} of 10 nodes and element {first_order} of first order share node {node}: mesh all of a \
         part with one order, or keep the parts' nodes apart (merge_mm = 0) to have them tied"
    )]
    MixedOrders {
        /// Number of the 10-node tetrahedron.
        second_order: u64,
        /// Number of the other.
        first_order: u64,
        /// Number of the node.
        node: u64,
    },
    /// Parts that are not joined.
    #[error(
        "{what} ({elements} elements, first {first}) is joined to nothing; the nearest other node is {gap_mm:.3e} mm \
         away: raise merge_mm (nodes that should be one) or tie_mm (meshes that do not match)"
    )]
    Apart {
        /// Region of the part.
        what: String,
        /// Number of its elements.
        elements: usize,
        /// Number of its first element.
        first: u64,
        /// Least distance to a node of another part, mm.
        gap_mm: f64,
    },
    /// The boundary has a hole, an edge of a third face, or a tunnel.
    #[error("boundary of the {kind}: {problem} (near node {node})")]
    Boundary {
        /// `hexahedra` or `tetrahedra`.
        kind: &'static str,
        /// Description of the defect.
        problem: String,
        /// A node there.
        node: u64,
    },
    /// A face of the pad that is not an outer face of an element that can touch.
    #[error("imported.sets.pad: {0}")]
    Pad(String),
    /// A set that has to hold something and is empty or missing.
    #[error("{0}")]
    Support(String),
    /// z = 0 of the file is not first touch.
    #[error(
        "in frame = \"plane\" the lowest point of the pad must lie at z = 0, but it lies at z = {lowest_mm:.4} mm; use \
         frame = \"finger\" to have first touch found"
    )]
    NotAtTouch {
        /// Its place.
        lowest_mm: f64,
    },
    /// First touch could not be found.
    #[error("first touch: {0}")]
    Touch(String),
    /// The resulting mesh was refused.
    #[error("the imported mesh: {0}")]
    Mesh(#[from] MeshError),
}
