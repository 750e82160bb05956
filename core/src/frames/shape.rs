//! Shapes of rigid bodies in frames of their own, as simulators and robots have them.
//!
//! Main type: [`Shape`]. Uses error and math.

use nalgebra::Vector3;

use crate::Error;
use crate::error::Field;
use crate::math::Elementary;

/// Least and largest radius or half extent of a shape, mm.
const SIZE_MM: [f32; 2] = [0.1, 1e6];
/// Least and largest angle between the faces of an edge, degrees.
const ANGLE_DEG: [f32; 2] = [1.0, 179.0];

/// The shape of a rigid body in the body's own frame. `R` is the precision of poses.
///
/// The frames are those that simulators use: the origin in the middle, the axis of a cylinder and a capsule along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape<R = f64>(pub(super) Kind<R>);

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind<R> {
    Plane,
    Ellipsoid { axes: Vector3<R> },
    Capsule { radius: R, half_length: R },
    Cylinder { radius: R, half_length: R },
    Edge { radius: R, angle_deg: R },
    Box { half: Vector3<R>, edge_radius: R },
}

impl<R: Elementary> Shape<R> {
    /// The plane z = 0; the body is below it.
    pub fn plane() -> Self {
        Self(Kind::Plane)
    }

    /// A sphere about the origin.
    ///
    /// # Errors
    /// [`Error::Range`] for a radius that is not within 0.1 and 1e6 mm, as for all sizes here.
    pub fn sphere(radius_mm: R) -> Result<Self, Error> {
        Self::ellipsoid([radius_mm; 3])
    }

    /// An ellipsoid about the origin. The finger meets it as a sphere of the geometric mean of both radii of curvature there.
    ///
    /// * `semi_axes_mm`: along x, y and z
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn ellipsoid(semi_axes_mm: [R; 3]) -> Result<Self, Error> {
        checked(&semi_axes_mm)?;
        Ok(Self(Kind::Ellipsoid { axes: semi_axes_mm.into() }))
    }

    /// A cylinder about z with two round ends.
    ///
    /// * `half_length_mm`: from the origin to the centre of an end
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn capsule(radius_mm: R, half_length_mm: R) -> Result<Self, Error> {
        checked(&[radius_mm, half_length_mm])?;
        Ok(Self(Kind::Capsule { radius: radius_mm, half_length: half_length_mm }))
    }

    /// A cylinder about z with two flat ends, with no model of their rims.
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn cylinder(radius_mm: R, half_length_mm: R) -> Result<Self, Error> {
        checked(&[radius_mm, half_length_mm])?;
        Ok(Self(Kind::Cylinder { radius: radius_mm, half_length: half_length_mm }))
    }

    /// Two plane faces that meet in a rounded edge along x. The origin lies on the rounding, and z points out of the body between the faces.
    ///
    /// * `angle_deg`: angle between the faces inside the body, 1 to 179
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn edge(radius_mm: R, angle_deg: R) -> Result<Self, Error> {
        checked(&[radius_mm])?;
        if !angle_deg.is_between(ANGLE_DEG[0], ANGLE_DEG[1]) {
            return Err(Error::Range { what: Field::FaceAngle, index: 0, value: angle_deg.to_f32() });
        }
        Ok(Self(Kind::Edge { radius: radius_mm, angle_deg }))
    }

    /// A box about the origin, with six faces and twelve rounded edges; it has no model of corners. A bed touches its faces alone.
    ///
    /// * `half_mm`: half its extents along x, y and z
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn cuboid(half_mm: [R; 3], edge_radius_mm: R) -> Result<Self, Error> {
        checked(&half_mm)?;
        checked(&[edge_radius_mm])?;
        Ok(Self(Kind::Box { half: half_mm.into(), edge_radius: edge_radius_mm }))
    }

    /// Whether all its faces are flat, so that a bed can touch it.
    pub fn is_flat(&self) -> bool {
        matches!(self.0, Kind::Plane | Kind::Box { .. })
    }
}

/// Refuses a size outside the range.
fn checked<R: Elementary>(sizes_mm: &[R]) -> Result<(), Error> {
    for (index, size) in sizes_mm.iter().enumerate() {
        if !size.is_between(SIZE_MM[0], SIZE_MM[1]) {
            return Err(Error::Range { what: Field::Radius, index: index as u16, value: size.to_f32() });
        }
    }
    Ok(())
}
