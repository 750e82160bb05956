//! Location of a point in a mesh: its element and its weights, and its depth below the skin.

use nalgebra::{Matrix3, Vector3};

use super::{Mesh, Region};

/// Largest distance outside an element at which a point counts as inside, share of the element.
const TOLERANCE: f64 = 1e-6;
/// Iterations of Newton's method for the place in a hexahedron; a few are enough unless the point is far outside.
const MOST_ITERATIONS: usize = 20;

/// The element that holds a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// Its number: hexahedra first, then tetrahedra of 4 and of 10 nodes.
    pub element: usize,
    /// Its region.
    pub region: Region,
    /// Its corners, with weights that sum to 1 and make the point.
    pub corners: Vec<(u32, f64)>,
}

/// Corners and region of every element: hexahedra first, then tetrahedra of 4 and of 10 nodes.
pub fn element_corners(mesh: &Mesh) -> impl Iterator<Item = (&[u32], Region)> {
    let hexes = mesh.hexes.iter().map(|e| (&e.nodes[..], e.region));
    let tets = mesh.tets.iter().map(|e| (&e.nodes[..], e.region));
    let tets10 = mesh.tets10.iter().map(|e| (&e.nodes[..4], e.region));
    hexes.chain(tets).chain(tets10)
}

/// The element of the undeformed mesh that holds `point`, mm; the first one of several that share it, None outside. Sides of 10-node
/// tetrahedra count as straight.
pub fn locate(mesh: &Mesh, point: &Vector3<f64>) -> Option<Located> {
    element_corners(mesh).enumerate().find_map(|(element, (nodes, region))| {
        let corners: Vec<Vector3<f64>> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        let margin = 1e-3;
        let outside = (0..3).any(|k| {
            corners.iter().all(|c| c[k] > point[k] + margin) || corners.iter().all(|c| c[k] < point[k] - margin)
        });
        if outside {
            return None;
        }
        let weights = if corners.len() == 8 { in_hex(&corners, point) } else { in_tet(&corners, point) }?;
        Some(Located { element, region, corners: nodes.iter().copied().zip(weights).collect() })
    })
}

fn in_tet(corners: &[Vector3<f64>], point: &Vector3<f64>) -> Option<Vec<f64>> {
    let edges = Matrix3::from_columns(&[1, 2, 3].map(|k| corners[k] - corners[0]));
    let at = edges.try_inverse()? * (point - corners[0]);
    let weights = vec![1.0 - at.sum(), at.x, at.y, at.z];
    weights.iter().all(|&w| w >= -TOLERANCE).then_some(weights)
}

fn in_hex(corners: &[Vector3<f64>], point: &Vector3<f64>) -> Option<Vec<f64>> {
    // The reference cube from 0 to 1, corners in the order of VTK_HEXAHEDRON.
    let sides = |k: usize| [[1, 2, 5, 6].contains(&k), [2, 3, 6, 7].contains(&k), k >= 4];
    let part = |at: f64, is_far: bool| if is_far { at } else { 1.0 - at };
    let slope = |is_far: bool| if is_far { 1.0 } else { -1.0 };
    let mut at = Vector3::repeat(0.5);
    for _ in 0..MOST_ITERATIONS {
        let (mut place, mut gradient) = (Vector3::zeros(), Matrix3::zeros());
        for (k, corner) in corners.iter().enumerate() {
            let far = sides(k);
            let [a, b, c] = [0, 1, 2].map(|i| part(at[i], far[i]));
            let d = [slope(far[0]) * b * c, a * slope(far[1]) * c, a * b * slope(far[2])];
            place += corner * (a * b * c);
            gradient += corner * Vector3::from(d).transpose();
        }
        let step = gradient.try_inverse()? * (point - place);
        at += step;
        if !at.iter().all(|a| (-4.0..5.0).contains(a)) {
            return None;
        }
        if step.amax() < 1e-12 {
            break;
        }
    }
    let inside = at.iter().all(|a| (-TOLERANCE..=1.0 + TOLERANCE).contains(a));
    let weight = |k: usize| (0..3).map(|i| part(at[i], sides(k)[i])).product();
    inside.then(|| (0..8).map(weight).collect())
}

/// The point `below_mm` under the pad's undeformed skin, along the skin's inner normal, where the line along z through (x, y) meets
/// the pad; None beside the pad.
pub fn below_skin(mesh: &Mesh, [x, y]: [f64; 2], below_mm: f64) -> Option<Vector3<f64>> {
    let quads = mesh.pad_faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let triangles = quads.chain(mesh.pad_triangles.iter().copied());
    let hits = triangles.filter_map(|triangle| {
        let [a, b, c] = triangle.map(|n| mesh.nodes[n as usize]);
        let outer = (b - a).cross(&(c - a));
        // Seen from below, along z: faces that look down.
        if outer.z >= 0.0 {
            return None;
        }
        let area = |p: &Vector3<f64>, q: &Vector3<f64>| (p.x - x) * (q.y - y) - (p.y - y) * (q.x - x);
        let [u, v, w] = [area(&b, &c), area(&c, &a), area(&a, &b)].map(|part| part / outer.z);
        if [u, v, w].iter().any(|&part| part < -TOLERANCE) {
            return None;
        }
        Some(a * u + b * v + c * w - outer.normalize() * below_mm)
    });
    hits.min_by(|a, b| a.z.total_cmp(&b.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FingertipShape, MeshPreset, fingertip};

    #[test]
    fn points_of_a_fingertip_come_out_of_their_weights() {
        let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
        let mut regions = std::collections::BTreeSet::new();
        for (element, (nodes, region)) in element_corners(&tip.mesh).enumerate().step_by(37) {
            let places = nodes.iter().map(|&n| tip.mesh.nodes[n as usize]);
            // Off the middle, so that no two weights are alike.
            let weights = (1..=nodes.len()).map(|k| k as f64 / (nodes.len() * (nodes.len() + 1) / 2) as f64);
            let point: Vector3<f64> = places.zip(weights).map(|(p, w)| p * w).sum();
            let found = locate(&tip.mesh, &point).unwrap_or_else(|| panic!("element {element}"));
            let made: Vector3<f64> = found.corners.iter().map(|&(n, w)| tip.mesh.nodes[n as usize] * w).sum();
            assert!((made - point).norm() < 1e-9, "element {element}: {made} for {point}");
            assert!((found.corners.iter().map(|c| c.1).sum::<f64>() - 1.0).abs() < 1e-12);
            regions.insert(region);
        }
        assert!(regions.len() >= 4, "{regions:?}");
        assert_eq!(locate(&tip.mesh, &Vector3::new(0.0, 0.0, -5.0)), None);
    }

    #[test]
    fn a_depth_below_the_skin_is_measured_along_its_normal() {
        let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
        let on = below_skin(&tip.mesh, [0.0, 3.0], 0.0).unwrap();
        let under = below_skin(&tip.mesh, [0.0, 3.0], 0.5).unwrap();
        assert!(((under - on).norm() - 0.5).abs() < 1e-12);
        // The pad rises to the sides: its inner normal leans to the middle.
        assert!(under.y < on.y && under.z > on.z, "{on} {under}");
        assert_eq!(below_skin(&tip.mesh, [0.0, 40.0], 0.5), None);
    }
}
