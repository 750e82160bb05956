//! One spring of the bed: its force, its energy, and the slip that returns it to its limit.
//!
//! Uses math.

use crate::math::Scalar;

/// Largest |q u| of a spring on its limit: its force grows with the displacement throughout.
pub(crate) const ODD_MAX: f32 = 0.4;
/// Relative margin of the squared limit to which a slipping displacement returns, so that rounding causes no further slip at
/// rest.
const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Twice the length by which a displacement may exceed its limit before it slips, mm. It covers the rounding of positions. Each slip
/// is then at least 4 nm long, so that rounding turns friction by less than 0.1 degrees even if a step is 1 nm long.
/// A spring whose limit is 0 has no slack and carries no force.
pub(crate) const SLACK_MM: f32 = 8e-6;
/// Added to squares in denominators, so that 0/0 does not occur.
pub(crate) const DIV_EPS: f32 = 1e-26;

/// The law along x: force u − q u² over the stiffness, with q as its number.
#[derive(Clone, Copy)]
pub(crate) struct QuadraticStiffness<T>(pub(crate) T);

impl<T: Scalar> QuadraticStiffness<T> {
    /// Force over stiffness, mm.
    #[inline(always)]
    pub(crate) fn force(&self, u: T) -> T {
        u - self.0 * u * u
    }

    /// Slope of the force.
    #[inline(always)]
    pub(crate) fn slope(&self, u: T) -> T {
        T::of(1.0) - T::of(2.0) * self.0 * u
    }
}

/// Sums over springs of stiffness times powers of the displacement: force and energy in one.
#[derive(Clone, Copy)]
pub(crate) struct Sums<T> {
    x: [T; 3],
    y: [T; 2],
}

impl<T: Scalar> Sums<T> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        // The compiler removes an addition to −0 but not one to 0.
        Self { x: [T::of(-0.0); 3], y: [T::of(-0.0); 2] }
    }

    /// Adds a spring; returns its stiffness times displacement, and along x also times the square.
    #[inline(always)]
    pub(crate) fn add(&mut self, stiffness: T, [x, y]: [T; 2]) -> [T; 3] {
        let (first, across) = (stiffness * x, stiffness * y);
        let second = first * x;
        self.x[0] += first;
        self.x[1] += second;
        self.x[2] += second * x;
        self.y[0] += across;
        self.y[1] += across * y;
        [first, second, across]
    }

    /// The same sums over springs of a stiffness that is `share` of theirs.
    #[inline(always)]
    pub(crate) fn times(&self, share: T) -> Self {
        Self { x: self.x.map(|sum| sum * share), y: self.y.map(|sum| sum * share) }
    }

    /// Force along x and y over the stiffness, mm.
    #[inline(always)]
    pub(crate) fn force(&self, odd: &QuadraticStiffness<T>) -> [T; 2] {
        [self.x[0] - odd.0 * self.x[1], self.y[0]]
    }

    /// Energy along x and y over the stiffness, mm².
    #[inline(always)]
    pub(crate) fn energy(&self, odd: &QuadraticStiffness<T>) -> [T; 2] {
        let half = T::of(0.5);
        [half * self.x[1] - odd.0 * T::of(1.0 / 3.0) * self.x[2], half * self.y[1]]
    }
}

/// The limit of a spring with displacement u and radius R: (u_x − alpha R)² + (b u_y)² = R² (1 + alpha²).
pub(crate) struct Limit<T> {
    /// alpha, and twice that.
    pub(crate) shift: T,
    twice: T,
    /// b: stiffness along y over that along x, over the ratio of the strengths.
    pub(crate) anisotropy: T,
    /// Stiffness along y over that along x.
    ratio: T,
    /// 1 + alpha², less the slack.
    wide: T,
}

/// Position of a displacement relative to the limit.
pub(crate) struct YieldCheck<T> {
    /// Displacement along y times the anisotropy.
    pub(crate) w: T,
    /// Excess of the squared distance from the middle of the limit over the squared limit; negative within.
    pub(crate) over: T,
}

impl<T: Scalar> Limit<T> {
    #[inline(always)]
    pub(crate) fn new(shift: T, anisotropy: T, ratio: T) -> Self {
        let wide = (T::of(1.0) + shift * shift) * T::of(1.0 - SLACK);
        Self { shift, twice: shift + shift, anisotropy, ratio, wide }
    }

