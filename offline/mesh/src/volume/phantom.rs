//! The parametric fingertip as a label volume, to test the import of volumes.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::super::surface::Body;
use super::super::{FingertipShape, MeshError};
use super::LabelVolume;

/// Labels of a phantom.
pub mod label {
    /// Air.
    pub const OUTSIDE: u16 = 0;
    /// Skin and subcutaneous tissue.
    pub const SOFT: u16 = 1;
    /// Both bones.
    pub const BONE: u16 = 2;
    /// Nail plate.
    pub const NAIL: u16 = 3;
}

/// Grid of a phantom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhantomSettings {
    /// Voxels along the finger, across it and up.
    pub voxels: [usize; 3],
    /// Size of the volume, mm.
    pub extent_mm: [f64; 3],
    /// Air before the tip, mm.
    pub margin_mm: f64,
    /// Whether the nail is labelled.
    pub nail: bool,
}

impl Default for PhantomSettings {
    /// The grid of Yoshida et al. 2011: 512 x 128 x 128 voxels over 120 x 30 x 30 mm.
    fn default() -> Self {
        Self { voxels: [512, 128, 128], extent_mm: [120.0, 30.0, 30.0], margin_mm: 2.0, nail: true }
    }
}

impl PhantomSettings {
    /// Spacing of the voxels, mm.
    pub fn spacing_mm(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.extent_mm[axis] / self.voxels[axis] as f64)
    }

    /// Origin of the finger's frame in the volume, mm from its corner.
    pub fn origin_mm(&self, shape: &FingertipShape) -> Vector3<f64> {
        let [x, y, z] = self.extent_mm;
        // The taper lifts the tip: share the room above and below.
        let lift = Body::outer(shape).taper.height(shape.length_mm);
        Vector3::new(x - self.margin_mm - shape.length_mm, 0.5 * y, 0.5 * (z - lift))
    }
}

/// Rasterises a fingertip: a voxel has the label of its middle. The axes are distal, lateral (left), dorsal; the
/// shaft and the second bone go on proximally to the end of the volume.
///
/// # Errors
/// A shape out of range, or one that the volume cannot hold.
pub fn phantom(shape: &FingertipShape, settings: &PhantomSettings) -> Result<LabelVolume, MeshError> {
    shape.validate()?;
    let origin = settings.origin_mm(shape);
    let lift = Body::outer(shape).taper.height(shape.length_mm);
    let thickness = if settings.nail { shape.nail_thickness_mm } else { 0.0 };
    let needed = [
        shape.length_mm + settings.margin_mm,
        2.0 * shape.half_width_mm + 2.0 * thickness,
        2.0 * shape.half_thickness_mm + lift + 2.0 * thickness,
    ];
    for axis in 0..3 {
        let (extent, spacing) = (settings.extent_mm[axis], settings.spacing_mm()[axis]);
        if !(extent.is_finite() && settings.voxels[axis] > 0 && extent >= needed[axis] + 2.0 * spacing) {
            return Err(MeshError::Shape {
                field: "extent_mm",
                value: extent,
                rule: format!("axis {axis} of the volume must hold {:.2} mm and two voxels", needed[axis]),
            });
        }
    }
    let (rasteriser, [ni, nj, nk], h) = (Rasteriser::new(shape, thickness), settings.voxels, settings.spacing_mm());
    let plane = |k: usize| {
        let mut labels = Vec::with_capacity(ni * nj);
        for j in 0..nj {
            for i in 0..ni {
                let middle = Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                labels.push(rasteriser.label(&(middle.component_mul(&Vector3::from(h)) - origin)));
            }
        }
        labels
    };
    let labels = (0..nk).into_par_iter().flat_map_iter(plane).collect();
    Ok(LabelVolume::new(settings.voxels, h, labels))
}

/// Labels of points of a shape.
pub(super) struct Rasteriser<'a> {
    shape: &'a FingertipShape,
    outer: Body,
    bone: Body,
    thickness_mm: f64,
}

impl<'a> Rasteriser<'a> {
    pub(super) fn new(shape: &'a FingertipShape, thickness_mm: f64) -> Self {
        Self { shape, outer: Body::outer(shape), bone: Body::bone(shape), thickness_mm }
    }

    /// Label of a point in the finger's frame.
    pub(super) fn label(&self, point: &Vector3<f64>) -> u16 {
        let gap = self.shape.joint_start_mm..self.shape.joint_end_mm;
        if self.bone.level(point) < 1.0 {
            return if gap.contains(&point.x) { label::SOFT } else { label::BONE };
        }
        if self.outer.level(point) < 1.0 {
            return label::SOFT;
        }
        if self.is_nail(point) { label::NAIL } else { label::OUTSIDE }
    }

    /// Whether a point outside the skin is in the nail plate.
    fn is_nail(&self, point: &Vector3<f64>) -> bool {
        let (thickness, shape) = (self.thickness_mm, self.shape);
        let reach = shape.nail_start_mm - thickness..shape.nail_end_mm + thickness;
        if thickness == 0.0 || !reach.contains(&point.x) {
            return false;
        }
        let closest = self.outer.closest_point(point);
        let angle = closest.y.atan2(closest.z - self.outer.taper.height(closest.x));
        (point - closest).norm() < thickness
            && (shape.nail_start_mm..=shape.nail_end_mm).contains(&closest.x)
            && angle.abs() <= shape.nail_half_angle_deg.to_radians()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_the_volumes_of_the_shape() {
        let shape = FingertipShape::default();
        let settings = PhantomSettings { voxels: [171, 101, 107], extent_mm: [40.0, 24.0, 24.0], ..Default::default() };
        let volume = phantom(&shape, &settings).unwrap();
        let voxel: f64 = settings.spacing_mm().iter().product();
        let counts = volume.counts();
        let mm3 = |label| counts[&label] as f64 * voxel;
        let bone = Body::bone(&shape);
        let section = (bone.volume() - Body { tip_x: bone.tip_x - 1.0, ..bone }.volume()) * 1.0;
        // 13 mm of shaft precede the origin of the finger's own frame.
        let more = 40.0 - settings.margin_mm - shape.length_mm;
        let bones = bone.volume() + section * (more - (shape.joint_end_mm - shape.joint_start_mm));
        assert!((mm3(label::BONE) / bones - 1.0).abs() < 0.01, "{} {bones}", mm3(label::BONE));
        let outer = Body::outer(&shape);
        let outer_section = outer.volume() - Body { tip_x: outer.tip_x - 1.0, ..outer }.volume();
        let soft = outer.volume() + outer_section * more - bones;
        assert!((mm3(label::SOFT) / soft - 1.0).abs() < 0.003, "{} {soft}", mm3(label::SOFT));
        assert!((60.0..110.0).contains(&mm3(label::NAIL)), "{}", mm3(label::NAIL));
    }

    #[test]
    fn a_volume_that_is_too_small_is_refused() {
        let small = PhantomSettings { extent_mm: [120.0, 15.0, 30.0], ..Default::default() };
        let error = phantom(&FingertipShape::default(), &small).unwrap_err().to_string();
        assert!(error.contains("extent_mm = 15") && error.contains("axis 1"), "{error}");
    }
}
