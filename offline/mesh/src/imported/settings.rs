//! Settings of the import of a mesh as a fingertip: the section of a configuration file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Element sets or physical volumes that make up each region.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegionNames {
    /// Superficial layer.
    pub skin: Vec<String>,
    /// Soft layer under it.
    pub subcutaneous: Vec<String>,
    /// Distal phalanx.
    pub bone: Vec<String>,
    /// Second bone.
    pub proximal_bone: Vec<String>,
    /// Nail plate.
    pub nail: Vec<String>,
}

impl Default for RegionNames {
    fn default() -> Self {
        let one = |name: &str| vec![name.to_owned()];
        Self {
            skin: one("skin"),
            subcutaneous: one("subcutaneous"),
            bone: one("bone"),
            proximal_bone: one("proximal_bone"),
            nail: one("nail"),
        }
    }
}

/// Node sets, surfaces or element sets that hold or touch.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SetNames {
    /// The surface that may touch the plane: a surface, or a node set whose faces are used. Without it, every outer
    /// face of the hexahedra that looks down and lies lower than `pad_height_mm`; in files of this program,
    /// `PAD_SURFACE` or `pad`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pad: Option<String>,
    /// The proximal section, held fixed; `proximal_fix` without a value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proximal_fix: Option<String>,
    /// The nail's outer face, held fixed; `nail_fix` without a value, and nothing if there is no such set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nail_fix: Option<String>,
    /// More nodes that move with the distal phalanx: the wall of the hole where its elements were left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bone: Option<String>,
    /// The same for the second bone, which is fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proximal_bone: Option<String>,
}

/// In which frame the file's coordinates are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImportFrame {
    /// That of the plane: z out of the plane into the finger, x the direction of sliding, z = 0 at first touch.
    #[default]
    Plane,
    /// The finger's own: x distal, z dorsal; it is inclined, and first touch is found.
    Finger,
}

/// A fingertip from a mesh of another program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImportedGeometry {
    /// The mesh: `.inp` or `.msh`; a relative name counts from the configuration file.
    pub file: PathBuf,
    /// Element sets or physical volumes that make up each region.
    pub regions: RegionNames,
    /// Node sets and surfaces.
    pub sets: SetNames,
    /// In which frame the file's coordinates are.
    pub frame: ImportFrame,
    /// Length of the file's unit, mm.
    pub unit_mm: f64,
    /// Angle between the finger's axis and the plane, tip down; for the frame of the finger.
    pub inclination_deg: f64,
    /// Faces up to this height above first touch are contact candidates if no pad is named.
    pub pad_height_mm: f64,
    /// Nodes of different elements closer than this become one, mm; 0 leaves them apart.
    pub merge_mm: f64,
    /// Nodes of tetrahedra within this distance of the hexahedra's outer faces are moved onto them and tied; so are
    /// nodes of soft tissue attached to a rigid bone that was meshed apart, mm.
    pub tie_mm: f64,
}

impl Default for ImportedGeometry {
    fn default() -> Self {
        Self {
            file: PathBuf::new(),
            regions: RegionNames::default(),
            sets: SetNames::default(),
            frame: ImportFrame::Plane,
            unit_mm: 1.0,
            inclination_deg: 30.0,
            pad_height_mm: 3.5,
            merge_mm: 1e-5,
            tie_mm: 0.02,
        }
    }
}
