//! The analytic surfaces: a superquadric cap on a shaft, sheared beyond some x.
//! Frame of the finger: x distal, y lateral, z dorsal; mm.

use nalgebra::Vector3;

use super::FingertipShape;

/// The shear z += k r(x): r is 0 up to `start_mm`, its slope grows smoothly to 1 over `blend_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taper {
    pub(super) slope: f64,
    pub(super) start_mm: f64,
    pub(super) blend_mm: f64,
}

impl Taper {
    /// k r(x), mm.
    pub(super) fn height(&self, x: f64) -> f64 {
        let t = ((x - self.start_mm) / self.blend_mm).max(0.0);
        let r = if t < 1.0 { t * t * t - 0.5 * t.powi(4) } else { t - 0.5 };
        self.slope * self.blend_mm * r
    }

    /// k r'(x).
    pub(super) fn slope(&self, x: f64) -> f64 {
        let t = ((x - self.start_mm) / self.blend_mm).clamp(0.0, 1.0);
        self.slope * t * t * (3.0 - 2.0 * t)
    }
}

/// A shaft with a superquadric cap; the outer surface of the finger or of its bones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Body {
    /// Half width a, mm.
    pub(super) a: f64,
    /// Half thickness b, mm.
    pub(super) b: f64,
    /// z of the axis before the shear, mm.
    pub(super) axis_z: f64,
    /// x of the tip, mm.
    pub(super) tip_x: f64,
    /// Length of the cap, mm.
    pub(super) cap: f64,
    /// Exponent of the section.
    pub(super) n: f64,
    /// Exponent of the profile.
    pub(super) m: f64,
    /// The shear.
    pub(super) taper: Taper,
}

impl Body {
    /// The skin's outside.
    pub(super) fn outer(shape: &FingertipShape) -> Self {
        Self {
            a: shape.half_width_mm,
            b: shape.half_thickness_mm,
            axis_z: 0.0,
            tip_x: shape.length_mm,
            cap: shape.cap_length_mm,
            n: shape.section_exponent,
            m: shape.profile_exponent,
            taper: Self::taper(shape),
        }
    }

    /// The bones' outside, the joint gap not cut out.
    pub(super) fn bone(shape: &FingertipShape) -> Self {
        Self {
            a: shape.bone_half_width_mm,
            b: shape.bone_half_thickness_mm,
            axis_z: shape.bone_dorsal_offset_mm,
            tip_x: shape.length_mm - shape.bone_distal_clearance_mm,
            cap: shape.bone_cap_length_mm,
            n: shape.bone_section_exponent,
            m: shape.bone_profile_exponent,
            taper: Self::taper(shape),
        }
    }

    fn taper(shape: &FingertipShape) -> Taper {
        Taper { slope: shape.taper_slope, start_mm: shape.taper_start_mm, blend_mm: shape.taper_blend_mm }
    }

    /// x where the cap begins, mm.
    pub(super) fn cap_x(&self) -> f64 {
        self.tip_x - self.cap
    }

    /// Size of the section at x relative to the shaft's: 1 in the shaft, 0 at the tip.
    pub(super) fn scale_at(&self, x: f64) -> f64 {
        let xi = ((x - self.cap_x()) / self.cap).clamp(0.0, 1.0);
        (1.0 - xi.powf(self.m)).powf(1.0 / self.m)
    }

    /// x of the cap where its section has this scale, mm.
    pub(super) fn x_at_scale(&self, scale: f64) -> f64 {
        self.cap_x() + self.cap * (1.0 - scale.clamp(0.0, 1.0).powf(self.m)).powf(1.0 / self.m)
    }

    /// (|p|^n + |q|^n)^(1/n): 1 on the section's outline, p = y/a, q = z/b.
    pub(super) fn section_norm(&self, p: f64, q: f64) -> f64 {
        (p.abs().powf(self.n) + q.abs().powf(self.n)).powf(1.0 / self.n)
    }

    /// Point of section x at relative position (p, q), the shear applied.
    pub(super) fn point(&self, x: f64, p: f64, q: f64) -> Vector3<f64> {
        Vector3::new(x, self.a * p, self.axis_z + self.b * q + self.taper.height(x))
    }

    /// Level of the implicit function: 1 on the surface, less inside.
    pub(super) fn level(&self, point: &Vector3<f64>) -> f64 {
        let z = point.z - self.axis_z - self.taper.height(point.x);
        let rho = self.section_norm(point.y / self.a, z / self.b);
        let xi = ((point.x - self.cap_x()) / self.cap).max(0.0);
        (rho.powf(self.m) + xi.powf(self.m)).powf(1.0 / self.m)
    }

