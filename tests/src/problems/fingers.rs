//! Fingers, paths and runs of them.

use std::ops::ControlFlow;

use fingerpad_fe::assembly::Body;
use fingerpad_fe::contact::{PenaltySettings, RigidBody, RubberFriction};
use fingerpad_fe::load_path::{
    BoneKind, Drive, Finger, LoadPathError, LoadSettings, Path, Problem, Tissue, Trajectory, Waypoint, follow_path,
};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, fingertip};
use fingerpad_fe::solve::{PadFaces, SolverSettings};

use crate::Failure;

/// A finger of a named shape with the published tissue, soft tissue `stiffness` times as stiff.
///
/// # Errors
/// Those of shape, mesh or body.
pub fn finger(shape: &str, preset: MeshPreset, bone: BoneKind, stiffness: f64) -> Result<Finger, Failure> {
    let tip = fingertip(&FingertipShape::named(shape)?, &preset.divisions())?;
    let mut tissue = Tissue::default();
    tissue.bone.kind = bone;
    for law in [&mut tissue.skin, &mut tissue.subcutaneous] {
        *law = law.stiffened(stiffness);
    }
    Ok(Finger::new(tip, &tissue)?)
}

/// The problem of `body` with defaults throughout and the published friction.
pub fn problem<'a>(body: &'a Body, pad_faces: impl Into<PadFaces<'a>>) -> Problem<'a> {
    Problem {
        body,
        pad_faces: pad_faces.into(),
        rigid_body: RigidBody::Plane,
        outline: None,
        half: None,
        friction: Some(RubberFriction::default()),
        penalty: PenaltySettings::default(),
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

/// A path through corners (normal, x, y), a second each.
pub fn path(drives: [Drive; 3], corners: &[[f64; 3]]) -> Path {
    let waypoints =
        corners.iter().enumerate().map(|(k, &[normal, x, y])| Waypoint { t_s: k as f64, normal, x, y }).collect();
    Path::new(drives, waypoints)
}

/// A path of depth and slides.
pub fn placed(corners: &[[f64; 3]]) -> Path {
    path([Drive::Displacement; 3], corners)
}

/// Follows the path to its end.
///
/// # Errors
/// [`LoadPathError`].
pub fn follow(problem: &Problem, path: &Path) -> Result<Trajectory, LoadPathError> {
    follow_path(problem, path, &[], &mut |_| ControlFlow::Continue(()))
}

/// The response at whole second `t`, that is at corner `t`.
pub fn at_corner(trajectory: &Trajectory, corner: usize) -> &fingerpad_fe::load_path::Response {
    let t = corner as f64;
    trajectory.responses.iter().rfind(|r| r.t_s <= t).expect("the start is recorded")
}
