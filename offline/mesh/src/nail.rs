//! The nail: a plate of tetrahedra on the dorsal skin, tied to its nodes, or a patch of fixed skin.
//! Frame of the finger, mm.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::surface::Body;
use super::{Divisions, FingertipShape, Region, Tet, Tie};

/// The six tetrahedra of a box with corners in VTK_HEXAHEDRON order, around its diagonal 0-6: in a
/// structured grid the diagonals of neighbouring boxes' faces agree.
pub(super) const BOX_TO_TETS: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];

/// A nail plate; node indices count from the end of the nodes that it was made for.
pub(super) struct Plate {
    /// Positions of the new nodes.
    pub(super) nodes: Vec<Vector3<f64>>,
    pub(super) tets: Vec<Tet>,
    pub(super) ties: Vec<Tie>,
    /// Nodes of the outer face.
    pub(super) outer: Vec<u32>,
}

/// Makes the plate on those of the skin's `dorsal` faces whose middles lie under the nail, a column of boxes on each,
/// symmetric about y = 0 if the faces are.
///
/// Each inner node of the plate is tied to the skin's node at the same place. The tie therefore constrains the skin
/// under every face of the nail and no other, up to half a face at the edge (at the tip's edge at the latest). A plate
/// with a grid of its own would constrain every face that it partly covers as a whole, an error of the order of their
/// size.
///
/// * `dorsal`: faces of a structured grid, counter-clockwise from outside, all in the same sense
pub(super) fn plate(
    shape: &FingertipShape,
    divisions: &Divisions,
    nodes: &[Vector3<f64>],
    dorsal: &[[u32; 4]],
) -> Plate {
    let body = Body::outer(shape);
    let footprint = Footprint::new(shape);
    let layers = divisions.nail_layers;
    let mirrored = mirrored(nodes, dorsal);
    // With an odd number of columns the boxes in the middle are their own mirror images, which their tetrahedra are not.
    let has_middle = divisions.columns.is_multiple_of(2);
    let first = nodes.len() as u32;
    let mut plate = Plate { nodes: vec![], tets: vec![], ties: vec![], outer: vec![] };
    // Lowest new node over each skin node.
    let mut over: BTreeMap<u32, u32> = BTreeMap::new();
    for face in dorsal {
        let middle = face.iter().map(|&n| nodes[n as usize]).sum::<Vector3<f64>>() / 4.0;
        if !footprint.covers(&middle) {
            continue;
        }
        for &skin in face {
            over.entry(skin).or_insert_with(|| {
                let slave = first + plate.nodes.len() as u32;
                let position = nodes[skin as usize];
                let normal = body.normal(&position);
                for layer in 0..=layers {
                    plate.nodes.push(position + shape.nail_thickness_mm * layer as f64 / layers as f64 * normal);
                }
                plate.ties.push(Tie { slave, masters: vec![(skin, 1.0)] });
                plate.outer.push(slave + layers as u32);
                slave
            });
        }
        for layer in 0..layers as u32 {
            let on_right = has_middle && middle.y < 0.0;
            let corners = if on_right { mirrored.map(|k| face[k]) } else { *face }.map(|skin| over[&skin] + layer);
            let corner = |n: usize| corners[n % 4] + n as u32 / 4;
            plate.tets.extend(BOX_TO_TETS.map(|[p, q, r, s]| {
                // A mirrored tetrahedron would be inside out.
                let order = if on_right { [q, p, r, s] } else { [p, q, r, s] };
                Tet { nodes: order.map(corner), region: Region::Nail }
            }));
        }
    }
    plate
}

/// Places in a face of the corners' mirror images, about y = 0, in the face that is its own.
///
/// The diagonals of a box's faces across y are the same in its mirror image, so that neighbours still agree.
fn mirrored(nodes: &[Vector3<f64>], faces: &[[u32; 4]]) -> [usize; 4] {
    let across = |k: usize| faces.iter().map(|f| (nodes[f[k] as usize].y - nodes[f[0] as usize].y).abs()).sum::<f64>();
    if across(1) > across(3) { [1, 0, 3, 2] } else { [3, 2, 1, 0] }
}

/// Place and size of the nail.
struct Footprint {
    body: Body,
    along_mm: [f64; 2],
    half_angle: f64,
}

impl Footprint {
    fn new(shape: &FingertipShape) -> Self {
        Self {
            body: Body::outer(shape),
            along_mm: [shape.nail_start_mm, shape.nail_end_mm],
            half_angle: shape.nail_half_angle_deg.to_radians(),
        }
    }

    /// Whether a point of the skin lies under the nail.
    fn covers(&self, point: &Vector3<f64>) -> bool {
        let angle = point.y.atan2(point.z - self.body.taper.height(point.x));
        (self.along_mm[0]..=self.along_mm[1]).contains(&point.x) && angle.abs() <= self.half_angle
    }
}

/// Skin nodes of the nail's patch.
pub(super) fn patch(shape: &FingertipShape, nodes: &[Vector3<f64>], faces: &[[u32; 4]]) -> Vec<u32> {
    let footprint = Footprint::new(shape);
    faces.iter().flatten().copied().filter(|&n| footprint.covers(&nodes[n as usize])).collect()
}

#[cfg(test)]
mod tests {
    use crate::{FingertipShape, MeshPreset, Region, fingertip, quality, set};

    #[test]
    fn plate_covers_the_nail_to_half_a_face() {
        for name in FingertipShape::NAMES {
            for (preset, most_mm) in [(MeshPreset::Coarse, 1.5), (MeshPreset::Default, 1.0), (MeshPreset::Fine, 0.6)] {
                let shape = FingertipShape::named(name).unwrap();
                let tip = fingertip(&shape, &preset.divisions()).unwrap();
                let finger = |n: u32| tip.touch.rotation.transpose() * tip.mesh.nodes[n as usize] + tip.touch.point_mm;
                let nail = tip.mesh.node_set(set::NAIL);
                let ties: Vec<_> = tip.mesh.ties.iter().filter(|tie| nail.binary_search(&tie.slave).is_ok()).collect();
                let mut masters: Vec<u32> = ties.iter().map(|tie| tie.masters[0].0).collect();
                for tie in &ties {
                    assert_eq!(tie.masters.len(), 1);
                    assert!((finger(tie.slave) - finger(tie.masters[0].0)).norm() < 1e-12);
                }
                masters.sort_unstable();
                masters.dedup();
                assert_eq!(masters.len(), ties.len(), "one nail node on each skin node");
                let along: Vec<f64> = masters.iter().map(|&n| finger(n).x).collect();
                let (start, end) = along.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
                println!("{name} {preset:?}: nail from {start:.2} to {end:.2} mm");
                assert!((start - shape.nail_start_mm).abs() < most_mm, "{name} {preset:?}: {start}");
                // It ends at the tip's edge at the latest.
                assert!((end - shape.nail_end_mm).abs() < most_mm.max(1.2), "{name} {preset:?}: {end}");
                let nail = &quality(&tip.mesh).regions[&Region::Nail];
                assert!(nail.volume_mm3 > 50.0 && nail.volume_mm3 < 110.0, "{}", nail.volume_mm3);
            }
        }
    }
}
