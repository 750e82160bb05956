//! A finger: mesh, materials and supports, from a configuration file.

use std::collections::BTreeMap;
use std::sync::Arc;

use fingerpad::Relaxation;
use nalgebra::Vector3;
use serde::Deserializer;

use super::{HalfFinger, LoadSettings, Symmetry};
use crate::assembly::{Body, BodyError, Joint, Material, Supports};
use crate::contact::{Outline, PenaltySettings, RigidBody};
use crate::material::{Doubt, Ogden, SaintVenantKirchhoff, Stiffness, partly, presets, relaxation};
use crate::mesh::{Fingertip, FirstTouch, HalfMesh, Mesh, Region, Skin, below_skin, locate, set};
use crate::solve::{PadFaces, SolverSettings};

/// Mechanical role of the bones.
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
    /// The kind of the bones.
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
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "TissueKeys")]
pub struct Tissue {
    /// Superficial layer.
    pub skin: Material,
    /// Layer between skin and bone.
    pub subcutaneous: Material,
    /// Nail plate.
    pub nail: SaintVenantKirchhoff,
    /// Bones.
    pub bone: Bone,
    /// Soft regions of an imported mesh beside skin and subcutaneous, by the names of their element sets.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub regions: BTreeMap<String, Material>,
    /// Branches of all soft regions; left out of the settings' hash if there are none.
    #[serde(skip_serializing_if = "relaxation::is_none", serialize_with = "relaxation::serialize")]
    pub relaxation: Relaxation,
}

/// The section of a settings file: `soft` is one material for all soft tissue, on a fixed core.
#[derive(Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TissueKeys {
    #[serde(deserialize_with = "soft")]
    soft: Option<Material>,
    #[serde(deserialize_with = "skin")]
    skin: Option<Material>,
    #[serde(deserialize_with = "subcutaneous")]
    subcutaneous: Option<Material>,
    #[serde(deserialize_with = "nail")]
    nail: Option<SaintVenantKirchhoff>,
    bone: Option<Bone>,
    #[serde(deserialize_with = "partly::regions")]
    regions: BTreeMap<String, Material>,
    #[serde(deserialize_with = "relaxation::deserialize")]
    relaxation: Option<Relaxation>,
}

impl TryFrom<TissueKeys> for Tissue {
    type Error = &'static str;

    fn try_from(keys: TissueKeys) -> Result<Self, Self::Error> {
        let TissueKeys { soft, skin, subcutaneous, nail, bone, regions, relaxation } = keys;
        if soft.is_some() && (skin.is_some() || subcutaneous.is_some()) {
            return Err(
                "tissue.soft is the material of all soft tissue: leave out tissue.skin and tissue.subcutaneous",
            );
        }
        let bone = bone.unwrap_or(if soft.is_some() {
            Bone { kind: BoneKind::Fixed, ..Bone::default() }
        } else {
            Bone::default()
        });
        let usual = Self::default();
        Ok(Self {
            skin: soft.or(skin).unwrap_or(usual.skin),
            subcutaneous: soft.or(subcutaneous).unwrap_or(usual.subcutaneous),
            nail: nail.unwrap_or(usual.nail),
            bone,
            regions,
            relaxation: relaxation.unwrap_or(usual.relaxation),
        })
    }
}

const SKIN: Ogden = Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 };
const SUBCUTANEOUS: Ogden = Ogden { mu_mpa: 0.00684, alpha: 1.4, d_per_mpa: 10.0 };

impl Default for Tissue {
    fn default() -> Self {
        Self {
            skin: Material::Ogden(SKIN),
            subcutaneous: Material::Ogden(SUBCUTANEOUS),
            nail: SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 },
            bone: Bone::default(),
            regions: BTreeMap::new(),
            relaxation: Relaxation::none(),
        }
    }
}

