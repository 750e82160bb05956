//! The faces of a shape, and how a finger stands against one.
//!
//! Main types: [`Face`], [`Site`], [`Stand`]. Uses shape. Lengths in mm, in the frame of the body.

use nalgebra::{Matrix3, Vector3};

use crate::math::{Elementary, Scalar};
use crate::pad::{Body, Cylinder, Edge, Sphere};

use super::shape::{BOX, CAPSULE, CYLINDER, EDGE, ELLIPSOID, PLANE, Shape};

/// Least cosine between the finger's normal and that of a face: 60 degrees. Beyond, the finger does not face it.
const FACING: f32 = 0.5;
/// The same of an edge of a box, 37 degrees: a finger that lies on a face does not come to the edge when it slides off.
const FACING_EDGE: f32 = 0.8;
/// About the radius of the fingertip's surface: how far the search for the apex of a round face goes ahead, mm.
const FINGER_RADIUS_MM: f32 = 20.0;
/// Largest depth below a face to which a finger may come within one step from above it, mm.
const HOVER_MM: f32 = 5.0;
/// Distance from which on a round shape is not looked at, mm.
const NEAR_MM: f32 = 30.0;
/// Most rounds of the search for an apex, and the changes of its direction that end it in double and in single precision.
const ROUNDS: usize = 60;
const SETTLED: [f32; 2] = [1e-9, 1e-6];
/// Number of the first edge of a box.
const FIRST_EDGE: u8 = 7;
/// Largest number of a face.
pub(super) const LAST_FACE: u32 = 18;

/// What the finger meets at a face, with its axis along `u`.
#[derive(Clone, Copy)]
enum Bent<R> {
    Plane,
    Sphere(R),
    Cylinder(R),
    Edge(R, R),
}

/// A face of a shape: u, v and the normal are right-handed.
pub(super) struct Face<R> {
    u: Vector3<R>,
    v: Vector3<R>,
    normal: Vector3<R>,
    /// Centre of curvature, and the distance from there along the normal to the apex.
    middle: Vector3<R>,
    offset: R,
    /// Half its extents along u and v, and the radius of its rim.
    half: [R; 2],
    rim: R,
    /// Depth of the middle of the shape below the face; of the far side of a round one.
    thickness: R,
    bent: Bent<R>,
}

/// A finger in the frame of the body: its place and its level axes as columns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub(super) struct Site<R> {
    pub at: Vector3<R>,
    pub axes: Matrix3<R>,
}

impl<R: Elementary> Site<R> {
    pub fn is_finite(&self) -> bool {
        let sum = self.at.iter().chain(self.axes.iter()).fold(R::of(0.0), |sum, x| sum + *x);
        sum * R::of(0.0) == R::of(0.0)
    }
}

/// How a finger stands against a face.
pub(super) struct Stand<R> {
    /// Place of the foot, the point of the tangent plane below the finger's origin, along u and v.
    pub foot: [R; 2],
    /// Height of the finger's origin over the tangent plane.
    pub height: R,
    /// Cosine and sine of the angle of the finger within the face.
    pub direction: [R; 2],
    /// Angles against the pose in which the finger lies level, rad: about its y axis (tip down), and about x before that.
    pub pitch: R,
    pub roll: R,
    /// The axes of the plane: along and across the finger, and the normal into it.
    pub axes: [Vector3<R>; 3],
}

fn unit<R: Scalar>(axis: u8, length: R) -> Vector3<R> {
    let at = |k| if axis % 3 == k { length } else { R::of(0.0) };
    Vector3::new(at(0), at(1), at(2))
}

fn component<R: Scalar>(v: &Vector3<R>, axis: u8) -> R {
    match axis % 3 {
        0 => v.x,
        1 => v.y,
        _ => v.z,
    }
}

/// The same direction with length 1, if it has one.
fn normalised<R: Scalar>(v: &Vector3<R>) -> Option<Vector3<R>> {
    let square = v.dot(v);
    (square > R::of(1e-24)).then(|| v * (R::of(1.0) / square.magnitude().sqrt()))
}

impl<R: Elementary> Face<R> {
    fn flat(axis: u8, side: R, offset: R) -> Self {
        let endless = R::of(f32::INFINITY);
        Self {
            u: unit(axis + 1, R::of(1.0)),
            v: unit(axis + 2, side),
            normal: unit(axis, side),
            middle: Vector3::zeros(),
            offset,
            half: [endless; 2],
            rim: endless,
            thickness: endless,
            bent: Bent::Plane,
        }
    }

