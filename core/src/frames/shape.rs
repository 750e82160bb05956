//! Shapes of rigid bodies in frames of their own, as simulators and robots have them.
//!
//! Main type: [`Shape`]. Uses error and math.

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
// Numbers throughout, so that any bits are a shape or are found out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Shape<R = f64> {
    pub(super) kind: u32,
    room: u32,
    pub(super) sizes: [R; 4],
}

// Values of `kind`, and what the sizes are.
/// None; they are ones.
pub(super) const PLANE: u32 = 0;
/// Semi-axes.
pub(super) const ELLIPSOID: u32 = 1;
/// Radius and half the length.
pub(super) const CAPSULE: u32 = 2;
pub(super) const CYLINDER: u32 = 3;
/// Radius, mm, and the angle between the faces, degrees.
pub(super) const EDGE: u32 = 4;
/// Half the extents, and the radius of the edges.
pub(super) const BOX: u32 = 5;

impl<R: Elementary> Shape<R> {
    /// The plane z = 0; the body is below it.
    pub fn plane() -> Self {
        Self { kind: PLANE, room: 0, sizes: [R::of(1.0); 4] }
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
        let [a, b, c] = semi_axes_mm;
        Self::checked(ELLIPSOID, [a, b, c, R::of(0.0)], 3)
    }

    /// A cylinder about z with two round ends.
    ///
    /// * `half_length_mm`: from the origin to the centre of an end
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn capsule(radius_mm: R, half_length_mm: R) -> Result<Self, Error> {
        Self::checked(CAPSULE, [radius_mm, half_length_mm, R::of(0.0), R::of(0.0)], 2)
    }

    /// A cylinder about z with two flat ends, with no model of their rims.
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn cylinder(radius_mm: R, half_length_mm: R) -> Result<Self, Error> {
        Self::checked(CYLINDER, [radius_mm, half_length_mm, R::of(0.0), R::of(0.0)], 2)
    }

    /// Two plane faces that meet in a rounded edge along x. The origin lies on the rounding, and z points out of the body between the faces.
    ///
    /// * `angle_deg`: angle between the faces inside the body, 1 to 179
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn edge(radius_mm: R, angle_deg: R) -> Result<Self, Error> {
        if !angle_deg.is_between(ANGLE_DEG[0], ANGLE_DEG[1]) {
            return Err(Error::Range { what: Field::FaceAngle, index: 0, value: angle_deg.to_f32() });
        }
        Self::checked(EDGE, [radius_mm, angle_deg, R::of(0.0), R::of(0.0)], 1)
    }

    /// A box about the origin, with six faces and twelve rounded edges; it has no model of corners. A bed touches its faces alone.
    ///
    /// * `half_mm`: half its extents along x, y and z
    ///
    /// # Errors
    /// [`Error::Range`] as above.
    pub fn cuboid(half_mm: [R; 3], edge_radius_mm: R) -> Result<Self, Error> {
        let [along, across, up] = half_mm;
        Self::checked(BOX, [along, across, up, edge_radius_mm], 4)
    }

    /// Whether all its faces are flat, so that a bed can touch it.
    pub fn is_flat(&self) -> bool {
        matches!(self.kind, PLANE | BOX)
    }

    fn checked(kind: u32, sizes: [R; 4], lengths: usize) -> Result<Self, Error> {
        for (index, size) in sizes.iter().take(lengths).enumerate() {
            if !size.is_between(SIZE_MM[0], SIZE_MM[1]) {
                return Err(Error::Range { what: Field::Radius, index: index as u16, value: size.to_f32() });
            }
        }
        Ok(Self { kind, room: 0, sizes })
    }

    /// Whether the numbers are such as a constructor leaves there.
    pub(super) fn is_sound(&self) -> bool {
        let [a, ..] = self.sizes;
        self.kind <= BOX && a >= R::of(SIZE_MM[0])
    }
}
