//! Rigid bodies that a pad touches.
//!
//! Main trait: [`Surface`]. In the body's frame z points out of it at its apex, which is the origin; the material is below.

use nalgebra::Vector3;

use crate::Error;
use crate::error::Field;
use crate::math::{Elementary, Scalar};
use crate::tuning::Units;

/// The surface of a rigid body.
///
/// The overlap must be a differentiable function of the place, and the gradient must be exact. Forces follow from both; a contact with
/// an inexact gradient yields work.
pub trait Surface<T> {
    /// Distance of a place below the surface, mm (negative outside), and its gradient: a unit vector into the body.
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>);
    /// Height of the surface over a place of the tangent plane at the apex, mm.
    fn height(&self, place: [T; 2]) -> T;
    /// Whether the surface is a plane, so that its origin may be moved along it.
    fn is_plane(&self) -> bool {
        false
    }
    /// The body with the least radius that patches can see, if its own is smaller. A body without a radius is left as it is.
    fn blunted(&self, _least: LeastRadii<T>) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Least radii of convex bodies that the patches of a pad can see, mm: a sharper body would dig in between them. See
/// [`super::Pad::least_radii_mm`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LeastRadii<T = f32> {
    /// Of a sphere.
    pub sphere_mm: T,
    /// Of a cylinder.
    pub cylinder_mm: T,
    /// Of the rounding of an edge.
    pub edge_mm: T,
}

/// `least` for a radius between 0 and it.
fn too_small<T: Scalar>(radius: T, least: T) -> Option<T> {
    (radius > T::of(0.0) && radius < least).then_some(least)
}

/// The plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plane;

impl<T: Scalar> Surface<T> for Plane {
    #[inline(always)]
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        (-place.z, Vector3::new(T::of(0.0), T::of(0.0), T::of(-1.0)))
    }
    #[inline(always)]
    fn height(&self, _: [T; 2]) -> T {
        T::of(0.0)
    }
    #[inline(always)]
    fn is_plane(&self) -> bool {
        true
    }
}

/// Least and largest magnitude of a radius, mm.
const RADIUS_MM: [f32; 2] = [0.1, 1e6];
/// Largest magnitude of the direction of an axis, degrees.
const AXIS_DEG: f32 = 180.0;
/// Least and largest angle between the faces of an edge, degrees.
const ANGLE_DEG: [f32; 2] = [1.0, 179.0];

/// Whether a number that is not negative is in its range.
fn check<T: Scalar>(what: Field, value: T, [least, most]: [f32; 2]) -> Result<(), Error> {
    if value.is_between(least, most) { Ok(()) } else { Err(Error::Range { what, index: 0, value: value.to_f32() }) }
}

/// A sphere; a bowl with a negative radius.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sphere<T = f32> {
    pub(crate) radius_mm: T,
}

impl<T: Scalar> Sphere<T> {
    /// A sphere with a radius of 0.1 to 1e6 mm; negative for a bowl.
    ///
    /// # Errors
    /// [`Error::Range`] for another radius.
    pub fn new(radius_mm: T) -> Result<Self, Error> {
        check(Field::Radius, radius_mm.magnitude(), RADIUS_MM)?;
        Ok(Self { radius_mm })
    }
}

impl<T: Scalar> Surface<T> for Sphere<T> {
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        let [x, y, z] = (*place).into();
        let arm = Vector3::new(x, y, z + self.radius_mm);
        let distance = length([x, y], z + self.radius_mm);
        let (side, radius) = (side(self.radius_mm), self.radius_mm.magnitude());
        let over = x * x + y * y + z * (z + T::of(2.0) * self.radius_mm);
        let inward = -side / distance;
        (-side * over / (distance + radius), arm * inward)
    }
    fn height(&self, [x, y]: [T; 2]) -> T {
        arc(self.radius_mm, x * x + y * y)
    }
    fn blunted(&self, least: LeastRadii<T>) -> Option<Self> {
        too_small(self.radius_mm, least.sphere_mm).map(|radius_mm| Self { radius_mm })
    }
}

/// A circular cylinder along the tangent plane; a trough with a negative radius.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Cylinder<T = f32> {
    pub(crate) radius_mm: T,
    /// Direction of its axis in the tangent plane: cosine and sine of its angle from x.
    pub(crate) axis: [T; 2],
}

