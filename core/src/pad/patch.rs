//! Normal contact of one patch: its force and its strength in friction at a given overlap.

use crate::math::Elementary;

use nalgebra::Vector3;

use super::{Law, Patch};

/// Law of the normal contact of a patch in one pose; it does not depend on the bulk.
#[derive(Clone, Copy)]
pub(crate) struct Compressed<T> {
    /// Compliance along the normal, mm/N.
    pub compliance: T,
    /// Standard deviation of the gaps within the patch, mm.
    pub spread: T,
    /// Force at which the whole patch touches, N.
    pub flat: T,
    /// Force at which the largest area in contact is reached, N, and that area, mm².
    pub full: T,
    pub full_area: T,
    /// Natural logarithm of the strength at `full` over lambda and `full_area`.
    pub full_log: T,
}

/// Normal force and strength of a patch.
#[derive(Clone, Copy)]
pub(crate) struct PatchForce<T> {
    /// Normal force, N, and its derivative over the overlap, N/mm.
    pub force: T,
    pub slope: T,
    /// Normal force of the relaxed tissue, N.
    pub relaxed: T,
    /// Largest friction, N.
    pub strength: T,
    /// Natural logarithm of that force over [`Compressed::full`], at most 0.
    pub below: T,
}

/// Derivative of [`Compressed::flat`] over the spread, N/mm.
#[inline(always)]
pub(crate) fn flat_force_rate<T: Elementary>(patch: &Patch<T>, law: &Law<T>) -> T {
    law.flattening_mpa[1] * patch.area_mm2.magnitude().sqrt()
}

/// Largest number of Newton iterations in [`Compressed::press`].
const ITERATIONS: usize = 24;
/// Relative change of the root in the last iteration; the error of the root is its square.
const ROOT: f32 = 1e-5;

impl<T: Elementary> Compressed<T> {
    /// The law of a patch whose gaps have the standard deviation `spread`, mm.
    pub fn new(patch: &Patch<T>, spread: T, law: &Law<T>) -> Self {
        let flat = patch.area_mm2 * law.flattening_mpa[0] + flat_force_rate(patch, law) * spread;
        let [area, force, _] = law.area;
        let (full, full_area) = (force * flat, area * patch.area_mm2);
        Self {
            compliance: patch.compliance_mm_per_n[0],
            spread,
            flat,
            full,
            full_area,
            full_log: law.friction[1] * (full / full_area).ln(),
        }
    }

    /// Whether the patch touches at an overlap of its middle, mm.
    #[inline(always)]
    pub fn touches(&self, overlap: T) -> bool {
        overlap + self.spread > T::of(0.0)
    }

    /// Force and strength of a patch that touches.
    ///
    /// * `branches`: s and h, N, of tissue that relaxes. The pressure follows the force, and the area the overlap.
    ///
    /// Up to [`Self::flat`] the force is flat s³ with compliance flat s³ + spread s² = overlap + spread; above it, overlap over compliance.
    #[inline(always)]
    pub fn press(&self, overlap: T, law: &Law<T>, branches: Option<[T; 2]>) -> PatchForce<T> {
        let over = overlap + self.spread;
        let a = self.compliance * self.flat;
        let (relaxed, mut slope) = if over >= a + self.spread {
            (overlap / self.compliance, T::of(1.0) / self.compliance)
        } else {
            // The left side is convex, so that Newton's method from above decreases monotonically to the root.
            let mut s = (over / self.spread).at_most(T::of(1.0)).magnitude().sqrt();
            for _ in 0..ITERATIONS {
                let value = (a * s + self.spread) * (s * s) - over;
                let rise = (T::of(3.0) * a * s + T::of(2.0) * self.spread) * s;
                let fall = value / (rise + T::of(f32::MIN_POSITIVE));
                s -= fall;
                if !(fall > T::of(ROOT) * s) {
                    break;
                }
            }
            let s = s.not_negative();
            let force = self.flat * (s * s * s);
            (force, T::of(3.0) * self.flat * s / (T::of(3.0) * a * s + T::of(2.0) * self.spread))
        };
        let (below, mut strength_log) = self.below_and_strength_log(relaxed, law);
        let beta = law.friction[1];
        let mut force = relaxed;
        if let Some([stiff, held]) = branches {
            force = stiff * relaxed - held;
            slope *= stiff;
            if force != relaxed {
                let tiny = T::of(f32::MIN_POSITIVE);
                strength_log += beta * ((force + tiny) / (relaxed + tiny)).ln();
            }
        }
        PatchForce { force, slope, relaxed, strength: law.friction[0] * self.full_area * strength_log.exp(), below }
    }

