//! The rigid body that the finger touches: flags that replace the section `rigid_body` of a configuration.

use std::path::{Path, PathBuf};

use anyhow::bail;
use fingerpad_fe::contact::RigidBody;
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Finger, Response};

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
pub fn warn_of_fine_body(config: &Config, finger: &Finger) {
    let mesh = &finger.mesh;
    let place = |node: u32| mesh.nodes[node as usize];
    let size = |face: &[u32; 4]| {
        let [a, b, c, d] = face.map(place);
        (0.5 * (c - a).cross(&(d - b)).norm()).sqrt()
    };
    let (Some(radius_mm), count) = (config.rigid_body.radius_mm, mesh.pad_faces.len()) else { return };
    if count == 0 {
        return;
    }
    let size_mm = mesh.pad_faces.iter().map(size).sum::<f64>() / count as f64;
    if radius_mm.abs() < LEAST_RADIUS * size_mm {
        eprintln!(
            "warning: the radius of the body, {radius_mm} mm, is small for a mesh with faces of {size_mm:.2} mm where it may touch: \
             forces hold roughly, the area does not; take a finer --mesh-preset"
        );
    }
}

/// Share of the contact's radius by which it may reach beyond a grid of heights.
const BEYOND: f64 = 0.1;

/// Warns of a contact that reaches beyond the grid of a height field, whose border goes on there.
pub fn warn_of_contact_beyond(finger: &Finger, responses: &[Response]) {
    let RigidBody::Heights(field) = &finger.rigid_body else { return };
    let side = |k: usize| [field.origin_mm[k], field.origin_mm[k] + field.spacing_mm[k] * (field.nodes[k] - 1) as f64];
    let beyond = responses.iter().find_map(|r| {
        // The contact as a circle, in the axes of the body.
        let radius_mm = (r.contact_area_mm2 / std::f64::consts::PI).sqrt();
        let [x, y] = [r.centre_of_pressure_mm[0] - r.slide_x_mm, r.centre_of_pressure_mm[1] - r.slide_y_mm];
        let (sin, cos) = r.spin_deg.to_radians().sin_cos();
        let middle = [cos * x + sin * y, cos * y - sin * x];
        let room = (1.0 - BEYOND) * radius_mm;
        let outside = |k: usize| middle[k] - room < side(k)[0] || middle[k] + room > side(k)[1];
        ((0..2).any(outside) && radius_mm > 0.0).then_some((r.t_s, middle, radius_mm))
    });
    if let Some((t_s, [x, y], radius_mm)) = beyond {
        let number = |value: f64| fingerpad_formats::significant(value, 4);
        let ([x0, x1], [y0, y1]) = (side(0).map(number), side(1).map(number));
        let t_s = number(t_s);
        eprintln!(
            "warning: at t = {t_s} s the contact, about {radius_mm:.2} mm in radius at x = {x:.2} mm, y = {y:.2} mm of the grid, reaches beyond \
             the heights, which are given from {x0} to {x1} mm and from {y0} to {y1} mm; there the heights of the border go on"
        );
    }
}
