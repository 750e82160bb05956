//! Pose of the rigid body: six coordinates of its motion, and the rigid frame that they give.
//!
//! The name `plane` covers every body here: for a curved one it means the tangent plane at the apex.

use nalgebra::{Matrix3, Rotation2, Rotation3, Vector2, Vector3};

use super::Reach;

/// Coordinates in which the plane is driven, in this order: slide along x and y (mm), depth (mm), spin, pitch and roll
/// (rad).
pub type Coordinates = [f64; 6];

/// Places of the coordinates.
pub const X: usize = 0;
/// Slide along y.
pub const Y: usize = 1;
/// Depth along the plane's normal.
pub const DEPTH: usize = 2;
/// Turn about the plane's normal, counter-clockwise seen from the finger's side.
pub const SPIN: usize = 3;
/// Turn of the finger that lowers its tip.
pub const PITCH: usize = 4;
/// Turn of the finger about the neutral x axis.
pub const ROLL: usize = 5;

/// Position of the plane relative to the finger's base, with its displacement along itself.
///
/// Pitch and roll are those of the finger against the plane, counted from the neutral pose in which the mesh was made:
/// the finger is turned first about the neutral x axis (roll), then about the neutral y axis (pitch, tip down), both by
/// the right-hand rule. The finger's base is fixed, so that the plane gets the inverse of this rotation.
///
/// Slide moves the apex of a body by (x, y) along its axes, which pitch and roll turn and spin does not; spin turns the body
/// about the normal through its apex. The pose is a function of the coordinates, so that a closed loop of them closes.
///
/// A plane is the same everywhere and has its apex at its foot, the point of it under first touch in the neutral pose:
/// slide and spin are its motions there, only these rates matter, and the order of slide and spin has no influence.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Plane {
    /// Coordinates of the motion, counted from the neutral pose at first touch.
    pub at: Coordinates,
    /// Place of a plane's material origin along the plane's axes, seen from the foot, mm.
    shift: Vector2<f64>,
}

impl Default for Plane {
    fn default() -> Self {
        Self::new([0.0; 6])
    }
}

impl From<[f64; 3]> for Plane {
    /// The plane in the neutral pose at slide x, slide y and depth, mm.
    fn from([x, y, depth]: [f64; 3]) -> Self {
        Self::new([x, y, depth, 0.0, 0.0, 0.0])
    }
}

impl Plane {
    /// The plane where a path starts.
    pub fn new(at: Coordinates) -> Self {
        Self { at, shift: Vector2::new(at[X], at[Y]) }
    }

    /// The plane moved on to these coordinates, slide and spin at even rates.
    pub fn moved_to(&self, at: Coordinates) -> Self {
        let slide = Vector2::new(at[X] - self.at[X], at[Y] - self.at[Y]);
        let spin = at[SPIN] - self.at[SPIN];
        // Mean of the rotation over the motion: each part of the slide is turned by the spin that follows it.
        let (along, across) = if spin.abs() < 1e-4 {
            (1.0 - spin * spin / 6.0, 0.5 * spin * (1.0 - spin * spin / 12.0))
        } else {
            (spin.sin() / spin, (1.0 - spin.cos()) / spin)
        };
        let turned = Vector2::new(along * slide.x - across * slide.y, across * slide.x + along * slide.y);
        Self { at, shift: Rotation2::new(spin) * self.shift + turned }
    }

    /// Rotation of the plane's axes by pitch and roll.
    pub fn tilt(&self) -> Rotation3<f64> {
        tilt(self.at[PITCH], self.at[ROLL])
    }

    /// The rigid frame of the plane whose normal meets first touch at the height that `reach` gives.
    pub fn frame(&self, reach: &Reach) -> Frame {
        let tilt = self.tilt();
        let foot = reach.pivot_mm() + tilt * Vector3::z() * (reach.height_mm(&tilt) + self.at[DEPTH]);
        let rotation = tilt * Rotation3::from_axis_angle(&Vector3::z_axis(), self.at[SPIN]);
        let origin = foot + self.origin_from_foot(reach, &tilt);
        Frame { rotation, origin, tilt, foot }
    }

    /// From the foot to the material origin, which is the apex of a curved body, finger's frame.
    fn origin_from_foot(&self, reach: &Reach, tilt: &Rotation3<f64>) -> Vector3<f64> {
        let [x, y] = if reach.body().is_plane() { self.shift.into() } else { [self.at[X], self.at[Y]] };
        tilt * Vector3::new(x, y, 0.0)
    }

