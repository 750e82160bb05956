//! The rigid body that the finger touches: gap, closest point, normal and curvature at any place near its surface.
//!
//! The body's frame has its z axis along the normal at the body's apex, which is the origin; the material is below, the finger
//! above. Of convex bodies the apex is the highest point, of concave ones (a bowl, a trough, a groove) the lowest.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::heights::HeightField;

/// Default angle between the two faces of an edge or of a groove, degrees.
pub const RIGHT_ANGLE_DEG: f64 = 90.0;

/// Shape of the rigid body.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RigidBody {
    /// An infinite plane.
    #[default]
    Plane,
    /// A sphere; a bowl with a negative radius.
    Sphere {
        /// Radius, mm; negative for a bowl, which the finger touches from inside.
        radius_mm: f64,
    },
    /// A circular cylinder; a trough with a negative radius.
    Cylinder {
        /// Radius, mm; negative for a trough.
        radius_mm: f64,
        /// Direction of its axis in the tangent plane, degrees from x towards y.
        axis_deg: f64,
    },
    /// Two planes that meet in a rounded edge, which points at the finger.
    Edge {
        /// Radius of the edge, mm.
        radius_mm: f64,
        /// Direction of the edge in the tangent plane, degrees from x towards y.
        axis_deg: f64,
        /// Angle between the two faces, inside the body, degrees.
        angle_deg: f64,
    },
    /// Two planes that meet in a rounded valley.
    Groove {
        /// Radius of the valley, mm.
        radius_mm: f64,
        /// Direction of the valley in the tangent plane, degrees from x towards y.
        axis_deg: f64,
        /// Angle between the two faces, outside the body, degrees.
        angle_deg: f64,
    },
    /// Heights over the tangent plane, from a file.
    Heights(HeightField),
}

/// Local geometry of a body near its surface; body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Distance from the surface, mm; negative inside the body.
    pub gap_mm: f64,
    /// The closest point of the surface.
    pub point: Vector3<f64>,
    /// Normal of the surface there, out of the body.
    pub normal: Vector3<f64>,
    /// Derivative of the normal over the place, 1/mm: symmetric, zero along the normal.
    pub bend: Matrix3<f64>,
}

impl Spot {
    /// Two unit vectors along the surface; the axes x and y if the normal is the axis z.
    pub fn tangents(&self) -> [Vector3<f64>; 2] {
        tangents(&self.normal)
    }

    /// The larger of the body's two curvatures there, either sign, 1/mm.
    pub fn most_curvature(&self) -> f64 {
        // Near the surface, where the gap changes the derivative of the normal little.
        self.bend.symmetric_eigenvalues().amax()
    }

    /// The spot of a place that is farther by the small `step` along the surface.
    pub fn moved_along(&self, step: &Vector3<f64>) -> Self {
        let turn = self.bend * step;
        let normal = if turn == Vector3::zeros() { self.normal } else { (self.normal + turn).normalize() };
        Self { point: self.point + step - turn * self.gap_mm, normal, ..*self }
    }

    /// The place at another distance from the same point of the surface.
    pub fn at_gap(&self, gap_mm: f64) -> Vector3<f64> {
        self.point + self.normal * gap_mm
    }
}

/// The axes x and y turned by the least rotation that brings the axis z to `normal`; for a normal that points straight down the
/// axes x and -y.
pub fn tangents(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let [x, y, z] = [normal.x, normal.y, normal.z];
    if z < -0.999_999 {
        return [Vector3::x(), -Vector3::y()];
    }
    let over = 1.0 / (1.0 + z);
    [Vector3::new(1.0 - x * x * over, -x * y * over, -x), Vector3::new(-x * y * over, 1.0 - y * y * over, -y)]
}

/// Why a body cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyShapeError {
    /// A number out of its range.
    #[error("{name} = {value}: {rule}")]
    Number {
        /// Key of the number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The required condition.
        rule: &'static str,
    },
    /// Heights that are no field.
    #[error("{0}")]
    Heights(String),
}

