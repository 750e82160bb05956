//! From fingertip poses to motions, and from responses to forces in space.
//!
//! Main type: [`ContactFrame`]. Uses nalgebra's plain matrices.

use nalgebra::{Matrix3, Vector3};

use crate::{Motion, Response};

/// A plane and the finger above it.
///
/// The plane's frame has z out of the plane into the finger and x along the plane's motion from proximal to distal.
/// The fingertip point is where the undeformed pad would first touch; it moves with the finger's base. Positions in
/// mm; 32 bits resolve 0.06 um at 1 m, so keep the origin near.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Plain", into = "Plain"))]
pub struct ContactFrame {
    axes: Matrix3<f32>,
    origin: Vector3<f32>,
    last: Option<Vector3<f32>>,
}

impl ContactFrame {
    /// A plane through `origin` whose frame's axes are the columns of `axes`, or `None` if they are not orthonormal
    /// and right-handed within 1e-3.
    pub fn new(axes: Matrix3<f32>, origin: Vector3<f32>) -> Option<Self> {
        let product = axes.transpose() * axes - Matrix3::identity();
        let orthonormal = product.iter().all(|x| x.abs() <= 1e-3);
        let x = axes.column(0).into_owned();
        let y = axes.column(1).into_owned();
        let z = axes.column(2).into_owned();
        let right_handed = x.cross(&y).dot(&z) > 0.0;
        (orthonormal && right_handed && origin.iter().all(|x| x.is_finite())).then_some(Self {
            axes,
            origin,
            last: None,
        })
    }

    /// Follows a moving plane; the slide includes its motion.
    pub fn move_plane(&mut self, origin: Vector3<f32>) {
        self.origin = origin;
    }

    /// The motion from the last fingertip position to this one. The first call gives no slide.
    ///
    /// Leaves out: rotation of the finger against the plane, for which the model has no input.
    pub fn motion(&mut self, fingertip: Vector3<f32>, dt_s: f32) -> Motion {
        let here = self.axes.transpose() * (fingertip - self.origin);
        let last = self.last.replace(here).unwrap_or(here);
        // The plane slides one way when the finger goes the other.
        Motion {
            depth_mm: -here.z,
            slide_increment_mm: [last.x - here.x, last.y - here.y],
            spin_increment_rad: 0.0,
            dt_s,
        }
    }

    /// The force that the plane exerts on the finger, N.
    pub fn force(&self, response: &Response) -> Vector3<f32> {
        let [x, y] = response.friction_n;
        self.axes * Vector3::new(x, y, response.normal_force_n)
    }

    /// The point of the plane below the fingertip, where [`ContactFrame::force`] acts to a good approximation, mm.
    pub fn contact_point(&self) -> Vector3<f32> {
        let here = self.last.unwrap_or_else(Vector3::zeros);
        self.axes * Vector3::new(here.x, here.y, 0.0) + self.origin
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for ContactFrame {
    fn format(&self, f: defmt::Formatter<'_>) {
        let axes: [[f32; 3]; 3] = self.axes.into();
        let (origin, last): ([f32; 3], Option<[f32; 3]>) = (self.origin.into(), self.last.map(Into::into));
        defmt::write!(f, "ContactFrame {{ axes: {}, origin: {}, last: {} }}", axes, origin, last);
    }
}

/// A frame as plain numbers; the axes by column.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Plain {
    axes: [[f32; 3]; 3],
    origin_mm: [f32; 3],
    last_mm: Option<[f32; 3]>,
}

#[cfg(feature = "serde")]
impl From<ContactFrame> for Plain {
    fn from(frame: ContactFrame) -> Self {
        Self { axes: frame.axes.into(), origin_mm: frame.origin.into(), last_mm: frame.last.map(Into::into) }
    }
}

#[cfg(feature = "serde")]
impl TryFrom<Plain> for ContactFrame {
    type Error = &'static str;

    fn try_from(plain: Plain) -> Result<Self, Self::Error> {
        let mut frame = Self::new(plain.axes.into(), plain.origin_mm.into())
            .ok_or("axes are not orthonormal and right-handed, or the origin is not a number")?;
        frame.last = plain.last_mm.map(Into::into);
        Ok(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_plane() {
        // The plane's normal points along world x.
        let axes = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let mut frame = ContactFrame::new(axes, Vector3::new(10.0, 0.0, 0.0)).unwrap();
        frame.motion(Vector3::new(10.0, 0.0, 0.0), 1e-3);
        let motion = frame.motion(Vector3::new(9.5, 0.25, -0.5), 1e-3);
        assert_eq!(motion.depth_mm, 0.5);
        assert_eq!(motion.slide_increment_mm, [-0.25, 0.5]);
        let response = Response { normal_force_n: 2.0, friction_n: [0.5, 0.25], ..Response::default() };
        assert_eq!(frame.force(&response), Vector3::new(2.0, 0.5, 0.25));
        assert_eq!(frame.contact_point(), Vector3::new(10.0, 0.25, -0.5));
        assert!(ContactFrame::new(Matrix3::zeros(), Vector3::zeros()).is_none());
        assert!(ContactFrame::new(-Matrix3::identity(), Vector3::zeros()).is_none());
    }
}
