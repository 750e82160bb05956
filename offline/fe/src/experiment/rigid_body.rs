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
    let formats::heights::Heights { nodes, spacing_mm, origin_mm, heights_mm } = formats::heights::read(path)?;
    HeightField::new(nodes, spacing_mm, origin_mm, heights_mm)
        .map_err(|error: BodyShapeError| ConfigError::RigidBody(format!("{}: {error}", path.display())))
}
