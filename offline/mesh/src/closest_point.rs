//! Closest points of bilinear faces.

use nalgebra::{Matrix2, Vector2, Vector3};

/// A point of a face, with the nodes and weights that make it.
pub(super) struct ClosestPoint {
    pub(super) position: Vector3<f64>,
    pub(super) masters: Vec<(u32, f64)>,
}

/// Closest point to `point` on the bilinear faces.
pub(super) fn nearest_on_faces(point: &Vector3<f64>, faces: &[[u32; 4]], nodes: &[Vector3<f64>]) -> ClosestPoint {
    let mut near: Vec<&[u32; 4]> = faces.iter().collect();
    near.sort_by(|a, b| {
        let distance = |f: &[u32; 4]| (center(f, nodes) - point).norm_squared();
        distance(a).total_cmp(&distance(b))
    });
    let mut best: Option<(f64, ClosestPoint)> = None;
    for face in near.into_iter().take(12) {
        let corners = face.map(|n| nodes[n as usize]);
        let weights = closest_weights(point, &corners);
        let position: Vector3<f64> = corners.iter().zip(weights).map(|(c, w)| c * w).sum();
        let distance = (position - point).norm();
        if best.as_ref().is_none_or(|(d, _)| distance < *d) {
            let masters = face.iter().copied().zip(weights);
            let masters = masters.filter(|(_, w)| *w > 0.0).collect();
            best = Some((distance, ClosestPoint { position, masters }));
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
        // A coordinate that is at its bound and pushed outward is kept there.
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

fn center(face: &[u32; 4], nodes: &[Vector3<f64>]) -> Vector3<f64> {
    face.iter().map(|&n| nodes[n as usize]).sum::<Vector3<f64>>() / 4.0
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
            let closest: Vector3<f64> = corners.iter().zip(w).map(|(c, w)| c * w).sum();
            let along_u = (corners[1] - corners[0]) * (1.0 - v) + (corners[2] - corners[3]) * v;
            let along_v = (corners[3] - corners[0]) * (1.0 - u) + (corners[2] - corners[1]) * u;
            let point = closest + off * along_u.cross(&along_v).normalize();
            let found = closest_weights(&point, &corners);
            for (found, expected) in found.iter().zip(w) {
                assert!((found - expected).abs() < 1e-9);
            }
        }
        // Beyond a corner the closest point is the corner.
        let found = closest_weights(&Vector3::new(2.0, 2.0, 0.5), &corners);
        assert!((found[2] - 1.0).abs() < 1e-12);
    }
}