    /// A sphere with an apex in a direction. Any axes across it will do, if they are always the same.
    fn round(radius: R, middle: Vector3<R>, apex: &Vector3<R>) -> Self {
        let least = u8::from(apex.x.magnitude() >= apex.y.magnitude());
        let other = if apex.z.magnitude() < component(apex, least).magnitude() { 2 } else { least };
        let u = normalised(&unit(other, R::of(1.0)).cross(apex)).unwrap_or_else(Vector3::x);
        Self {
            u,
            v: apex.cross(&u),
            normal: *apex,
            middle,
            thickness: radius + radius,
            bent: Bent::Sphere(radius),
            ..Self::flat(2, R::of(1.0), radius)
        }
    }

    /// An ellipsoid where its outward normal is `apex`: with the semi-axes a and the height h = |a n| of the tangent plane it touches at
    /// a² n / h, and the geometric mean of the radii of curvature is a b c / h².
    fn ellipsoid(axes: &Vector3<R>, apex: &Vector3<R>) -> Self {
        let squares = axes.component_mul(axes).component_mul(apex);
        let height = squares.dot(apex).magnitude().sqrt();
        let radius = axes.x * axes.y * axes.z / (height * height);
        let middle = squares * (R::of(1.0) / height) - apex * radius;
        Self { thickness: height, ..Self::round(radius, middle, apex) }
    }

    /// The side of a cylinder about z.
    fn side(radius: R, half_length: R, apex: &Vector3<R>) -> Self {
        let u = unit(2, R::of(1.0));
        Self {
            u,
            v: apex.cross(&u),
            normal: *apex,
            half: [half_length, R::of(f32::INFINITY)],
            thickness: radius + radius,
            bent: Bent::Cylinder(radius),
            ..Self::flat(2, R::of(1.0), radius)
        }
    }

    /// An edge of a box along an axis; `sides` are the signs of the faces that follow this axis in turn.
    fn box_edge(half: &Vector3<R>, radius: R, axis: u8, sides: [R; 2]) -> Self {
        let [a, b] = [axis + 1, axis + 2];
        let normal = (unit(a, sides[0]) + unit(b, sides[1])) * R::of(0.5).sqrt();
        let u = unit(axis, R::of(1.0));
        let inner = |axis, side| unit(axis, side * (component(half, axis) - radius));
        Self {
            u,
            v: normal.cross(&u),
            normal,
            middle: inner(a, sides[0]) + inner(b, sides[1]),
            half: [component(half, axis), R::of(f32::INFINITY)],
            thickness: component(half, a).at_most(component(half, b)),
            bent: Bent::Edge(radius, R::of(90.0)),
            ..Self::flat(2, R::of(1.0), radius)
        }
    }

    /// The face of a number, see [`super::FrameResponse::face`]; `apex` is the normal of a round one.
    fn of(shape: &Shape<R>, number: u8, apex: &Vector3<R>) -> Self {
        let one = R::of(1.0);
        let sign = |is_far: bool| if is_far { -one } else { one };
        let side = sign(number == 3);
        let [a, b, c, d] = shape.sizes;
        match shape.kind {
            PLANE => Self::flat(2, one, R::of(0.0)),
            ELLIPSOID => Self::ellipsoid(&Vector3::new(a, b, c), apex),
            CAPSULE | CYLINDER if number == 1 => Self::side(a, b, apex),
            CAPSULE => Self::round(a, unit(2, side * b), apex),
            CYLINDER => Self { rim: a, thickness: b, ..Self::flat(2, side, b) },
            EDGE => Self {
                u: unit(0, one),
                v: unit(1, one),
                middle: unit(2, -a),
                bent: Bent::Edge(a, b),
                ..Self::flat(2, one, a)
            },
            _ if number >= FIRST_EDGE => {
                let edge = number - FIRST_EDGE;
                Self::box_edge(&Vector3::new(a, b, c), d, edge / 4, [sign(edge & 1 != 0), sign(edge & 2 != 0)])
            }
            _ => {
                let axis = number.wrapping_sub(1) % 3;
                let half = Vector3::new(a, b, c);
                let [thickness, along, across] = [0, 1, 2].map(|k| component(&half, axis + k));
                Self { half: [along, across], thickness, ..Self::flat(axis, sign(number > 3), thickness) }
            }
        }
    }

    /// Whether the finger stands over the face, faces it, and is no deeper below it than `reach`.
    fn is_below(&self, site: &Site<R>, reach: R) -> bool {
        let at = site.at - self.middle;
        let (u, v) = (at.dot(&self.u), at.dot(&self.v));
        site.axes.column(2).dot(&self.normal) > R::of(FACING)
            && u.magnitude() <= self.half[0]
            && v.magnitude() <= self.half[1]
            && u * u + v * v <= self.rim * self.rim
            && at.dot(&self.normal) > self.offset - reach
    }

