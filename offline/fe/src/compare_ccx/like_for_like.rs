//! The problem of a deck in this program: bones fixed, penalty contact without augmentation, hexahedra to choose.
//!
//! Main functions: [`finger`], [`problem`]. With [`Element::C3d8r`] only the solver differs from CalculiX.

use nalgebra::Vector3;

use crate::assembly::{Body, BodyError, Supports};
use crate::contact::{PenaltySettings, RigidBody, RubberFriction};
use crate::element::Hex8;
use crate::load_path::{Bone, BoneKind, Finger, LoadSettings, Problem, Tissue};
use crate::mesh::{Fingertip, Region, set};
use crate::solve::SolverSettings;

/// Which hexahedra this program uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Element {
    /// Mean dilatation (Q1P0), as everywhere else.
    MeanDilatation,
    /// CalculiX's C3D8R, one point with hourglass control after Flanagan & Belytschko (1981).
    #[default]
    C3d8r,
}

/// The materials with the bones fixed, as a deck has them.
pub fn tissue(tissue: &Tissue) -> Tissue {
    Tissue { bone: Bone { kind: BoneKind::Fixed, ..tissue.bone }, ..tissue.clone() }
}

/// Mesh and body of a fingertip with fixed bones.
///
/// # Errors
/// [`BodyError`] if no body can be made of the mesh.
pub fn finger(tip: Fingertip, tissue: &Tissue, element: Element) -> Result<Finger, BodyError> {
    let tissue = self::tissue(tissue);
    let finger = Finger::new(tip, &tissue)?;
    if element == Element::MeanDilatation {
        return Ok(finger);
    }
    let mesh = finger.mesh.clone();
    let fixed = [set::PROXIMAL_FIX, set::NAIL_FIX, set::PROXIMAL_BONE, set::DISTAL_BONE];
    let supports = Supports {
        fixed: fixed.iter().flat_map(|name| mesh.node_set(name)).copied().collect(),
        contact: mesh.node_set(set::PAD).to_vec(),
        ..Supports::default()
    };
    let material = |region: Region| tissue.material(&mesh, region);
    let joint = tissue.bone.joint;
    let body = Body::with_hexes(Hex8::uniform_strain, &mesh, material, &supports, Vector3::zeros(), joint)?;
    Ok(Finger { body, mesh, half: None, ..finger })
}

/// The contact problem with CalculiX's kind of contact: a penalty (MPa/mm) and no augmentation.
pub fn problem(finger: &Finger, friction: Option<RubberFriction>, penalty_mpa_per_mm: f64) -> Problem<'_> {
    Problem {
        body: &finger.body,
        pad_faces: (&finger.mesh).into(),
        rigid_body: RigidBody::Plane,
        outline: None,
        half: None,
        friction,
        penalty: PenaltySettings { penalty_mpa_per_mm, augment: false, ..Default::default() },
        settings: SolverSettings::default(),
        load_steps: LoadSettings::default(),
        neutral_pitch_deg: 30.0,
        obstacles: &[],
        beside_pad: &[],
        clearance_mm: f64::INFINITY,
        relaxation: fingerpad::Relaxation::none(),
        observed: None,
    }
}
