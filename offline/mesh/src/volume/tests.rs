use std::collections::BTreeSet;

use nalgebra::Rotation3;

use super::phantom::Rasteriser;
use super::*;
use crate::closest_point::nearest_on_faces;
use crate::surface::Body;
use crate::{Mesh, MeshPreset, Region, fingertip, quality, set};

const EXTENT: [f64; 3] = [32.0, 24.0, 24.0];

/// Settings of a phantom of this voxel size along the finger; `stretch` makes voxels longer across and up.
fn settings(voxel_mm: f64, stretch: [f64; 2]) -> PhantomSettings {
    let h = [voxel_mm, voxel_mm * stretch[0], voxel_mm * stretch[1]];
    let voxels = [0, 1, 2].map(|axis| (EXTENT[axis] / h[axis]) as usize);
    PhantomSettings { voxels, extent_mm: EXTENT, ..Default::default() }
}

fn shape_e() -> FingertipShape {
    FingertipShape::named("e").unwrap()
}

fn coarse(volume: &LabelVolume, geometry: &VolumeGeometry) -> Result<VolumeFingertip, VolumeError> {
    volume_fingertip(volume, geometry, &MeshPreset::Coarse.divisions())
}

fn outer_nodes(fingertip: &Fingertip) -> BTreeSet<u32> {
    fingertip.outer_faces.iter().flatten().copied().collect()
}

/// Errors of the skin's nodes against a distance function in the finger's frame: the worst and the root mean square.
fn off(fingertip: &Fingertip, distance: impl Fn(&Vector3<f64>) -> f64) -> (f64, f64) {
    let nodes = outer_nodes(fingertip);
    let touch = &fingertip.touch;
    let (mut worst, mut sum) = (0.0f64, 0.0);
    for &n in &nodes {
        let p = touch.rotation.transpose() * fingertip.mesh.nodes[n as usize] + touch.point_mm;
        worst = worst.max(distance(&p).abs());
        sum += distance(&p).powi(2);
    }
    (worst, (sum / nodes.len() as f64).sqrt())
}

fn volume_of(mesh: &Mesh, regions: &[Region]) -> f64 {
    quality(mesh).regions.iter().filter(|(r, _)| regions.contains(r)).map(|(_, q)| q.volume_mm3).sum()
}

#[test]
fn the_phantom_gives_its_shape_back() {
    gives_its_shape_back(&[(0.25, [1.5, 1.2], 0.04, 0.015), (0.5, [1.0, 1.0], 0.08, 0.03)]);
}

#[test]
#[ignore = "nightly"]
fn a_fine_phantom_gives_its_shape_back() {
    gives_its_shape_back(&[(0.234_375, [1.0, 1.0], 0.02, 0.006)]);
}

/// Voxels and their stretch, with the bounds of the skin and of the first touch, mm.
fn gives_its_shape_back(volumes: &[(f64, [f64; 2], f64, f64)]) {
    let shape = shape_e();
    let exact = fingertip(&shape, &MeshPreset::Coarse.divisions()).unwrap();
    let body = Body::outer(&shape);
    for &(voxel, stretch, worst_mm, touch_mm) in volumes {
        let volume = phantom(&shape, &settings(voxel, stretch)).unwrap();
        let made = coarse(&volume, &VolumeGeometry::default()).unwrap();
        // The finger's own frame: the fitted tip is the shape's but for this.
        let shift = Vector3::x() * (made.template.bone_distal_clearance_mm - shape.bone_distal_clearance_mm);
        let (worst, rms) = off(&made.fingertip, |p| body.distance(&(p + shift)));
        let depth = |tip: &Fingertip| {
            let bone = tip.mesh.node_set(set::DISTAL_BONE);
            bone.iter().map(|n| tip.mesh.nodes[*n as usize].z).fold(f64::INFINITY, f64::min)
        };
        let touch = depth(&made.fingertip) - depth(&exact);
        println!("{voxel} mm {stretch:?}: skin off by {rms:.4} mm rms, {worst:.4} worst; bone over plane {touch:+.4}");
        assert!(worst < worst_mm, "{voxel}: {worst} mm");
        assert!(touch.abs() < touch_mm, "{voxel}: {touch} mm");
        for regions in [&[Region::Skin][..], &[Region::Subcutaneous], &[Region::DistalBone, Region::ProximalBone]] {
            let ratio = volume_of(&made.fingertip.mesh, regions) / volume_of(&exact.mesh, regions);
            println!("  {regions:?}: {:+.2} % of volume", 100.0 * (ratio - 1.0));
            assert!((ratio - 1.0).abs() < 0.01 + 0.06 * voxel, "{regions:?}: {ratio}");
        }
        assert_eq!(made.fingertip.mesh.hexes.len(), exact.mesh.hexes.len());
        assert!(made.report.nail_measured && quality(&made.fingertip.mesh).worst_hex_scaled_jacobian > 0.35);
        let measured = [made.template.nail_thickness_mm, made.template.nail_half_angle_deg];
        assert!((measured[0] - 0.5).abs() < 0.06 && (measured[1] - 50.0).abs() < 3.0, "{measured:?}");
    }
}

