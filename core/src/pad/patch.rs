//! A patch under a given overlap: the force that it bears, and how strong its friction is.

use crate::math::Elementary;

use super::Law;

/// What of a patch does not depend on the bulk.
#[derive(Clone, Copy)]
pub(crate) struct Compressed<T> {
    /// Compliance along the normal, mm/N.
    pub compliance: T,
    /// Spread of the gaps within the patch, mm.
    pub spread: T,
    /// Force at which all of it touches, N.
    pub flat: T,
    /// Natural logarithms of the largest area in contact, mm², and of the force at which it is reached, N.
    pub log_area: T,
    pub log_full: T,
}

/// What a patch bears.
#[derive(Clone, Copy)]
pub(crate) struct Borne<T> {
    /// Normal force, N, and its slope over the overlap, N/mm.
    pub force: T,
    pub slope: T,
    /// Largest friction, N.
    pub strength: T,
}

/// Most rounds of the root in [`Compressed::press`], and the share of it by which the last changes it: its error is the square of that.
const ROUNDS: usize = 24;
const ROOT: f32 = 1e-5;

impl<T: Elementary> Compressed<T> {
    /// Whether it touches at an overlap of its middle, mm.
    #[inline(always)]
    pub fn touches(&self, overlap: T) -> bool {
        overlap + self.spread > T::of(0.0)
    }

    /// Force and strength of a patch that touches.
    ///
    /// Of the share s³ of [`Self::flat`] that it bears: compliance flat s³ + spread s² = overlap + spread, up to s = 1.
    pub fn press(&self, overlap: T, law: &Law<T>) -> Borne<T> {
        let over = overlap + self.spread;
        let a = self.compliance * self.flat;
        let (force, slope) = if over >= a + self.spread {
            (overlap / self.compliance, T::of(1.0) / self.compliance)
        } else {
            // The left side is convex: Newton's method from above the root falls to it.
            let mut s = (over / self.spread).at_most(T::of(1.0)).magnitude().sqrt();
            for _ in 0..ROUNDS {
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
        let [lambda, beta] = law.friction;
        let log_force = (force + T::of(f32::MIN_POSITIVE)).ln();
        let log_area = self.log_area_at(log_force, law);
        let strength = lambda * (log_area + beta * (log_force - log_area)).exp();
        Borne { force, slope, strength }
    }

    /// Area in contact at a force, mm².
    pub fn area(&self, force: T, law: &Law<T>) -> T {
        self.log_area_at((force + T::of(f32::MIN_POSITIVE)).ln(), law).exp()
    }

    #[inline(always)]
    fn log_area_at(&self, log_force: T, law: &Law<T>) -> T {
        let below = log_force - self.log_full;
        if below < T::of(0.0) { self.log_area + law.area[2] * below } else { self.log_area }
    }

    /// Energy stored along the normal, mJ, and its derivative over the spread where the force at which all of it touches grows with the
    /// spread by `flat_rate`, N.
    pub fn energy(&self, overlap: T, force: T, flat_rate: T) -> (T, T) {
        let half = T::of(0.5) * self.compliance * force * force;
        if force >= self.flat {
            let part = T::of(0.4) * self.flat;
            return (force * overlap - half + part * self.spread, part + T::of(0.4) * self.spread * flat_rate);
        }
        // s² of the share that touches.
        let over = overlap + self.spread - self.compliance * force;
        let square = over / self.spread;
        let dual = half + self.spread * force * (T::of(0.6) * square - T::of(1.0));
        let by_flat = T::of(0.4) * self.spread * force * square / self.flat;
        (force * overlap - dual, force * (T::of(1.0) - T::of(0.6) * square) + by_flat * flat_rate)
    }
}