    /// How the finger stands against the face.
    pub fn stand(&self, site: &Site<R>) -> Stand<R> {
        let [x, y, z]: [Vector3<R>; 3] =
            [site.axes.column(0).into(), site.axes.column(1).into(), site.axes.column(2).into()];
        let (cosine, sine) = (x.dot(&self.u), x.dot(&self.v));
        let flat = (cosine * cosine + sine * sine).magnitude().sqrt();
        let direction = if flat > R::of(1e-6) { [cosine / flat, sine / flat] } else { [R::of(1.0), R::of(0.0)] };
        let along = self.u * direction[0] + self.v * direction[1];
        let across = self.v * direction[0] - self.u * direction[1];
        let at = site.at - self.middle;
        Stand {
            foot: [at.dot(&self.u), at.dot(&self.v)],
            height: at.dot(&self.normal) - self.offset,
            direction,
            pitch: (-x.dot(&self.normal)).atan2(flat),
            roll: (-z.dot(&across)).atan2(y.dot(&across)),
            axes: [along, across, self.normal],
        }
    }

    /// Distance of a place below the tangent plane at the apex.
    pub fn depth_of(&self, place: &Vector3<R>) -> R {
        self.offset - (place - self.middle).dot(&self.normal)
    }

    /// The body that the finger meets, with its axis along u.
    pub fn body<T: Elementary>(&self) -> Body<T> {
        let axis = [1.0, 0.0].map(T::of);
        match self.bent {
            Bent::Plane => Body::Plane,
            Bent::Sphere(radius) => Body::Sphere(Sphere { radius_mm: T::near(radius) }),
            Bent::Cylinder(radius) => Body::Cylinder(Cylinder { radius_mm: T::near(radius), axis }),
            Bent::Edge(radius, angle_deg) => {
                Body::Edge(Edge { radius_mm: T::near(radius), axis, face: Edge::slope(T::near(angle_deg)) })
            }
        }
    }

    pub fn is_plane(&self) -> bool {
        matches!(self.bent, Bent::Plane)
    }

    /// Whether a disk about a place along u and v reaches beyond the face.
    pub fn ends_within(&self, [u, v]: [R; 2], radius: R) -> bool {
        u.magnitude() + radius > self.half[0]
            || v.magnitude() + radius > self.half[1]
            || (u * u + v * v).magnitude().sqrt() + radius > self.rim
    }

    /// Whether a shift along u changes nothing.
    pub fn is_long(&self) -> bool {
        matches!(self.bent, Bent::Cylinder(_) | Bent::Edge(..))
    }

    /// Radius beyond which the finger would close around the body, which the model does not do.
    pub fn radius(&self) -> Option<R> {
        match self.bent {
            Bent::Sphere(radius) | Bent::Cylinder(radius) => Some(radius),
            _ => None,
        }
    }
}

/// A face over which a finger stands: its number, and the normal at the apex of a round one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chosen<R> {
    pub number: u8,
    pub apex: Vector3<R>,
}

impl<R: Elementary> Chosen<R> {
    pub fn face(&self, shape: &Shape<R>) -> Face<R> {
        Face::of(shape, self.number, &self.apex)
    }
}

/// Number of faces of a shape without edges.
fn faces(kind: u32) -> u8 {
    match kind {
        BOX => 6,
        CAPSULE | CYLINDER => 3,
        _ => 1,
    }
}

fn is_round(kind: u32, number: u8) -> bool {
    matches!(kind, ELLIPSOID | CAPSULE) || (kind == CYLINDER && number == 1)
}

