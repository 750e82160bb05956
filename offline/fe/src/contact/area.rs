//! Parts of the contact area that belong to surface nodes, and their changes with the nodes' places.

use nalgebra::{Vector2, Vector3};

use super::contour::Facet;
use super::rigid::tangents;
use super::{ContactState, Plane, Spot, Surface};

/// Share of the largest nominal pressure at a face's corners above which a corner has its whole part of the face's
/// contact area. Below it, the part moves continuously to the other corners, so that no part jumps when a node opens.
const WHOLLY_BEARING: f64 = 0.25;

/// Shares of the size of a face and of its largest level over which differences of its parts are taken.
const PLACE_STEP: f64 = 1e-6;
const LEVEL_STEP: f64 = 1e-5;

/// How the nodes' parts of the contact area are had.
#[derive(Clone, Copy, Debug)]
pub enum Parts<'a> {
    /// Held at these values, mm².
    Held(&'a [f64]),
    /// Those of the positions: friction changes with them.
    Followed,
}

/// Derivative of the part of the area of one node over the place of another, mm²/mm, rigid body's frame.
pub(super) struct PartChange {
    /// Surface node whose part it is.
    pub node: usize,
    /// Surface node that moves; the same at times.
    pub by: usize,
    /// Derivative.
    pub gradient: Vector3<f64>,
}

/// A face with the places of its corners on the rigid body, laid flat, and their levels.
pub(super) struct Corners {
    place: Vec<Vector2<f64>>,
    level: Vec<f64>,
}

impl Corners {
    /// On a plane the places are those on it. On a curved body they are on the tangent plane at the middle of the face, as far
    /// from the middle as along an arc of the body.
    pub(super) fn of(facet: &Facet, spots: &[Spot], level: &[f64]) -> Self {
        let spot: Vec<Spot> = facet.corners().iter().map(|&n| spots[n]).collect();
        Self::at(&spot, facet.corners().iter().map(|&n| level[n]).collect())
    }

    /// The same of a face whose corners are at these spots.
    fn at(spots: &[Spot], level: Vec<f64>) -> Self {
        if spots.iter().all(|spot| spot.normal == Vector3::z()) {
            let place = spots.iter().map(|spot| spot.point.xy()).collect();
            return Self { place, level };
        }
        let share = 1.0 / spots.len() as f64;
        let normal = spots.iter().map(|spot| spot.normal).sum::<Vector3<f64>>().normalize();
        let middle = spots.iter().map(|spot| spot.point * share).sum::<Vector3<f64>>();
        let axes = tangents(&normal);
        let place = spots
            .iter()
            .map(|Spot { point, normal: there, .. }| {
                let arm = point - middle;
                let cos = there.dot(&normal).clamp(-1.0, 1.0);
                let sin = (1.0 - cos * cos).sqrt();
                let longer = if sin > 1e-6 { sin.atan2(cos) / sin } else { 1.0 };
                Vector2::new(axes[0].dot(&arm), axes[1].dot(&arm)) * longer
            })
            .collect();
        Self { place, level }
    }

    /// The part of the face inside the contour, shared among the corners that touch.
    fn parts(&self, facet: &Facet) -> [f64; 4] {
        let shares = facet.shares(&self.place, &self.level);
        let highest = self.level.iter().copied().fold(0.0, f64::max);
        let mut parts = [0.0; 4];
        if highest > 0.0 {
            for ((part, share), level) in parts.iter_mut().zip(shares).zip(&self.level) {
                *part = share * (level / (WHOLLY_BEARING * highest)).clamp(0.0, 1.0);
            }
            let (enclosed, assigned): (f64, f64) = (shares.iter().sum(), parts.iter().sum());
            parts.iter_mut().for_each(|part| *part *= if assigned > 0.0 { enclosed / assigned } else { 0.0 });
        }
        parts
    }

    /// Whether a part of the face has a negative area.
    pub(super) fn is_inside_out(&self, facet: &Facet) -> bool {
        facet.least_triangle_area(&self.place) < 0.0
    }

    /// The parts with the level of a corner moved.
    fn parts_at_level(&mut self, facet: &Facet, corner: usize, step: f64) -> [f64; 4] {
        let at = self.level[corner];
        self.level[corner] = at + step;
        let parts = self.parts(facet);
        self.level[corner] = at;
        parts
    }
}

/// Derivative from the values a step to either side.
fn difference(up: [f64; 4], down: [f64; 4], step: f64) -> [f64; 4] {
    std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * step))
}

impl Surface {
    /// Part of the contact area of each node at these positions, mm²; `last` holds the multipliers.
    pub fn areas(&self, last: &ContactState, position: &[Vector3<f64>], plane: &Plane) -> Vec<f64> {
        let frame = self.frame(plane);
        let spots: Vec<Spot> = position.iter().map(|x| self.body().spot(&frame.to_plane(x))).collect();
        self.areas_at(last, &spots)
    }

    /// The same at spots of the rigid body.
    pub(super) fn areas_at(&self, last: &ContactState, spots: &[Spot]) -> Vec<f64> {
        let level = self.level_at(last, spots);
        let mut parts = vec![0.0; self.nodes.len()];
        for facet in self.touching_facets(&level) {
            let of_face = Corners::of(facet, spots, &level).parts(facet);
            for (&n, part) in facet.corners().iter().zip(of_face) {
                parts[n] += part;
            }
        }
        parts
    }