impl<T: Elementary> Cylinder<T> {
    /// A cylinder with a radius of 0.1 to 1e6 mm, negative for a trough, whose axis points `axis_deg` degrees from x towards y, within ±180.
    ///
    /// # Errors
    /// [`Error::Range`] for other numbers.
    pub fn new(radius_mm: T, axis_deg: T) -> Result<Self, Error> {
        check(Field::Radius, radius_mm.magnitude(), RADIUS_MM)?;
        check(Field::Axis, axis_deg.magnitude(), [0.0, AXIS_DEG])?;
        Ok(Self { radius_mm, axis: direction(axis_deg) })
    }
}

impl<T: Scalar> Surface<T> for Cylinder<T> {
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        let [cos, sin] = self.axis;
        let (u, z) = (cos * place[1] - sin * place[0], place[2]);
        let distance = length([u, T::of(0.0)], z + self.radius_mm);
        let (side, radius) = (side(self.radius_mm), self.radius_mm.magnitude());
        let over = u * u + z * (z + T::of(2.0) * self.radius_mm);
        let inward = -side / distance;
        let across = u * inward;
        let slope = Vector3::new(-sin * across, cos * across, (z + self.radius_mm) * inward);
        (-side * over / (distance + radius), slope)
    }
    fn height(&self, [x, y]: [T; 2]) -> T {
        let u = self.axis[0] * y - self.axis[1] * x;
        arc(self.radius_mm, u * u)
    }
    fn blunted(&self, least: LeastRadii<T>) -> Option<Self> {
        too_small(self.radius_mm, least.cylinder_mm).map(|radius_mm| Self { radius_mm, ..*self })
    }
}

/// Two plane faces that meet in a rounded edge, which points at the finger.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Edge<T = f32> {
    /// Radius of the rounding, mm.
    pub(crate) radius_mm: T,
    /// Direction of the edge in the tangent plane: cosine and sine of its angle from x.
    pub(crate) axis: [T; 2],
    /// Slope of the faces against the tangent plane: cosine and sine of an angle above 0 and below 90 degrees.
    pub(crate) face: [T; 2],
}

impl<T: Elementary> Edge<T> {
    /// An edge that is rounded with a radius of 0.1 to 1e6 mm and points `axis_deg` degrees from x towards y, within ±180.
    ///
    /// * `angle_deg`: angle between the faces inside the body, 1 to 179
    ///
    /// # Errors
    /// [`Error::Range`] for other numbers.
    pub fn new(radius_mm: T, axis_deg: T, angle_deg: T) -> Result<Self, Error> {
        check(Field::Radius, radius_mm, RADIUS_MM)?;
        check(Field::Axis, axis_deg.magnitude(), [0.0, AXIS_DEG])?;
        check(Field::FaceAngle, angle_deg, ANGLE_DEG)?;
        Ok(Self { radius_mm, axis: direction(axis_deg), face: Self::slope(angle_deg) })
    }

    /// Cosine and sine of the slope of faces with an angle between them.
    pub(crate) fn slope(angle_deg: T) -> [T; 2] {
        direction(T::of(0.5) * (T::of(180.0) - angle_deg))
    }
}

/// Cosine and sine of an angle in degrees.
fn direction<T: Elementary>(deg: T) -> [T; 2] {
    // In this order 180 degrees are exactly half a turn in double precision too.
    let (sin, cos) = (deg / T::of(180.0) * T::half_turn()).sin_cos();
    [cos, sin]
}

/// A body that is chosen at run time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Body<T = f32> {
    /// A plane.
    Plane,
    /// A sphere or a bowl.
    Sphere(Sphere<T>),
    /// A cylinder or a trough.
    Cylinder(Cylinder<T>),
    /// An edge.
    Edge(Edge<T>),
}

impl<T: Scalar> Surface<T> for Body<T> {
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        match self {
            Self::Plane => Plane.overlap(place),
            Self::Sphere(body) => body.overlap(place),
            Self::Cylinder(body) => body.overlap(place),
            Self::Edge(body) => body.overlap(place),
        }
    }
    fn height(&self, place: [T; 2]) -> T {
        match self {
            Self::Plane => Plane.height(place),
            Self::Sphere(body) => body.height(place),
            Self::Cylinder(body) => body.height(place),
            Self::Edge(body) => body.height(place),
        }
    }
    fn is_plane(&self) -> bool {
        matches!(self, Self::Plane)
    }
    fn blunted(&self, least: LeastRadii<T>) -> Option<Self> {
        match self {
            Self::Plane => None,
            Self::Sphere(body) => body.blunted(least).map(Self::Sphere),
            Self::Cylinder(body) => body.blunted(least).map(Self::Cylinder),
            Self::Edge(body) => body.blunted(least).map(Self::Edge),
        }
    }
}

