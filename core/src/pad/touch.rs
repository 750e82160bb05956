//! First touch: at which height a plane meets the finger, and how the patches come to meet it there.
//!
//! Main functions: [`Pad::first_touch_mm`], [`Pad::approach`]. Uses body and patch.
//!
//! Depth counts from the height at which a plane meets the skin, a polynomial of the plane's normal. The patches are ellipsoids that
//! stand for the skin; the first of them meets the plane up to some tenths of a millimetre earlier or later. A body is therefore shifted
//! along the normal near first touch, by exactly this distance at depth zero and by nothing from a small depth on. The energy of a pad is
//! a function of depth and pose also with the shift, so that forces and moments are its slopes.

use nalgebra::{Matrix3, Vector3};

use crate::math::{Elementary, Scalar};

use super::body::{Surface, steepness};
use super::patch::{spread_along, times_spread};
use super::step::axes;
use super::{FIRST_TOUCH_TERMS, Pad};

/// The shift ends at this share of the largest depth of the fit,
const SHIFTED: f32 = 0.02;
/// plus this multiple of the distance by which the patches are off. Above 2, a motion to a greater depth always goes deeper.
const PER_DISTANCE: f32 = 3.0;
/// It ends at this share of the largest depth at the latest. A distance for which that is too early is made up for in part.
const MOST_SHIFTED: f32 = 0.22;
/// A body whose slope 2 mm beside its apex is one over this is not shifted (a ball of 20 mm), since it meets other patches than a plane.
const ROUND: f32 = 20.0;
/// Patches whose distances from a plane differ by less share its first touch, mm; beyond the second length only the nearer one counts.
const TOGETHER_MM: f32 = 0.005;
const APART_MM: f32 = 20.0 * TOGETHER_MM;

/// The shift of a body near first touch.
pub(crate) struct Approach<T> {
    /// Shift along the normal, mm.
    pub shift: T,
    /// Change of the place along the normal per depth: 1 without a shift.
    pub rate: T,
    /// Addition to the arm of the normal force, finger's frame, mm: the shift depends on the pose.
    pub arm: Vector3<T>,
}

impl<T: Elementary> Pad<'_, T> {
    /// Height of the plane at first touch over the origin, along its normal (finger's frame), mm.
    pub fn first_touch_mm(&self, normal: &[T; 3]) -> T {
        self.fitted_first_touch_mm(&Vector3::from(*normal)) * self.units.length
    }

    /// The point of the undeformed finger that a plane touches first in a pose, along the axes of the finger, mm.
    ///
    /// * `pose_deg`: pitch and roll, degrees, clamped to the range of the fit
    pub fn first_touch_point_mm(&self, pose_deg: [T; 2]) -> [T; 3] {
        (self.fitted_first_touch_point_mm(&axes(self.tilt(pose_deg).0)) * self.units.length).into()
    }

    /// The same for the fitted finger, in its units.
    pub(crate) fn fitted_first_touch_mm(&self, normal: &Vector3<T>) -> T {
        weighted(&first_touch_terms(normal.x, normal.y), &self.numbers.first_touch_mm)
    }

    /// The same for the fitted finger, in its units.
    ///
    /// * `axes`: axes of the plane in the finger's frame
    pub(crate) fn fitted_first_touch_point_mm(&self, axes: &Matrix3<T>) -> Vector3<T> {
        let normal = &axes.row(2).transpose();
        // The derivative of the height over the rotation of the plane is the place along the plane.
        let slopes = first_touch_slopes(normal.x, normal.y, &self.numbers.first_touch_mm);
        let [x, y] = [0, 1].map(|k| axes[(k, 0)] * slopes[0] + axes[(k, 1)] * slopes[1]);
        axes.tr_mul(&Vector3::new(x, y, self.fitted_first_touch_mm(normal)))
    }

    /// The shift of a body at a depth, mm.
    ///
    /// * `axes`: axes of the plane in the finger's frame
    /// * `pivot`: centre of rotation of poses, finger's frame, mm
    pub(crate) fn approach(
        &self,
        depth: T,
        axes: &Matrix3<T>,
        pivot: &Vector3<T>,
        body: &impl Surface<T>,
    ) -> Approach<T> {
        let normal = &axes.row(2).transpose();
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let none = Approach { shift: zero, rate: one, arm: Vector3::zeros() };
        let [least, most] = [SHIFTED, MOST_SHIFTED].map(|share| T::of(share) * self.numbers.depth_max_mm);
        let flatness = (one - T::of(ROUND) * steepness(body)).not_negative();
        if depth >= most || flatness == zero {
            return none;
        }
        let per_distance = T::of(PER_DISTANCE);
        let (height, meets) = self.patches_meet(normal);
        let off = height - self.fitted_first_touch_mm(normal);
        let largest = (most - least) / per_distance;
        let within = if off < zero { -(-off).at_most(largest) } else { off.at_most(largest) };
        let late = within * flatness;
        let range = least + per_distance * late.magnitude();
        let left = one - depth / range;
        if !(left > zero) {
            return none;
        }
        let touch = self.fitted_first_touch_point_mm(axes);
        let per_depth = T::of(-2.0) * late * left / range;
        let per_late = left * left + per_depth.magnitude() * per_distance * depth / range;
        let per_off = if within == off { per_late * flatness } else { zero };
        Approach {
            shift: late * left * left,
            rate: one + per_depth,
            arm: (touch - meets) * per_off + (touch - pivot) * per_depth,
        }
    }

    /// Height of a plane, mm, at which the first patches meet it, and where they do, mm; finger's frame. A smooth function of the normal,
    /// and never above the first patch.
    fn patches_meet(&self, normal: &Vector3<T>) -> (T, Vector3<T>) {
        let per_mm = T::of(1.0 / TOGETHER_MM);
        let (mut least, mut sum, mut place) = (T::of(f32::MAX), T::of(0.0), Vector3::zeros());
        for patch in self.patches {
            let (along, spread) = spread_along(patch, normal);
            let height = normal.dot(&Vector3::from(patch.middle_mm)) - spread;
            let mut weight = T::of(1.0);
            if height < least {
                let kept =
                    if least - height < T::of(APART_MM) { ((height - least) * per_mm).exp() } else { T::of(0.0) };
                (sum, place, least) = (sum * kept, place * kept, height);
            } else if height - least < T::of(APART_MM) {
                weight = ((least - height) * per_mm).exp();
            } else {
                continue;
            }
            // The point of the ellipsoid that is closest to the plane.
            let edge = times_spread(patch, &(along * (T::of(-1.0) / spread)));
            sum += weight;
            place += (Vector3::from(patch.middle_mm) + edge) * weight;
        }
        // A pad may have no patches.
        let sum = sum + T::of(f32::MIN_POSITIVE);
        (least - T::of(TOGETHER_MM) * sum.ln(), place * (T::of(1.0) / sum))
    }
}

