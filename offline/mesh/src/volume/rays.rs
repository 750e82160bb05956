//! Points where rays from the axis leave the skin and the bone.

use nalgebra::Vector3;

use super::super::surface::Body;
use super::error::VolumeError;
use super::tissue::{Kind, Pose, Tissue};

/// One measured point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Distance from the template's point to the ray's exit, mm; None if it cannot be measured.
    pub(super) offset_mm: Option<f64>,
    /// Slack of the labels to both sides, along the ray, mm.
    pub(super) slack_mm: f64,
    /// Direction of the ray, in the finger's frame.
    pub(super) direction: Vector3<f64>,
}

/// Rays into a surface of the labels, from the axis of its template.
pub(super) struct Rays<'a> {
    pub(super) tissue: &'a Tissue,
    pub(super) pose: Pose,
    /// The template; rays begin on its axis.
    pub(super) body: &'a Body,
    /// `the skin` or `the bone`.
    pub(super) surface: &'static str,
    /// Kinds inside the surface.
    pub(super) inside: fn(Kind) -> bool,
    /// Kinds that are allowed between two parts of the inside.
    pub(super) between: fn(Kind) -> bool,
    pub(super) noise: f64,
    /// x of the tip, mm, for messages.
    pub(super) length_mm: f64,
}

impl Rays<'_> {
    /// Where the ray through a point of the template begins: on the axis, in the point's section but for those
    /// near the tip, which share a centre.
    pub(super) fn origin(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let x = point.x.min(self.body.tip_x - 0.8 * self.body.a.min(self.body.b));
        Vector3::new(x, 0.0, self.body.axis_z + self.body.taper.height(x))
    }

    /// Follows the ray through a point of the template to its last exit from the surface.
    ///
    /// # Errors
    /// A ray that begins outside, never leaves, or enters again after more than a voxel.
    pub(super) fn crossing(&self, point: &Vector3<f64>) -> Result<Crossing, VolumeError> {
        let origin = self.origin(point);
        let (ray, h) = (point - origin, self.tissue.spacing_mm);
        let (length, direction) = (ray.norm(), ray.normalize());
        let step = 0.25 * h.iter().copied().fold(f64::INFINITY, f64::min);
        let steps = ((1.8 * length + 4.0) / step).ceil() as usize;
        let fail = |what: String| self.failure(&origin, point, what);
        let (mut left, mut gap, mut last) = (None, 0.0, self.share(&origin, self.inside));
        if last < 0.5 {
            return Err(fail("begins outside it".into()));
        }
        for n in 1..=steps {
            let at = step * n as f64;
            let place = origin + at * direction;
            let share = self.share(&place, self.inside);
            match left {
                None if share < 0.5 => left = Some(at - step * (0.5 - share) / (last - share)),
                Some(first) if share >= 0.5 => {
                    if gap > self.voxel_along(&direction) {
                        return Err(fail(format!(
                            "leaves after {first:.2} mm and is inside again after {at:.2} mm, with {gap:.2} mm between"
                        )));
                    }
                    left = None;
                }
                Some(_) if self.share(&place, self.between) < 0.5 => gap += step,
                _ => {}
            }
            if left.is_none() {
                gap = 0.0;
            }
            last = share;
        }
        let left = left.ok_or_else(|| fail(format!("is still inside after {:.1} mm", step * steps as f64)))?;
        let normal = self.pose.rotation * self.body.normal(point);
        let support: f64 = (0..3).map(|axis| normal[axis].abs() * h[axis]).sum();
        let slant = (self.pose.rotation * direction).dot(&normal).abs().max(0.3);
        let slack_mm = 0.5 * self.noise * support / slant;
        Ok(Crossing { offset_mm: Some(left - length), slack_mm, direction })
    }

    /// A crossing of which nothing is known.
    pub(super) fn unknown(&self, point: &Vector3<f64>) -> Crossing {
        let direction = (point - self.origin(point)).normalize();
        Crossing { offset_mm: None, slack_mm: 0.0, direction }
    }

    /// Trilinear share of voxels around a point of the finger's frame that are such.
    fn share(&self, point: &Vector3<f64>, of: fn(Kind) -> bool) -> f64 {
        let (size, h) = (self.tissue.size, self.tissue.spacing_mm);
        let place = self.pose.to_volume(point);
        let mut base = [0i64; 3];
        let mut part = [0.0; 3];
        for axis in 0..3 {
            let at = place[axis] / h[axis] - 0.5;
            base[axis] = at.floor() as i64;
            part[axis] = at - at.floor();
        }
        let mut share = 0.0;
        for corner in 0..8usize {
            let mut weight = 1.0;
            let mut index = [0usize; 3];
            for axis in 0..3 {
                let up = corner >> axis & 1;
                weight *= if up == 1 { part[axis] } else { 1.0 - part[axis] };
                index[axis] = (base[axis] + up as i64).clamp(0, size[axis] as i64 - 1) as usize;
            }
            if weight > 0.0 && of(self.tissue.kinds[self.tissue.index(index)]) {
                share += weight;
            }
        }
        share
    }

    /// Length of a voxel along a direction of the finger's frame, mm.
    fn voxel_along(&self, direction: &Vector3<f64>) -> f64 {
        let direction = self.pose.rotation * direction;
        (0..3).map(|axis| direction[axis].abs() * self.tissue.spacing_mm[axis]).sum()
    }

    fn failure(&self, origin: &Vector3<f64>, point: &Vector3<f64>, what: String) -> VolumeError {
        let file = |p: &Vector3<f64>| self.tissue.voxel_in_file(&self.pose.to_volume(p));
        let ray = point - origin;
        VolumeError::NotStarShaped {
            surface: self.surface,
            from: file(origin),
            through: file(point),
            what,
            from_tip_mm: self.length_mm - point.x,
            angle_deg: ray.y.atan2(-ray.z).to_degrees(),
        }
    }
}
