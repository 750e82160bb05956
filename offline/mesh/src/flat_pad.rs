//! A flat pad of gel on a rigid plate, as that of an optical tactile sensor, by its dimensions.
//!
//! Main type: [`FlatPad`]. Uses divisions; the import makes the fingertip of its mesh.

use fingerpad_formats::raw_mesh::{RawElement, RawKind, RawMesh};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::imported::{ImportFrame, ImportedGeometry};
use super::shape::dimensions;
use super::{Divisions, MeshError};

/// A pad of gel on a rigid plate, crowned and with a rounded rim.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlatPad {
    /// Along x.
    pub length_mm: f64,
    /// Along y.
    pub width_mm: f64,
    /// From the plate to the middle of the face.
    pub thickness_mm: f64,
    /// Radius of the face's crown: a face that is flat to the last bit touches everywhere at once.
    pub crown_radius_mm: f64,
}

/// Crown of a pad whose name has none.
const CROWN_RADIUS_MM: f64 = 100.0;
/// Radius of the rim over the thickness.
const RIM: f64 = 0.25;
/// Sine of the slope at which the rounding ends; steeper elements would be slivers.
const STEEPEST: f64 = 0.7;
/// Angle between the pad's own x axis and the face. It only names the pose: a pad lies in the middle of the range of a reduced model.
const PITCH_DEG: f64 = 30.0;

impl FlatPad {
    /// The pad that a name like `flat:20,16,4` or `flat:20,16,4,60` states: length, width, thickness, radius of the crown; None for another
    /// name.
    ///
    /// # Errors
    /// [`MeshError::ShapeFile`] with the number that is wrong.
    pub fn named(name: &str) -> Result<Option<Self>, MeshError> {
        let Some(numbers) = dimensions(name, "flat:", &["length", "width", "thickness", "crown radius"], 3)? else {
            return Ok(None);
        };
        let [length_mm, width_mm, thickness_mm] = [0, 1, 2].map(|k| numbers[k]);
        let crown_radius_mm = numbers.get(3).copied().unwrap_or(CROWN_RADIUS_MM);
        let refuse = |message: String| Err(MeshError::ShapeFile { name: name.into(), message });
        let half = 0.5 * length_mm.hypot(width_mm);
        if crown_radius_mm < half || Self::sag(half, crown_radius_mm) > 0.5 * thickness_mm {
            return refuse(format!(
                "a crown of {crown_radius_mm} mm lifts the corners by more than half of the thickness of {thickness_mm} mm: give a larger radius"
            ));
        }
        if 2.0 * RIM * thickness_mm > 0.5 * length_mm.min(width_mm) {
            return refuse(format!("{thickness_mm} mm is too thick for a pad of {length_mm} mm by {width_mm} mm"));
        }
        Ok(Some(Self { length_mm, width_mm, thickness_mm, crown_radius_mm }))
    }

    fn sag(away: f64, radius: f64) -> f64 {
        radius - (radius * radius - away * away).sqrt()
    }

    /// Height of the face over the middle of it, mm.
    fn height(&self, x: f64, y: f64) -> f64 {
        let rim = RIM * self.thickness_mm;
        let rounded = |at: f64, side: f64| {
            let beyond = at.abs() - 0.5 * side + STEEPEST * rim;
            Self::sag(beyond.clamp(0.0, STEEPEST * rim), rim)
        };
        Self::sag(x.hypot(y), self.crown_radius_mm) + rounded(x, self.length_mm).max(rounded(y, self.width_mm))
    }