impl Tissue {
    /// The law of a region of `mesh`; None for a rigid region, and for a soft region that has none in
    /// [`Self::regions`].
    pub fn material(&self, mesh: &Mesh, region: Region) -> Option<Material> {
        match region {
            Region::Skin => Some(self.skin),
            Region::Subcutaneous => Some(self.subcutaneous),
            Region::Nail => Some(Material::Linear(self.nail)),
            Region::DistalBone | Region::ProximalBone => {
                (self.bone.kind == BoneKind::Deformable).then_some(Material::Linear(self.bone.elastic))
            }
            Region::Soft(_) => self.regions.get(mesh.region_name(region)).copied(),
        }
    }

    /// Unusual stiffnesses, which another unit may explain, with the sections that hold them.
    pub fn doubts(&self) -> Vec<(String, Doubt)> {
        let own = [
            ("skin", Stiffness::of_law(&self.skin), self.skin.young_mpa()),
            ("subcutaneous", Stiffness::of_law(&self.subcutaneous), self.subcutaneous.young_mpa()),
            ("nail", Stiffness::Nail, self.nail.young_mpa),
            ("bone.elastic", Stiffness::Bone, self.bone.elastic.young_mpa),
        ];
        let own = own.into_iter().map(|(name, kind, young_mpa)| (format!("tissue.{name}"), kind.doubt(young_mpa)));
        let named = self
            .regions
            .iter()
            .map(|(name, law)| (format!("tissue.regions.{name}"), Stiffness::of_law(law).doubt(law.young_mpa())));
        own.chain(named).filter_map(|(section, doubt)| Some((section, doubt?))).collect()
    }

    /// Mean shear modulus of the soft materials, MPa.
    pub fn shear_mpa(&self) -> f64 {
        let own = [self.skin, self.subcutaneous];
        let laws: Vec<_> =
            if self.regions.is_empty() { own.to_vec() } else { self.regions.values().copied().collect() };
        (laws.iter().map(|law| law.shear_mpa().ln()).sum::<f64>() / laws.len() as f64).exp()
    }

    /// The same over that of the human finger.
    pub fn stiffness(&self) -> f64 {
        self.shear_mpa() / Self::default().shear_mpa()
    }

    /// Every stiffness times `factor` (> 0): soft tissue, nail, bones, joint.
    pub fn stiffen(&mut self, factor: f64) {
        for law in [&mut self.skin, &mut self.subcutaneous].into_iter().chain(self.regions.values_mut()) {
            *law = law.stiffened(factor);
        }
        self.nail = self.nail.stiffened(factor);
        self.bone.elastic = self.bone.elastic.stiffened(factor);
        self.bone.joint.translation_n_per_mm *= factor;
        self.bone.joint.rotation_nmm_per_rad *= factor;
    }
}

fn soft<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Material>, D::Error> {
    presets::named_or_table(from).map(Some)
}

fn skin<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Material>, D::Error> {
    partly::soft(from, SKIN).map(Some)
}

fn subcutaneous<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Material>, D::Error> {
    partly::soft(from, SUBCUTANEOUS).map(Some)
}

fn nail<'de, D: Deserializer<'de>>(from: D) -> Result<Option<SaintVenantKirchhoff>, D::Error> {
    partly::saint_venant_kirchhoff(from, Tissue::default().nail).map(Some)
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
    /// Use of symmetry; left out of the settings' hash if it is the default.
    #[serde(skip_serializing_if = "Symmetry::is_auto")]
    pub symmetry: Symmetry,
}

/// A finger ready to be pressed.
pub struct Finger {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its body.
    pub body: Body,
    /// Angle between its axis and the plane in the pose of its mesh, tip down, degrees.
    pub neutral_pitch_deg: f64,
    /// Points of its supports and of its bones, mm.
    pub obstacles: Vec<Vector3<f64>>,
    /// Nodes of the skin's outside that are not of the pad: the plane must not reach them.
    pub beside_pad: Vec<u32>,
    /// The rigid body that it touches; the plane unless something else is put here.
    pub rigid_body: RigidBody,
    /// The undeformed surface, from which depth counts; None for the nodes of the pad.
    pub outline: Option<Outline>,
    /// The same in closed form, of a parametric fingertip.
    pub skin: Option<Skin>,
    /// Its half, if it is symmetric about y = 0.
    pub half: Option<HalfFinger>,
    /// Branches of its soft regions.
    pub relaxation: Relaxation,
}

