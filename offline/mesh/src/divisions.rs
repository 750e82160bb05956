//! Numbers of elements by direction: presets, and any other numbers for convergence studies.

use serde::{Deserialize, Serialize};

use super::MeshError;

/// Named resolutions of the same shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshPreset {
    /// About 2 300 nodes: sweeps and tests.
    Coarse,
    /// About 11 000 nodes, graded toward the pad.
    Medium,
    /// The medium mesh with the pad's faces halved and two layers of elements through the skin there.
    #[default]
    Default,
    /// About 58 000 nodes, nearly twice as fine as the medium mesh in each direction.
    Fine,
}

/// Height over the plane up to which the pad of the default mesh is refined, mm.
const REFINED_HEIGHT_MM: f64 = 2.0;
/// Layers of elements that are refined there, from the outside: the skin and the first layer under it.
const REFINED_LAYERS: usize = 2;

/// Most halvings of the pad's elements.
const MOST_REFINEMENT: usize = 2;

impl MeshPreset {
    /// All presets, coarse to fine.
    pub const ALL: [Self; 4] = [Self::Coarse, Self::Medium, Self::Default, Self::Fine];

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
                pad_refinement: 0,
                refined_height_mm: REFINED_HEIGHT_MM,
                refined_layers: REFINED_LAYERS,
            },
            Self::Medium => Divisions {
                columns: 16,
                rows: 6,
                proximal_rings: 2,
                joint_rings: 1,
                distal_rings: 17,
                bone_layers: 1,
                subcutaneous_layers: 6,
                skin_layers: 1,
                nail_layers: 1,
                pad_refinement: 0,
                refined_height_mm: REFINED_HEIGHT_MM,
                refined_layers: REFINED_LAYERS,
            },
            Self::Default => Divisions { pad_refinement: 1, ..Self::Medium.divisions() },
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
                pad_refinement: 0,
                refined_height_mm: REFINED_HEIGHT_MM,
                refined_layers: REFINED_LAYERS,
            },
        }
    }
}

/// Numbers of elements of the capped box: a box of `columns` x `rows` x rings inside the bone, and layers
/// around it on its palmar, dorsal, lateral and tip faces. Near the pad they may be halved in all three directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Number of times that the elements of the pad are halved in each direction, 0 to 2. Elements twice as large
    /// surround those halved twice.
    pub pad_refinement: usize,
    /// Elements under faces of the skin are halved this often if the middle of the face is lower than this over the
    /// plane at first touch, mm.
    pub refined_height_mm: f64,
    /// Halved that often are this many layers from the outside, skin and subcutaneous tissue.
    pub refined_layers: usize,
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
        self.validate_refinement()
    }

    /// Refuses a refined zone that cannot be made, or that would reach the bone: hanging nodes must not follow the
    /// bone.
    fn validate_refinement(&self) -> Result<(), MeshError> {
        let refuse = |field, value, rule: String| Err(MeshError::Refinement { field, value, rule });
        if self.pad_refinement > MOST_REFINEMENT {
            return refuse("pad_refinement", self.pad_refinement as f64, format!("must be at most {MOST_REFINEMENT}"));
        }
        if !(self.refined_height_mm > 0.0 && self.refined_height_mm.is_finite()) {
            return refuse("refined_height_mm", self.refined_height_mm, "must be positive".into());
        }
        let layers = self.skin_layers + self.subcutaneous_layers;
        let most = layers.saturating_sub(self.pad_refinement.max(1));
        if self.pad_refinement > 0 && !(1..=most).contains(&self.refined_layers) {
            let rule = format!(
                "must be in 1..={most} for {layers} layers of skin and subcutaneous tissue and pad_refinement {}",
                self.pad_refinement
            );
            return refuse("refined_layers", self.refined_layers as f64, rule);
        }
        Ok(())
    }

    /// Cells of the finest grid on an edge of an unrefined one.
    pub(super) fn refinement_factor(&self) -> usize {
        1 << self.pad_refinement
    }

    /// The grid in which all elements are halved as often as those of the pad.
    pub(super) fn refined_everywhere(&self) -> Self {
        let factor = self.refinement_factor();
        let times = |n: usize| n * factor;
        Self {
            columns: times(self.columns),
            rows: times(self.rows),
            proximal_rings: times(self.proximal_rings),
            joint_rings: times(self.joint_rings),
            distal_rings: times(self.distal_rings),
            bone_layers: times(self.bone_layers),
            subcutaneous_layers: times(self.subcutaneous_layers),
            skin_layers: times(self.skin_layers),
            ..*self
        }
    }

    /// Rings in all.
    pub fn rings(&self) -> usize {
        self.proximal_rings + self.joint_rings + self.distal_rings
    }

    /// All numbers of elements multiplied by `factor` and rounded, for convergence studies; the refined zone is
    /// unchanged.
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
            refined_layers: times(self.refined_layers),
            ..*self
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
    fn refined_zones_that_cannot_be_are_refused_by_name() {
        let refused = |divisions: Divisions| match divisions.validate() {
            Err(MeshError::Refinement { field, .. }) => field,
            other => panic!("{other:?}"),
        };
        let default = Divisions::default();
        assert_eq!(refused(Divisions { pad_refinement: 3, ..default }), "pad_refinement");
        assert_eq!(refused(Divisions { refined_height_mm: f64::NAN, ..default }), "refined_height_mm");
        assert_eq!(refused(Divisions { refined_layers: 0, ..default }), "refined_layers");
        // One layer must be left between the refined zone and the bone.
        let layers = default.skin_layers + default.subcutaneous_layers;
        assert_eq!(refused(Divisions { refined_layers: layers, ..default }), "refined_layers");
        Divisions { refined_layers: layers - 1, ..default }.validate().unwrap();
        assert_eq!(refused(Divisions { refined_layers: layers - 1, pad_refinement: 2, ..default }), "refined_layers");
        Divisions { refined_layers: layers, pad_refinement: 0, ..default }.validate().unwrap();
    }

    #[test]
    fn presets_are_valid() {
        for preset in MeshPreset::ALL {
            preset.divisions().validate().unwrap();
            preset.divisions().scaled(0.3).validate().unwrap();
        }
    }
}
