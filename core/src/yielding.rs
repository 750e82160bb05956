//! An element that yields is drawn back onto its limit.
//!
//! Uses math.

use crate::math::sqrt;

/// Value of the yield function at which an element yields. It is drawn back to 1, up to rounding; the gap between the
/// two is wider than that, so that an element on its limit stays where it is when nothing moves.
pub(crate) const YIELD: f32 = 1.0 + 1.0 / (1u32 << 18) as f32;

/// An element beyond its limit drawn back onto it.
///
/// The overshoot goes back along (u_x, rho u_y) as slip, which makes friction oppose it. With the slope
/// f = 2 (u_x² + rho u_y²) − 2 alpha u_x and o = v² − v the direction is (u_x (f + rho o), u_y (f + o)), where
/// f + o = v² + u_x² + (2 rho − 1) u_y². `y` times `round` is u_y; `lack` is 1 − rho, `rest` 2 rho − 1.
#[inline(always)]
pub(crate) fn drawn_back(
    [mut x, mut y]: [f32; 2],
    round: f32,
    level: f32,
    tilt: f32,
    lack: f32,
    rest: f32,
) -> [f32; 2] {
    let y_round = y * round;
    let mut along = level * level;
    let over = along - level;
    along += x * x;
    along += rest * y_round * y_round;
    x *= along - lack * over;
    let to_y = y_round * along;
    let ahead = tilt * x;
    let back = 1.0 / (sqrt(x * x + to_y * to_y + ahead * ahead) - ahead);
    y *= along;
    [x * back, y * back]
}

/// Limit over the strength L in a direction; `shift` is the tilt times its cosine to x.
#[inline(always)]
pub(crate) fn limit_share(shift: f32) -> f32 {
    shift + sqrt(1.0 + shift * shift)
}

#[cfg(test)]
mod tests {
    /// Drawing an element back onto its limit never gives energy: F · plastic slip >= 0 for any stiffness ratio,
    /// tilt, direction and overshoot, and what was drawn back does not yield again.
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
