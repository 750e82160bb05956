//! The parametric shape nearest to the labels, and where the finger lies among the voxels.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use super::super::FingertipShape;
use super::super::surface::Body;
use super::error::VolumeError;
use super::fit::Sample;
use super::tissue::{Kind, Pose, Tissue};
use super::{VolumeGeometry, fit, nail};

/// The template.
pub(super) struct Template {
    pub(super) shape: FingertipShape,
    pub(super) pose: Pose,
    pub(super) yaw_deg: f64,
    pub(super) skin_rms_mm: f64,
    pub(super) bone_rms_mm: f64,
    pub(super) nail_measured: bool,
}

/// A border between two voxels, in the finger's frame.
struct Border {
    sample: Sample,
    /// Kind on the inner side.
    kind: Kind,
    /// Axis and direction of the step outward, in the turned volume.
    axis: usize,
    sign: f64,
}

impl Template {
    /// Places the finger, separates the bones, fits both surfaces.
    pub(super) fn of(tissue: &mut Tissue, settings: &VolumeGeometry) -> Result<Self, VolumeError> {
        let length = settings.length_mm;
        split_bones(tissue, settings)?;
        let yaw_deg = settings.yaw_deg.unwrap_or_else(|| yaw_of(tissue, length));
        let [yaw, pitch, roll] = [yaw_deg, settings.pitch_deg, settings.roll_deg].map(f64::to_radians);
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), roll);

        let mut pose = Pose { rotation, origin_mm: Vector3::zeros() };
        let points: Vec<Sample> = borders(tissue, pose, Kind::is_inside).map(|b| b.sample).collect();
        let most = |it: &mut dyn Iterator<Item = f64>| it.fold(f64::NEG_INFINITY, f64::max);
        let tip = most(&mut points.iter().map(|p| p.place.x));
        let shaft: Vec<Vector3<f64>> = points.iter().map(|p| p.place).collect();
        let shaft: Vec<_> = shaft.iter().filter(|p| (0.0..0.25 * length).contains(&(p.x - tip + length))).collect();
        let (mut middle, mut half) = ([0.0; 2], [0.0; 2]);
        for (c, axis) in [1, 2].into_iter().enumerate() {
            let (high, low) = (most(&mut shaft.iter().map(|p| p[axis])), -most(&mut shaft.iter().map(|p| -p[axis])));
            (middle[c], half[c]) = (0.5 * (high + low), 0.5 * (high - low));
        }
        let start = Vector3::new(tip - length, middle[0], middle[1]);
        let moved = points.iter().map(|p| Sample { place: p.place - start, ..*p });
        let points: Vec<_> = moved.filter(|p| p.place.x > 0.0).collect();
        let outer = fit::outer(&points, length, half)?;
        pose.origin_mm = rotation * (start + outer.shift);

        let bones = borders(tissue, pose, Kind::is_bone);
        let bones: Vec<Border> = bones.filter(|b| (0.0..length).contains(&b.sample.place.x)).collect();
        let (bone, bone_rms_mm) = bone_body(&bones, outer.body, length)?;
        let joint = match settings.joint_from_tip_mm {
            Some([near, far]) => [length - far, length - near],
            None => joint(&bones, &bone)?,
        };
        let mut shape = shape_of(settings, &outer.body, &bone, joint);
        let nail_measured = nail::measure(&mut shape, tissue, pose, settings);
        shape.validate().map_err(|error| {
            VolumeError::Fit(format!("the parametric shape nearest to the labels is out of range ({error})"))
        })?;
        Ok(Self { shape, pose, yaw_deg, skin_rms_mm: outer.rms_mm, bone_rms_mm, nail_measured })
    }
}

