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
            elastic_slip: (from_scaled * Vector2::from(at.elastic_slip)).into(),
            by_slip: [[by_slip[(0, 0)], by_slip[(0, 1)]], [by_slip[(1, 0)], by_slip[(1, 1)]]],
            by_pressure: back(at.by_pressure).into(),
            by_turn: (back(at.by_turn) * share).into(),
            // Slip and axis that turn together turn the traction with them.
            by_axis: (quarter(traction) - by_slip * quarter(trial)).into(),
            ..at
        }
    }
}
