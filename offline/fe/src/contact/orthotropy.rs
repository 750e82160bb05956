//! Orthotropic friction: the strength across an axis of the skin differs from the strength along it.
//!
//! The limit of the traction is an ellipse. With e along and p across the axis, scaled slip `g^ = (g.e, r g.p)` and
//! traction `t^ = (t.e, t.p / r)` have the same power, and the law of `t^` over `g^` is the isotropic one. The plastic slip
//! is therefore normal to the ellipse, friction never yields work, and the tangent stays symmetric. The stiffness of the
//! elastic slip across the axis is r² of that along it, and its limit there is `gamma_crit / r`.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::contour::Facet;
use super::{FrictionLaw, Sliding, Spot};

/// Constants of orthotropic friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthotropy {
    /// Strength across the axis over the strength along it, > 0.
    pub across_over_along: f64,
    /// Angle of the axis from x towards y in the undeformed finger, degrees.
    pub skin_axis_deg: f64,
}

/// The axis of the deformed skin at a node, in the tangent plane of the rigid body there.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkinAxis {
    ratio: f64,
    /// Unit vector across the axis, body's frame.
    pub across: Vector3<f64>,
    /// The same along the two tangents.
    across_tangents: Vector2<f64>,
    /// Change of the axis' angle, rad, per change of the skin's line element and per change of the body's normal.
    per_element: Vector3<f64>,
    per_normal: Vector3<f64>,
}

/// Line element of the skin along an axis of the undeformed finger: corners of the faces around a node, with their weights for the
/// axes x and y.
pub(super) type LineElement = Vec<(usize, Vector2<f64>)>;

/// Line elements at all nodes of a surface with these `undeformed` positions.
pub(super) fn line_elements(facets: &[Facet], undeformed: &[Vector3<f64>]) -> Vec<LineElement> {
    let mut elements = vec![LineElement::new(); undeformed.len()];
    for facet in facets {
        let corners = facet.corners();
        for (k, &node) in corners.iter().enumerate() {
            let sides = [1, corners.len() - 1].map(|step| corners[(k + step) % corners.len()]);
            let [first, second] = sides.map(|n| undeformed[n] - undeformed[node]);
            let gram = Matrix2::new(first.dot(&first), first.dot(&second), first.dot(&second), second.dot(&second));
            let Some(inverse) = gram.try_inverse() else { continue };
            let area = first.cross(&second).norm();
            let [of_first, of_second] =
                [0, 1].map(|side| (inverse[(side, 0)] * first.xy() + inverse[(side, 1)] * second.xy()) * area);
            let element = &mut elements[node];
            for (by, weight) in [(sides[0], of_first), (sides[1], of_second), (node, -of_first - of_second)] {
                match element.iter_mut().find(|(n, _)| *n == by) {
                    Some((_, sum)) => *sum += weight,
                    None => element.push((by, weight)),
                }
            }
        }
    }
    elements
}

impl Orthotropy {
    /// Weight of a corner in the line element along the axis.
    pub(super) fn weight(&self, weight: &Vector2<f64>) -> f64 {
        let (sin, cos) = self.skin_axis_deg.to_radians().sin_cos();
        weight.dot(&Vector2::new(cos, sin))
    }

    /// The axis at a node at `spots[node]`; none where the skin's line element has no part along the body.
    pub(super) fn axis(&self, element: &LineElement, node: usize, spots: &[Spot]) -> Option<SkinAxis> {
        let Spot { normal, .. } = spots[node];
        let place = |n: usize| spots[n].at_gap(spots[n].gap_mm);
        let line: Vector3<f64> = element.iter().map(|(n, weight)| place(*n) * self.weight(weight)).sum();
        let off = normal.dot(&line);
        let along = line - normal * off;
        let length = along.norm();
        if !(length > 1e-9 * line.norm()) {
            return None;
        }
        let across = normal.cross(&along) / length;
        let across_tangents = Vector2::from(spots[node].tangents().map(|t| t.dot(&across)));
        let per_element = across / length;
        let ratio = self.across_over_along;
        Some(SkinAxis { ratio, across, across_tangents, per_element, per_normal: per_element * -off })
    }
}