    /// Its mesh and the settings of the import.
    pub fn mesh(&self, divisions: &Divisions) -> (RawMesh, ImportedGeometry) {
        let finer = 1.4_f64.powi(divisions.pad_refinement as i32);
        let along = 2 * (divisions.columns as f64 * finer).round() as usize;
        let across = 2 * ((0.5 * along as f64 * self.width_mm / self.length_mm).round() as usize).max(2);
        let up = divisions.subcutaneous_layers + divisions.skin_layers + 1;
        let (sin, cos) = PITCH_DEG.to_radians().sin_cos();
        let label = |i: usize, j: usize, k: usize| 1 + ((i * (across + 1) + j) * (up + 1) + k) as u64;
        let mut raw = RawMesh::new();
        for i in 0..=along {
            for j in 0..=across {
                let x = self.length_mm * (i as f64 / along as f64 - 0.5);
                let y = self.width_mm * (j as f64 / across as f64 - 0.5);
                let face = self.height(x, y);
                for k in 0..=up {
                    let share = k as f64 / up as f64;
                    let z = face + share * (self.thickness_mm - face);
                    // The import turns the finger's axis down by the pitch; the face then lies level.
                    raw.nodes.push((label(i, j, k), Vector3::new(cos * x - sin * z, y, sin * x + cos * z)));
                    if k == up {
                        raw.node_sets.entry("plate".into()).or_default().push(label(i, j, k));
                    }
                }
            }
        }
        let mut elements = Vec::new();
        for i in 0..along {
            for j in 0..across {
                for k in 0..up {
                    let corner = |[a, b]: [usize; 2], c: usize| label(i + a, j + b, k + c);
                    let ring = [[0, 0], [1, 0], [1, 1], [0, 1]];
                    let nodes = [0, 1].iter().flat_map(|&c| ring.map(|of| corner(of, c))).collect();
                    let number = 1 + elements.len() as u64;
                    elements.push(number);
                    raw.elements.push(RawElement { label: number, kind: RawKind::Hex, nodes });
                }
            }
        }
        raw.element_sets.insert("gel".into(), elements);
        let mut settings = ImportedGeometry {
            frame: ImportFrame::Finger,
            inclination_deg: PITCH_DEG,
            pad_height_mm: 0.75 * self.thickness_mm,
            ..ImportedGeometry::default()
        };
        settings.regions.subcutaneous = vec!["gel".into()];
        settings.sets.proximal_fix = Some("plate".into());
        (raw, settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imported::imported_fingertip;
    use crate::{MeshPreset, quality};

    /// The mesh of every preset is sound, has the volume of a slab less its rim and crown, and touches in its middle.
    #[test]
    fn a_flat_pad_is_a_fingertip() {
        let pad = FlatPad::named("flat:20,16,4").unwrap().unwrap();
        for preset in MeshPreset::ALL {
            let (raw, settings) = pad.mesh(&preset.divisions());
            let made = imported_fingertip(&raw, &settings, &[]).unwrap();
            let quality = quality(&made.fingertip.mesh);
            assert!(quality.worst_hex_scaled_jacobian > 0.4, "{preset:?}: {}", quality.worst_hex_scaled_jacobian);
            let volume: f64 = quality.regions.values().map(|of| of.volume_mm3).sum();
            let crown = 20.0 * 16.0 * (20.0_f64.powi(2) + 16.0_f64.powi(2)) / 24.0 / 100.0;
            // Section of the arc up to its end, along the rim.
            let (end, up) = (0.7_f64, (1.0 - 0.49_f64).sqrt());
            let rim = (end - 0.5 * (end * up + end.asin())) * 2.0 * (20.0 + 16.0);
            let slab = 20.0 * 16.0 * 4.0 - crown - rim;
            // A coarse mesh cuts more off the rim.
            assert!((volume / slab - 1.0).abs() < 0.03, "{preset:?}: {volume} for {slab}");
            assert!((made.fingertip.touch.curvature_radius_mm / 100.0 - 1.0).abs() < 0.5, "{:?}", made.fingertip.touch);
        }
    }

    #[test]
    fn dimensions_are_refused_by_value() {
        for (name, part) in [
            ("flat:20,16", "thickness"),
            ("flat:20,16,4,9", "crown of 9 mm"),
            ("flat:20,16,-4", "-4"),
            ("flat:20,6,8", "too thick"),
            ("flat:20,x,4", "x"),
        ] {
            let error = FlatPad::named(name).unwrap_err().to_string();
            assert!(error.contains(part), "{name}: {error}");
        }
        assert_eq!(FlatPad::named("e").unwrap(), None);
    }
}
