//! Parts of the contact area that surface nodes stand for, and how they change with the nodes' places.

use nalgebra::{Vector2, Vector3};

use super::contour::Facet;
use super::{ContactState, Plane, Surface};

/// Share of the largest nominal pressure at a face's corners from which on a corner takes its whole part of the face's
/// contact area; below, its part goes over to the others, so that no part jumps when a node opens.
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

/// Derivative of the part of the area of one node over the place of another, mm²/mm, plane's frame.
pub(super) struct PartChange {
    /// Surface node whose part it is.
    pub node: usize,
    /// Surface node that moves; the same at times.
    pub by: usize,
    /// Derivative.
    pub gradient: Vector3<f64>,
}

/// A face with the places and levels of its corners.
struct Corners {
    place: Vec<Vector2<f64>>,
    level: Vec<f64>,
}

impl Corners {
    fn of(facet: &Facet, place: &[Vector3<f64>], level: &[f64]) -> Self {
        Self { place: corner_places(facet, place), level: corner_values(facet, level) }
    }

    /// What the contour encloses of the face, shared among the corners that touch.
    fn parts(&self, facet: &Facet) -> [f64; 4] {
        let shares = facet.shares(&self.place, &self.level);
        let highest = self.level.iter().copied().fold(0.0, f64::max);
        let mut parts = [0.0; 4];
        if highest > 0.0 {
            for ((part, share), level) in parts.iter_mut().zip(shares).zip(&self.level) {
                *part = share * (level / (WHOLLY_BEARING * highest)).clamp(0.0, 1.0);
            }
            let (enclosed, borne): (f64, f64) = (shares.iter().sum(), parts.iter().sum());
            parts.iter_mut().for_each(|part| *part *= if borne > 0.0 { enclosed / borne } else { 0.0 });
        }
        parts
    }

    /// Half the difference of the parts between two values of one number, a step to either side of it.
    fn change(&mut self, facet: &Facet, step: f64, number: impl Fn(&mut Self) -> &mut f64) -> [f64; 4] {
        let at = *number(self);
        *number(self) = at + step;
        let up = self.parts(facet);
        *number(self) = at - step;
        let down = self.parts(facet);
        *number(self) = at;
        std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * step))
    }
}

impl Surface {
    /// Part of the contact area of each node at these positions, mm²; `last` holds the multipliers.
    pub fn areas(&self, last: &ContactState, position: &[Vector3<f64>], plane: &Plane) -> Vec<f64> {
        let frame = self.frame(plane);
        let place: Vec<Vector3<f64>> = position.iter().map(|x| frame.to_plane(x)).collect();
        self.areas_at(last, &place)
    }

    /// The same at places in the plane's frame.
    pub(super) fn areas_at(&self, last: &ContactState, place: &[Vector3<f64>]) -> Vec<f64> {
        let level = self.level_at(last, place);
        let mut parts = vec![0.0; self.nodes.len()];
        for facet in self.touching_facets(&level) {
            let of_face = Corners::of(facet, place, &level).parts(facet);
            for (&n, part) in facet.corners().iter().zip(of_face) {
                parts[n] += part;
            }
        }
        parts
    }

    /// Derivatives of [`Self::areas_at`] over the places, by differences.
    pub(super) fn area_changes(&self, last: &ContactState, place: &[Vector3<f64>]) -> Vec<PartChange> {
        let level = self.level_at(last, place);
        let mut changes = Vec::new();
        for facet in self.touching_facets(&level) {
            let mut face = Corners::of(facet, place, &level);
            let corners = facet.corners();
            let size = (face.place[1] - face.place[0]).norm();
            let highest = face.level.iter().fold(0.0, |a: f64, l| a.max(l.abs()));
            for (c, &by) in corners.iter().enumerate() {
                let along =
                    |face: &mut Corners, k: usize| face.change(facet, PLACE_STEP * size, |f| &mut f.place[c][k]);
                let (by_x, by_y) = (along(&mut face, 0), along(&mut face, 1));
                let by_level = face.change(facet, LEVEL_STEP * highest, |f| &mut f.level[c]);
                let slope = self.level_slope(by, level[by]);
                changes.extend(corners.iter().enumerate().map(|(k, &node)| PartChange {
                    node,
                    by,
                    gradient: Vector3::new(by_x[k], by_y[k], by_level[k] * slope),
                }));
            }
        }
        changes
    }

    fn level_at(&self, last: &ContactState, place: &[Vector3<f64>]) -> Vec<f64> {
        let force: Vec<f64> = place.iter().enumerate().map(|(n, y)| self.normal_force(n, y.z, last)).collect();
        self.contact_level(place, &force)
    }

    /// Faces of which a corner touches.
    fn touching_facets<'s>(&'s self, level: &'s [f64]) -> impl Iterator<Item = &'s Facet> {
        self.facets.iter().filter(|facet| facet.corners().iter().any(|&n| level[n] > 0.0))
    }

    /// The field whose zero contour is the edge of the contact, MPa.
    pub(super) fn contact_level(&self, place: &[Vector3<f64>], force: &[f64]) -> Vec<f64> {
        (0..place.len())
            .map(|n| {
                if force[n] > 0.0 { force[n] / self.reference_area[n] } else { -self.per_gap[n] * place[n].z.max(0.0) }
            })
            .collect()
    }

    /// Derivative of a node's level over its height, MPa/mm.
    fn level_slope(&self, node: usize, level: f64) -> f64 {
        if level > 0.0 { -self.penalty } else { -self.per_gap[node] }
    }

    /// Area of each face in which a field at the nodes is positive, mm².
    pub(super) fn face_areas(&self, place: &[Vector3<f64>], level: &[f64]) -> Vec<f64> {
        let area = |facet: &Facet| {
            let Corners { place, level } = Corners::of(facet, place, level);
            facet.shares(&place, &level).iter().sum()
        };
        self.facets.iter().map(area).collect()
    }

    /// Contact area of each face and area of the whole face, on the plane, mm².
    pub fn contact_areas(&self, state: &ContactState) -> Vec<[f64; 2]> {
        let force: Vec<f64> = state.nodes.iter().map(|n| n.normal_force_n).collect();
        let level = self.contact_level(&state.position, &force);
        let areas = |facet: &Facet| {
            let Corners { place, level } = Corners::of(facet, &state.position, &level);
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

fn corner_places(facet: &Facet, place: &[Vector3<f64>]) -> Vec<Vector2<f64>> {
    facet.corners().iter().map(|&n| place[n].xy()).collect()
}

fn corner_values(facet: &Facet, values: &[f64]) -> Vec<f64> {
    facet.corners().iter().map(|&n| values[n]).collect()
}