impl<T: Scalar> Surface<T> for Edge<T> {
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        let [cos, sin] = self.axis;
        let [face_cos, face_sin] = self.face;
        let (u, up) = (cos * place[1] - sin * place[0], place[2] + self.radius_mm);
        let far = u.magnitude();
        // The place is beside the rounding where its direction from the rounding's centre is steeper than the normal of the face.
        let on_arc = up > T::of(0.0) && far * face_cos <= up * face_sin;
        let (overlap, out) = if on_arc {
            let distance = length([u, T::of(0.0)], up);
            let z = place[2];
            let over = u * u + z * (z + T::of(2.0) * self.radius_mm);
            (-over / (distance + self.radius_mm), [u / distance, up / distance])
        } else {
            let to_side = if u < T::of(0.0) { -face_sin } else { face_sin };
            (self.radius_mm - far * face_sin - up * face_cos, [to_side, face_cos])
        };
        (overlap, Vector3::new(sin * out[0], -cos * out[0], -out[1]))
    }
    fn height(&self, [x, y]: [T; 2]) -> T {
        let u = (self.axis[0] * y - self.axis[1] * x).magnitude();
        let [cos, sin] = self.face;
        let end = self.radius_mm * sin;
        if u <= end {
            return arc(self.radius_mm, u * u);
        }
        -(self.radius_mm * (T::of(1.0) - cos) + (u - end) * sin / cos)
    }
    fn blunted(&self, least: LeastRadii<T>) -> Option<Self> {
        too_small(self.radius_mm, least.edge_mm).map(|radius_mm| Self { radius_mm, ..*self })
    }
}

/// Sign of a radius: 1 for a convex body, -1 for a concave one.
fn side<T: Scalar>(radius: T) -> T {
    if radius < T::of(0.0) { T::of(-1.0) } else { T::of(1.0) }
}

/// Length of a vector, never 0.
fn length<T: Scalar>([x, y]: [T; 2], z: T) -> T {
    (x * x + y * y + z * z + T::of(f32::MIN_POSITIVE)).magnitude().sqrt()
}

/// Height of a circle through the origin whose centre lies at -radius, from the square of the distance from its apex.
fn arc<T: Scalar>(radius: T, square: T) -> T {
    let rest = (radius * radius - square).not_negative().magnitude().sqrt();
    -side(radius) * square / (radius.magnitude() + rest)
}

/// Quadrature points of a patch on a curved body, relative to its middle: these three and their negatives, body's axes, mm.
pub(crate) type Sides<T> = [Vector3<T>; 3];

/// Variation of the overlap within a patch.
#[derive(Clone, Copy)]
pub(crate) struct Spread<T> {
    /// Mean moment of the gradients of the overlap about the middle of the patch, mm.
    pub moment: Vector3<T>,
    /// Variance of the overlap, mm².
    pub variance: T,
    /// Gradient of half the variance, mm.
    pub variance_slope: Vector3<T>,
    /// Derivative of half the variance over a rotation about the middle, mm².
    pub variance_moment: Vector3<T>,
}

/// Mean overlap of a patch at a place, mm, and its gradient.
///
/// On a plane this is the overlap of the middle. On a curved body it is the mean over the quadrature points.
#[inline(always)]
pub(crate) fn mean<T: Scalar>(body: &impl Surface<T>, place: &Vector3<T>, sides: &Sides<T>) -> (T, Vector3<T>) {
    if body.is_plane() {
        return body.overlap(place);
    }
    let sixth = T::of(1.0 / 6.0);
    let (mut overlap, mut slope) = (T::of(0.0), Vector3::zeros());
    for side in sides {
        for sign in [T::of(1.0), T::of(-1.0)] {
            let (o, s) = body.overlap(&(place + *side * sign));
            overlap += o * sixth;
            slope += s * sixth;
        }
    }
    (overlap, slope)
}

