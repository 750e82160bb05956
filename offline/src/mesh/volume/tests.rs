use super::*;
use crate::mesh::surface::Body;
use crate::mesh::{MeshPreset, fingertip, quality, set};

/// A phantom of a shape at this voxel size along the finger; `stretch` makes voxels longer across and up.
fn phantom_of(shape: &FingertipShape, voxel_mm: f64, stretch: [f64; 2]) -> LabelVolume {
    let extent = [32.0, 24.0, 24.0];
    let h = [voxel_mm, voxel_mm * stretch[0], voxel_mm * stretch[1]];
    let voxels = [0, 1, 2].map(|axis| (extent[axis] / h[axis]) as usize);
    phantom(shape, &PhantomSettings { voxels, extent_mm: extent, ..Default::default() }).unwrap()
}

#[test]
fn the_phantom_gives_its_shape_back() {
    let shape = FingertipShape::named("e").unwrap();
    let divisions = MeshPreset::Coarse.divisions();
    let volume = phantom_of(&shape, 0.25, [1.0, 1.0]);
    let start = std::time::Instant::now();
    let made = volume_fingertip(&volume, &VolumeGeometry::default(), &divisions).unwrap();
    println!("{:?}", start.elapsed());
    println!("{:#?}\n{:#?}", made.template, made.report);
    let exact = fingertip(&shape, &divisions).unwrap();
    let body = Body::outer(&shape);
    let (mut worst, mut sum) = (0.0f64, 0.0);
    let nodes: std::collections::BTreeSet<u32> = made.fingertip.outer_faces.iter().flatten().copied().collect();
    for &n in &nodes {
        let p = made.fingertip.mesh.nodes[n as usize];
        let off = body.distance(&(exact.touch.rotation.transpose() * p + exact.touch.point_mm));
        worst = worst.max(off.abs());
        sum += off * off;
    }
    let rms = (sum / nodes.len() as f64).sqrt();
    let report = quality(&made.fingertip.mesh);
    println!("skin nodes off the surface: rms {rms:.4}, worst {worst:.4} mm; {report:?}");
    println!("touch {:?} exact {:?}", made.fingertip.touch, exact.touch);
    assert!(made.fingertip.mesh.node_set(set::PAD).len() > 10);
}
