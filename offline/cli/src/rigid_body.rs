//! What the finger touches: the flags that stand for the section `rigid_body` of a configuration.

use std::path::{Path, PathBuf};

use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};

/// The rigid body that the finger touches.
#[derive(clap::Args)]
pub struct BodyArgs {
    /// Rigid body: plane, sphere, cylinder, edge, groove, or a file of heights (CSV of x_mm, y_mm and height_mm, or 2-D NRRD)
    #[arg(long, value_name = "KIND|FILE")]
    body: Option<String>,
    /// Radius of a sphere or a cylinder (negative: hollow), or of the rounding of an edge or a groove, mm
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    radius_mm: Option<f64>,
    /// Direction of the axis of a cylinder, an edge or a groove in the tangent plane, degrees from x towards y
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    axis_deg: Option<f64>,
    /// Angle between the faces of an edge or a groove, degrees
    #[arg(long, value_name = "A")]
    angle_deg: Option<f64>,
}

impl BodyArgs {
    /// Puts what is given in place of what the configuration says; another kind of body forgets its numbers too.
    pub fn apply(&self, config: &mut Config) {
        if let Some(body) = &self.body {
            let kind = match body.as_str() {
                "plane" => BodyKind::Plane,
                "sphere" => BodyKind::Sphere,
                "cylinder" => BodyKind::Cylinder,
                "edge" => BodyKind::Edge,
                "groove" => BodyKind::Groove,
                _ => BodyKind::Heights,
            };
            let file = (kind == BodyKind::Heights).then(|| PathBuf::from(body));
            config.rigid_body = RigidBodySettings { kind, file, ..RigidBodySettings::default() };
        }
        let body = &mut config.rigid_body;
        body.radius_mm = self.radius_mm.or(body.radius_mm);
        body.axis_deg = self.axis_deg.or(body.axis_deg);
        body.angle_deg = self.angle_deg.or(body.angle_deg);
    }

    /// The file of heights, if one is given.
    pub fn input(config: &Config) -> Option<&Path> {
        config.rigid_body.file.as_deref()
    }
}