impl RigidBody {
    /// Refuses numbers of which no body can be made.
    ///
    /// # Errors
    /// [`BodyShapeError`] with the number.
    pub fn check(&self) -> Result<(), BodyShapeError> {
        let need = |holds: bool, name, value, rule| {
            if holds { Ok(()) } else { Err(BodyShapeError::Number { name, value, rule }) }
        };
        let axis = |axis_deg: f64| need(axis_deg.is_finite(), "axis_deg", axis_deg, "must be a number");
        let signed = "must be a number other than 0 (negative for a concave body)";
        match *self {
            Self::Plane => Ok(()),
            Self::Sphere { radius_mm } => {
                need(radius_mm.is_finite() && radius_mm != 0.0, "radius_mm", radius_mm, signed)
            }
            Self::Cylinder { radius_mm, axis_deg } => {
                need(radius_mm.is_finite() && radius_mm != 0.0, "radius_mm", radius_mm, signed)?;
                axis(axis_deg)
            }
            Self::Edge { radius_mm, axis_deg, angle_deg } | Self::Groove { radius_mm, axis_deg, angle_deg } => {
                need(radius_mm.is_finite() && radius_mm > 0.0, "radius_mm", radius_mm, "must be more than 0")?;
                axis(axis_deg)?;
                need(angle_deg > 0.0 && angle_deg < 180.0, "angle_deg", angle_deg, "must be between 0 and 180")
            }
            Self::Heights(ref heights) => heights.check(),
        }
    }

    /// Whether it is the plane.
    pub fn is_plane(&self) -> bool {
        *self == Self::Plane
    }

    /// Least radius of its curvature, mm; infinite for a plane.
    pub fn least_radius_mm(&self) -> f64 {
        match *self {
            Self::Plane => f64::INFINITY,
            Self::Sphere { radius_mm }
            | Self::Cylinder { radius_mm, .. }
            | Self::Edge { radius_mm, .. }
            | Self::Groove { radius_mm, .. } => radius_mm.abs(),
            Self::Heights(ref heights) => heights.least_radius_mm(),
        }
    }

    /// Whether a part of it is hollow, so that the finger need not touch it at its apex first.
    pub fn may_be_hollow(&self) -> bool {
        match *self {
            Self::Plane | Self::Edge { .. } => false,
            Self::Sphere { radius_mm } | Self::Cylinder { radius_mm, .. } => radius_mm < 0.0,
            Self::Groove { .. } | Self::Heights(_) => true,
        }
    }

    /// Direction of its axis in the tangent plane, degrees, if it is the same all along one.
    pub fn axis_deg(&self) -> Option<f64> {
        match *self {
            Self::Plane | Self::Sphere { .. } | Self::Heights(_) => None,
            Self::Cylinder { axis_deg, .. } | Self::Edge { axis_deg, .. } | Self::Groove { axis_deg, .. } => {
                Some(axis_deg)
            }
        }
    }

    /// Whether it is its own mirror image about y = 0.
    pub fn is_symmetric(&self) -> bool {
        match *self {
            Self::Plane | Self::Sphere { .. } => true,
            Self::Cylinder { axis_deg, .. } | Self::Edge { axis_deg, .. } | Self::Groove { axis_deg, .. } => {
                axis_deg.rem_euclid(90.0) == 0.0
            }
            Self::Heights(_) => false,
        }
    }

