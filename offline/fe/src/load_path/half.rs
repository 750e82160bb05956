//! The half of a finger that replaces the whole on paths that are symmetric about y = 0.

use nalgebra::Vector3;

use super::{FaceState, Snapshot};
use crate::assembly::Body;
use crate::mesh::HalfMesh;
use crate::solve::PadFaces;

/// Whether the half y >= 0 of a finger is computed in place of the whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Symmetry {
    /// For a finger and a path that are symmetric about y = 0: the same results, to the tolerance of equilibrium, for a
    /// third of the time.
    #[default]
    Auto,
    /// Never.
    Off,
}

impl Symmetry {
    /// Whether it is the default, which is not written down.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// The half y >= 0 of a finger that is its own mirror image about y = 0.
pub struct HalfFinger {
    /// Its body: held along y in the plane of symmetry, its rigid bone to the motions that are symmetric, on half the
    /// joint's stiffness.
    pub body: Body,
    /// Its elements and pad faces, and the corresponding parts of the whole.
    pub mesh: HalfMesh,
}

impl HalfFinger {
    /// The field of the whole finger, from that of the half.
    pub(super) fn whole(&self, half: &Snapshot) -> Snapshot {
        let faces = (self.mesh.pad_face.iter().zip(&self.mesh.pad_face_is_mirrored))
            .map(|(&from, &is_mirrored)| {
                let face = half.faces[from as usize];
                let mirror = |[x, y]: [f64; 2]| if is_mirrored { [x, -y] } else { [x, y] };
                FaceState { traction_mpa: mirror(face.traction_mpa), slip_mm: mirror(face.slip_mm), ..face }
            })
            .collect();
        let elements = self.elements();
        let density = &half.strain_energy_density_mpa;
        let stress = |(from, is_mirrored): (usize, bool)| half.stresses[from].mirrored_if(is_mirrored);
        Snapshot {
            response: half.response,
            displacement_mm: self.displacements(&half.displacement_mm),
            faces,
            strain_energy_density_mpa: elements.iter().map(|&(from, _)| density[from]).collect(),
            stresses: elements.iter().copied().map(stress).collect(),
        }
    }

    /// Displacements of the whole finger's nodes, from those of the half.
    pub(super) fn displacements(&self, half: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mirrored = |(n, &from): (usize, &u32)| {
            let u = half[from as usize];
            if from as usize == n { u } else { Vector3::new(u.x, -u.y, u.z) }
        };
        self.mesh.node.iter().enumerate().map(mirrored).collect()
    }

    /// The element of the half that represents each of the whole, and whether as its mirror image: hexahedra first,
    /// then tetrahedra, in the half as in the whole.
    pub(super) fn elements(&self) -> Vec<(usize, bool)> {
        let hexes = self.mesh.mesh.hexes.len();
        (self.mesh.hex.iter().map(|&e| e as usize))
            .chain(self.mesh.tet.iter().map(|&e| hexes + e as usize))
            .zip(self.mesh.hex_is_mirrored.iter().chain(&self.mesh.tet_is_mirrored).copied())
            .collect()
    }
}

/// The model of a run: the whole finger, or a half of it.
#[derive(Clone, Copy)]
pub struct Model<'a> {
    /// The body.
    pub body: &'a Body,
    /// Faces that may touch the plane, as mesh node numbers.
    pub pad_faces: PadFaces<'a>,
    /// The half, if this is it.
    pub half: Option<&'a HalfFinger>,
}

impl Model<'_> {
    /// Factor from forces, areas and energies of the model to those of the whole finger.
    pub fn copies(&self) -> f64 {
        if self.half.is_some() { 2.0 } else { 1.0 }
    }
}
