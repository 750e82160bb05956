//! The depth at which the rigid body meets the finger's supports.

use nalgebra::Vector3;

use super::{Finger, Path};
use crate::Rounded;
use crate::contact::{Outline, Plane, Reach, plane};
use crate::mesh::set;

/// The support that the plane would meet first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// A bone.
    Bone,
    /// A surface of the finger that is held fixed: its proximal section, or the nail.
    HeldSection,
}

/// The depth at which the plane meets the finger's supports, by the undeformed shape.
///
/// Beyond it the model has no meaning: supports cannot yield, so that the forces grow without bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Height of the obstacle's lowest point above first touch, mm; infinite if nothing is held.
    pub depth_mm: f64,
    /// The support that is met.
    pub obstacle: Obstacle,
}

impl Clearance {
    /// The clearance of a finger under the plane.
    pub fn of(finger: &Finger) -> Self {
        let lowest = |sets: &[&str]| {
            let nodes = sets.iter().flat_map(|name| finger.mesh.node_set(name));
            nodes.map(|&n| finger.mesh.nodes[n as usize].z).fold(f64::INFINITY, f64::min)
        };
        let bone = lowest(&[set::DISTAL_BONE, set::PROXIMAL_BONE]);
        let held = lowest(&[set::PROXIMAL_FIX, set::NAIL_FIX]);
        if held < bone {
            Self { depth_mm: held, obstacle: Obstacle::HeldSection }
        } else {
            Self { depth_mm: bone, obstacle: Obstacle::Bone }
        }
    }

    /// Reason why the rigid body cannot take the pose, slide and depth of a row of `path`; None if it can.
    pub fn refusal_in_pose(finger: &Finger, path: &Path, row: usize) -> Option<String> {
        let body = &finger.rigid_body;
        let at = path.coordinates(row, finger.neutral_pitch_deg);
        let outline = finger.outline.clone().unwrap_or_else(|| {
            let pad = finger.mesh.node_set(set::PAD).iter().map(|&n| finger.mesh.nodes[n as usize]).collect();
            Outline::of_points(pad, &finger.mesh.nodes)
        });
        let start = Plane::new(path.coordinates(0, finger.neutral_pitch_deg));
        let frame = Plane::new(at).frame(&Reach::new(outline, body.clone(), &start));
        let gap = |x: &Vector3<f64>| body.spot(&frame.to_plane(x)).gap_mm;
        let reached = finger.obstacles.iter().map(gap).fold(f64::INFINITY, f64::min);
        let what = if body.is_plane() { "plane" } else { "rigid body" };
        (reached <= 0.0).then(|| {
            let [pitch, roll] = [at[plane::PITCH].to_degrees() + finger.neutral_pitch_deg, at[plane::ROLL].to_degrees()];
            format!(
                "depth_mm {} at a pitch of {pitch:.1} and a roll of {roll:.1} degrees: the {what} would reach {:.2} mm into \
                 the held section of the finger or its bone",
                Rounded(at[plane::DEPTH]),
                -reached
            )
        })
    }

    /// Reason why the plane cannot reach `depth_mm`; None if it can.
    pub fn refusal(&self, depth_mm: f64) -> Option<String> {
        if depth_mm < self.depth_mm {
            return None;
        }
        let what = match self.obstacle {
            Obstacle::Bone => "the bone, whose lowest point",
            Obstacle::HeldSection => "the held section of the finger (raise its inclination_deg), whose lowest point",
        };
        Some(format!("{} mm reaches {what} is {:.2} mm above first touch", Rounded(depth_mm), self.depth_mm))
    }
}
