//! The rigid body that the finger touches: flags that replace the section `rigid_body` of a configuration.

use std::path::{Path, PathBuf};

use anyhow::bail;
use fingerpad::Status;
use fingerpad_fe::contact::RigidBody;
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Finger, Path as FingerPath, Response};
use fingerpad_fe::mesh::Mesh;

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

/// Mean size of the faces of a mesh that may touch, mm: the root of their area. None without faces of four corners.
fn face_mm(mesh: &Mesh) -> Option<f64> {
    let place = |node: u32| mesh.nodes[node as usize];
    let size = |face: &[u32; 4]| {
        let [a, b, c, d] = face.map(place);
        (0.5 * (c - a).cross(&(d - b)).norm()).sqrt()
    };
    let count = mesh.pad_faces.len();
    (count > 0).then(|| mesh.pad_faces.iter().map(size).sum::<f64>() / count as f64)
}

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
/// Error of the normal force of a contact of one face, a share; it falls with the root of their number. An envelope of presses on
/// the plane and on balls of 5 and 10 mm by 0.03 to 1 mm, on coarse and medium against default.
const ERROR_OF_ONE_FACE: f64 = 0.25;

/// Warns of rows of the path at which the contact covers too few faces for its force and area.
pub fn warn_of_few_faces(path: &FingerPath, finger: &Finger, responses: &[Response]) {
    let Some(size_mm) = face_mm(&finger.mesh) else { return };
    let ends_row = |r: &&Response| r.contact_area_mm2 > 0.0 && path.waypoints.iter().any(|w| w.t_s == r.t_s);
    let smallest = responses.iter().filter(ends_row).min_by(|a, b| a.contact_area_mm2.total_cmp(&b.contact_area_mm2));
    let Some(Response { t_s, contact_area_mm2, .. }) = smallest else { return };
    let faces = contact_area_mm2 / (size_mm * size_mm);
    if faces < FEWEST_FACES {
        let percent = (100.0 * ERROR_OF_ONE_FACE / faces.sqrt()).min(100.0);
        eprintln!(
            "warning: at t = {t_s} s the contact of {contact_area_mm2:.2} mm² covers {faces:.1} faces of {size_mm:.2} mm: its normal \
             force may be off by {percent:.0} %, its area by twice that; take a finer --mesh-preset"
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
