//! The nail: a plate of tetrahedra on the dorsal skin, tied to its faces, or a patch of fixed skin.
//! Frame of the finger, mm.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::arcs::Meridian;
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

/// Makes the plate. Its inner nodes are moved onto the nearest of `faces`, so that ties have no offset.
pub(super) fn plate(
    shape: &FingertipShape,
    divisions: &Divisions,
    nodes: &[Vector3<f64>],
    faces: &[[u32; 4]],
) -> Plate {
    let body = Body::outer(shape);
    let meridian = Meridian::new(&body, 0.0, 1.0);
    let (from, to) = (meridian.length_to_x(shape.nail_start_mm), meridian.length_to_x(shape.nail_end_mm));
    let (rings, columns, layers) = (divisions.nail_rings, divisions.nail_columns, divisions.nail_layers);
    let part = |i: usize, count: usize| i as f64 / count as f64;
    let dorsal: Vec<[u32; 4]> = faces.iter().filter(|f| center(f, nodes).z > 0.0).copied().collect();

    let first = nodes.len() as u32;
    let mut plate = Plate { nodes: vec![], tets: vec![], ties: vec![], outer: vec![] };
    for i in 0..=rings {
        let (x, scale) = meridian.at(from + (to - from) * part(i, rings));
        for j in 0..=columns {
            let angle = shape.nail_half_angle_deg.to_radians() * (2.0 * part(j, columns) - 1.0);
            let (p, q) = (angle.sin() / body.a, angle.cos() / body.b);
            let f = scale / body.section_norm(p, q);
            let point = body.point(x, p * f, q * f);
            let normal = body.normal(&point);
            let Foot { position, masters } = nearest_on_faces(&point, &dorsal, nodes);
            plate.ties.push(Tie { slave: first + plate.nodes.len() as u32, masters });
            for layer in 0..=layers {
                plate.nodes.push(position + shape.nail_thickness_mm * part(layer, layers) * normal);
            }
            plate.outer.push(first + plate.nodes.len() as u32 - 1);
        }
    }
    let node = |i: usize, j: usize, layer: usize| first + ((i * (columns + 1) + j) * (layers + 1) + layer) as u32;
    for i in 0..rings {
        for j in 0..columns {
            for l in 0..layers {
                let ring = |i: usize, l: usize| [node(i, j, l), node(i, j + 1, l)];
                let ([a, d], [b, c], [e, h], [f, g]) = (ring(i, l), ring(i + 1, l), ring(i, l + 1), ring(i + 1, l + 1));
                let corners = [a, b, c, d, e, f, g, h];
                let tets = BOX_TO_TETS.map(|t| Tet { nodes: t.map(|n| corners[n]), region: Region::Nail });
                plate.tets.extend(tets);
            }
        }
    }
    plate
}

/// Skin nodes of the nail's patch.
pub(super) fn patch(shape: &FingertipShape, nodes: &[Vector3<f64>], faces: &[[u32; 4]]) -> Vec<u32> {
    let body = Body::outer(shape);
    let half_angle = shape.nail_half_angle_deg.to_radians();
    let inside = |node: &u32| {
        let p = nodes[*node as usize];
        let angle = p.y.atan2(p.z - body.taper.height(p.x));
        (shape.nail_start_mm..=shape.nail_end_mm).contains(&p.x) && angle.abs() <= half_angle
    };
    faces.iter().flatten().copied().filter(inside).collect()
}

fn center(face: &[u32; 4], nodes: &[Vector3<f64>]) -> Vector3<f64> {
    face.iter().map(|&n| nodes[n as usize]).sum::<Vector3<f64>>() / 4.0
}

/// A point of a face, with the nodes and weights that make it.
pub(super) struct Foot {
    pub(super) position: Vector3<f64>,
    pub(super) masters: Vec<(u32, f64)>,
}

/// Closest point to `point` on the bilinear faces.
pub(super) fn nearest_on_faces(point: &Vector3<f64>, faces: &[[u32; 4]], nodes: &[Vector3<f64>]) -> Foot {
    let mut near: Vec<&[u32; 4]> = faces.iter().collect();
    near.sort_by(|a, b| {
        let distance = |f: &[u32; 4]| (center(f, nodes) - point).norm_squared();
        distance(a).total_cmp(&distance(b))
    });
    let mut best: Option<(f64, Foot)> = None;
    for face in near.into_iter().take(12) {
        let corners = face.map(|n| nodes[n as usize]);
        let weights = closest_weights(point, &corners);
        let position: Vector3<f64> = corners.iter().zip(weights).map(|(c, w)| c * w).sum();
        let distance = (position - point).norm();
        if best.as_ref().is_none_or(|(d, _)| distance < *d) {
            let masters = face.iter().copied().zip(weights);
            let masters = masters.filter(|(_, w)| *w > 0.0).collect();
            best = Some((distance, Foot { position, masters }));
        }
    }
    best.expect("the skin has dorsal faces").1
}