impl Finger {
    /// A finger of `tissue` on the mesh of `fingertip`.
    ///
    /// # Errors
    /// [`BodyError::InvertedMesh`] for a mesh with an inverted element, [`BodyError::NoLaw`] for a named soft region
    /// without a law.
    pub fn new(fingertip: Fingertip, tissue: &Tissue) -> Result<Self, BodyError> {
        let neutral_pitch_deg = neutral_pitch_deg(&fingertip.touch);
        let (outline, skin) = (smooth_outline(&fingertip), fingertip.skin);
        let mut beside_pad: Vec<u32> = fingertip.outer_faces.iter().flatten().copied().collect();
        beside_pad.extend(fingertip.outer_triangles.iter().flatten());
        beside_pad.sort_unstable();
        beside_pad.dedup();
        let mesh = fingertip.mesh;
        let pad = mesh.pad_nodes();
        beside_pad.retain(|node| pad.binary_search(node).is_err());
        if let Some(number) = mesh.soft_regions.iter().position(|name| !tissue.regions.contains_key(name)) {
            return Err(BodyError::NoLaw { number });
        }
        let supports = supports(&mesh, tissue.bone.kind);
        let reference = joint_point(&mesh);
        let body = body(&mesh, tissue, &supports, reference, tissue.bone.joint)?;
        let half = match HalfMesh::of(&mesh) {
            Some(half) => Some(half_finger(half, tissue, supports, reference)?),
            None => None,
        };
        let sets = [set::DISTAL_BONE, set::PROXIMAL_BONE, set::PROXIMAL_FIX, set::NAIL_FIX];
        let mut obstacles: Vec<u32> = sets.iter().flat_map(|name| mesh.node_set(name)).copied().collect();
        obstacles.sort_unstable();
        obstacles.dedup();
        let obstacles = obstacles.into_iter().map(|n| mesh.nodes[n as usize]).collect();
        let rigid_body = RigidBody::Plane;
        let relaxation = tissue.relaxation;
        Ok(Self { mesh, body, neutral_pitch_deg, obstacles, beside_pad, rigid_body, outline, skin, half, relaxation })
    }

    /// The point `below_mm` under the undeformed skin of the pad, along its inner normal, where the line along z through (x, y) meets
    /// the pad, mm; None beside the pad. On a parametric fingertip it is the same on every mesh, unless the faces of the mesh leave it
    /// outside.
    pub fn below_skin(&self, place: [f64; 2], below_mm: f64) -> Option<Vector3<f64>> {
        if let Some(skin) = &self.skin {
            let (on_skin, outward) = skin.on_pad(place)?;
            let point = on_skin - outward * below_mm;
            if locate(&self.mesh, &point).is_some() {
                return Some(point);
            }
        }
        below_skin(&self.mesh, place, below_mm)
    }
}

/// Angle between the finger's axis and the plane in the pose of its mesh, tip down, degrees.
pub fn neutral_pitch_deg(touch: &FirstTouch) -> f64 {
    (-(touch.rotation * Vector3::x()).z).asin().to_degrees()
}

/// The analytic surface of a fingertip, if it has one.
fn smooth_outline(fingertip: &Fingertip) -> Option<Outline> {
    fingertip.skin.map(|skin| Outline::Smooth(Arc::new(move |normal| skin.lowest(normal))))
}

/// The undeformed surface of a fingertip: the analytic one, or the nodes of its outer faces.
pub fn outline(fingertip: &Fingertip) -> Outline {
    smooth_outline(fingertip).unwrap_or_else(|| {
        let quads = fingertip.outer_faces.iter().flatten();
        let nodes = quads.chain(fingertip.outer_triangles.iter().flatten()).map(|&n| fingertip.mesh.nodes[n as usize]);
        Outline::of_points(nodes.collect(), &fingertip.mesh.nodes)
    })
}

/// Supports of a finger with such bones, and the nodes that may touch.
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
    let material = |region: Region| tissue.material(mesh, region);
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
