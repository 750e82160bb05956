//! Settings of the import of a label volume as a fingertip: the section of a configuration file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::super::Nail;
use super::VolumeError;

/// Roles of the labels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Labels {
    /// Air.
    pub outside: Vec<u16>,
    /// Skin and subcutaneous tissue together.
    pub soft: Vec<u16>,
    /// Bones; the distal phalanx is the piece at the tip.
    pub bone: Vec<u16>,
    /// Nail; may be missing from the volume.
    pub nail: Vec<u16>,
}

impl Default for Labels {
    fn default() -> Self {
        Self { outside: vec![0], soft: vec![1], bone: vec![2], nail: vec![3] }
    }
}

/// A direction along the voxels of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum VoxelAxis {
    /// Rising first index.
    #[serde(rename = "+i")]
    PlusI,
    /// Falling first index.
    #[serde(rename = "-i")]
    MinusI,
    /// Rising second index.
    #[serde(rename = "+j")]
    PlusJ,
    /// Falling second index.
    #[serde(rename = "-j")]
    MinusJ,
    /// Rising third index.
    #[serde(rename = "+k")]
    PlusK,
    /// Falling third index.
    #[serde(rename = "-k")]
    MinusK,
}

impl VoxelAxis {
    /// Index of the axis and its sign.
    pub(super) fn axis_and_sign(self) -> (usize, f64) {
        match self {
            Self::PlusI => (0, 1.0),
            Self::MinusI => (0, -1.0),
            Self::PlusJ => (1, 1.0),
            Self::MinusJ => (1, -1.0),
            Self::PlusK => (2, 1.0),
            Self::MinusK => (2, -1.0),
        }
    }
}

/// A fingertip from a label volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VolumeGeometry {
    /// The volume: NRRD or NIfTI; a relative name counts from the configuration file.
    pub file: PathBuf,
    /// Roles of the labels.
    pub labels: Labels,
    /// Voxel direction that points to the fingertip.
    pub distal_axis: VoxelAxis,
    /// Voxel direction that points to the nail's side.
    pub dorsal_axis: VoxelAxis,
    /// Turn of the finger about its dorsal axis, counter-clockwise from above the nail; without a value it is found
    /// from the middles of the sections.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
    /// Turn about the lateral axis, tip up positive.
    pub pitch_deg: f64,
    /// Turn about the finger's axis, counter-clockwise seen from the tip.
    pub roll_deg: f64,
    /// From the tip to the plane that cuts the finger; its section is `proximal_fix`.
    pub length_mm: f64,
    /// Thickness of the skin along the surface normal.
    pub skin_thickness_mm: f64,
    /// Angle between the finger's axis and the plane, tip down.
    pub inclination_deg: f64,
    /// Skin faces up to this height above the plane at first touch are contact candidates.
    pub pad_height_mm: f64,
    /// Tolerance of the labels' border beyond their voxels, as a share of half a voxel: 1 for a perfect segmentation,
    /// more for a rough one, which is then smoothed more.
    pub noise: f64,
    /// Distances of the start of the distal bone and the end of the second bone from the tip, if the label does not
    /// show a gap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_from_tip_mm: Option<[f64; 2]>,
    /// How the nail is made.
    pub nail: Nail,
    /// Distal and proximal edge of the nail, from the tip; measured if the volume labels the nail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nail_from_tip_mm: Option<[f64; 2]>,
    /// Half the angle that the nail spans; measured if the volume labels the nail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nail_half_angle_deg: Option<f64>,
    /// Thickness of the nail; measured if the volume labels the nail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nail_thickness_mm: Option<f64>,
}

impl Default for VolumeGeometry {
    fn default() -> Self {
        Self {
            file: PathBuf::new(),
            labels: Labels::default(),
            distal_axis: VoxelAxis::PlusI,
            dorsal_axis: VoxelAxis::PlusK,
            yaw_deg: None,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            length_mm: 25.0,
            skin_thickness_mm: 0.6,
            inclination_deg: 30.0,
            pad_height_mm: 3.5,
            noise: 1.0,
            joint_from_tip_mm: None,
            nail: Nail::Tets,
            nail_from_tip_mm: None,
            nail_half_angle_deg: None,
            nail_thickness_mm: None,
        }
    }
}

impl VolumeGeometry {
    /// Refuses values from which no mesh can be made, naming the key.
    pub(super) fn validate(&self) -> Result<(), VolumeError> {
        let refuse = |field, value: String, rule: &str| Err(VolumeError::Setting { field, value, rule: rule.into() });
        for (field, value) in [("length_mm", self.length_mm), ("skin_thickness_mm", self.skin_thickness_mm)] {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(field, value.to_string(), "must be a positive number");
            }
        }
        if !(0.5..=20.0).contains(&self.noise) {
            return refuse("noise", self.noise.to_string(), "must be in 0.5..=20");
        }
        for (field, value) in
            [("yaw_deg", self.yaw_deg.unwrap_or(0.0)), ("pitch_deg", self.pitch_deg), ("roll_deg", self.roll_deg)]
        {
            if !(value.abs() <= 90.0) {
                return refuse(field, value.to_string(), "must be in -90..=90");
            }
        }
        let pairs = [("joint_from_tip_mm", self.joint_from_tip_mm), ("nail_from_tip_mm", self.nail_from_tip_mm)];
        for (field, pair) in pairs {
            if let Some([near, far]) = pair
                && !(0.0 < near && near < far && far < self.length_mm)
            {
                return refuse(field, format!("[{near}, {far}]"), "must rise, between 0 and length_mm");
            }
        }
        Ok(())
    }
}
