//! Paths of the design on rigid bodies other than a plane.

use std::f64::consts::PI;

use fingerpad_fe::experiment::{BodyKind, RigidBodySettings};
use fingerpad_fe::load_path::Path;

use super::DesignSettings;
use super::halton::HaltonPoint;
use super::path_builder::PathBuilder;

/// Least and largest depth, mm.
const DEPTHS_MM: [f64; 2] = [0.6, 1.8];
/// Slide over that on a plane: the contact with a round body is smaller and slips earlier.
const SLIDE: f64 = 0.7;

/// The body of a path: spheres of three radii, a cylinder along and across the finger, an edge, in turn.
pub(super) fn body(number: usize) -> RigidBodySettings {
    let (kind, radius_mm, axis_deg) = match number % 6 {
        0 => (BodyKind::Sphere, 5.0, None),
        1 => (BodyKind::Sphere, 10.0, None),
        2 => (BodyKind::Sphere, 40.0, None),
        3 => (BodyKind::Cylinder, 10.0, Some(0.0)),
        4 => (BodyKind::Cylinder, 10.0, Some(90.0)),
        _ => (BodyKind::Edge, 2.0, Some(45.0)),
    };
    RigidBodySettings { kind, radius_mm: Some(radius_mm), axis_deg, ..RigidBodySettings::default() }
}

/// The first six paths press, slide and turn back; the others start in another pose, spin and turn.
pub(super) fn path(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let [least, most] = DEPTHS_MM;
    let depth = point.between(least, most);
    let angle = point.angle();
    let slide = SLIDE * settings.slip_slide_mm(depth);
    if number % 12 < 6 {
        let mut path = PathBuilder::new();
        path.press(depth);
        path.press(0.5 * depth);
        path.press(depth);
        path.slide(angle, slide);
        path.slide(angle + PI + point.between(-0.5, 0.5), 0.8 * slide);
        path.lift();
        path.finish()
    } else {
        let pose = [point.between(25.0, 50.0), point.between(-15.0, 15.0)];
        let mut path = PathBuilder::in_pose(pose);
        path.press(depth);
        path.spin(point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.6), 0.0, 0.0);
        path.pose([pose[0] + point.between(-8.0, 8.0), pose[1] + point.between(-8.0, 8.0)], angle, 0.5 * slide);
        path.slide(angle + 1.2, 0.5 * slide);
        path.lift();
        path.finish()
    }
}
