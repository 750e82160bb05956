//! The rigid body of a configuration: kind and numbers, or the file of a height field.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::ConfigError;
use crate::contact::{BodyShapeError, HeightField, RIGHT_ANGLE_DEG, RigidBody};
use fingerpad_formats as formats;

/// Kinds of rigid bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// An infinite plane.
    #[default]
    Plane,
    /// A sphere, or a bowl with a negative radius.
    Sphere,
    /// A circular cylinder, or a trough with a negative radius.
    Cylinder,
    /// Two planes that meet in a rounded edge.
    Edge,
    /// Two planes that meet in a rounded valley.
    Groove,
    /// Heights over the tangent plane, from a file.
    Heights,
}

/// The rigid body that the finger touches.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigidBodySettings {
    /// Its kind.
    pub kind: BodyKind,
    /// Radius of a sphere or a cylinder (negative: concave), or of the rounding of an edge or a groove, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Direction of the axis of a cylinder, an edge or a groove in the tangent plane, degrees from x towards y; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_deg: Option<f64>,
    /// Angle between the faces of an edge or a groove, degrees; 90 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Heights, mm: a CSV file of x_mm, y_mm and height_mm on a regular grid, or a 2-D NRRD file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
}

impl RigidBodySettings {
    /// Whether it is the plane.
    pub fn is_plane(&self) -> bool {
        self.kind == BodyKind::Plane
    }

    /// The body; reads the file of a height field.
    ///
    /// # Errors
    /// [`ConfigError::RigidBody`] for a dimension that is missing, that the kind does not have, or that is out of
    /// range, and the errors of reading the file.
    pub fn read(&self) -> Result<RigidBody, ConfigError> {
        let refuse = |message: String| ConfigError::RigidBody(message);
        let Self { kind, radius_mm, axis_deg, angle_deg, file } = self;
        let (has_radius, has_axis, has_angle) = match kind {
            BodyKind::Plane | BodyKind::Heights => (false, false, false),
            BodyKind::Sphere => (true, false, false),
            BodyKind::Cylinder => (true, true, false),
            BodyKind::Edge | BodyKind::Groove => (true, true, true),
        };
        let name = serde_json::to_string(kind).expect("a name").replace('"', "");
        for (key, value, has) in [
            ("radius_mm", radius_mm, has_radius),
            ("axis_deg", axis_deg, has_axis),
            ("angle_deg", angle_deg, has_angle),
        ] {
            if let (Some(value), false) = (value, has) {
                return Err(refuse(format!("{key} = {value}: a body of kind {name} has none")));
            }
        }
        if file.is_some() && *kind != BodyKind::Heights {
            return Err(refuse(format!("file: a body of kind {name} has none")));
        }
        let radius =
            || radius_mm.ok_or_else(|| refuse(format!("radius_mm is missing: a body of kind {name} needs one")));
        let axis_deg = axis_deg.unwrap_or(0.0);
        let angle_deg = angle_deg.unwrap_or(RIGHT_ANGLE_DEG);
        let body = match kind {
            BodyKind::Plane => RigidBody::Plane,
            BodyKind::Sphere => RigidBody::Sphere { radius_mm: radius()? },
            BodyKind::Cylinder => RigidBody::Cylinder { radius_mm: radius()?, axis_deg },
            BodyKind::Edge => RigidBody::Edge { radius_mm: radius()?, axis_deg, angle_deg },
            BodyKind::Groove => RigidBody::Groove { radius_mm: radius()?, axis_deg, angle_deg },
            BodyKind::Heights => {
                let file = file
                    .as_ref()
                    .ok_or_else(|| refuse("file is missing: a height field is read from a file".into()))?;
                RigidBody::Heights(read_heights(file)?)
            }
        };
        body.check().map_err(|error| refuse(error.to_string()))?;
        Ok(body)
    }
}

/// A height field from a file.
fn read_heights(path: &Path) -> Result<HeightField, ConfigError> {
    let heights = formats::heights::read(path)?;
    if let Some(problem) = implausible_heights(&heights) {
        return Err(ConfigError::RigidBody(format!("{}: {problem}", path.display())));
    }
    let formats::heights::Heights { nodes, spacing_mm, origin_mm, heights_mm } = heights;
    HeightField::new(nodes, spacing_mm, origin_mm, heights_mm)
        .map_err(|error: BodyShapeError| ConfigError::RigidBody(format!("{}: {error}", path.display())))
}

/// Longest sides that a height field under a fingertip has, mm.
const GRID_MM: [f64; 2] = [0.3, 1000.0];
/// Largest slope of a height field, root mean square from node to node.
const STEEPEST: f64 = 10.0;

/// What is wrong with a height field of a size or a slope that only another unit explains.
fn implausible_heights(field: &formats::heights::Heights) -> Option<String> {
    let formats::heights::Heights { nodes, spacing_mm, heights_mm, .. } = field;
    let number = |value: f64| formats::significant(value, 3);
    let sides = [0, 1].map(|k| spacing_mm[k] * (nodes[k] as f64 - 1.0));
    let longest = sides[0].max(sides[1]);
    let (unit, letters, factor) = match longest {
        longest if longest < GRID_MM[0] => ("metres", "m", 1e3),
        longest if longest > GRID_MM[1] => ("micrometres", "um", 1e-3),
        _ => ("", "", 0.0),
    };
    let columns = |letters| format!("name the columns x_{letters}, y_{letters} and height_{letters}, or convert them");
    if factor > 0.0 {
        let [a, b] = sides.map(number);
        let [c, d] = sides.map(|side| number(side * factor));
        return Some(format!(
            "the grid is {a} x {b} mm; is the file in {unit} ({c} x {d} mm)? If so, {} (of NRRD set `space units`)",
            columns(letters)
        ));
    }
    let [nx, ny] = *nodes;
    let along = |step: usize, spacing: f64| {
        let has_next = move |k: &usize| if step == 1 { k % nx + 1 < nx } else { k / nx + 1 < ny };
        (0..heights_mm.len()).filter(has_next).map(move |k| ((heights_mm[k + step] - heights_mm[k]) / spacing).powi(2))
    };
    let (sum, count) =
        along(1, spacing_mm[0]).chain(along(nx, spacing_mm[1])).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    let slope = (sum / count).sqrt();
    if slope > STEEPEST && slope.is_finite() {
        let (low, high) =
            heights_mm.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        return Some(format!(
            "the heights differ by {} mm over a grid of {} mm, a mean slope of {}; are the heights in micrometres? If so, name \
             the column height_um, or convert it",
            number(high - low),
            number(longest),
            number(slope)
        ));
    }
    None
}