/// Bilinear weights of the point of a quadrilateral closest to `point`: Gauss-Newton, clamped to the face.
fn closest_weights(point: &Vector3<f64>, corners: &[Vector3<f64>; 4]) -> [f64; 4] {
    let mut at = Vector2::new(0.5, 0.5);
    for _ in 0..50 {
        let gap: Vector3<f64> = corners.iter().zip(bilinear(at)).map(|(c, w)| c * w).sum::<Vector3<f64>>() - point;
        let (u, v) = (at.x, at.y);
        let along_u = (corners[1] - corners[0]) * (1.0 - v) + (corners[2] - corners[3]) * v;
        let along_v = (corners[3] - corners[0]) * (1.0 - u) + (corners[2] - corners[1]) * u;
        let mut gradient = Vector2::new(along_u.dot(&gap), along_v.dot(&gap));
        let mut normal =
            Matrix2::new(along_u.norm_squared(), along_u.dot(&along_v), along_u.dot(&along_v), along_v.norm_squared());
        // A coordinate that is at its bound and pushed outward stays there.
        for c in 0..2 {
            if (at[c] <= 0.0 && gradient[c] > 0.0) || (at[c] >= 1.0 && gradient[c] < 0.0) {
                gradient[c] = 0.0;
                normal[(0, 1)] = 0.0;
                normal[(1, 0)] = 0.0;
            }
        }
        let step = normal.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * gradient);
        let next = (at - step).map(|c| c.clamp(0.0, 1.0));
        let moved = (next - at).norm();
        at = next;
        if moved < 1e-14 {
            break;
        }
    }
    bilinear(at)
}

fn bilinear(at: Vector2<f64>) -> [f64; 4] {
    let (u, v) = (at.x, at.y);
    [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closest_point_of_a_twisted_quad() {
        let corners = [
            Vector3::new(0.0, 0.0, 0.0),
            Vector3::new(1.2, 0.1, 0.1),
            Vector3::new(1.0, 1.0, 0.3),
            Vector3::new(-0.1, 0.9, 0.0),
        ];
        for (u, v, off) in [(0.3, 0.8, 0.2), (0.0, 0.4, 0.1), (1.0, 1.0, 0.0)] {
            let w = bilinear(Vector2::new(u, v));
            let foot: Vector3<f64> = corners.iter().zip(w).map(|(c, w)| c * w).sum();
            let along_u = (corners[1] - corners[0]) * (1.0 - v) + (corners[2] - corners[3]) * v;
            let along_v = (corners[3] - corners[0]) * (1.0 - u) + (corners[2] - corners[1]) * u;
            let point = foot + off * along_u.cross(&along_v).normalize();
            let found = closest_weights(&point, &corners);
            for (found, expected) in found.iter().zip(w) {
                assert!((found - expected).abs() < 1e-9);
            }
        }
        // Beyond a corner the closest point is the corner.
        let found = closest_weights(&Vector3::new(2.0, 2.0, 0.5), &corners);
        assert!((found[2] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn plate_lies_on_the_skin() {
        use crate::mesh::{MeshPreset, fingertip, quality};
        let shape = FingertipShape::default();
        let body = Body::outer(&shape);
        for (preset, most_mm) in [(MeshPreset::Coarse, 0.5), (MeshPreset::Default, 0.2), (MeshPreset::Fine, 0.07)] {
            let tip = fingertip(&shape, &preset.divisions()).unwrap();
            let finger = |n: u32| tip.touch.rotation.transpose() * tip.mesh.nodes[n as usize] + tip.touch.point_mm;
            // How far ties are off the analytic surface: facets only, so always inside where it is convex.
            let sink = |tie: &Tie| {
                let point = finger(tie.slave);
                let gradient = (body.level(&(point + 1e-4 * body.normal(&point))) - body.level(&point)) / 1e-4;
                ((1.0 - body.level(&point)) / gradient).abs()
            };
            let worst = tip.mesh.ties.iter().map(sink).fold(0.0, f64::max);
            println!("{preset:?}: ties up to {worst:.3} mm off the analytic surface");
            assert!(worst < most_mm, "{preset:?}: {worst} mm");
            let report = quality(&tip.mesh);
            let nail = &report.regions[&Region::Nail];
            println!("{preset:?}: nail {:.1} mm3", nail.volume_mm3);
            assert!(nail.volume_mm3 > 60.0 && nail.volume_mm3 < 110.0, "{}", nail.volume_mm3);
        }
    }
}
