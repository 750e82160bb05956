//! The point of the analytic surface that the plane touches first, and the frame at that point.

use nalgebra::{Matrix3, Vector3};

use super::FingertipShape;
use super::surface::{Body, midpoint};

/// First touch of the analytic surface, and the frame of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstTouch {
    /// The touched point in the finger's own frame (x distal, y lateral, z dorsal), mm. It is the origin
    /// of the frame of the plane.
    pub point_mm: Vector3<f64>,
    /// Rotation from the finger's frame to the plane's.
    pub rotation: Matrix3<f64>,
    /// Radius of curvature at the point, in the plane of symmetry (along the finger), mm. Across, a
    /// section exponent above 2 has no curvature there.
    pub curvature_radius_mm: f64,
}

impl FirstTouch {
    /// Lowest point of the surface over the plane; x is found to about 1e-12 mm.
    pub fn of(shape: &FingertipShape) -> Self {
        let body = Body::outer(shape);
        let (sin, cos) = shape.inclination_deg.to_radians().sin_cos();
        // By symmetry and convexity the point lies on y = 0, on the palmar outline, whose slope grows with x:
        // bisect.
        let derivative = |x: f64| cos * lower_slope(&body, x) - sin;
        let (mut low, mut high) = (0.0, shape.length_mm);
        while high - low > 1e-13 * shape.length_mm {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if derivative(middle) < 0.0 { low = middle } else { high = middle }
        }
        let x = 0.5 * (low + high);
        let step = 1e-4;
        let bend = (lower_slope(&body, x + step) - lower_slope(&body, x - step)) / (2.0 * step);
        let slope = lower_slope(&body, x);
        Self {
            point_mm: Vector3::new(x, 0.0, lower(&body, x)),
            rotation: Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos),
            curvature_radius_mm: (1.0 + slope * slope).powf(1.5) / bend,
        }
    }

    /// From the finger's frame to the plane's, mm.
    pub fn to_plane(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * (point - self.point_mm)
    }

    /// Area of the undeformed analytic body's section at this height above first touch, mm².
    pub fn section_area_mm2(&self, shape: &FingertipShape, height_mm: f64) -> f64 {
        let body = Body::outer(shape);
        let reach = 2.0 * (shape.length_mm + shape.half_thickness_mm);
        reach
            * midpoint(|t| {
                let in_plane = Vector3::new(reach * (t - 0.5), 0.0, height_mm);
                let point = self.rotation.transpose() * in_plane + self.point_mm;
                if point.x < 0.0 || point.x > shape.length_mm {
                    return 0.0;
                }
                let q = (point.z - body.axis_z - body.taper.height(point.x)) / body.b;
                let rest = body.scale_at(point.x).powf(body.n) - q.abs().powf(body.n);
                2.0 * body.a * rest.max(0.0).powf(1.0 / body.n)
            })
    }
}

/// z of the palmar outline, mm.
fn lower(body: &Body, x: f64) -> f64 {
    body.axis_z - body.b * body.scale_at(x) + body.taper.height(x)
}

/// dz/dx of the palmar outline.
fn lower_slope(body: &Body, x: f64) -> f64 {
    let xi = ((x - body.cap_x()) / body.cap).clamp(0.0, 1.0);
    let scale = body.scale_at(x);
    body.b / body.cap * (xi / scale).powf(body.m - 1.0) + body.taper.slope(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Effective radius from the section area at 0.75 mm, A = 2 pi R d.
    fn effective_radius_mm(name: &str) -> f64 {
        let shape = FingertipShape::named(name).unwrap();
        FirstTouch::of(&shape).section_area_mm2(&shape, 0.75) / (2.0 * std::f64::consts::PI * 0.75)
    }

    #[test]
    fn nothing_of_the_surface_is_below_the_plane() {
        for name in FingertipShape::NAMES {
            let shape = FingertipShape::named(name).unwrap();
            let (body, touch) = (Body::outer(&shape), FirstTouch::of(&shape));
            assert!((body.level(&touch.point_mm) - 1.0).abs() < 1e-12);
            assert!((touch.rotation * body.normal(&touch.point_mm) + Vector3::z()).norm() < 1e-9);
            for i in 0..4000 {
                let x = shape.length_mm * f64::from(i) / 4000.0;
                for p in [0.0, 0.05, 0.3] {
                    let q = (body.scale_at(x).powf(body.n) - f64::powf(p, body.n)).max(0.0).powf(1.0 / body.n);
                    assert!(touch.to_plane(&body.point(x, p, -q)).z > -1e-12);
                }
            }
        }
    }

    #[test]
    fn axis_points_down_and_frame_is_right_handed() {
        let touch = FirstTouch::of(&FingertipShape::default());
        let axis = touch.rotation * Vector3::x();
        assert!((axis - Vector3::new(0.75f64.sqrt(), 0.0, -0.5)).norm() < 1e-12);
        assert!((touch.rotation.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn sphere() {
        let shape = FingertipShape::round(8.0);
        let touch = FirstTouch::of(&shape);
        let expected = Vector3::new(17.0 + 4.0, 0.0, -8.0 * 0.75f64.sqrt());
        assert!((touch.point_mm - expected).norm() < 1e-9);
        assert!((touch.curvature_radius_mm - 8.0).abs() < 1e-5);
        let cap_area = std::f64::consts::PI * (2.0 * 8.0 * 0.5 - 0.25);
        assert!((touch.section_area_mm2(&shape, 0.5) / cap_area - 1.0).abs() < 1e-4);
    }

    #[test]
    fn effective_radii_of_the_shipped_shapes() {
        // Estimates from the contact study of these shapes, on faceted meshes.
        for (name, expected) in [("base", 9.3), ("b", 18.8), ("d", 18.8), ("a", 18.7), ("e", 19.0)] {
            let radius = effective_radius_mm(name);
            let along = FirstTouch::of(&FingertipShape::named(name).unwrap()).curvature_radius_mm;
            println!("{name}: R_eff {radius:.2} mm, expected about {expected}; along the finger {along:.2} mm");
            assert!((radius / expected - 1.0).abs() < 0.1, "{name}: {radius} mm");
        }
    }
}