    /// Unit outward normal at a point of the surface.
    pub(super) fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.direction(point).normalize()
    }

    /// Gradient of level^m / m; the level's own is this times level^(1 - m).
    fn direction(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let (p, q) = (point.y / self.a, (point.z - self.axis_z - self.taper.height(point.x)) / self.b);
        let rho = self.section_norm(p, q).max(1e-300);
        let xi = ((point.x - self.cap_x()) / self.cap).max(0.0);
        let radial = |s: f64| s.signum() * (s.abs() / rho).powf(self.n - 1.0) * rho.powf(self.m - 1.0);
        let gradient_z = radial(q) / self.b;
        let gradient_x = xi.powf(self.m - 1.0) / self.cap - self.taper.slope(point.x) * gradient_z;
        Vector3::new(gradient_x, radial(p) / self.a, gradient_z)
    }

    /// Distance from the surface, positive outside, to first order (exact in the limit of small distances), mm.
    pub(super) fn distance(&self, point: &Vector3<f64>) -> f64 {
        let level = self.level(point).max(1e-6);
        (level - 1.0) / (level.powf(1.0 - self.m) * self.direction(point).norm()).max(1e-12)
    }

    /// The point of the surface under a point near it, along the normal, mm.
    pub(super) fn closest_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let mut closest = *point;
        for _ in 0..3 {
            closest -= self.distance(&closest) * self.normal(&closest);
        }
        // Removes the sliding of the steps along the surface.
        let normal = self.normal(&closest);
        let slid = (point - closest) - (point - closest).dot(&normal) * normal;
        closest += slid;
        closest - self.distance(&closest) * self.normal(&closest)
    }

    /// Lowest level of this body over the points `depth_mm` under the surface of `outer`: above 1 if the
    /// two do not meet.
    pub(super) fn level_of_skin_inside(&self, outer: &Body, depth_mm: f64) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..=200 {
            let scale = (f64::from(i) * std::f64::consts::FRAC_PI_2 / 200.0).cos();
            for j in 0..=200 {
                let angle = f64::from(j) * std::f64::consts::PI / 200.0;
                let (p, q) = (angle.sin(), -angle.cos());
                let f = scale / outer.section_norm(p, q);
                let surface = outer.point(outer.x_at_scale(scale), p * f, q * f);
                least = least.min(self.level(&(surface - depth_mm * outer.normal(&surface))));
            }
        }
        least
    }

    /// Volume from x = 0 to the tip, mm³ (the shear keeps it).
    pub(super) fn volume(&self) -> f64 {
        let area = 4.0
            * self.a
            * self.b
            * midpoint(|t| {
                // Quarter of the unit section; p = 1 - (1 - t)^2 removes the vertical tangent at p = 1.
                let p = 1.0 - (1.0 - t) * (1.0 - t);
                (1.0 - p.powf(self.n)).powf(1.0 / self.n) * 2.0 * (1.0 - t)
            });
        let cap = self.cap
            * midpoint(|t| {
                let xi = 1.0 - (1.0 - t) * (1.0 - t);
                (1.0 - xi.powf(self.m)).powf(2.0 / self.m) * 2.0 * (1.0 - t)
            });
        area * (self.cap_x() + cap)
    }
}

/// Midpoint rule on 0..1 with 20 000 points.
pub(super) fn midpoint(f: impl Fn(f64) -> f64) -> f64 {
    let count = 20_000;
    (0..count).map(|i| f((f64::from(i) + 0.5) / f64::from(count))).sum::<f64>() / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taper_is_the_integral_of_its_slope() {
        let taper = Taper { slope: 0.3, start_mm: 8.0, blend_mm: 4.0 };
        for x in [7.0, 8.5, 10.0, 11.9, 12.5, 20.0] {
            let numeric = (taper.height(x + 1e-6) - taper.height(x - 1e-6)) / 2e-6;
            assert!((numeric - taper.slope(x)).abs() < 1e-8);
        }
    }

    #[test]
    fn points_lie_on_the_level_and_normals_are_its_gradient() {
        let body = Body::outer(&FingertipShape::default());
        for scale in [0.2f64, 0.5, 0.8, 0.99] {
            for angle in [0.1f64, 0.8, 1.9, 3.0, -2.0] {
                let f = scale / body.section_norm(angle.sin(), angle.cos());
                let point = body.point(body.x_at_scale(scale), f * angle.sin(), f * angle.cos());
                assert!((body.level(&point) - 1.0).abs() < 1e-12);
                let gradient = Vector3::from_fn(|i, _| {
                    let mut step = Vector3::zeros();
                    step[i] = 1e-6;
                    body.level(&(point + step)) - body.level(&(point - step))
                });
                assert!((gradient.normalize() - body.normal(&point)).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn foot_and_distance_near_the_surface() {
        let body = Body::outer(&FingertipShape::default());
        for (scale, angle) in [(1.0f64, 0.3f64), (0.9, 1.2), (0.6, 2.8), (0.3, -1.0)] {
            let f = scale / body.section_norm(angle.sin(), angle.cos());
            let point = body.point(body.x_at_scale(scale), f * angle.sin(), f * angle.cos());
            for off in [-0.4, -0.05, 0.05, 0.5] {
                let beside = point + off * body.normal(&point);
                assert!((body.distance(&beside) / off - 1.0).abs() < 0.15, "{}", body.distance(&beside));
                assert!(
                    (body.closest_point(&beside) - point).norm() < 0.06 * off.abs(),
                    "{}",
                    body.closest_point(&beside) - point
                );
            }
        }
    }

    #[test]
    fn volume_of_an_ellipsoid() {
        let shape = FingertipShape {
            section_exponent: 2.0,
            profile_exponent: 2.0,
            length_mm: 25.0,
            ..FingertipShape::default()
        };
        let exact = std::f64::consts::PI * 8.5 * 7.5 * (13.0 + 2.0 / 3.0 * 12.0);
        assert!((Body::outer(&shape).volume() / exact - 1.0).abs() < 1e-6);
    }
}
