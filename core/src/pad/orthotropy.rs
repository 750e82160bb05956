//! Orthotropic friction of the patches: the strength across an axis of the skin differs from the strength along it.
//!
//! Friction is the point of an ellipse that is closest to the elastic force of the stretch. It is thus the gradient of a convex energy, and
//! the anchor of a patch that slips moves along the normal of the ellipse. The stretch of a patch that sticks is not changed.
//!
//! Main types: [`Orthotropy`], [`SkinAxis`]. Uses equilibrium.

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

use crate::Error;
use crate::error::Field;
use crate::math::{Elementary, Scalar};

use super::equilibrium::PatchContact;

/// Least and largest ratio.
const RATIO: [f32; 2] = [0.1, 10.0];
/// Most Newton iterations for the closest point, and the relative change in the last one.
const ITERATIONS: usize = 12;
const ROOT: f32 = 1e-5;
/// Least bound of a stretch in quotients, mm.
const LEAST_BOUND_MM: f32 = 1e-12;

/// Constants of orthotropic friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Orthotropy<T = f32> {
    across_over_along: T,
    skin_axis_deg: T,
}

// SAFETY: a `repr(C)` struct of two 32-bit floats: no padding, and any bits are a number.
#[allow(unsafe_code)]
mod plain {
    use super::{Orthotropy, Pod, Zeroable};
    unsafe impl Zeroable for Orthotropy<f32> {}
    unsafe impl Pod for Orthotropy<f32> {}
}

impl Orthotropy {
    /// Orthotropic friction.
    ///
    /// * `across_over_along`: strength across the axis over the strength along it, which is that of the model; 0.1 to 10
    /// * `skin_axis_deg`: angle of the axis from x towards y in the undeformed finger, degrees, within ±180
    ///
    /// # Errors
    /// [`Error::Range`] with the number that is out of its range: index 0 for the ratio, 1 for the angle.
    pub fn new(across_over_along: f32, skin_axis_deg: f32) -> Result<Self, Error> {
        Self { across_over_along, skin_axis_deg }.check()
    }

    pub(crate) fn check(self) -> Result<Self, Error> {
        let refuse = |index, value| Err(Error::Range { what: Field::Orthotropy, index, value });
        if !(RATIO[0]..=RATIO[1]).contains(&self.across_over_along) {
            return refuse(0, self.across_over_along);
        }
        if !(self.skin_axis_deg.abs() <= 180.0) {
            return refuse(1, self.skin_axis_deg);
        }
        Ok(self)
    }

    /// The same in another scalar.
    pub fn cast<U: Scalar>(&self) -> Orthotropy<U> {
        Orthotropy { across_over_along: U::of(self.across_over_along), skin_axis_deg: U::of(self.skin_axis_deg) }
    }
}

impl<T: Scalar> Orthotropy<T> {
    /// The same strength in all directions.
    pub fn isotropic() -> Self {
        Self { across_over_along: T::of(1.0), skin_axis_deg: T::of(0.0) }
    }

    /// Whether the strength depends on the direction.
    pub fn is_some(&self) -> bool {
        self.across_over_along != T::of(1.0)
    }
}

/// The axis of the skin in a step, and the shape of the ellipse.
#[derive(Clone, Copy)]
pub(crate) struct SkinAxis<T> {
    /// Along the axis, body's frame.
    along: Vector3<T>,
    /// Strength across over along, and the inverse of its square.
    ratio: T,
    per_square: T,
}

impl<T: Elementary> SkinAxis<T> {
    /// * `to_body`: direction in the body's frame of a direction of the skin in the finger's frame
    pub fn new(orthotropy: &Orthotropy<T>, to_body: impl FnOnce(Vector3<T>) -> Vector3<T>) -> Self {
        let ratio = orthotropy.across_over_along;
        let (sin, cos) = (orthotropy.skin_axis_deg * (T::half_turn() / T::of(180.0))).sin_cos();
        let along = to_body(Vector3::new(cos, sin, T::of(0.0)));
        Self { along, ratio, per_square: T::of(1.0) / (ratio * ratio) }
    }

    /// The part of a vector along the axis in a tangent plane with this normal, and the vector across it.
    fn parts(&self, v: &Vector3<T>, normal: &Vector3<T>) -> (Vector3<T>, Vector3<T>) {
        let along = self.along - normal * normal.dot(&self.along);
        let square = along.dot(&along) + T::of(f32::MIN_POSITIVE);
        let along = along * (along.dot(v) / square);
        (along, v - along)
    }