/// Variation of the overlap within a patch at a place.
pub(crate) fn spread<T: Scalar>(body: &impl Surface<T>, place: &Vector3<T>, sides: &Sides<T>) -> Spread<T> {
    let sixth = T::of(1.0 / 6.0);
    let (overlap, _) = mean(body, place, sides);
    let zero = Vector3::zeros();
    let mut out = Spread { moment: zero, variance: T::of(0.0), variance_slope: zero, variance_moment: zero };
    for side in sides {
        for sign in [T::of(1.0), T::of(-1.0)] {
            let arm = *side * sign;
            let (o, s) = body.overlap(&(place + arm));
            let off = o - overlap;
            out.variance += off * off * sixth;
            out.moment += arm.cross(&s) * sixth;
            out.variance_slope += s * (off * sixth);
            out.variance_moment += arm.cross(&s) * (off * sixth);
        }
    }
    out
}

/// Distance from the apex at which the slope of a body is taken, mm.
const BESIDE_MM: f32 = 2.0;

/// Mean slope of a body between its apex and four points around it; 0 for a plane.
pub(crate) fn steepness<T: Scalar>(body: &impl Surface<T>) -> T {
    if body.is_plane() {
        return T::of(0.0);
    }
    let mut sum = T::of(0.0);
    for place in [[BESIDE_MM, 0.0], [-BESIDE_MM, 0.0], [0.0, BESIDE_MM], [0.0, -BESIDE_MM]] {
        sum += body.height(place.map(T::of));
    }
    sum.magnitude() * T::of(0.25 / BESIDE_MM)
}

/// The point of the surface over a place of the tangent plane, mm.
#[inline(always)]
pub(crate) fn point<T: Scalar>(body: &impl Surface<T>, place: [T; 2]) -> Vector3<T> {
    Vector3::new(place[0], place[1], body.height(place))
}

/// A body in the units of the fitted finger, for a tuned pad.
pub(crate) struct InUnits<'a, B, T> {
    body: &'a B,
    length: T,
    per_length: T,
}

impl<'a, B, T: Scalar> InUnits<'a, B, T> {
    pub(crate) fn new(body: &'a B, units: &Units<T>) -> Self {
        Self { body, length: units.length, per_length: units.per_length }
    }
}

impl<T: Elementary, B: Surface<T>> Surface<T> for InUnits<'_, B, T> {
    #[inline(always)]
    fn overlap(&self, place: &Vector3<T>) -> (T, Vector3<T>) {
        let (overlap, slope) = self.body.overlap(&(*place * self.length));
        (overlap * self.per_length, slope)
    }
    fn height(&self, place: [T; 2]) -> T {
        self.body.height(place.map(|x| x * self.length)) * self.per_length
    }
    fn is_plane(&self) -> bool {
        self.body.is_plane()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bodies() -> [(&'static str, std::boxed::Box<dyn Surface<f64>>); 6] {
        [
            ("plane", std::boxed::Box::new(Plane)),
            ("sphere", std::boxed::Box::new(Sphere::new(5.0).unwrap())),
            ("bowl", std::boxed::Box::new(Sphere::new(-30.0).unwrap())),
            ("cylinder", std::boxed::Box::new(Cylinder::new(10.0, 37.0).unwrap())),
            ("trough", std::boxed::Box::new(Cylinder::new(-25.0, 37.0).unwrap())),
            ("edge", std::boxed::Box::new(Edge::new(0.5, 37.0, 106.0).unwrap())),
        ]
    }

    #[test]
    fn the_gradient_is_that_of_the_overlap_and_the_surface_has_none() {
        for (name, body) in bodies() {
            for place in [[0.3, -0.2, 0.1], [1.5, 0.7, -0.4], [-2.0, 1.0, -1.5], [0.0, 0.0, -0.1]] {
                let (_, gradient) = body.overlap(&place.into());
                let norm: f64 = gradient.iter().map(|g| g * g).sum();
                assert!((norm - 1.0).abs() < 1e-12, "{name}: {norm}");
                for k in 0..3 {
                    let moved = |by: f64| {
                        let mut at = place;
                        at[k] += by;
                        body.overlap(&at.into()).0
                    };
                    let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                    assert!((slope - gradient[k]).abs() < 1e-7, "{name} {place:?}: {slope} {}", gradient[k]);
                }
                let on = [place[0], place[1], body.height([place[0], place[1]])];
                assert!(body.overlap(&on.into()).0.abs() < 1e-12, "{name} {on:?}");
            }
        }
    }

    #[test]
    fn a_huge_sphere_is_a_plane_in_single_precision() {
        let (overlap, _) = Sphere::new(1e6_f32).unwrap().overlap(&Vector3::new(1.0, 2.0, -0.123));
        assert!((overlap - 0.123).abs() < 1e-5, "{overlap}");
    }
}