/// Terms of the height of first touch: products of powers of x and of y², the components of the plane's normal in the finger's frame.
pub fn first_touch_terms<T: Scalar>(x: T, y: T) -> [T; FIRST_TOUCH_TERMS] {
    let one = T::of(1.0);
    let y = y * y;
    let (x2, y2) = (x * x, y * y);
    let (x3, x4, x6) = (x2 * x, x2 * x2, x2 * x2 * x2);
    [
        one,
        x,
        x2,
        x3,
        x4,
        x4 * x,
        x6,
        y,
        y * x,
        y * x2,
        y * x3,
        y * x4,
        y2,
        y2 * x,
        y2 * x2,
        y2 * y,
        y2 * y * x,
        x6 * x,
        y2 * x3,
        y2 * y2,
    ]
}

/// Derivatives of the height of first touch over the x and the y of the plane's normal, mm.
fn first_touch_slopes<T: Scalar>(x: T, y: T, coefficients: &[T; FIRST_TOUCH_TERMS]) -> [T; 2] {
    let (of, root) = (T::of, y);
    let (zero, one, y) = (of(0.0), of(1.0), y * y);
    let (x2, y2) = (x * x, y * y);
    let (x3, x4, y3) = (x2 * x, x2 * x2, y2 * y);
    let by_x = [
        zero,
        one,
        of(2.0) * x,
        of(3.0) * x2,
        of(4.0) * x3,
        of(5.0) * x4,
        of(6.0) * x4 * x,
        zero,
        y,
        of(2.0) * x * y,
        of(3.0) * x2 * y,
        of(4.0) * x3 * y,
        zero,
        y2,
        of(2.0) * x * y2,
        zero,
        y3,
        of(7.0) * x4 * x2,
        of(3.0) * x2 * y2,
        zero,
    ];
    let over_y = [
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        one,
        x,
        x2,
        x3,
        x4,
        of(2.0) * y,
        of(2.0) * x * y,
        of(2.0) * x2 * y,
        of(3.0) * y2,
        of(3.0) * y2 * x,
        zero,
        of(2.0) * x3 * y,
        of(4.0) * y3,
    ];
    [weighted(&by_x, coefficients), of(2.0) * root * weighted(&over_y, coefficients)]
}

/// Sum of terms times the coefficients.
fn weighted<T: Scalar>(terms: &[T; FIRST_TOUCH_TERMS], coefficients: &[T; FIRST_TOUCH_TERMS]) -> T {
    terms.iter().zip(coefficients).fold(T::of(0.0), |sum, (term, coefficient)| sum + *term * *coefficient)
}