    /// The spot of a place `y`, body's frame, mm.
    pub fn spot(&self, y: &Vector3<f64>) -> Spot {
        match *self {
            Self::Plane => {
                Spot { gap_mm: y.z, point: Vector3::new(y.x, y.y, 0.0), normal: Vector3::z(), bend: Matrix3::zeros() }
            }
            Self::Sphere { radius_mm } => {
                // Side on which the material is: 1 inside the sphere, -1 around it.
                let side = radius_mm.signum();
                let arm = y - Vector3::new(0.0, 0.0, -radius_mm);
                let distance = arm.norm().max(f64::MIN_POSITIVE);
                let normal = arm * (side / distance);
                // The difference of two lengths, of their squares, so that a huge radius costs no digits.
                let gap_mm = side * (y.norm_squared() + 2.0 * radius_mm * y.z) / (distance + radius_mm.abs());
                let across = Matrix3::identity() - normal * normal.transpose();
                Spot { gap_mm, point: y - normal * gap_mm, normal, bend: across * (side / distance) }
            }
            Self::Cylinder { radius_mm, axis_deg } => {
                let section = Section { radius_mm: radius_mm.abs(), side: radius_mm.signum(), most_rad: f64::INFINITY };
                section.spot(axis_deg, y)
            }
            Self::Edge { radius_mm, axis_deg, angle_deg } => {
                Section { radius_mm, side: 1.0, most_rad: face_rad(angle_deg) }.spot(axis_deg, y)
            }
            Self::Groove { radius_mm, axis_deg, angle_deg } => {
                Section { radius_mm, side: -1.0, most_rad: face_rad(angle_deg) }.spot(axis_deg, y)
            }
            Self::Heights(ref heights) => heights.spot(y),
        }
    }

    /// Height of the body over the line through (x, y) along z, mm; None if the line does not meet it.
    pub fn height_mm(&self, x: f64, y: f64) -> Option<f64> {
        match *self {
            Self::Plane => Some(0.0),
            Self::Sphere { radius_mm } => arc(radius_mm.abs(), radius_mm.signum(), x.hypot(y)),
            Self::Cylinder { radius_mm, axis_deg } => arc(radius_mm.abs(), radius_mm.signum(), across(axis_deg, x, y)),
            Self::Edge { radius_mm, axis_deg, angle_deg } => {
                Some(faces(radius_mm, 1.0, face_rad(angle_deg), across(axis_deg, x, y)))
            }
            Self::Groove { radius_mm, axis_deg, angle_deg } => {
                Some(faces(radius_mm, -1.0, face_rad(angle_deg), across(axis_deg, x, y)))
            }
            Self::Heights(ref heights) => Some(heights.height_mm(x, y)),
        }
    }
}

/// Angle between a face and the tangent plane at the edge, rad.
fn face_rad(angle_deg: f64) -> f64 {
    0.5 * (180.0 - angle_deg).to_radians()
}

/// Coordinate across an axis in the tangent plane.
fn across(axis_deg: f64, x: f64, y: f64) -> f64 {
    let (sin, cos) = axis_deg.to_radians().sin_cos();
    cos * y - sin * x
}

/// Height of a circle through the origin at `u` from its apex: below it if the material is inside (`side` 1).
fn arc(radius_mm: f64, side: f64, u: f64) -> Option<f64> {
    let rest = radius_mm * radius_mm - u * u;
    (rest >= 0.0).then(|| -side * (u * u) / (radius_mm + rest.sqrt()))
}

/// Height of two faces with a rounded edge at `u` from the edge.
fn faces(radius_mm: f64, side: f64, most_rad: f64, u: f64) -> f64 {
    let (sin, cos) = most_rad.sin_cos();
    let (u, end) = (u.abs(), radius_mm * sin);
    if u <= end {
        arc(radius_mm, side, u).unwrap_or(0.0)
    } else {
        -side * (radius_mm * (1.0 - cos) + (u - end) * sin / cos)
    }
}

/// A section across an axis: an arc about (0, -side radius) that continues as straight lines where its normal has
/// turned by `most_rad`.
struct Section {
    radius_mm: f64,
    /// 1 if the material is inside the arc, -1 if it is around it.
    side: f64,
    most_rad: f64,
}

