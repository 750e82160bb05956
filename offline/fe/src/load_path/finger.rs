//! A finger: mesh, materials and supports, from a configuration file.

use nalgebra::Vector3;
use serde::Deserializer;

use super::{HalfFinger, LoadSettings, Symmetry};
use crate::assembly::{Body, BodyError, Joint, Material, Supports};
use crate::contact::PenaltySettings;
use crate::material::{Ogden, SaintVenantKirchhoff, partly};
use crate::mesh::{Fingertip, HalfMesh, Mesh, Region, set};
use crate::solve::{PadFaces, SolverSettings};

/// What the bones are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoneKind {
    /// Both bones rigid and fixed.
    Fixed,
    /// The distal phalanx rigid with six degrees of freedom on a soft joint, the second bone fixed.
    #[default]
    Floating,
    /// Both bones elastic; fixed at the proximal section only.
    Deformable,
}

/// Bones.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bone {
    /// What they are.
    pub kind: BoneKind,
    /// Law of deformable bones.
    #[serde(deserialize_with = "elastic")]
    pub elastic: SaintVenantKirchhoff,
    /// Joint of the floating phalanx.
    pub joint: Joint,
}

impl Default for Bone {
    fn default() -> Self {
        Self {
            kind: BoneKind::Floating,
            elastic: SaintVenantKirchhoff { young_mpa: 10_000.0, poisson: 0.3 },
            joint: Joint::default(),
        }
    }
}

/// Materials of the finger [Yoshida et al. 2011 for all constants but the joint].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tissue {
    /// Superficial layer.
    #[serde(deserialize_with = "skin")]
    pub skin: Ogden,
    /// Layer between skin and bone.
    #[serde(deserialize_with = "subcutaneous")]
    pub subcutaneous: Ogden,
    /// Nail plate.
    #[serde(deserialize_with = "nail")]
    pub nail: SaintVenantKirchhoff,
    /// Bones.
    pub bone: Bone,
}

impl Default for Tissue {
    fn default() -> Self {
        Self {
            skin: Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 },
            subcutaneous: Ogden { mu_mpa: 0.00684, alpha: 1.4, d_per_mpa: 10.0 },
            nail: SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 },
            bone: Bone::default(),
        }
    }
}

fn skin<'de, D: Deserializer<'de>>(from: D) -> Result<Ogden, D::Error> {
    partly::ogden(from, Tissue::default().skin)
}

fn subcutaneous<'de, D: Deserializer<'de>>(from: D) -> Result<Ogden, D::Error> {
    partly::ogden(from, Tissue::default().subcutaneous)
}

fn nail<'de, D: Deserializer<'de>>(from: D) -> Result<SaintVenantKirchhoff, D::Error> {
    partly::saint_venant_kirchhoff(from, Tissue::default().nail)
}

fn elastic<'de, D: Deserializer<'de>>(from: D) -> Result<SaintVenantKirchhoff, D::Error> {
    partly::saint_venant_kirchhoff(from, Bone::default().elastic)
}

/// Everything that the numerics are set by.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Numerics {
    /// Contact.
    pub contact: PenaltySettings,
    /// Equilibrium.
    pub solver: SolverSettings,
    /// Increments. The key is `march`, which the settings' hash of stored runs holds.
    #[serde(rename = "march")]
    pub load_steps: LoadSettings,
    /// Use of symmetry; left out of the settings' hash where it is the default.
    #[serde(skip_serializing_if = "Symmetry::is_auto")]
    pub symmetry: Symmetry,
}

/// A finger ready to be pressed.
pub struct Finger {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its body.
    pub body: Body,
    /// Its half, if it is symmetric about y = 0.
    pub half: Option<HalfFinger>,
}

impl Finger {
    /// A finger of `tissue` on the mesh of `fingertip`.
    ///
    /// # Errors
    /// [`BodyError::InvertedMesh`] for a mesh with an inverted element.
    pub fn new(fingertip: Fingertip, tissue: &Tissue) -> Result<Self, BodyError> {
        let mesh = fingertip.mesh;
        let supports = supports(&mesh, tissue.bone.kind);
        let reference = joint_point(&mesh);
        let body = body(&mesh, tissue, &supports, reference, tissue.bone.joint)?;
        let half = match HalfMesh::of(&mesh) {
            Some(half) => Some(half_finger(half, tissue, supports, reference)?),
            None => None,
        };
        Ok(Self { mesh, body, half })
    }
}