impl SkinAxis {
    /// Change of the axis' angle with the places of the nodes of its line element, rad/mm; `bend` is the derivative of the normal over
    /// the place of the node itself.
    pub fn turns<'a>(
        &'a self,
        law: Orthotropy,
        element: &'a LineElement,
        node: usize,
        spot: &'a Spot,
    ) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'a {
        let with_normal = (node, spot.bend.transpose() * self.per_normal);
        let others = element.iter().map(move |(n, weight)| (*n, self.per_element * law.weight(weight)));
        others.chain([with_normal])
    }

    /// A vector with its part across the axis times `factor`.
    fn scaled(&self, v: &Vector3<f64>, factor: f64) -> Vector3<f64> {
        v + self.across * (self.across.dot(v) * (factor - 1.0))
    }

    /// Friction of a node over its strength along the axis, and the direction of a slip, in the scaled space.
    pub fn scaled_use(&self, used: &Vector3<f64>, direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let direction = self.scaled(direction, self.ratio);
        [self.scaled(used, 1.0 / self.ratio), direction.try_normalize(0.0).unwrap_or(direction)]
    }

    /// As [`FrictionLaw::return_map`] and [`Sliding::turned`], with the derivative over the axis' angle.
    pub fn return_map(
        &self,
        law: &dyn FrictionLaw,
        trial_mm: [f64; 2],
        pressure_mpa: f64,
        force_stick: bool,
        turn_rad: f64,
    ) -> Sliding {
        let p = self.across_tangents;
        let scale = |factor: f64| Matrix2::identity() + p * p.transpose() * (factor - 1.0);
        let (to_scaled, from_scaled) = (scale(self.ratio), scale(1.0 / self.ratio));
        let trial = Vector2::from(trial_mm);
        let scaled = to_scaled * trial;
        // A turn of the slip is another one in the scaled space.
        let (square, scaled_square) = (trial.norm_squared(), scaled.norm_squared());
        let share = if scaled_square > 0.0 { self.ratio * square / scaled_square } else { 1.0 };
        let at = law.return_map(scaled.into(), pressure_mpa, force_stick).turned(scaled.into(), turn_rad * share);
        let back = |v: [f64; 2]| to_scaled * Vector2::from(v);
        let traction = back(at.traction);
        let [[xx, xy], [yx, yy]] = at.by_slip;
        let mut by_slip = to_scaled * Matrix2::new(xx, xy, yx, yy) * to_scaled;
        let by_share = back(at.by_turn) * turn_rad;
        if scaled_square > 0.0 {
            let share_change = (trial * self.ratio - to_scaled * scaled * share) * (2.0 / scaled_square);
            by_slip += by_share * share_change.transpose();
        }
        let quarter = |v: Vector2<f64>| Vector2::new(-v.y, v.x);
        Sliding {
            traction: traction.into(),
            // Without rounding where the slip is elastic.
            elastic_slip: if at.stuck { trial_mm } else { (from_scaled * Vector2::from(at.elastic_slip)).into() },
            by_slip: [[by_slip[(0, 0)], by_slip[(0, 1)]], [by_slip[(1, 0)], by_slip[(1, 1)]]],
            by_pressure: back(at.by_pressure).into(),
            by_turn: (back(at.by_turn) * share).into(),
            // Slip and axis that turn together turn the traction with them.
            by_axis: (quarter(traction) - by_slip * quarter(trial)).into(),
            ..at
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{RigidBody, RubberFriction};

    /// The axis on a sphere, of skin that lies askew on it, turns with the corners as its derivatives say, and so does the traction with
    /// slip, pressure, turn and axis.
    #[test]
    fn derivatives_of_axis_and_traction_match_their_differences() {
        let undeformed = [[0.0, 0.0], [1.0, 0.1], [1.1, 1.0], [-0.1, 0.9]].map(|[x, y]| Vector3::new(x, y, 0.2 * x));
        let element = &line_elements(&[Facet::Quad([0, 1, 2, 3])], &undeformed)[0];
        let orthotropy = Orthotropy { across_over_along: 0.5, skin_axis_deg: 25.0 };
        let body = RigidBody::Sphere { radius_mm: 3.0 };
        let place = undeformed.map(|x| 1.2 * x + Vector3::new(0.3 * x.y, -0.2 * x.x, 0.4 * x.x * x.y + 0.1));
        let at = |place: &[Vector3<f64>]| {
            let spots: Vec<Spot> = place.iter().map(|y| body.spot(y)).collect();
            (orthotropy.axis(element, 0, &spots).unwrap(), spots)
        };
        let (axis, spots) = at(&place);
        let along = axis.across.cross(&spots[0].normal);
        let turns: Vec<_> = axis.turns(orthotropy, element, 0, &spots[0]).collect();
        for (node, k) in (0..4).flat_map(|node| [(node, 0), (node, 1), (node, 2)]) {
            let moved = |h: f64| {
                let mut place = place;
                place[node][k] += h;
                at(&place).0.across
            };
            let numeric = -along.dot(&(moved(1e-6) - moved(-1e-6))) / 2e-6;
            let exact: f64 = turns.iter().filter(|(by, _)| *by == node).map(|(_, turn)| turn[k]).sum();
            assert!((numeric - exact).abs() < 1e-8, "node {node}, coordinate {k}: {numeric} {exact}");
        }

        let law = RubberFriction::default();
        for (trial, turn) in [([0.002, -0.001], 0.3), ([0.02, 0.07], 0.3), ([0.012, 0.004], -0.3)] {
            // Trial slip, pressure, turn and angle of the axis.
            let of = |[x, y, pressure, turn, angle]: [f64; 5]| {
                let across_tangents = Vector2::new(-angle.sin(), angle.cos());
                SkinAxis { across_tangents, ..axis }.return_map(&law, [x, y], pressure, false, turn)
            };
            let here = [trial[0], trial[1], 0.004, turn, 0.7];
            let Sliding { by_slip, by_pressure, by_turn, by_axis, .. } = of(here);
            let exact = [by_slip.map(|row| row[0]), by_slip.map(|row| row[1]), by_pressure, by_turn, by_axis];
            for (k, exact) in exact.into_iter().enumerate() {
                let moved = |h: f64| {
                    let mut there = here;
                    there[k] += h;
                    of(there).traction
                };
                let (up, down) = (moved(1e-8), moved(-1e-8));
                for i in 0..2 {
                    let numeric = (up[i] - down[i]) / 2e-8;
                    assert!(
                        (numeric - exact[i]).abs() < 1e-6,
                        "{trial:?} {turn}, argument {k}: {numeric} {}",
                        exact[i]
                    );
                }
            }
        }
    }
}
