//! A mesh as plain arrays: nodes, hexahedra, tetrahedra of first and second order, named sets, ties.
//!
//! Given in the frame of the plane (mm): `z` out of the plane into the finger, `x` the direction in which the plane is
//! moved from proximal to distal, `y` to the left of it.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{REGIONS, region_index};

/// Material of a piece of the finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Region {
    /// Superficial layer, stiff.
    Skin,
    /// Soft layer between skin and bone; also the tissue in the joint gap.
    Subcutaneous,
    /// Distal phalanx.
    DistalBone,
    /// The second bone, toward the proximal end; always fixed when bones are rigid.
    ProximalBone,
    /// Nail plate (tetrahedra).
    Nail,
    /// A soft region with a law of its own: its place in [`Mesh::soft_regions`].
    Soft(u16),
}

/// An 8-node hexahedron: nodes 0-3 counter-clockwise seen from inside the element, from the outward side of
/// face 0-1-2-3 clockwise, then 4-7 above them (VTK_HEXAHEDRON, C3D8): positive Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hex {
    /// Node indices in VTK_HEXAHEDRON order.
    pub nodes: [u32; 8],
    /// Material.
    pub region: Region,
}

/// A 4-node tetrahedron (VTK_TETRA, C3D4): (n1-n0) x (n2-n0) . (n3-n0) > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tet {
    /// Node indices in VTK_TETRA order.
    pub nodes: [u32; 4],
    /// Material.
    pub region: Region,
}

/// A 10-node tetrahedron (VTK_QUADRATIC_TETRA, C3D10): corners as of a [`Tet`], then a node on each of the edges 01,
/// 12, 20, 03, 13, 23.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tet10 {
    /// Node indices in VTK_QUADRATIC_TETRA order.
    pub nodes: [u32; 10],
    /// Material.
    pub region: Region,
}

impl Tet10 {
    /// The node in the middle of [`Self::PARTS`], after the ten: the mean of the six edge nodes.
    pub const CENTRE: usize = 10;
    /// The twelve tetrahedra, right side out, on which its displacement is linear: those at the corners, then those
    /// around the centre.
    pub const PARTS: [[usize; 4]; 12] = [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 5, 6, 10],
        [9, 6, 5, 10],
        [4, 6, 7, 10],
        [4, 8, 5, 10],
        [9, 7, 6, 10],
        [9, 5, 8, 10],
        [4, 7, 8, 10],
        [9, 8, 7, 10],
    ];

    /// Corners of the twelve parts, mm, of a mesh's `nodes`.
    pub fn parts(&self, nodes: &[Vector3<f64>]) -> [[Vector3<f64>; 4]; 12] {
        Self::parts_of(self.nodes.map(|n| nodes[n as usize]))
    }

    /// Corners of the twelve parts of an element with nodes at `places`.
    pub fn parts_of(places: [Vector3<f64>; 10]) -> [[Vector3<f64>; 4]; 12] {
        let centre = places[4..].iter().sum::<Vector3<f64>>() / 6.0;
        Self::PARTS.map(|part| part.map(|n| if n == Self::CENTRE { centre } else { places[n] }))
    }
}

/// A multi-point constraint: the displacement of `slave` is the weighted sum of its masters'.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Constrained node: of tetrahedra, tied to the hexahedra that they lie on; or of hexahedra, in the middle of an
    /// edge or a face of a larger one.
    pub slave: u32,
    /// Master nodes (of hexahedra, not tied themselves) with weights that sum to 1.
    pub masters: Vec<(u32, f64)>,
}