impl Section {
    fn spot(&self, axis_deg: f64, y: &Vector3<f64>) -> Spot {
        let (sin, cos) = axis_deg.to_radians().sin_cos();
        let u = cos * y.y - sin * y.x;
        // From the arc's middle to the place; up is towards the arc's apex.
        let (arm_u, arm_up) = (u, self.side * y.z + self.radius_mm);
        let distance = arm_u.hypot(arm_up).max(f64::MIN_POSITIVE);
        let turned = arm_u.atan2(arm_up);
        let angle = turned.clamp(-self.most_rad, self.most_rad);
        let on_arc = angle == turned;
        let (normal_u, normal_up) = if on_arc { (arm_u / distance, arm_up / distance) } else { angle.sin_cos() };
        // Along the arc the difference of two lengths, of their squares, so that a huge radius costs no digits.
        let gap_mm = if on_arc {
            let up = self.side * y.z;
            self.side * (u * u + up * up + 2.0 * self.radius_mm * up) / (distance + self.radius_mm)
        } else {
            self.side * (arm_u * normal_u + arm_up * normal_up - self.radius_mm)
        };
        let in_space = |u: f64, z: f64| Vector3::new(-sin * u, cos * u, z);
        // The direction from the middle points out of the material or into it; up is along z or against it.
        let normal = in_space(self.side * normal_u, normal_up);
        let along_arc = in_space(normal_up, -self.side * normal_u);
        let bend = if on_arc { along_arc * along_arc.transpose() * (self.side / distance) } else { Matrix3::zeros() };
        Spot { gap_mm, point: y - normal * gap_mm, normal, bend }
    }
}

/// Spot of a graph z = h(x, y) whose height, gradient and second derivatives `at` gives: the closest point by Newton's method.
pub(super) fn spot_of_graph(at: impl Fn(f64, f64) -> (f64, Vector2<f64>, Matrix2<f64>), y: &Vector3<f64>) -> Spot {
    let mut foot = y.xy();
    let (mut height, mut slope, mut second) = at(foot.x, foot.y);
    for _ in 0..20 {
        let off = height - y.z;
        // Half the squared distance over the foot: gradient and Hessian, the latter kept positive.
        let gradient = (foot - y.xy()) + slope * off;
        let whole = Matrix2::identity() + slope * slope.transpose() + second * off;
        let safe = if whole.determinant() > 0.1 && whole.trace() > 0.0 {
            whole
        } else {
            Matrix2::identity() + slope * slope.transpose()
        };
        let Some(inverse) = safe.try_inverse() else { break };
        let step = inverse * gradient;
        foot -= step;
        (height, slope, second) = at(foot.x, foot.y);
        if step.norm() < 1e-13 {
            break;
        }
    }
    let steep = (1.0 + slope.norm_squared()).sqrt();
    let normal = Vector3::new(-slope.x, -slope.y, 1.0) / steep;
    let point = Vector3::new(foot.x, foot.y, height);
    let gap_mm = (y - point).dot(&normal);
    // Derivative of the normal along the surface, in the coordinates of the foot, and that of the foot over the place.
    let turn = |by: Vector2<f64>| {
        let raw = Vector3::new(-by.x, -by.y, 0.0) / steep;
        raw - normal * normal.dot(&raw)
    };
    let off = height - y.z;
    let hessian = Matrix2::identity() + slope * slope.transpose() + second * off;
    let Some(inverse) = hessian.try_inverse() else {
        return Spot { gap_mm, point, normal, bend: Matrix3::zeros() };
    };
    // Gradient's derivative over the place: -(e_x, e_y) - slope e_z.
    let by_place = nalgebra::Matrix2x3::new(1.0, 0.0, slope.x, 0.0, 1.0, slope.y);
    let foot_by_place = inverse * by_place;
    let turns = nalgebra::Matrix3x2::from_columns(&[turn(second.column(0).into()), turn(second.column(1).into())]);
    let bend = turns * foot_by_place;
    Spot { gap_mm, point, normal, bend: 0.5 * (bend + bend.transpose()) }
}

#[cfg(test)]
mod tests;