    /// [`PatchForce::below`], and the natural logarithm of the strength over lambda and [`Self::full_area`], at a force of relaxed tissue.
    #[inline(always)]
    fn below_and_strength_log(&self, relaxed: T, law: &Law<T>) -> (T, T) {
        let log = (relaxed / self.full + T::of(f32::MIN_POSITIVE)).ln();
        let beta = law.friction[1];
        let (below, exponent) =
            if log < T::of(0.0) { (log, beta + law.area[2] * (T::of(1.0) - beta)) } else { (T::of(0.0), beta) };
        (below, exponent * log + self.full_log)
    }

    /// [`PatchForce::strength`] of relaxed tissue at its normal force, N.
    #[inline(always)]
    pub fn relaxed_strength(&self, relaxed: T, law: &Law<T>) -> T {
        law.friction[0] * self.full_area * self.below_and_strength_log(relaxed, law).1.exp()
    }

    /// Share of [`Self::full_area`] in contact at [`PatchForce::below`].
    pub fn contact_share(&self, below: T, law: &Law<T>) -> T {
        (law.area[2] * below).exp()
    }

    /// Energy of the normal contact, mJ, and its derivative over the spread, N.
    ///
    /// * `flat_force_rate`: derivative of [`Self::flat`] over the spread, N/mm
    pub fn energy(&self, overlap: T, force: T, flat_force_rate: T) -> (T, T) {
        let half = T::of(0.5) * self.compliance * force * force;
        if force >= self.flat {
            let part = T::of(0.4) * self.flat;
            return (force * overlap - half + part * self.spread, part + T::of(0.4) * self.spread * flat_force_rate);
        }
        // Share of the patch that touches: s².
        let over = overlap + self.spread - self.compliance * force;
        let square = over / self.spread;
        let dual = half + self.spread * force * (T::of(0.6) * square - T::of(1.0));
        let by_flat = T::of(0.4) * self.spread * force * square / self.flat;
        (force * overlap - dual, force * (T::of(1.0) - T::of(0.6) * square) + by_flat * flat_force_rate)
    }
}

/// Least mean square of the gaps within a patch, mm².
const LEAST_SPREAD_MM2: f32 = 1e-8;

/// L' d for the factor L of the second moment of a patch and a direction d, mm; and its length, the standard deviation along d.
#[inline(always)]
pub(crate) fn spread_along<T: Elementary>(patch: &Patch<T>, direction: &Vector3<T>) -> (Vector3<T>, T) {
    let [xx, xy, yy, xz, yz, zz] = patch.spread_mm;
    let [x, y, z] = (*direction).into();
    let along = Vector3::new(xx * x + xy * y + xz * z, yy * y + yz * z, zz * z);
    (along, root_of_variance(along.dot(&along)))
}

/// L v for the same factor, mm.
#[inline(always)]
pub(crate) fn times_spread<T: Elementary>(patch: &Patch<T>, v: &Vector3<T>) -> Vector3<T> {
    let [xx, xy, yy, xz, yz, zz] = patch.spread_mm;
    let [a, b, c] = (*v).into();
    Vector3::new(xx * a, xy * a + yy * b, xz * a + yz * b + zz * c)
}

/// Standard deviation of the gaps within a patch, mm.
#[inline(always)]
pub(crate) fn root_of_variance<T: Elementary>(variance: T) -> T {
    (variance + T::of(LEAST_SPREAD_MM2)).magnitude().sqrt()
}
