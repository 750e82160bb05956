//! The rigid body that the finger touches: flags that replace the section `rigid_body` of a configuration.

use std::path::{Path, PathBuf};

use anyhow::bail;
use fingerpad::Status;
use fingerpad_fe::contact::RigidBody;
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Finger, MeshError, Path as FingerPath, Response, face_mm};

use super::outputs;

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
    /// Whether any of the flags is given.
    pub fn is_given(&self) -> bool {
        self.body.is_some() || self.radius_mm.is_some() || self.axis_deg.is_some() || self.angle_deg.is_some()
    }

    /// Replaces values of the configuration by those of the flags; another kind of body also discards the
    /// configuration's dimensions.
    ///
    /// # Errors
    /// A word that is neither a kind of body nor a file.
    pub fn apply(&self, config: &mut Config) -> anyhow::Result<()> {
        if let Some(body) = &self.body {
            let kind = match body.as_str() {
                "plane" => BodyKind::Plane,
                "sphere" => BodyKind::Sphere,
                "cylinder" => BodyKind::Cylinder,
                "edge" => BodyKind::Edge,
                "groove" => BodyKind::Groove,
                _ => BodyKind::Heights,
            };
            if kind == BodyKind::Heights && !Path::new(body).exists() {
                bail!("--body {body}: neither plane, sphere, cylinder, edge or groove nor a file that is there");
            }
            let file = (kind == BodyKind::Heights).then(|| PathBuf::from(body));
            config.rigid_body = RigidBodySettings { kind, file, ..RigidBodySettings::default() };
        }
        let body = &mut config.rigid_body;
        body.radius_mm = self.radius_mm.or(body.radius_mm);
        body.axis_deg = self.axis_deg.or(body.axis_deg);
        body.angle_deg = self.angle_deg.or(body.angle_deg);
        Ok(())
    }

    /// The file of heights, if one is given.
    pub fn input(config: &Config) -> Option<&Path> {
        config.rigid_body.file.as_deref()
    }
}

/// Radius of a body over the size of the faces that touch it below which the faces are too coarse for it.
const LEAST_RADIUS: f64 = 2.0;

/// Warns of a body that is finer than the mesh: contact is found at the nodes, so features between them are missed.
pub fn warn_of_fine_body(finger: &Finger) {
    let (radius_mm, Some(size_mm)) = (finger.rigid_body.least_radius_mm(), face_mm(&finger.mesh)) else { return };
    if radius_mm < LEAST_RADIUS * size_mm {
        let what = match finger.rigid_body {
            RigidBody::Heights(_) => "the least radius of curvature of the heights",
            _ => "the radius of the body",
        };
        eprintln!(
            "warning: {what}, {} mm, is small for a mesh with faces of {size_mm:.2} mm where it may touch: forces hold roughly, \
             the area does not; take a finer --mesh-preset",
            fingerpad_formats::significant(radius_mm, 3)
        );
    }
}

/// Faces below which a contact is warned of.
const FEWEST_FACES: f64 = 10.0;

/// Prints the errors that the mesh leaves in the last row of the path with contact, and warns of the row with the smallest if it covers
/// too few faces for its force and area.
pub fn print_mesh_error(path: &FingerPath, finger: &Finger, responses: &[Response], out: &Path) {
    let Some(size_mm) = face_mm(&finger.mesh) else { return };
    let ends_row = |r: &&Response| r.contact_area_mm2 > 0.0 && path.waypoints.iter().any(|w| w.t_s == r.t_s);
    let by_area = |a: &&Response, b: &&Response| a.contact_area_mm2.total_cmp(&b.contact_area_mm2);
    let rows = || responses.iter().filter(ends_row);
    let (Some(smallest), Some(last)) = (rows().min_by(by_area), rows().next_back()) else { return };
    let faces = |r: &Response| r.contact_area_mm2 / (size_mm * size_mm);
    let percent = |error: f64, of: f64| format!("{:.0} %", (100.0 * error / of).min(100.0));
    let error = MeshError::of(last, size_mm);
    let friction_n = last.friction_x_n.hypot(last.friction_y_n);
    let friction =
        if error.friction_n < friction_n { percent(error.friction_n, friction_n) } else { "all of it".into() };
    outputs::say(
        out,
        &format!(
            "error of the mesh at t = {} s, where the contact covers {:.0} faces, in nine of ten cases at most: normal force {}, friction \
             {friction}, area {}, stick ratio {:.2}, centre of pressure {:.2} mm, moments {} N mm",
            last.t_s,
            faces(last),
            percent(error.normal_force_n, last.normal_force_n),
            percent(error.contact_area_mm2, last.contact_area_mm2),
            error.stick_ratio,
            error.centre_mm,
            fingerpad_formats::significant(error.moment_n_mm, 2)
        ),
    );
    if faces(smallest) < FEWEST_FACES {
        let error = MeshError::of(smallest, size_mm);
        eprintln!(
            "warning: at t = {} s the contact of {:.2} mm² covers {:.1} faces of {size_mm:.2} mm: its normal force may be off by {}, its \
             area by {}; take a finer --mesh-preset",
            smallest.t_s,
            smallest.contact_area_mm2,
            faces(smallest),
            percent(error.normal_force_n, smallest.normal_force_n),
            percent(error.contact_area_mm2, smallest.contact_area_mm2)
        );
    }
}

/// Warns of a contact that reaches beyond the grid of a height field, whose border goes on there.
pub fn warn_of_contact_beyond(finger: &Finger, responses: &[Response]) {
    let RigidBody::Heights(field) = &finger.rigid_body else { return };
    let Some(beyond) = responses.iter().find(|r| r.status.contains(Status::BEYOND_EDGE)) else { return };
    let number = |value: f64| fingerpad_formats::significant(value, 4);
    let side = |k: usize| {
        let end = field.origin_mm[k] + field.spacing_mm[k] * (field.nodes[k] - 1) as f64;
        format!("{} to {} mm", number(field.origin_mm[k]), number(end))
    };
    eprintln!(
        "warning: from t = {} s on the contact of {:.2} mm² reaches beyond the heights, which are given from x = {} and y = {}; there \
         the heights of the border go on, and the rows have the status beyond_edge; give heights of a larger part of the body",
        number(beyond.t_s),
        beyond.contact_area_mm2,
        side(0),
        side(1)
    );
}