/// Names of the node sets that every fingertip mesh carries.
pub mod set {
    /// Nodes of the skin elements.
    pub const SKIN: &str = "skin";
    /// Nodes of the subcutaneous elements.
    pub const SUBCUTANEOUS: &str = "subcutaneous";
    /// Nodes of the distal phalanx, its surface included.
    pub const DISTAL_BONE: &str = "bone";
    /// Nodes of the second bone, its surface included.
    pub const PROXIMAL_BONE: &str = "proximal_bone";
    /// Nodes of the nail plate.
    pub const NAIL: &str = "nail";
    /// Nodes of the nail's outer face, held fixed.
    pub const NAIL_FIX: &str = "nail_fix";
    /// Nodes of the proximal section, held fixed.
    pub const PROXIMAL_FIX: &str = "proximal_fix";
    /// Nodes of the pad faces that are not tied (contact candidates).
    pub const PAD: &str = "pad";
}

/// A mesh in the frame of the plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Undeformed positions, mm.
    pub nodes: Vec<Vector3<f64>>,
    /// Hexahedra.
    pub hexes: Vec<Hex>,
    /// 4-node tetrahedra.
    pub tets: Vec<Tet>,
    /// 10-node tetrahedra.
    pub tets10: Vec<Tet10>,
    /// Node sets by name, each sorted and without duplicates (see [`set`]).
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Faces of the skin that may touch the plane, each a hex face, counter-clockwise seen from outside.
    pub pad_faces: Vec<[u32; 4]>,
    /// Linear triangles that may touch the plane, counter-clockwise seen from outside: the four between corners and
    /// edge nodes of each face of a 10-node tetrahedron.
    pub pad_triangles: Vec<[u32; 3]>,
    /// Multi-point constraints: tetrahedra on hexahedra, small hexahedra beside large ones.
    pub ties: Vec<Tie>,
    /// Names of the soft regions [`Region::Soft`].
    pub soft_regions: Vec<String>,
}

impl Mesh {
    /// Every region that the mesh may have with the spelling of its element set, in the order of file output.
    pub fn regions(&self) -> Vec<(Region, &str)> {
        let soft = self.soft_regions.iter().enumerate().map(|(k, name)| (Region::Soft(k as u16), name.as_str()));
        REGIONS.into_iter().chain(soft).collect()
    }

    /// Spelling of a region's element set.
    ///
    /// # Panics
    /// For a soft region that the mesh does not name.
    pub fn region_name(&self, region: Region) -> &str {
        match region {
            Region::Soft(k) => &self.soft_regions[usize::from(k)],
            shared => REGIONS[region_index(shared)].1,
        }
    }

    /// The same in words for people. Without a held nail the mesh is no finger, and its layers are not called skin and bone.
    pub fn region_label(&self, region: Region) -> &str {
        let is_finger = !self.node_set(set::NAIL_FIX).is_empty();
        match region {
            Region::Skin if is_finger => "skin",
            Region::Skin => "outer layer",
            Region::Subcutaneous if is_finger => "subcutaneous tissue",
            Region::Subcutaneous => "soft material",
            Region::DistalBone if is_finger => "distal phalanx",
            Region::DistalBone => "core",
            Region::ProximalBone if is_finger => "second bone",
            Region::ProximalBone => "core at the mount",
            Region::Nail => "nail",
            Region::Soft(_) => self.region_name(region),
        }
    }

    /// Nodes of the named set; empty if there is no such set.
    pub fn node_set(&self, name: &str) -> &[u32] {
        self.node_sets.get(name).map_or(&[], Vec::as_slice)
    }

    /// Nodes and region of every element: hexahedra, then 4-node tetrahedra, then 10-node ones.
    pub fn elements(&self) -> impl Iterator<Item = (&[u32], Region)> {
        let hexes = self.hexes.iter().map(|e| (&e.nodes[..], e.region));
        let tets = self.tets.iter().map(|e| (&e.nodes[..], e.region));
        hexes.chain(tets).chain(self.tets10.iter().map(|e| (&e.nodes[..], e.region)))
    }

    /// Nodes of the faces that may touch, sorted and without duplicates.
    pub fn pad_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> =
            self.pad_faces.iter().flatten().chain(self.pad_triangles.iter().flatten()).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