    /// Derivatives of [`Self::areas_at`] over the places, by differences.
    pub(super) fn area_changes(&self, last: &ContactState, spots: &[Spot]) -> Vec<PartChange> {
        let level = self.level_at(last, spots);
        let mut changes = Vec::new();
        for facet in self.touching_facets(&level) {
            let corners = facet.corners();
            let mut spot: Vec<Spot> = corners.iter().map(|&n| spots[n]).collect();
            let mut face = Corners::of(facet, spots, &level);
            let size = (face.place[1] - face.place[0]).norm();
            let highest = face.level.iter().fold(0.0, |a: f64, l| a.max(l.abs()));
            for (c, &by) in corners.iter().enumerate() {
                let step = PLACE_STEP * size;
                let mut moved = |by: f64, axis: &Vector3<f64>| {
                    spot[c] = spots[corners[c]].moved_along(&(axis * by));
                    let parts = Corners::at(&spot, face.level.clone()).parts(facet);
                    spot[c] = spots[corners[c]];
                    parts
                };
                let axes = spots[by].tangents();
                let [by_x, by_y] = axes.map(|axis| difference(moved(step, &axis), moved(-step, &axis), step));
                let step = LEVEL_STEP * highest;
                let by_level =
                    difference(face.parts_at_level(facet, c, step), face.parts_at_level(facet, c, -step), step);
                let slope = self.level_slope(by, level[by]);
                let normal = spots[by].normal;
                changes.extend(corners.iter().enumerate().map(|(k, &node)| PartChange {
                    node,
                    by,
                    gradient: axes[0] * by_x[k] + axes[1] * by_y[k] + normal * (by_level[k] * slope),
                }));
            }
        }
        changes
    }

    fn level_at(&self, last: &ContactState, spots: &[Spot]) -> Vec<f64> {
        let force: Vec<f64> = spots.iter().enumerate().map(|(n, at)| self.normal_force(n, at.gap_mm, last)).collect();
        self.contact_level(spots, &force)
    }

    /// Faces of which a corner touches.
    fn touching_facets<'s>(&'s self, level: &'s [f64]) -> impl Iterator<Item = &'s Facet> {
        self.facets.iter().filter(|facet| facet.corners().iter().any(|&n| level[n] > 0.0))
    }

    /// The field whose zero contour is the edge of the contact, MPa.
    pub(super) fn contact_level(&self, spots: &[Spot], force: &[f64]) -> Vec<f64> {
        let level = |n: usize| {
            if force[n] > 0.0 { force[n] / self.reference_area[n] } else { -self.per_gap(n) * spots[n].gap_mm.max(0.0) }
        };
        (0..spots.len()).map(level).collect()
    }

    /// Derivative of a node's level over its gap, MPa/mm.
    fn level_slope(&self, node: usize, level: f64) -> f64 {
        if level > 0.0 { -self.penalty } else { -self.per_gap(node) }
    }

    /// Area of each face in which a field at the nodes is positive, mm².
    pub(super) fn face_areas(&self, spots: &[Spot], level: &[f64]) -> Vec<f64> {
        let area = |facet: &Facet| {
            let Corners { place, level, .. } = Corners::of(facet, spots, level);
            facet.shares(&place, &level).iter().sum()
        };
        self.facets.iter().map(area).collect()
    }

    /// Contact area of each face and area of the whole face, on the rigid body, mm².
    pub fn contact_areas(&self, state: &ContactState) -> Vec<[f64; 2]> {
        let force: Vec<f64> = state.nodes.iter().map(|n| n.normal_force_n).collect();
        let spots = self.spots(&state.position);
        let level = self.contact_level(&spots, &force);
        let areas = |facet: &Facet| {
            let Corners { place, level, .. } = Corners::of(facet, &spots, &level);
            let whole = facet.shares(&place, &[1.0; 4][..level.len()]).iter().sum();
            [facet.shares(&place, &level).iter().sum(), whole]
        };
        self.facets.iter().map(areas).collect()
    }
}

/// Integrals of the corners' shape functions over a face of the reference surface, mm².
pub(super) fn reference_shares(facet: &Facet, undeformed: &[Vector3<f64>]) -> [f64; 4] {
    let x: Vec<Vector3<f64>> = facet.corners().iter().map(|&n| undeformed[n]).collect();
    let area = |a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>| 0.5 * (b - a).cross(&(c - a)).norm();
    let mut shares = [0.0; 4];
    if let Facet::Triangle(_) = facet {
        shares[..3].fill(area(x[0], x[1], x[2]) / 3.0);
        return shares;
    }
    let centre = (x[0] + x[1] + x[2] + x[3]) * 0.25;
    for k in 0..4 {
        let next = (k + 1) % 4;
        let third = area(x[k], x[next], centre) / 3.0;
        shares[k] += third;
        shares[next] += third;
        for share in &mut shares {
            *share += 0.25 * third;
        }
    }
    shares
}
