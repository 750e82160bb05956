//! How many elements in which direction: presets, and any other number for convergence studies.

use serde::{Deserialize, Serialize};

use super::MeshError;

/// Named resolutions of the same shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshPreset {
    /// About 2 300 nodes: sweeps and tests.
    Coarse,
    /// About 11 000 nodes, graded toward the pad.
    #[default]
    Default,
    /// About 58 000 nodes, nearly twice as fine as the default in each direction.
    Fine,
}

impl MeshPreset {
    /// The preset's numbers of elements.
    pub fn divisions(self) -> Divisions {
        match self {
            Self::Coarse => Divisions {
                columns: 8,
                rows: 3,
                proximal_rings: 2,
                joint_rings: 1,
                distal_rings: 10,
                bone_layers: 1,
                subcutaneous_layers: 3,
                skin_layers: 1,
                nail_layers: 1,
            },
            Self::Default => Divisions {
                columns: 16,
                rows: 6,
                proximal_rings: 2,
                joint_rings: 1,
                distal_rings: 17,
                bone_layers: 1,
                subcutaneous_layers: 6,
                skin_layers: 1,
                nail_layers: 1,
            },
            Self::Fine => Divisions {
                columns: 28,
                rows: 10,
                proximal_rings: 3,
                joint_rings: 2,
                distal_rings: 32,
                bone_layers: 1,
                subcutaneous_layers: 11,
                skin_layers: 2,
                nail_layers: 2,
            },
        }
    }
}

/// Numbers of elements of the capped box: a box of `columns` x `rows` x rings inside the bone, and layers
/// around it on its palmar, dorsal, lateral and tip faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Divisions {
    /// Across the palmar side (y).
    pub columns: usize,
    /// Up each lateral side (z), and from the palmar to the dorsal edge of the tip.
    pub rows: usize,
    /// Along the proximal bone.
    pub proximal_rings: usize,
    /// Along the joint gap.
    pub joint_rings: usize,
    /// From the joint gap to the edge of the tip.
    pub distal_rings: usize,
    /// Between the box inside the bone and the bone's surface.
    pub bone_layers: usize,
    /// Through the subcutaneous tissue.
    pub subcutaneous_layers: usize,
    /// Through the skin.
    pub skin_layers: usize,
    /// Nail: boxes (of 6 tetrahedra) through the thickness; along and across it has the skin's faces.
    pub nail_layers: usize,
}

impl Default for Divisions {
    fn default() -> Self {
        MeshPreset::Default.divisions()
    }
}

impl Divisions {
    /// Refuses numbers from which no mesh can be made.
    pub fn validate(&self) -> Result<(), MeshError> {
        let numbers = [
            ("columns", self.columns, 2),
            ("rows", self.rows, 2),
            ("proximal_rings", self.proximal_rings, 1),
            ("joint_rings", self.joint_rings, 1),
            ("distal_rings", self.distal_rings, 3),
            ("bone_layers", self.bone_layers, 1),
            ("subcutaneous_layers", self.subcutaneous_layers, 1),
            ("skin_layers", self.skin_layers, 1),
            ("nail_layers", self.nail_layers, 1),
        ];
        for (field, value, least) in numbers {
            if value < least {
                return Err(MeshError::Divisions { field, value, least });
            }
        }
        Ok(())
    }

    /// Rings in all.
    pub fn rings(&self) -> usize {
        self.proximal_rings + self.joint_rings + self.distal_rings
    }

    /// All numbers multiplied by `factor` and rounded, for convergence studies.
    pub fn scaled(&self, factor: f64) -> Self {
        let times = |n: usize| ((n as f64 * factor).round() as usize).max(1);
        Self {
            columns: times(self.columns).max(2),
            rows: times(self.rows).max(2),
            proximal_rings: times(self.proximal_rings),
            joint_rings: times(self.joint_rings),
            distal_rings: times(self.distal_rings).max(3),
            bone_layers: times(self.bone_layers),
            subcutaneous_layers: times(self.subcutaneous_layers),
            skin_layers: times(self.skin_layers),
            nail_layers: times(self.nail_layers),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_is_refused_by_name() {
        let divisions = Divisions { skin_layers: 0, ..Divisions::default() };
        let expected = MeshError::Divisions { field: "skin_layers", value: 0, least: 1 };
        assert_eq!(divisions.validate(), Err(expected));
    }

    #[test]
    fn presets_are_valid() {
        for preset in [MeshPreset::Coarse, MeshPreset::Default, MeshPreset::Fine] {
            preset.divisions().validate().unwrap();
            preset.divisions().scaled(0.3).validate().unwrap();
        }
    }
}
