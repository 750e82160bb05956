//! Whether the faces of the surface follow the rigid body that they touch.

use super::area::Corners;
use super::{ContactState, RigidBody, Surface};

/// A face that touches, against the curvature of the body there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sharpness {
    /// Size of the face: the root of its area, mm.
    pub face_mm: f64,
    /// Least radius of curvature of the body at its touching corners, mm.
    pub radius_mm: f64,
    /// Whether the face is inside out on the body: the middle of the body's curvature has passed through it.
    pub is_inside_out: bool,
}

/// One less the cosine between normals that are the same.
const SAME_NORMAL: f64 = 1e-9;

impl Surface {
    /// Of the touching face that is largest against the body's radius, or of one that is inside out; None on flat bodies and
    /// without contact.
    pub fn sharpest_contact(&self, state: &ContactState) -> Option<Sharpness> {
        if self.body().is_plane() {
            return None;
        }
        let spots = self.spots(&state.position);
        let touches = |n: &usize| state.nodes[*n].normal_force_n > 0.0;
        let of_face = |corners: &[usize]| {
            let at = |k: usize| state.position[corners[k]];
            let half = |a, b, c| 0.5 * (at(b) - at(a)).cross(&(at(c) - at(a))).norm();
            let area = half(0, 1, 2) + if corners.len() > 3 { half(0, 2, 3) } else { 0.0 };
            let curvatures = corners.iter().filter(|n| touches(n)).map(|&n| spots[n].most_curvature());
            let radius_mm = 1.0 / curvatures.fold(0.0, f64::max);
            // The rounding of an edge may lie between the corners.
            let bends = |n: &usize| spots[*n].normal.dot(&spots[corners[0]].normal) < 1.0 - SAME_NORMAL;
            let is_over_edge = matches!(self.body(), RigidBody::Edge { .. }) && corners.iter().any(bends);
            (area.sqrt(), if is_over_edge { self.body().least_radius_mm() } else { radius_mm })
        };
        let faces = self.facets.iter().filter(|facet| facet.corners().iter().any(&touches));
        let all = faces.map(|facet| {
            let (face_mm, radius_mm) = of_face(facet.corners());
            let is_inside_out = Corners::of(facet, &spots, &vec![1.0; spots.len()]).is_inside_out(facet);
            Sharpness { face_mm, radius_mm, is_inside_out }
        });
        let rank = |s: &Sharpness| (s.is_inside_out, s.face_mm / s.radius_mm);
        all.max_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal))
            .filter(|s| s.is_inside_out || s.radius_mm.is_finite())
    }

    /// Whether a point in contact lies beyond the grid of a height field.
    pub fn leaves_heights(&self, state: &ContactState) -> bool {
        let RigidBody::Heights(field) = self.body() else { return false };
        let mut touching = state.nodes.iter().zip(&state.point).filter(|(node, _)| node.normal_force_n > 0.0);
        touching.any(|(_, point)| !field.covers(point.x, point.y))
    }
}