fn shape_of(settings: &VolumeGeometry, outer: &Body, bone: &Body, joint: [f64; 2]) -> FingertipShape {
    let length = settings.length_mm;
    FingertipShape {
        half_width_mm: outer.a,
        half_thickness_mm: outer.b,
        length_mm: length,
        // The caps begin beyond the joint.
        cap_length_mm: outer.cap.min(length - joint[1] - 0.5),
        section_exponent: outer.n,
        profile_exponent: outer.m,
        taper_slope: outer.taper.slope,
        taper_start_mm: outer.taper.start_mm.clamp(0.0, 0.9 * length),
        taper_blend_mm: outer.taper.blend_mm,
        skin_thickness_mm: settings.skin_thickness_mm,
        bone_half_width_mm: bone.a,
        bone_half_thickness_mm: bone.b,
        bone_cap_length_mm: bone.cap.min(bone.tip_x - joint[1]),
        bone_section_exponent: bone.n,
        bone_profile_exponent: bone.m,
        bone_dorsal_offset_mm: bone.axis_z,
        bone_distal_clearance_mm: length - bone.tip_x,
        joint_start_mm: joint[0],
        joint_end_mm: joint[1],
        nail: settings.nail,
        pad_height_mm: settings.pad_height_mm,
        inclination_deg: settings.inclination_deg,
        ..FingertipShape::default()
    }
}

/// Borders between voxels that are such and their neighbours that are not.
fn borders(tissue: &Tissue, pose: Pose, of: fn(Kind) -> bool) -> impl Iterator<Item = Border> + '_ {
    let inside = (0..tissue.kinds.len()).filter(move |v| of(tissue.kinds[*v]));
    inside.flat_map(move |voxel| {
        let kind = tissue.kinds[voxel];
        tissue.neighbours(voxel).filter(move |(n, _, _)| !of(tissue.kinds[*n])).map(move |(_, axis, sign)| {
            let mut place = tissue.middle(tissue.place(voxel));
            place[axis] += 0.5 * sign * tissue.spacing_mm[axis];
            let step = pose.rotation.inverse() * Vector3::ith(axis, tissue.spacing_mm[axis]);
            Border { sample: Sample { place: pose.to_finger(&place), step }, kind, axis, sign }
        })
    })
}

/// Turn about the dorsal axis: of the line through the middles of the sections, degrees. The sections are perpendicular
/// to the line itself, hence the iteration: oblique sections give wrong middles where the finger narrows.
fn yaw_of(tissue: &Tissue, length_mm: f64) -> f64 {
    let inside: Vec<Vector3<f64>> = (0..tissue.kinds.len())
        .filter(|v| tissue.kinds[*v].is_inside())
        .map(|v| tissue.middle(tissue.place(v)))
        .collect();
    let mut yaw = 0.0f64;
    for _ in 0..6 {
        let (sin, cos) = yaw.sin_cos();
        let turned = || inside.iter().map(|p| (cos * p.x + sin * p.y, cos * p.y - sin * p.x));
        let tip = turned().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
        let width = tissue.spacing_mm[0].max(tissue.spacing_mm[1]);
        let mut sections: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
        for (x, y) in turned().filter(|(x, _)| (0.2 * length_mm..length_mm).contains(&(tip - x))) {
            let section = sections.entry((x / width).floor() as i64).or_default();
            *section = (section.0 + y, section.1 + 1.0);
        }
        // The lattice fills the first and last ones on one side only.
        for _ in 0..2 {
            sections.pop_first();
            sections.pop_last();
        }
        let middles: Vec<(f64, f64)> = sections.iter().map(|(i, (sum, n))| (*i as f64 * width, sum / n)).collect();
        let n = middles.len() as f64;
        let (mx, my) = middles.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / n, my + y / n));
        let (xx, xy) =
            middles.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - mx).powi(2), xy + (x - mx) * (y - my)));
        let more = if xx > 0.0 { (xy / xx).atan() } else { 0.0 };
        yaw += more;
        if more.abs() < 1e-4 {
            break;
        }
    }
    yaw.to_degrees()
}

