//! First touch of a surface that is known at points.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector2, Vector3};

use super::FirstTouch;

/// Lowest point of a surface over the plane, the finger's axis inclined tip down.
///
/// * `points`: of the surface, in the frame of the finger (x distal, z dorsal), mm; at least 12 within the reach
///   of the lowest one, which takes a spacing of up to half of it
/// * `reach_mm`: points this near make the cubic surface whose lowest point is first touch
///
/// The point is that of the surface through the lowest points: lower than the lowest of them, which misses the
/// surface's own lowest point by up to spacing²/8R. None if there are too few points, or if they are an edge or hollow there.
pub(super) fn lowest(points: &[Vector3<f64>], inclination_deg: f64, reach_mm: f64) -> Option<FirstTouch> {
    let (sin, cos) = inclination_deg.to_radians().sin_cos();
    let rotation = Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos);
    let turned: Vec<Vector3<f64>> = points.iter().map(|p| rotation * p).collect();
    let bottom = *turned.iter().min_by(|a, b| a.z.total_cmp(&b.z))?;
    let mut middle = bottom.xy();
    let mut found = None;
    // The surface is expanded about its own lowest point.
    for _ in 0..4 {
        let near: Vec<&Vector3<f64>> =
            turned.iter().filter(|p| (p.xy() - middle).norm() < reach_mm && p.z < bottom.z + reach_mm).collect();
        if near.len() < 12 {
            return None;
        }
        let row = |p: &Vector3<f64>| {
            let (u, v) = (p.x - middle.x, p.y - middle.y);
            [1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v]
        };
        let terms = if near.len() < 20 { 6 } else { 10 };
        let matrix = DMatrix::from_fn(near.len(), terms, |r, c| row(near[r])[c]);
        let right = DVector::from_iterator(near.len(), near.iter().map(|p| p.z - bottom.z));
        let c = matrix.clone().svd(true, true).solve(&right, 1e-10).ok()?;
        // An edge or a corner is no touch.
        let rms = (&matrix * &c - &right).norm() / (near.len() as f64).sqrt();
        if !(rms < 0.02 * reach_mm) {
            return None;
        }
        let hessian: Matrix2<f64> = Matrix2::new(2.0 * c[3], c[4], c[4], 2.0 * c[5]);
        if !(hessian[(0, 0)] > 0.0 && hessian.determinant() > 0.0) {
            return None;
        }
        let step: Vector2<f64> = -(hessian.try_inverse()? * Vector2::new(c[1], c[2]));
        if !(step.norm() < reach_mm) {
            return None;
        }
        let z = c[0] + 0.5 * (c[1] * step.x + c[2] * step.y);
        middle += step;
        found = Some((Vector3::new(middle.x, middle.y, bottom.z + z), 1.0 / hessian[(0, 0)]));
    }
    let (point, curvature_radius_mm) = found?;
    Some(FirstTouch { point_mm: rotation.transpose() * point, rotation, curvature_radius_mm })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Body;
    use crate::{FingertipShape, MeshPreset, fingertip};

    #[test]
    fn nodes_of_the_parametric_meshes_give_the_analytic_touch() {
        for (preset, most_mm, reach) in [(MeshPreset::Coarse, 0.02, 3.0), (MeshPreset::Default, 0.006, 2.0)] {
            for name in FingertipShape::NAMES {
                let shape = FingertipShape::named(name).unwrap();
                let tip = fingertip(&shape, &preset.divisions()).unwrap();
                let finger =
                    |n: &u32| tip.touch.rotation.transpose() * tip.mesh.nodes[*n as usize] + tip.touch.point_mm;
                let mut nodes: Vec<u32> = tip.outer_faces.iter().flatten().copied().collect();
                nodes.sort_unstable();
                nodes.dedup();
                let points: Vec<_> = nodes.iter().map(finger).collect();
                let found = lowest(&points, shape.inclination_deg, reach).unwrap();
                let off = tip.touch.to_plane(&found.point_mm).z;
                let body = Body::outer(&shape);
                println!("{name} {preset:?}: {off:.4} mm, level {:.5}", body.level(&found.point_mm));
                assert!(off.abs() < most_mm, "{name} {preset:?}: first touch off by {off} mm");
            }
        }
    }

    #[test]
    fn nothing_is_found_where_there_is_no_lowest_point() {
        let flat: Vec<Vector3<f64>> =
            (0..100).map(|i| Vector3::new(f64::from(i % 10), f64::from(i / 10), f64::from(i) * 0.1)).collect();
        assert!(lowest(&flat, 30.0, 2.0).is_none() && lowest(&[], 30.0, 2.0).is_none());
    }
}
