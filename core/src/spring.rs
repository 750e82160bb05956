//! One spring of the bed: its force, its energy, and the slip that returns it to its limit.
//!
//! Uses math.

use crate::math::Scalar;

/// Largest |q u| of a spring on its limit: its force grows with the displacement throughout.
pub(crate) const ODD_MAX: f32 = 0.4;
/// Share by which the square of a displacement may exceed its limit's before the spring slips. It is returned to the limit up
/// to rounding; the gap is wider than that, so that a spring on its limit stays where it is when nothing moves.
const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Twice the length by which a displacement may exceed a small limit, mm: what rounding of positions within some ten mm makes.
/// A spring whose limit is 0 has none and carries nothing.
pub(crate) const SLACK_MM: f32 = 2e-6;
/// A square that is added to others, so that quotients of the two are numbers.
pub(crate) const NOTHING: f32 = 1e-26;

/// The law along x: force u − q u² over the stiffness.
#[derive(Clone, Copy)]
pub(crate) struct Odd<T>(pub(crate) T);

impl<T: Scalar> Odd<T> {
    /// Force over stiffness, mm.
    #[inline(always)]
    pub(crate) fn force(&self, u: T) -> T {
        u - self.0 * u * u
    }

    /// Force and energy over stiffness, mm and mm².
    #[inline(always)]
    pub(crate) fn force_and_energy(&self, u: T) -> [T; 2] {
        let bent = self.0 * u;
        let square = u * u;
        [u - bent * u, T::of(0.5) * square - T::of(1.0 / 3.0) * (bent * square)]
    }

    /// Slope of the force.
    #[inline(always)]
    pub(crate) fn slope(&self, u: T) -> T {
        T::of(1.0) - T::of(2.0) * self.0 * u
    }
}

/// The limit of a spring with displacement u and radius R: (u_x − alpha R)² + (b u_y)² = R² (1 + alpha²).
pub(crate) struct Limit<T> {
    /// alpha.
    pub(crate) shift: T,
    /// b: stiffness along y over that along x, over the ratio of the strengths.
    pub(crate) anisotropy: T,
    /// Stiffness along y over that along x.
    pub(crate) ratio: T,
    /// 1 + alpha².
    wide: T,
}

/// Where a spring is after its return.
pub(crate) struct Returned<T> {
    /// Displacement, mm.
    pub(crate) u: [T; 2],
    /// Displacement from the middle of its limit, along y times the anisotropy.
    pub(crate) v: [T; 2],
    /// Square of the limit's radius less that of `v`; 0 where it slips.
    pub(crate) room: T,
    /// Whether it slips.
    pub(crate) slips: bool,
}

impl<T: Scalar> Limit<T> {
    #[inline(always)]
    pub(crate) fn new(shift: T, anisotropy: T, ratio: T) -> Self {
        Self { shift, anisotropy, ratio, wide: T::of(1.0) + shift * shift }
    }

    /// A spring beyond its limit, returned onto it by slip along the friction, which loses energy.
    ///
    /// The overshoot o = v² − R² (1 + alpha²) goes back along (u_x, r u_y) by lambda = o/(o + 2 (u_x v_x + r v_y²)): Newton's
    /// step for a small overshoot, the whole way to the middle for a large one. Then `v` is scaled to the radius.
    #[inline(always)]
    pub(crate) fn return_map(&self, [ux, uy]: [T; 2], radius: T) -> Returned<T> {
        let middle = self.shift * radius;
        let square = radius * radius * self.wide;
        let (vx, vy) = (ux - middle, uy * self.anisotropy);
        let over = vx * vx + vy * vy - square;
        let slips = over > radius * (radius * T::of(SLACK) + T::of(SLACK_MM));
        // Computed whether it is wanted or not: a step takes the same time in stick and in slip.
        let along = ux * vx + self.ratio * (vy * vy);
        let share = over / (over.magnitude() + (along + along).magnitude() + T::of(NOTHING));
        let back_y = T::of(1.0) - self.ratio * share;
        let (nx, ny) = (vx - share * ux, vy * back_y);
        let scale = (square / (nx * nx + ny * ny + T::of(NOTHING))).sqrt();
        let slid = [nx * scale, ny * scale];
        let to = [slid[0] + middle, uy * (back_y * scale)];
        Returned {
            u: [T::select(slips, to[0], ux), T::select(slips, to[1], uy)],
            v: [T::select(slips, slid[0], vx), T::select(slips, slid[1], vy)],
            room: T::select(slips, T::of(0.0), (-over).not_negative()),
            slips,
        }
    }
}

/// Limit over the strength L in a direction; `shift` is alpha times the direction's cosine to x.
#[inline(always)]
pub(crate) fn limit_share<T: Scalar>(shift: T) -> T {
    shift + (T::of(1.0) + shift * shift).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slip goes along the friction that is left, whatever the stiffness ratio, strength ratio, tilt, odd term, direction
    /// and overshoot: it never gives energy. What was returned does not slip again.
    #[test]
    fn slip_loses_energy() {
        for ratio in [0.25f64, 0.4, 0.6, 1.0, 1.6, 4.0] {
            for strength in [0.5, 0.8, 1.0, 1.3, 2.0] {
                for tilt in [-0.25f64, -0.1, 0.0, 0.03, 0.25] {
                    for q in [-0.44f64, -0.1, 0.0, 0.2, 0.44] {
                        let (limit, odd) = (Limit::new(tilt, ratio / strength, ratio), Odd(q));
                        for degrees in (0..360).step_by(5) {
                            for overshoot in [1e-4f64, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 1000.0] {
                                let (s, c) = f64::from(degrees).to_radians().sin_cos();
                                let radius = 0.7;
                                let length = radius * (1.0 + tilt * tilt).sqrt() * (1.0 + overshoot);
                                let u = [tilt * radius + c * length, s * length / (ratio / strength)];
                                let r = limit.return_map(u, radius);
                                assert!(r.slips && (q * r.u[0]).abs() <= f64::from(ODD_MAX));
                                assert!(!limit.return_map(r.u, radius).slips);
                                let slip = [u[0] - r.u[0], u[1] - r.u[1]];
                                let lost = odd.force(r.u[0]) * slip[0] + ratio * r.u[1] * slip[1];
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
            let odd = Odd(q);
            for i in -130..130 {
                let (u, h) = (0.01 * f64::from(i), 1e-5);
                let [force, _] = odd.force_and_energy(u);
                let slope = (odd.force_and_energy(u + h)[1] - odd.force_and_energy(u - h)[1]) / (2.0 * h);
                assert!((force - slope).abs() < 1e-7 && (force - odd.force(u)).abs() < 1e-12, "{q} {u}");
                let numeric = (odd.force(u + h) - odd.force(u - h)) / (2.0 * h);
                assert!((odd.slope(u) - numeric).abs() < 1e-8 && numeric > 0.0, "{q} {u}");
            }
        }
    }
}