/// A finger that no parameters describe: bent sideways, the pulp bulged to one side, a dent; and where a point of it
/// lies in the plain shape.
fn warped(p: &Vector3<f64>) -> Vector3<f64> {
    let bump = |x: f64, y: f64, wide: f64| (-((p.x - x).powi(2) + (p.y - y).powi(2)) / (2.0 * wide * wide)).exp();
    let palmar = 0.5 * (1.0 - (0.5 * p.z).tanh());
    let bend = 0.003 * (p.x - 12.0).powi(2);
    let lift = palmar * (0.7 * bump(17.0, 1.5, 3.5) - 0.4 * bump(9.0, -3.0, 2.5));
    p + Vector3::new(0.0, -bend, lift)
}

/// Label volume of the warped finger, turned by `yaw_deg` about the dorsal axis through the middle of the volume.
fn warped_volume(yaw_deg: f64, voxel_mm: f64) -> LabelVolume {
    let (shape, settings) = (shape_e(), settings(voxel_mm, [1.0, 1.0]));
    let (origin, h) = (settings.origin_mm(&shape), settings.spacing_mm());
    let rasteriser = Rasteriser::new(&shape, shape.nail_thickness_mm);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_deg.to_radians());
    let [ni, nj, nk] = settings.voxels;
    let mut labels = Vec::new();
    for k in 0..nk {
        for j in 0..nj {
            for i in 0..ni {
                let middle = Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                let place = middle.component_mul(&Vector3::from(h)) - origin - Vector3::x() * 12.0;
                labels.push(rasteriser.label(&warped(&(turn * place + Vector3::x() * 12.0))));
            }
        }
    }
    LabelVolume::new(settings.voxels, h, labels)
}

#[test]
fn a_finger_that_is_no_template_is_followed() {
    let shape = shape_e();
    let body = Body::outer(&shape);
    let geometry = VolumeGeometry { yaw_deg: Some(0.0), ..Default::default() };
    let volume = warped_volume(0.0, 0.25);
    let made = volume_fingertip(&volume, &geometry, &MeshPreset::Default.divisions()).unwrap();
    println!("{:#?}", made.report);
    // The frame of the finger is that of the template's tip and axis; it is computed here from the skin itself.
    let distance = |p: &Vector3<f64>| body.distance(&warped(p));
    let start = Vector3::zeros();
    let frame = (0..80).fold(start, |shift, _| {
        let mut best = (off(&made.fingertip, |p| distance(&(p + shift))).1, shift);
        for axis in 0..3 {
            for step in [-0.01, 0.01] {
                let moved = shift + step * Vector3::ith(axis, 1.0);
                let rms = off(&made.fingertip, |p| distance(&(p + moved))).1;
                if rms < best.0 {
                    best = (rms, moved);
                }
            }
        }
        best.1
    });
    let (worst, rms) = off(&made.fingertip, |p| distance(&(p + frame)));
    println!("frame moved by {frame:?}; skin off by {rms:.4} mm rms, {worst:.4} mm worst");
    // A quarter and two thirds of a voxel.
    assert!(rms < 0.0625 && worst < 0.17, "{rms} {worst}");

    // Normals: from the skin's inner to its outer nodes.
    let touch = &made.fingertip.touch;
    let finger = |n: u32| touch.rotation.transpose() * made.fingertip.mesh.nodes[n as usize] + touch.point_mm + frame;
    let (mut angles, mut hexes) = (Vec::new(), 0);
    let outer = outer_nodes(&made.fingertip);
    for hex in made.fingertip.mesh.hexes.iter().filter(|h| h.region == Region::Skin && outer.contains(&h.nodes[4])) {
        hexes += 1;
        for c in 0..4 {
            let (inner, skin) = (finger(hex.nodes[c]), finger(hex.nodes[c + 4]));
            if skin.z < -2.0 && (6.0..22.0).contains(&skin.x) {
                let gradient = Vector3::from_fn(|axis, _| {
                    let step = 1e-4 * Vector3::ith(axis, 1.0);
                    distance(&(skin + step)) - distance(&(skin - step))
                });
                angles.push((skin - inner).angle(&gradient).to_degrees());
            }
        }
    }
    let rms_deg = (angles.iter().map(|a| a * a).sum::<f64>() / angles.len() as f64).sqrt();
    let worst_deg = angles.iter().copied().fold(0.0, f64::max);
    println!("normals of the pad, {} nodes of {hexes} hexes: {rms_deg:.2}° rms, {worst_deg:.2}° worst", angles.len());
    assert!(rms_deg < 4.0 && worst_deg < 15.0, "{rms_deg} {worst_deg}");

    // The opposite direction: from points of the true surface to the mesh.
    let mesh = &made.fingertip.mesh;
    let mut far = 0.0f64;
    for i in 0..40 {
        for j in 0..40 {
            let (x, angle) = (2.0 + 0.5 * f64::from(i), f64::from(j) * std::f64::consts::TAU / 40.0);
            let (mut low, mut high) = (2.0, 14.0);
            let axis = body.taper.height(x);
            let at = |r: f64| Vector3::new(x, r * angle.sin(), axis - r * angle.cos());
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if distance(&at(middle)) < 0.0 { low = middle } else { high = middle }
            }
            if x > 22.0 {
                continue;
            }
            let point = touch.to_plane(&(at(low) - frame));
            let closest = nearest_on_faces(&point, &made.fingertip.outer_faces, &mesh.nodes);
            far = far.max((closest.position - point).norm());
        }
    }
    println!("the true surface is up to {far:.3} mm from the mesh (facets included)");
    assert!(far < 0.35, "{far}");
    assert!(quality(mesh).worst_hex_scaled_jacobian > 0.2);
}

