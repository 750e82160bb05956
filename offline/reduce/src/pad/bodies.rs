//! The rigid bodies of the finite elements that a pad supports.

use fingerpad::Elementary;
use fingerpad::pad::{Body, Cylinder, Edge, Sphere};
use fingerpad_fe::contact::RigidBody;

/// The same body for a pad; None for grooves, height fields and radii that a pad does not support.
///
/// * `near`: rounds to the pad's precision
pub fn body_of<T: Elementary>(body: &RigidBody, near: impl Fn(f64) -> T) -> Option<Body<T>> {
    // An axis has the same direction after half a turn.
    let axis = |deg: f64| near((deg + 90.0).rem_euclid(180.0) - 90.0);
    match *body {
        RigidBody::Plane => Some(Body::Plane),
        RigidBody::Sphere { radius_mm } => Sphere::new(near(radius_mm)).ok().map(Body::Sphere),
        RigidBody::Cylinder { radius_mm, axis_deg } => {
            Cylinder::new(near(radius_mm), axis(axis_deg)).ok().map(Body::Cylinder)
        }
        RigidBody::Edge { radius_mm, axis_deg, angle_deg } => {
            Edge::new(near(radius_mm), axis(axis_deg), near(angle_deg)).ok().map(Body::Edge)
        }
        RigidBody::Groove { .. } | RigidBody::Heights(_) => None,
    }
}