    /// Excess of a displacement over the limit: u_x² + w² − R (R + 2 alpha u_x), with a slack for rounding.
    #[inline(always)]
    pub(crate) fn yield_check(&self, [ux, uy]: [T; 2], radius: T) -> YieldCheck<T> {
        let w = uy * self.anisotropy;
        let most = (radius + T::of(SLACK_MM)) + self.twice * ux;
        YieldCheck { w, over: ux * ux + w * w - radius * most }
    }

    /// A displacement beyond its limit, returned onto it by slip along the friction, which dissipates energy; and its component along y
    /// times the anisotropy.
    ///
    /// The overshoot o = v² − R² (1 + alpha²), v from the centre of the limit, is returned along (u_x, r u_y) by
    /// lambda = o/(o + 2 (u_x v_x + r b u_y v_y)): Newton's step for a small overshoot, the whole way to the middle for a large
    /// one. Then `v` is scaled to the radius. The slack decides whether a spring slips and is part of the overshoot: if scaling removed
    /// it, slow slip would turn friction towards the middle of the limit.
    #[inline(always)]
    pub(crate) fn return_map(&self, [ux, uy]: [T; 2], w: T, radius: T) -> ([T; 2], T) {
        let middle = self.shift * radius;
        let vx = ux - middle;
        let square = radius * radius * self.wide;
        let over = vx * vx + w * w - square;
        let along = ux * vx + self.ratio * (w * w);
        let share = over / (over + (along + along).magnitude());
        let back_y = T::of(1.0) - self.ratio * share;
        let nx = vx - share * ux;
        let ny = w * back_y;
        let scale = (square / (nx * nx + ny * ny + T::of(DIV_EPS))).magnitude().sqrt();
        let to_x = middle + nx * scale;
        let back_y = back_y * scale;
        ([to_x, uy * back_y], w * back_y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slip is along the remaining friction for any stiffness ratio, strength ratio, tilt, odd term, direction and overshoot, so that it never
    /// yields energy. A returned displacement does not slip again.
    #[test]
    fn slip_loses_energy() {
        for ratio in [0.25f64, 0.4, 0.6, 1.0, 1.6, 4.0] {
            for strength in [0.5, 0.8, 1.0, 1.3, 2.0] {
                for tilt in [-0.25f64, -0.1, 0.0, 0.03, 0.25] {
                    for q in [-0.44f64, -0.1, 0.0, 0.2, 0.44] {
                        let anisotropy = ratio / strength;
                        let (limit, odd) = (Limit::new(tilt, anisotropy, ratio), QuadraticStiffness(q));
                        for degrees in (0..360).step_by(5) {
                            for overshoot in [1e-4f64, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 1000.0] {
                                let (s, c) = f64::from(degrees).to_radians().sin_cos();
                                let radius = 0.7;
                                let length = radius * (1.0 + tilt * tilt).sqrt() * (1.0 + overshoot);
                                let u = [tilt * radius + c * length, s * length / anisotropy];
                                let seen = limit.yield_check(u, radius);
                                let to = limit.return_map(u, seen.w, radius).0;
                                assert!(seen.over > 0.0 && (q * to[0]).abs() <= f64::from(ODD_MAX));
                                assert!(limit.yield_check(to, radius).over <= 0.0);
                                let slip = [u[0] - to[0], u[1] - to[1]];
                                let lost = odd.force(to[0]) * slip[0] + ratio * to[1] * slip[1];
                                assert!(
                                    lost >= -1e-12,
                                    "ratio {ratio} strength {strength} tilt {tilt} q {q} {degrees} deg {overshoot}: {lost}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn force_is_the_slope_of_the_energy() {
        for q in [-0.3f64, 0.0, 0.3] {
            let odd = QuadraticStiffness(q);
            let at = |u: f64| {
                let mut sums = Sums::new();
                sums.add(0.6, [u, 0.4 * u]);
                sums.add(0.4, [0.8 * u, -u]);
                sums
            };
            for i in -130..130 {
                let (u, h) = (0.01 * f64::from(i), 1e-5);
                let [before, after] = [u - h, u + h].map(|u| at(u).energy(&odd));
                let alone = 0.6 * odd.force(u) + 0.4 * 0.8 * odd.force(0.8 * u);
                assert!((alone - (after[0] - before[0]) / (2.0 * h)).abs() < 2e-7, "{q} {u}");
                let together = 0.6 * odd.force(u) + 0.4 * odd.force(0.8 * u);
                assert!((at(u).force(&odd)[0] - together).abs() < 1e-12, "{q} {u}");
                let numeric = (odd.force(u + h) - odd.force(u - h)) / (2.0 * h);
                assert!((odd.slope(u) - numeric).abs() < 1e-8 && numeric > 0.0, "{q} {u}");
            }
        }
    }
}