/// Separates the distal phalanx from the next bone; other bits of bone become soft tissue.
fn split_bones(tissue: &mut Tissue, settings: &VolumeGeometry) -> Result<(), VolumeError> {
    let filled = |i: usize| tissue.kinds[..].iter().enumerate().any(|(v, k)| k.is_inside() && tissue.place(v)[0] == i);
    let tip = (0..tissue.size[0]).rev().find(|&i| filled(i)).map_or(0, |i| i + 1);
    let from_tip = |i: usize| (tip as f64 - i as f64 - 0.5) * tissue.spacing_mm[0];
    if let Some([near, far]) = settings.joint_from_tip_mm {
        for voxel in 0..tissue.kinds.len() {
            if tissue.kinds[voxel].is_bone() {
                tissue.kinds[voxel] = match from_tip(tissue.place(voxel)[0]) {
                    d if d < near => Kind::DistalBone,
                    d if d < far => Kind::Soft,
                    _ => Kind::ProximalBone,
                };
            }
        }
        return Ok(());
    }
    let pieces = tissue.pieces(Kind::is_bone);
    let along = |piece: &[usize]| {
        let all = piece.iter().map(|v| from_tip(tissue.place(*v)[0]));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[near, far], d| [near.min(d), far.max(d)])
    };
    let spans: Vec<[f64; 2]> = pieces.iter().map(|p| along(p)).collect();
    let near = |n: &usize| spans[*n][0];
    let no_joint = VolumeError::NoJoint { length_mm: settings.length_mm, pieces: pieces.len() };
    let distal = (0..pieces.len()).min_by(|a, b| near(a).total_cmp(&near(b))).ok_or(no_joint.clone())?;
    // The next bone: the largest piece that lies wholly behind the first one's middle and reaches the cut.
    let middle = 0.5 * (spans[distal][0] + spans[distal][1]);
    let behind = |n: &usize| *n != distal && spans[*n][0] > middle && spans[*n][1] > settings.length_mm;
    let proximal = (0..pieces.len()).find(behind);
    let Some(proximal) = proximal.filter(|n| spans[*n][0] < settings.length_mm) else {
        return Err(no_joint);
    };
    for (n, piece) in pieces.into_iter().enumerate() {
        let kind = match n {
            _ if n == distal => Kind::DistalBone,
            _ if n == proximal => Kind::ProximalBone,
            _ => Kind::Soft,
        };
        if kind == Kind::Soft {
            tissue.dropped += piece.len();
        }
        piece.into_iter().for_each(|v| tissue.kinds[v] = kind);
    }
    Ok(())
}

/// Fits the bones' common surface to their borders, the ends that face each other left out.
fn bone_body(bones: &[Border], outer: Body, length_mm: f64) -> Result<(Body, f64), VolumeError> {
    let facing = |b: &Border| {
        b.axis == 0
            && match b.kind {
                Kind::DistalBone => b.sign < 0.0,
                _ => b.sign > 0.0,
            }
    };
    let points: Vec<_> = bones.iter().filter(|b| !facing(b)).map(|b| b.sample).collect();
    fit::bone(&points, outer.taper, length_mm)
}

/// x of the ends of the two bones, near their axis.
fn joint(bones: &[Border], body: &Body) -> Result<[f64; 2], VolumeError> {
    let end = |kind: Kind, sign: f64| {
        let near_axis = |b: &&Border| {
            let z = b.sample.place.z - body.axis_z - body.taper.height(b.sample.place.x);
            (b.sample.place.y / body.a).hypot(z / body.b) < 0.6
        };
        let faces = bones.iter().filter(|b| b.kind == kind && b.axis == 0 && b.sign == sign).filter(near_axis);
        let mut places: Vec<f64> = faces.map(|b| b.sample.place.x).collect();
        places.sort_unstable_by(f64::total_cmp);
        places.get(places.len() / 2).copied()
    };
    match (end(Kind::ProximalBone, 1.0), end(Kind::DistalBone, -1.0)) {
        (Some(start), Some(end)) if start < end => Ok([start, end]),
        found => Err(VolumeError::Fit(format!("the ends of the bones at the joint are not clear: {found:?} mm"))),
    }
}
