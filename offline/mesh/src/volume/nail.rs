//! The nail's place and thickness, from its label or from the settings.

use super::super::FingertipShape;
use super::super::surface::Body;
use super::VolumeGeometry;
use super::tissue::{Kind, Pose, Tissue};

/// Less nail than this is noise, mm³.
const LEAST_MM3: f64 = 5.0;

/// Sets the nail of `shape`: by the settings first, then by the label, then as in shape E. Returns whether the label
/// was used.
pub(super) fn measure(shape: &mut FingertipShape, tissue: &Tissue, pose: Pose, settings: &VolumeGeometry) -> bool {
    let measured = from_label(shape, tissue, pose);
    let length = settings.length_mm;
    let (mut from_tip, mut half_angle_deg, mut thickness_mm) = ([2.0, 14.0], 50.0, 0.5);
    if let Some(nail) = &measured {
        from_tip = [length - nail.along_mm[1], length - nail.along_mm[0]];
        (half_angle_deg, thickness_mm) = (nail.half_angle_deg, nail.thickness_mm);
    }
    let [near, far] = settings.nail_from_tip_mm.unwrap_or(from_tip);
    (shape.nail_start_mm, shape.nail_end_mm) = (length - far, length - near);
    shape.nail_half_angle_deg = settings.nail_half_angle_deg.unwrap_or(half_angle_deg);
    shape.nail_thickness_mm = settings.nail_thickness_mm.unwrap_or(thickness_mm);
    measured.is_some()
}

struct Measured {
    along_mm: [f64; 2],
    half_angle_deg: f64,
    thickness_mm: f64,
}

fn from_label(shape: &FingertipShape, tissue: &Tissue, pose: Pose) -> Option<Measured> {
    let body = Body::outer(shape);
    let h = tissue.spacing_mm;
    let voxel_mm3: f64 = h.iter().product();
    let (mut along, mut angles) = (Vec::new(), Vec::new());
    let (mut volume, mut area, mut under) = (0.0, 0.0, 0.0);
    for (voxel, _) in tissue.kinds.iter().enumerate().filter(|(_, k)| **k == Kind::Nail) {
        let point = pose.to_finger(&tissue.middle(tissue.place(voxel)));
        let closest = body.closest_point(&point);
        along.push(closest.x);
        angles.push(closest.y.atan2(closest.z - body.taper.height(closest.x)).to_degrees().abs());
        volume += voxel_mm3;
        // The flux of the normal through the staircase under the nail is its area.
        let normal = pose.rotation * body.normal(&closest);
        for (neighbour, axis, sign) in tissue.neighbours(voxel) {
            if tissue.kinds[neighbour].is_inside() {
                area -= sign * normal[axis] * voxel_mm3 / h[axis];
                under += 1.0;
            }
        }
    }
    if !(volume > LEAST_MM3 && under > 0.0 && area > 0.0) {
        return None;
    }
    // A few stray voxels must not set the edges; half a voxel lies beyond the outermost middle.
    let quantile = |values: &mut Vec<f64>, q: f64| {
        values.sort_unstable_by(f64::total_cmp);
        values[((values.len() - 1) as f64 * q).round() as usize]
    };
    let (start, end) = (quantile(&mut along, 0.002) - 0.5 * h[0], quantile(&mut along, 0.998) + 0.5 * h[0]);
    Some(Measured {
        along_mm: [start, end.min(shape.length_mm - 0.5)],
        half_angle_deg: quantile(&mut angles, 0.995).clamp(5.0, 85.0),
        thickness_mm: volume / area,
    })
}