/// Finds the apex of a round face: the point of it under which the finger touches first. It lies on the line from the face's centre of
/// curvature to that of the finger's surface, which is about the same for all poses near the one sought.
///
/// * `touch`: the point of the finger that touches first in a pose (pitch and roll against level, rad), along its level axes
fn find_apex<R: Elementary>(
    shape: &Shape<R>,
    number: u8,
    site: &Site<R>,
    touch: &impl Fn([R; 2]) -> Vector3<R>,
) -> Option<Vector3<R>> {
    let is_side = number == 1 && matches!(shape.kind, CAPSULE | CYLINDER);
    let across = |v: &Vector3<R>| if is_side { Vector3::new(v.x, v.y, R::of(0.0)) } else { *v };
    let one = R::of(1.0);
    let settled = R::of(SETTLED[usize::from(one + R::of(SETTLED[0]) == one)]);
    let mut apex = normalised(&across(&site.axes.column(2).into()))?;
    let mut touched = Vector3::zeros();
    let mut middle = Vector3::zeros();
    for _ in 0..ROUNDS {
        let face = Face::of(shape, number, &apex);
        let stand = face.stand(site);
        middle = face.middle;
        touched = site.at + site.axes * touch([stand.pitch, stand.roll]) - middle;
        let to = normalised(&across(&(touched + apex * R::of(FINGER_RADIUS_MM))))?;
        let turn = sum_of_magnitudes(&(to - apex));
        apex = to;
        if turn < settled {
            break;
        }
    }
    // Beyond the end of a capsule's side its cap is touched, and the other way round.
    let [_, half_length, ..] = shape.sizes;
    let is_there = match shape.kind {
        CAPSULE if is_side => touched.z.magnitude() <= half_length,
        CAPSULE => !(touched.z * middle.z < R::of(0.0)),
        _ => true,
    };
    is_there.then_some(apex)
}

/// Sum of the magnitudes of the components.
pub(super) fn sum_of_magnitudes<R: Scalar>(v: &Vector3<R>) -> R {
    v.x.magnitude() + v.y.magnitude() + v.z.magnitude()
}

/// The edge of a box to which a finger comes next: the centre of its surface lies beyond two of the box's faces.
fn choose_edge<R: Elementary>(shape: &Shape<R>, site: &Site<R>, touch: Vector3<R>) -> Option<Chosen<R>> {
    if shape.kind != BOX {
        return None;
    }
    let [along, across, up, edge_radius] = shape.sizes;
    let half = Vector3::new(along, across, up);
    let normal = Vector3::from(site.axes.column(2));
    let from = site.at + site.axes * touch + normal * R::of(FINGER_RADIUS_MM);
    let is_beyond = |axis| component(&from, axis).magnitude() > component(&half, axis);
    let mut within = (0..3).filter(|axis| !is_beyond(*axis));
    let (Some(axis), None) = (within.next(), within.next()) else { return None };
    let far = |axis| u8::from(component(&from, axis) < R::of(0.0));
    let number = FIRST_EDGE + 4 * axis + far(axis + 1) + 2 * far(axis + 2);
    let chosen = Chosen { number, apex: Vector3::zeros() };
    let face = chosen.face(shape);
    let stands = edge_radius <= face.thickness
        && normal.dot(&face.normal) >= R::of(FACING_EDGE)
        && face.is_below(site, face.thickness);
    stands.then_some(chosen)
}

/// The face over which a finger stands: the old one, else an edge that it comes next to, else the face that it faces most.
///
/// * `old`: the face of the last step, and whether the finger touched it
/// * `touch`: as in [`find_apex`]
/// * `has_edges`: whether the finger's model can touch edges
pub(super) fn choose<R: Elementary>(
    shape: &Shape<R>,
    site: &Site<R>,
    old: Option<(Chosen<R>, bool)>,
    touch: &impl Fn([R; 2]) -> Vector3<R>,
    has_edges: bool,
) -> Option<Chosen<R>> {
    if let Some((chosen, touches)) = old {
        let face = chosen.face(shape);
        // Depth is compression of the finger: one that touches may sink in deeper than the body is thick. One that was above the face may
        // pass a little in one step. Any other must be in front of the body's middle, behind which it stands with its back to the body.
        let hover = R::of(HOVER_MM);
        let ahead = if face.thickness > hover { face.thickness } else { hover };
        if face.is_below(site, if touches { R::of(f32::INFINITY) } else { ahead }) {
            return Some(chosen);
        }
    }
    let [a, b, c, _] = shape.sizes;
    let size = match shape.kind {
        ELLIPSOID => Some(a + b + c),
        CAPSULE | CYLINDER => Some(a + b),
        _ => None,
    };
    if let Some(size) = size {
        let near = size + R::of(NEAR_MM);
        if site.at.dot(&site.at) > near * near {
            return None;
        }
    }
    if has_edges && let Some(edge) = choose_edge(shape, site, touch([R::of(0.0); 2])) {
        return Some(edge);
    }
    let mut best = None;
    let mut most = R::of(0.0);
    for number in 1..=faces(shape.kind) {
        let apex = if is_round(shape.kind, number) {
            let Some(apex) = find_apex(shape, number, site, touch) else { continue };
            apex
        } else {
            Vector3::zeros()
        };
        let chosen = Chosen { number, apex };
        let face = chosen.face(shape);
        let facing = site.axes.column(2).dot(&face.normal);
        if facing > most && face.is_below(site, face.thickness) {
            (best, most) = (Some(chosen), facing);
        }
    }
    best
}