    /// The length of a vector, and its length in units of the ellipse: 1 at a limit of 1 along the axis. The vector 0 counts as along the
    /// smaller axis of the ellipse.
    pub fn lengths(&self, v: &Vector3<T>, normal: &Vector3<T>) -> [T; 2] {
        let (along, across) = self.parts(v, normal);
        let (along, across) = (along.dot(&along), across.dot(&across));
        let tiny = T::of(f32::MIN_POSITIVE);
        let largest = if self.per_square > T::of(1.0) { self.per_square } else { T::of(1.0) };
        [along + across + tiny, along + self.per_square * across + largest * tiny]
            .map(|square| square.magnitude().sqrt())
    }

    /// Limit in the direction of a vector over that along the axis.
    pub fn limit_along(&self, v: &Vector3<T>, normal: &Vector3<T>) -> T {
        let [length, scaled] = self.lengths(v, normal);
        length / scaled
    }

    /// Smallest limit over that along the axis.
    pub fn least_limit(&self) -> T {
        self.ratio.at_most(T::of(1.0))
    }

    /// Friction while the surface slides along `velocity`, over the strength along the axis: the point of the ellipse where that is the
    /// normal.
    pub fn sliding(&self, velocity: &Vector3<T>, normal: &Vector3<T>) -> Vector3<T> {
        let (along, across) = self.parts(velocity, normal);
        let square = along.dot(&along) + self.ratio * self.ratio * across.dot(&across);
        let friction = along + across * (self.ratio * self.ratio);
        friction * (T::of(1.0) / (square + T::of(f32::MIN_POSITIVE)).magnitude().sqrt())
    }

    /// Strength of a patch in the direction of its friction.
    ///
    /// A stretch beyond the ellipse is replaced by one along the friction. Its length over the bound is 1 plus the multiplier of the
    /// closest point, so that [`Self::along_limit`] can be computed from it.
    pub fn strength(&self, contact: &mut PatchContact<T>, compliance: T, normal: &Vector3<T>) -> T {
        let (one, q) = (T::of(1.0), self.per_square);
        let (along, across) = self.parts(&contact.stretch, normal);
        let bound = contact.strength * compliance + T::of(LEAST_BOUND_MM);
        let per_square = one / (bound * bound);
        let (first, second) = (along.dot(&along) * per_square, across.dot(&across) * per_square);
        if !(first + q * second > one) {
            return contact.strength * self.limit_along(&contact.stretch, normal);
        }
        // The root of 1/|v| = 1, v = (u / (1 + m), sqrt(q) w / (1 + q m)), which is concave in m; from below, where the smaller stiffness of
        // both axes is applied to both parts.
        let root = |x: T| x.not_negative().magnitude().sqrt();
        let weakest = if q < one { one / q } else { one };
        let mut multiplier = (root(first + second / q) - weakest).not_negative();
        let mut size = one;
        for _ in 0..ITERATIONS {
            let (a, b) = (one / (one + multiplier), one / (one + q * multiplier));
            let (u, w) = (first * a * a, q * second * b * b);
            let square = u + w;
            size = root(square);
            let change = (size - one) * square / (u * a + w * q * b);
            multiplier += change;
            if !(change.magnitude() > T::of(ROOT) * (one + multiplier)) {
                break;
            }
        }
        let (a, b) = (one / (one + multiplier), one / (one + q * multiplier));
        size = if size > T::of(0.0) { root(first * a * a + q * second * b * b) } else { one };
        let kept = (along * a + across * b) * (one / size);
        let length = root(kept.dot(&kept));
        contact.stretch = kept * (one + multiplier);
        contact.length = length * (one + multiplier) + T::of(f32::MIN_POSITIVE);
        length / compliance
    }

