//! The skin's analytic surface as the rigid body meets it: its lowest point along any direction.

use nalgebra::Vector3;

use super::surface::Body;
use super::{FingertipShape, FirstTouch};

/// The smooth surface of a parametric fingertip, in the frame of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    body: Body,
    touch: FirstTouch,
    /// Height above first touch to which the pad reaches, mm.
    pad_height_mm: f64,
}

impl Skin {
    /// The surface of `shape`, whose first touch is `touch`.
    pub fn of(shape: &FingertipShape, touch: FirstTouch) -> Self {
        Self { body: Body::outer(shape), touch, pad_height_mm: shape.pad_height_mm }
    }

    /// The lowest point along `normal`, which points out of the rigid body into the finger, mm; the origin is the lowest along z.
    ///
    /// Of every section the lowest point is that of a superellipse, in closed form; over the sections the height is convex, so
    /// that its slope is bisected.
    pub fn lowest(&self, normal: &Vector3<f64>) -> Vector3<f64> {
        let Body { a, b, cap, n, m, taper, tip_x, .. } = self.body;
        let of_finger = self.touch.rotation.transpose() * normal;
        let (across, up) = (of_finger.y * a, of_finger.z * b);
        // Norm dual to that of the section.
        let dual = n / (n - 1.0);
        let drop = (across.abs().powf(dual) + up.abs().powf(dual)).powf(1.0 / dual);
        let slope = |x: f64| {
            let xi = ((x - self.body.cap_x()) / cap).clamp(0.0, 1.0);
            let scale = self.body.scale_at(x);
            of_finger.x + of_finger.z * taper.slope(x) + drop / cap * (xi / scale).powf(m - 1.0)
        };
        let (mut low, mut high) = (0.0, tip_x);
        while high - low > 1e-13 * tip_x {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if slope(middle) < 0.0 { low = middle } else { high = middle }
        }
        let x = 0.5 * (low + high);
        let scale = self.body.scale_at(x);
        let relative = |v: f64| if drop > 0.0 { -scale * v.signum() * (v.abs() / drop).powf(dual - 1.0) } else { 0.0 };
        let (p, q) = (relative(across), relative(up));
        self.touch.to_plane(&self.body.point(x, p, q))
    }

    /// The point of the pad on the line along z through (x, y), mm, and the skin's outward normal there; None beside the pad.
    pub fn on_pad(&self, [x, y]: [f64; 2]) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let of_finger = |z: f64| self.touch.rotation.transpose() * Vector3::new(x, y, z) + self.touch.point_mm;
        let is_inside = |z: f64| self.body.level(&of_finger(z)) < 1.0;
        let (mut outside, mut inside) = (-self.pad_height_mm, self.pad_height_mm);
        if is_inside(outside) || !is_inside(inside) {
            return None;
        }
        while inside - outside > 1e-13 * self.pad_height_mm {
            let middle = 0.5 * (outside + inside);
            if middle <= outside || middle >= inside {
                break;
            }
            if is_inside(middle) { inside = middle } else { outside = middle }
        }
        let found = of_finger(inside);
        (found.x >= 0.0).then(|| (Vector3::new(x, y, inside), self.touch.rotation * self.body.normal(&found)))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn points_of_the_pad_lie_on_the_surface_over_their_place() {
        for name in FingertipShape::NAMES {
            let shape = FingertipShape::named(name).unwrap();
            let touch = FirstTouch::of(&shape);
            let skin = Skin::of(&shape, touch);
            for place in [[0.0, 0.0], [1.0, 2.0], [-3.0, 0.5], [0.0, -4.0]] {
                let (point, outward) = skin.on_pad(place).unwrap();
                assert!((point.xy() - Vector2::from(place)).norm() < 1e-12 && point.z > -1e-9, "{name}: {point}");
                // No point of the surface is lower along its inward normal.
                assert!((skin.lowest(&-outward) - point).norm() < 1e-5, "{name}: {point}");
            }
            assert_eq!(skin.on_pad([0.0, shape.half_width_mm + 0.1]), None, "{name}");
            assert_eq!(skin.on_pad([2.0 * shape.length_mm, 0.0]), None, "{name}");
            assert_eq!(skin.on_pad([-2.0 * shape.length_mm, 0.0]), None, "{name}");
        }
    }

    #[test]
    fn no_point_of_the_surface_is_lower() {
        for name in FingertipShape::NAMES {
            let shape = FingertipShape::named(name).unwrap();
            let body = Body::outer(&shape);
            let touch = FirstTouch::of(&shape);
            let skin = Skin::of(&shape, touch);
            assert!(skin.lowest(&Vector3::z()).norm() < 1e-6, "{name}: {}", skin.lowest(&Vector3::z()));
            for (u, v) in [(0.0, 0.0), (0.3, 0.1), (-0.4, 0.3), (0.1, -0.7), (0.5, 0.0)] {
                let normal = Vector3::new(u, v, 1.0).normalize();
                let lowest = skin.lowest(&normal);
                let own = touch.rotation.transpose() * lowest + touch.point_mm;
                assert!((body.level(&own) - 1.0).abs() < 1e-9, "{name}: {own} is off the surface");
                let mut least = f64::INFINITY;
                for i in 0..400 {
                    let x = body.x_at_scale((f64::from(i) / 400.0 * std::f64::consts::FRAC_PI_2).cos());
                    for sections in [x, shape.length_mm * f64::from(i) / 400.0] {
                        for k in 0..400 {
                            let (p, q) = (f64::from(k) * std::f64::consts::TAU / 400.0).sin_cos();
                            let f = body.scale_at(sections) / body.section_norm(p, q);
                            let point = touch.to_plane(&body.point(sections, p * f, q * f));
                            least = least.min(point.dot(&normal));
                        }
                    }
                }
                let height = lowest.dot(&normal);
                assert!(height <= least + 1e-12 && height > least - 1e-3, "{name}: {height} {least}");
            }
        }
    }
}