#[test]
fn a_turned_finger_is_found() {
    let geometry = VolumeGeometry::default();
    let (straight, turned) =
        (coarse(&warped_volume(0.0, 0.4), &geometry).unwrap(), coarse(&warped_volume(5.0, 0.4), &geometry).unwrap());
    let yaw = turned.report.yaw_deg - straight.report.yaw_deg;
    println!("yaw {:.3} and {:.3} degrees", straight.report.yaw_deg, turned.report.yaw_deg);
    assert!((yaw - 5.0).abs() < 0.3, "{yaw}");
    let area = |f: &VolumeFingertip| quality(&f.fingertip.mesh).pad_area_mm2;
    let volume = |f: &VolumeFingertip| quality(&f.fingertip.mesh).volume_mm3();
    assert!((volume(&turned) / volume(&straight) - 1.0).abs() < 0.01);
    println!("pad {} and {} mm2", area(&straight), area(&turned));
}

#[test]
#[ignore = "nightly"]
fn the_order_of_axes_in_the_file_does_not_matter() {
    let volume = warped_volume(0.0, 0.5);
    let [ni, nj, nk] = volume.size;
    // i' = k, j' = -j, k' = -... : a proper turn of the file's axes, i runs down, k runs proximally.
    let mut labels = Vec::new();
    for i in (0..ni).rev() {
        for j in 0..nj {
            for k in 0..nk {
                labels.push(volume.labels[(k * nj + j) * ni + i]);
            }
        }
    }
    let h = volume.spacing_mm();
    let mut turned = LabelVolume::new([nk, nj, ni], [h[2], h[1], h[0]], labels);
    let geometry =
        VolumeGeometry { distal_axis: VoxelAxis::MinusK, dorsal_axis: VoxelAxis::PlusI, ..Default::default() };
    let (plain, other) = (coarse(&volume, &VolumeGeometry::default()).unwrap(), coarse(&turned, &geometry).unwrap());
    let apart = |a: &Fingertip, b: &Fingertip| {
        a.mesh.nodes.iter().zip(&b.mesh.nodes).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    assert!(apart(&plain.fingertip, &other.fingertip) < 1e-6, "{}", apart(&plain.fingertip, &other.fingertip));
    // A rotated scanner frame changes nothing; a reversed axis mirrors the finger.
    let askew = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
    turned.steps_mm = turned.steps_mm.map(|s| askew * s);
    assert!(apart(&plain.fingertip, &coarse(&turned, &geometry).unwrap().fingertip) < 1e-6);
    turned.steps_mm = turned.steps_mm.map(|s| -s);
    let mirrored = coarse(&turned, &geometry).unwrap();
    assert!(apart(&plain.fingertip, &mirrored.fingertip) > 0.1);
}

#[test]
fn bad_volumes_are_refused_with_place_and_labels() {
    let shape = shape_e();
    let grid = settings(0.4, [1.0, 1.0]);
    let volume = phantom(&shape, &grid).unwrap();
    let (origin, h) = (grid.origin_mm(&shape), grid.spacing_mm());
    let plain = VolumeGeometry::default();
    let refused = |volume: &LabelVolume, geometry: &VolumeGeometry| coarse(volume, geometry).unwrap_err();
    let changed = |change: &dyn Fn(Vector3<f64>, u16) -> u16| {
        let mut volume = volume.clone();
        let [ni, nj, _] = volume.size;
        for (n, label) in volume.labels.iter_mut().enumerate() {
            let index = Vector3::new((n % ni) as f64, (n / ni % nj) as f64, (n / ni / nj) as f64);
            let place = (index + Vector3::repeat(0.5)).component_mul(&Vector3::from(h)) - origin;
            *label = change(place, *label);
        }
        volume
    };
    let say = |error: VolumeError, expected: &[&str]| {
        let text = error.to_string();
        println!("{text}");
        assert!(expected.iter().all(|e| text.contains(e)), "{text}\nshould contain {expected:?}");
    };

    let odd = changed(&|p, l| if l == 1 && p.x > 20.0 { 7 } else { l });
    say(refused(&odd, &plain), &["label 7", "1 (", "2 ("]);
    let boneless = changed(&|_, l| if l == 2 { 1 } else { l });
    say(refused(&boneless, &plain), &["no voxel is bone (labels [2])", "labels 0 (", "3 ("]);
    let empty = changed(&|_, _| 0);
    say(refused(&empty, &plain), &["no voxel is soft tissue (labels [1])"]);
    let fused = changed(&|p, l| {
        let gap = (shape.joint_start_mm - 0.5..shape.joint_end_mm + 0.5).contains(&p.x);
        if gap && (p.z - 3.2).abs() < 1.0 && p.y.abs() < 1.0 { 2 } else { l }
    });
    say(refused(&fused, &plain), &["no joint gap within 25 mm", "1 piece(s)", "joint_from_tip_mm"]);
    let with_joint = VolumeGeometry { joint_from_tip_mm: Some([16.0, 18.0]), ..plain.clone() };
    coarse(&fused, &with_joint).unwrap();
    let long = VolumeGeometry { length_mm: 29.9, ..plain.clone() };
    say(refused(&volume, &long), &["the finger ends", "length_mm = 29.9"]);
    let distal_only = VolumeGeometry { length_mm: 15.0, ..plain.clone() };
    say(refused(&volume, &distal_only), &["no joint gap within 15 mm"]);
    // A cut under the pulp, open to the side: the ray down leaves and enters again.
    let cut =
        changed(&|p, l| if p.y > -2.0 && (13.0..16.0).contains(&p.x) && (-4.0..-2.5).contains(&p.z) { 0 } else { l });
    say(refused(&cut, &plain), &["the skin is not star-shaped", "inside again", "mm from the tip", "voxels"]);
    let hooked = changed(&|p, l| if l == 2 && p.x > 12.0 && p.x < 14.5 && p.z < 4.4 && p.z > 3.2 { 1 } else { l });
    say(refused(&hooked, &plain), &["the bone is not star-shaped"]);
    // A pocket of air and a speck beside the finger are repaired and reported.
    let dirty = changed(&|p, l| {
        let pocket = (p - Vector3::new(15.0, 0.0, -4.0)).norm() < 0.7;
        let speck = (p - Vector3::new(5.0, 10.5, 5.0)).norm() < 0.7;
        if pocket {
            0
        } else if speck {
            1
        } else {
            l
        }
    });
    let made = coarse(&dirty, &plain).unwrap();
    assert!(made.report.filled_voxels > 5 && made.report.dropped_voxels > 5, "{:?}", made.report);
    let twice = VolumeGeometry { labels: Labels { nail: vec![2], ..Labels::default() }, ..plain.clone() };
    say(refused(&volume, &twice), &["volume.labels = 2"]);
    let same = VolumeGeometry { dorsal_axis: VoxelAxis::MinusI, ..plain.clone() };
    say(refused(&volume, &same), &["volume.dorsal_axis"]);
    let nan = VolumeGeometry { skin_thickness_mm: f64::NAN, ..plain };
    say(refused(&volume, &nan), &["volume.skin_thickness_mm = NaN"]);
}