    /// Velocity of the plane per rate of a coordinate: its rotation, and the motion of the point of it at the foot, in the
    /// finger's frame.
    pub fn twist(&self, coordinate: usize, reach: &Reach) -> Twist {
        let tilt = self.tilt();
        let axis = |k: usize| tilt * Vector3::ith(k, 1.0);
        match coordinate {
            X | Y | DEPTH => Twist { turn: Vector3::zeros(), motion: axis(coordinate), spin: 0.0 },
            SPIN => {
                let is_plane = reach.body().is_plane();
                let motion =
                    if is_plane { Vector3::zeros() } else { self.origin_from_foot(reach, &tilt).cross(&axis(2)) };
                Twist { turn: axis(2), motion, spin: 1.0 }
            }
            _ => {
                // The plane turns against the finger: tilt = Rx(-roll) Ry(-pitch).
                let turn = if coordinate == ROLL {
                    -Vector3::x()
                } else {
                    -(Rotation3::from_axis_angle(&Vector3::x_axis(), -self.at[ROLL]) * Vector3::y())
                };
                let height = reach.height_mm(&tilt) + self.at[DEPTH];
                let shifted = |sign: f64| {
                    let mut at = self.at;
                    at[coordinate] += sign * DIFFERENCE_RAD;
                    reach.height_mm(&crate::contact::plane::tilt(at[PITCH], at[ROLL]))
                };
                let rise = (shifted(1.0) - shifted(-1.0)) / (2.0 * DIFFERENCE_RAD);
                Twist { turn, motion: turn.cross(&(axis(2) * height)) + axis(2) * rise, spin: 0.0 }
            }
        }
    }
}

/// Step of the difference quotient of the height of first touch over an angle, rad.
const DIFFERENCE_RAD: f64 = 1e-5;

/// Rotation of the plane against a finger that is pitched and rolled, rad.
fn tilt(pitch: f64, roll: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), -roll) * Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch)
}

/// A rigid motion at an instant: turn (rad) about the plane's foot and motion (mm) of the plane there, per unit of the
/// driving coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Turn, finger's frame.
    pub turn: Vector3<f64>,
    /// Motion at the foot, finger's frame.
    pub motion: Vector3<f64>,
    /// Part of the turn that is spin, against the axes along which the plane slides.
    pub spin: f64,
}

impl Twist {
    /// Velocity of the plane's material at `arm` from the foot.
    pub fn velocity(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.motion + self.turn.cross(arm)
    }
}

/// The plane as a rigid frame in the frame of the finger, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Axes of the plane's material: x and y along it, z out of it into the finger.
    rotation: Rotation3<f64>,
    origin: Vector3<f64>,
    tilt: Rotation3<f64>,
    foot: Vector3<f64>,
}

impl Frame {
    /// A point of space in coordinates of the plane's material; z is its height over the plane.
    pub fn to_plane(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse_transform_vector(&(x - self.origin))
    }

    /// A point of the plane's material frame in space.
    pub fn from_plane(&self, y: &Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * y
    }

    /// A vector of the plane's frame in the finger's.
    pub fn to_finger(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * v
    }

    /// A linear map in the plane's frame, in the finger's.
    pub fn map_to_finger(&self, map: &Matrix3<f64>) -> Matrix3<f64> {
        self.rotation.matrix() * map * self.rotation.matrix().transpose()
    }

    /// Axis x, y or z of the plane, which spin does not turn, finger's frame.
    pub fn axis(&self, k: usize) -> Vector3<f64> {
        self.tilt * Vector3::ith(k, 1.0)
    }

    /// Vector of the finger's frame along the plane's axes, which spin does not turn.
    pub fn along_axes(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.tilt.inverse_transform_vector(v)
    }

    /// The foot: the point of the plane under the pivot of [`Reach`], finger's frame.
    pub fn foot(&self) -> Vector3<f64> {
        self.foot
    }

    /// A vector of the plane's material frame along its axes x and y, which spin does not turn.
    pub fn unspun(&self, v: &Vector3<f64>) -> [f64; 2] {
        let along = self.along_axes(&self.to_finger(v));
        [along.x, along.y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Outline, RigidBody};

    /// Where a point of a body is, in the frame of the finger, after a path.
    fn place(body: &RigidBody, path: &[Coordinates], point: Vector3<f64>) -> Vector3<f64> {
        let outline = Outline::of_points(vec![Vector3::zeros()], &[Vector3::zeros()]);
        let reach = Reach::new(outline, body.clone(), &Plane::new(path[0]));
        let last = path[1..].iter().fold(Plane::new(path[0]), |plane, at| plane.moved_to(*at));
        last.frame(&reach).from_plane(&point)
    }

    /// A ball spins about the normal through its apex: its middle stays, and loops of slide and spin close. A plane spins about the foot.
    #[test]
    fn a_curved_body_spins_about_its_apex_and_a_plane_about_the_foot() {
        let ball = RigidBody::Sphere { radius_mm: 8.0 };
        let middle = Vector3::new(0.0, 0.0, -8.0);
        let (start, slid) = ([0.0; 6], [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
        let spun = [1.0, 0.5, 0.0, 2.0, 0.0, 0.0];
        let back = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0];
        let at = |path: &[Coordinates]| place(&ball, path, middle);
        assert!((at(&[start, slid, spun]) - at(&[start, slid])).norm() < 1e-14);
        let beside = Vector3::new(0.3, 0.1, 0.0);
        assert!(
            (place(&ball, &[start, slid, spun, back, start], beside) - place(&ball, &[start], beside)).norm() < 1e-14
        );
        // The middle of the plane goes round the foot by the chord of the spin.
        let origin = |path: &[Coordinates]| place(&RigidBody::Plane, path, Vector3::zeros());
        let chord = 2.0 * 1.25f64.sqrt() * 1.0f64.sin();
        assert!(((origin(&[start, slid, spun]) - origin(&[start, slid])).norm() - chord).abs() < 1e-14);
    }
}
