//! The yield surface of an element, and the return of one that yields onto it.
//!
//! Uses math.

use crate::math::sqrt;

/// Value of the yield function at which an element yields. It is returned to 1, up to rounding; the gap between the
/// two is wider than that, so that an element on its limit stays where it is when nothing moves.
pub(crate) const YIELD: f32 = 1.0 + 1.0 / (1u32 << 18) as f32;

/// The yield surface of an element: |u|² − 2 alpha u_x = 1, a circle that is shifted by alpha along x.
pub(crate) struct YieldSurface {
    /// u_y over the component along y that the state holds.
    anisotropy: f32,
    /// alpha.
    shift: f32,
    shift_twice: f32,
    /// 1 − rho, rho the stiffness along y over that along x.
    lack: f32,
    /// 2 rho − 1.
    rest: f32,
}

impl YieldSurface {
    /// `ratio` is rho.
    #[inline(always)]
    pub(crate) fn new(anisotropy: f32, shift: f32, ratio: f32) -> Self {
        let lack = 1.0 - ratio;
        Self { anisotropy, shift, shift_twice: shift + shift, lack, rest: ratio - lack }
    }

    /// Value of the yield function: 1 on the surface.
    #[inline(always)]
    pub(crate) fn level(&self, [x, y]: [f32; 2]) -> f32 {
        let y = y * self.anisotropy;
        y * y + x * (x - self.shift_twice)
    }

    /// An element beyond the surface, where the yield function is `level`, returned onto it.
    ///
    /// The overshoot goes back along (u_x, rho u_y) as slip, which makes friction oppose it. With the slope
    /// f = 2 (u_x² + rho u_y²) − 2 alpha u_x and o = v² − v the direction is (u_x (f + rho o), u_y (f + o)), where
    /// f + o = v² + u_x² + (2 rho − 1) u_y² and v is `level`.
    #[inline(always)]
    pub(crate) fn return_map(&self, [mut x, mut y]: [f32; 2], level: f32) -> [f32; 2] {
        let u_y = y * self.anisotropy;
        let mut along = level * level;
        let over = along - level;
        along += x * x;
        along += self.rest * u_y * u_y;
        x *= along - self.lack * over;
        let to_y = u_y * along;
        let shifted = self.shift * x;
        let back = 1.0 / (sqrt(x * x + to_y * to_y + shifted * shifted) - shifted);
        y *= along;
        [x * back, y * back]
    }
}

/// Limit over the strength L in a direction; `shift` is alpha times the direction's cosine to x.
#[inline(always)]
pub(crate) fn limit_share(shift: f32) -> f32 {
    shift + sqrt(1.0 + shift * shift)
}

#[cfg(test)]
mod tests {
    /// Returning an element onto its yield surface never gives energy: F · plastic slip >= 0 for any stiffness ratio,
    /// tilt, direction and overshoot, and what was returned does not yield again.
    #[test]
    fn yielding_dissipates() {
        for ratio in [0.25f64, 0.4, 0.6, 0.8, 1.0, 1.3, 2.0, 4.0] {
            for tilt in [-0.25f64, -0.1, 0.0, 0.03, 0.2, 0.25] {
                for degrees in 0..=180 {
                    for overshoot in [2e-3f64, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0] {
                        let (s, c) = f64::from(degrees).to_radians().sin_cos();
                        let limit = tilt * c + (1.0 + tilt * tilt * c * c).sqrt();
                        let (ux, uy) = (c * limit * (1.0 + overshoot), s * limit * (1.0 + overshoot));
                        let square = ux * ux + uy * uy;
                        let level = square - 2.0 * tilt * ux;
                        let lack = 1.0 - ratio;
                        let over = level * level - level;
                        let along_y = over + level + square - 2.0 * lack * uy * uy;
                        let along_x = along_y - lack * over;
                        let (wx, wy) = (ux * along_x, uy * along_y);
                        let length = wx * wx + wy * wy;
                        let back = (tilt * wx + (tilt * tilt * wx * wx + length).sqrt()) / length;
                        let (nx, ny) = (wx * back, wy * back);
                        let slip = [ux - nx, (uy - ny) / ratio];
                        let gain = nx * slip[0] + ny * slip[1];
                        assert!(gain >= 0.0, "{ratio} {tilt} {degrees} {overshoot}: {gain}");
                        let again = nx * nx + ny * ny - 2.0 * tilt * nx;
                        assert!((again - 1.0).abs() < 1e-12, "{tilt} {degrees}: {again}");
                    }
                }
            }
        }
    }
}