    /// The direction in which the friction of a patch that slips changes with its stretch, and that stiffness over [`PatchContact::grip`].
    pub fn along_limit(&self, contact: &PatchContact<T>, normal: &Vector3<T>) -> (Vector3<T>, T) {
        let (one, q) = (T::of(1.0), self.per_square);
        let multiplier = (contact.length / (contact.bound + T::of(f32::MIN_POSITIVE)) - one).not_negative();
        let (along, across) = self.parts(&(contact.stretch * (one / contact.length)), normal);
        let outward = along + across * q;
        let (first, second) = (along.dot(&along), across.dot(&across) * q * q);
        let square = first + second + T::of(f32::MIN_POSITIVE);
        let share = (one + multiplier) / (one + q * multiplier);
        let direction = normal.cross(&outward) * (one / square.magnitude().sqrt());
        (direction, share * square / (first + share * second + T::of(f32::MIN_POSITIVE)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pad::{EXAMPLE_PATCHES, Effort, ExamplePad, Pad, PadState, Plane};
    use crate::{Motion, Response};

    /// Friction of a patch of compliance 0.9 mm/N, N, and its contact.
    fn friction(axis: &SkinAxis<f64>, strength: f64, [x, y]: [f64; 2]) -> (Vector3<f64>, PatchContact<f64>) {
        let mut contact = PatchContact::without_contact();
        (contact.strength, contact.stretch, contact.length) = (strength, Vector3::new(x, y, 0.0), x.hypot(y));
        let limit = axis.strength(&mut contact, 0.9, &-Vector3::z());
        contact.bound = 0.9 * limit;
        contact.grip = if contact.length > contact.bound { limit / contact.length } else { 1.0 / 0.9 };
        (contact.stretch * contact.grip, contact)
    }

    /// Against a search over all points of the ellipse, and the stiffness against differences.
    #[test]
    fn friction_is_the_point_of_the_ellipse_that_is_closest_to_the_elastic_force() {
        let mut slipped = 0;
        for ratio in [0.1, 0.5, 0.9, 1.6, 10.0] {
            let orthotropy = Orthotropy::new(ratio, 25.0).unwrap().cast::<f64>();
            let axis = SkinAxis::new(&orthotropy, |axis| axis);
            let ratio = f64::from(ratio);
            let (sin, cos) = 25f64.to_radians().sin_cos();
            for k in 0..60 {
                let (size, angle) = (0.02 * 1.2f64.powi(k % 30), f64::from(k) * 0.7);
                let (stretch, strength) = ([size * angle.cos(), size * angle.sin()], 0.05);
                let (found, contact) = friction(&axis, strength, stretch);
                let elastic = stretch.map(|s| s / 0.9);
                let [along, across] = [elastic[0] * cos + elastic[1] * sin, elastic[1] * cos - elastic[0] * sin];
                if along.hypot(across / ratio) <= strength {
                    assert!((found.x - elastic[0]).hypot(found.y - elastic[1]) < 1e-12);
                    continue;
                }
                slipped += 1;
                let away = |f: [f64; 2]| (f[0] - elastic[0]).hypot(f[1] - elastic[1]);
                let closest = (0..20000).map(|n| {
                    let (s, c) = (f64::from(n) * core::f64::consts::TAU / 20000.0).sin_cos();
                    away([strength * (c * cos - ratio * s * sin), strength * (c * sin + ratio * s * cos)])
                });
                let least = closest.fold(f64::MAX, f64::min);
                let [along, across] = [found.x * cos + found.y * sin, found.y * cos - found.x * sin];
                assert!((along.hypot(across / ratio) / strength - 1.0).abs() < 1e-9, "{ratio} {k}: {found}");
                assert!(away([found.x, found.y]) < least + 1e-9, "{ratio} {k}: {} {least}", away([found.x, found.y]));
                let (direction, share) = axis.along_limit(&contact, &-Vector3::z());
                for by in [[1.0, 0.0], [0.0, 1.0]] {
                    let at = |h: f64| friction(&axis, strength, [stretch[0] + h * by[0], stretch[1] + h * by[1]]).0;
                    let numeric = (at(1e-5) - at(-1e-5)) / 2e-5;
                    let exact = direction * (contact.grip * share * (direction.x * by[0] + direction.y * by[1]));
                    assert!((numeric - exact).norm() < 1e-4, "{ratio} {k}: {numeric} {exact}");
                }
            }
        }
        assert!(slipped > 150, "{slipped}");
        // A patch without strength, and one without stretch.
        let axis = SkinAxis::new(&Orthotropy::new(0.5, 0.0).unwrap(), |axis| axis);
        let mut contact = PatchContact::<f32>::without_contact();
        (contact.stretch, contact.length) = (Vector3::new(3.0, 60.0, 0.0), 60.07);
        assert!(axis.strength(&mut contact, 0.9, &Vector3::new(0.0, 0.0, -1.0)) < 1e-10 && contact.length.is_finite());
        (contact.strength, contact.stretch) = (0.2, Vector3::zeros());
        assert!((axis.strength(&mut contact, 0.9, &Vector3::new(0.0, 0.0, -1.0)) - 0.1).abs() < 1e-6);
    }

    /// The pad after a press, a spin of the plane and a slide of 40 mm along `angle`, in the axes of the plane.
    fn slid(pad: &Pad<'_, f64>, spin: f64, angle: f64) -> Response<f64> {
        let mut state = PadState::<EXAMPLE_PATCHES, f64>::new(pad).unwrap();
        let mut last = Response::default();
        for k in 0..440 {
            let way = if k < 40 { 0.0 } else { 0.1 };
            let motion = Motion {
                depth_mm: (f64::from(k) * 0.05).min(1.0),
                slide_increment_mm: [way * angle.cos(), way * angle.sin()],
                spin_increment_rad: if (20..40).contains(&k) { spin / 20.0 } else { 0.0 },
                dt_s: 1e-3,
            };
            last = pad.step(&mut state, &Plane, motion, [30.0, 0.0]);
        }
        last
    }

    /// A body that slides along v is held by D² v / |D v| times the strength, D = diag(1, r) along and across the axis, whatever the spin of
    /// the plane before: the axis is the skin's.
    #[test]
    fn a_long_slide_in_any_direction_ends_on_the_ellipse_of_the_skin() {
        let example = ExamplePad::new().cast::<f64>();
        for (ratio, axis_deg, spin) in [(0.5, 0.0, 0.0), (0.6, 40.0, 0.7), (1.7, -70.0, -0.4)] {
            let pad = example.pad().with_orthotropy(Orthotropy::new(ratio, axis_deg).unwrap().cast());
            let (ratio, axis) = (f64::from(ratio), f64::from(axis_deg).to_radians());
            for angle in (0..8).map(|k| 0.1 + f64::from(k) * core::f64::consts::FRAC_PI_4) {
                let (r, isotropic) = (slid(&pad, spin, angle), slid(&example.pad(), spin, angle));
                let ((sin, cos), (axis_sin, axis_cos)) = ((angle - axis).sin_cos(), axis.sin_cos());
                let size = cos.hypot(ratio * sin);
                let [along, across] = [cos / size, ratio * ratio * sin / size];
                let wanted = [along * axis_cos - across * axis_sin, along * axis_sin + across * axis_cos];
                // The strength goes with the normal force, which the shear of the pad changes, to a power near 0.6.
                let strength = r.friction_limit_n / along.hypot(across);
                let same = isotropic.friction_limit_n * (r.normal_force_n / isotropic.normal_force_n).powf(0.6);
                assert!((strength / same - 1.0).abs() < 0.03, "{} {r:?} {isotropic:?}", strength / same);
                for k in 0..2 {
                    let off = r.friction_n[k] / strength - wanted[k];
                    assert!(off.abs() < 0.02, "{ratio} {axis_deg} {angle}: {:?} {wanted:?} {strength}", r.friction_n);
                }
                assert!(r.slip_margin < 5e-3 && r.stick_ratio < 1e-6, "{r:?}");
            }
        }
    }

    /// Strength s along an axis and r s across it is strength r s along the axis at a right angle to it and s across that, in every number
    /// of the response at every step. The pose is the neutral one, in which both axes stay at a right angle on the plane.
    #[test]
    fn the_answer_turns_together_with_the_axis() {
        let example = ExamplePad::new().cast::<f64>();
        let mut scaled = example;
        scaled.numbers.law.friction[0] *= 0.5;
        let pads = [(example.pad(), 0.5f32, 20.0), (scaled.pad(), 2.0, 110.0)]
            .map(|(pad, ratio, axis_deg)| {
                (pad.with_effort(Effort { tolerance: 1e-9, ..Effort::default() }), ratio, axis_deg)
            })
            .map(|(pad, ratio, axis_deg)| pad.with_orthotropy(Orthotropy::new(ratio, axis_deg).unwrap().cast()));
        let mut states = pads.map(|pad| PadState::<EXAMPLE_PATCHES, f64>::new(&pad).unwrap());
        let mut slipping = 0;
        for k in 0..400 {
            let phase = f64::from(k) * 0.02;
            let motion = Motion {
                depth_mm: 0.8 + 0.3 * phase.sin(),
                slide_increment_mm: [0.02 * (2.3 * phase).cos(), 0.02 * (1.1 * phase).sin()],
                spin_increment_rad: 0.003 * (0.7 * phase).cos(),
                dt_s: 1e-3,
            };
            let [a, b] = core::array::from_fn(|n| pads[n].step(&mut states[n], &Plane, motion, [30.0, 0.0]));
            let numbers = |r: Response<f64>| {
                let ([x, y], limit, margin) = (r.friction_n, r.friction_limit_n, r.slip_margin);
                [r.normal_force_n, x, y, limit, margin, r.band_friction_n, r.spin_moment_n_mm]
            };
            assert!(numbers(a).iter().zip(numbers(b)).all(|(x, y)| (x - y).abs() < 1e-6), "step {k}: {a:?} {b:?}");
            slipping += usize::from(a.stick_ratio < 0.5);
        }
        assert!(slipping > 50, "{slipping}");
    }
}
