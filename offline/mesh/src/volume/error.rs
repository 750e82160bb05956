//! Why a volume cannot become a fingertip.

use nalgebra::Vector3;
use thiserror::Error;

use super::super::MeshError;

/// Why a volume cannot become a fingertip. Voxels are named by their indices in the file.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum VolumeError {
    /// A setting is out of its range.
    #[error("volume.{field} = {value}: {rule}")]
    Setting {
        /// Its key.
        field: &'static str,
        /// Its value.
        value: String,
        /// The required condition.
        rule: String,
    },
    /// Labels of the volume that the settings do not name.
    #[error("label {label} ({voxels} voxels) is not named in volume.labels; the volume has {found}")]
    UnknownLabel {
        /// The label.
        label: u16,
        /// Number of voxels that have it.
        voxels: usize,
        /// All labels with their voxels.
        found: String,
    },
    /// A label that is needed and that no voxel has.
    #[error("no voxel is {what} (labels {expected:?}); the volume has {found}")]
    MissingLabel {
        /// `soft tissue` or `bone`.
        what: &'static str,
        /// The labels that would be.
        expected: Vec<u16>,
        /// All labels with their voxels.
        found: String,
    },
    /// The finger does not reach from its tip to the cutting plane.
    #[error("{what} ends {reach_mm:.2} mm from the tip, before the cut at length_mm = {length_mm}")]
    TooShort {
        /// `the finger` or `the bone`.
        what: &'static str,
        /// Its extent.
        reach_mm: f64,
        /// Place of the cut.
        length_mm: f64,
    },
    /// No joint gap between the cut and the tip.
    #[error(
        "no joint gap within {length_mm} mm of the tip: the bone is {pieces} piece(s) there; the mesh needs the distal \
         phalanx and an end of the next bone: change length_mm, separate the bones, or give joint_from_tip_mm"
    )]
    NoJoint {
        /// Place of the cut.
        length_mm: f64,
        /// Pieces of bone.
        pieces: usize,
    },
    /// A ray from the axis meets a surface other than once.
    #[error(
        "{surface} is not star-shaped about its axis: the ray from {from:?} through {through:?} (voxels) {what}; \
         {from_tip_mm:.1} mm from the tip, {angle_deg:.0}° from palmar"
    )]
    NotStarShaped {
        /// `the skin` or `the bone`.
        surface: &'static str,
        /// Voxel where the ray begins.
        from: [i64; 3],
        /// Voxel that defines the ray's direction.
        through: [i64; 3],
        /// The defect along the ray.
        what: String,
        /// Where along the finger, mm.
        from_tip_mm: f64,
        /// Direction about the axis, positive to the left.
        angle_deg: f64,
    },
    /// The template could not be fitted.
    #[error("no fingertip was recognised: {0}")]
    Fit(String),
    /// The resulting mesh was refused.
    #[error("the mesh of the volume: {0}")]
    Mesh(#[from] MeshError),
}

/// A place in the volume as voxel indices, for messages.
pub(super) fn voxel(place: Vector3<f64>) -> [i64; 3] {
    [place.x, place.y, place.z].map(|c| c.round() as i64)
}