/// What holds a finger with such bones, and where it may touch.
fn supports(mesh: &Mesh, bones: BoneKind) -> Supports {
    let mut fixed = mesh.node_set(set::PROXIMAL_FIX).to_vec();
    fixed.extend(mesh.node_set(set::NAIL_FIX));
    let mut rigid = Vec::new();
    match bones {
        BoneKind::Fixed => {
            fixed.extend(mesh.node_set(set::PROXIMAL_BONE));
            fixed.extend(mesh.node_set(set::DISTAL_BONE));
        }
        BoneKind::Floating => {
            fixed.extend(mesh.node_set(set::PROXIMAL_BONE));
            rigid = mesh.node_set(set::DISTAL_BONE).to_vec();
        }
        BoneKind::Deformable => {}
    }
    Supports { fixed, rigid, contact: mesh.node_set(set::PAD).to_vec(), ..Default::default() }
}

/// The elements of `mesh` that deform.
fn body(
    mesh: &Mesh,
    tissue: &Tissue,
    supports: &Supports,
    reference: Vector3<f64>,
    joint: Joint,
) -> Result<Body, BodyError> {
    let deformable = tissue.bone.kind == BoneKind::Deformable;
    let material = |region: Region| match region {
        Region::Skin => Some(Material::Ogden(tissue.skin)),
        Region::Subcutaneous => Some(Material::Ogden(tissue.subcutaneous)),
        Region::Nail => Some(Material::Linear(tissue.nail)),
        Region::DistalBone | Region::ProximalBone => deformable.then_some(Material::Linear(tissue.bone.elastic)),
    };
    Body::new(mesh, material, supports, reference, joint)
}

/// The half of a finger, held so that it moves as it does beside its mirror image.
fn half_finger(
    mesh: HalfMesh,
    tissue: &Tissue,
    mut supports: Supports,
    reference: Vector3<f64>,
) -> Result<HalfFinger, BodyError> {
    supports.fixed_components = mesh.middle.iter().map(|&node| (node, 1)).collect();
    // The bone shifts along y, and turns about x and z, in no symmetric state.
    supports.held_rigid = vec![1, 3, 5];
    let Joint { translation_n_per_mm, rotation_nmm_per_rad } = tissue.bone.joint;
    let joint =
        Joint { translation_n_per_mm: 0.5 * translation_n_per_mm, rotation_nmm_per_rad: 0.5 * rotation_nmm_per_rad };
    let body = body(&mesh.mesh, tissue, &supports, Vector3::new(reference.x, 0.0, reference.z), joint)?;
    Ok(HalfFinger { body, mesh })
}

impl<'a> From<&'a Mesh> for PadFaces<'a> {
    fn from(mesh: &'a Mesh) -> Self {
        Self { quads: &mesh.pad_faces, triangles: &mesh.pad_triangles }
    }
}

/// Middle of the distal bone's end that faces the second bone, mm; the origin if there are not two bones.
fn joint_point(mesh: &Mesh) -> Vector3<f64> {
    let middle =
        |nodes: &[u32]| nodes.iter().map(|&n| mesh.nodes[n as usize]).sum::<Vector3<f64>>() / nodes.len() as f64;
    let (distal, proximal) = (mesh.node_set(set::DISTAL_BONE), mesh.node_set(set::PROXIMAL_BONE));
    if distal.is_empty() || proximal.is_empty() {
        return Vector3::zeros();
    }
    let axis = (middle(distal) - middle(proximal)).normalize();
    let along = |n: u32| mesh.nodes[n as usize].dot(&axis);
    let first = distal.iter().map(|&n| along(n)).fold(f64::INFINITY, f64::min);
    let end: Vec<u32> = distal.iter().copied().filter(|&n| along(n) < first + 0.5).collect();
    middle(&end)
}
