//! Additional terms of a refitted baseline: strength over direction, and normal force due to friction.
//!
//! They are no effects but further parameters of the fit. They are stored in effect slots with numbers of their own and are evaluated with
//! the effects.

use super::{Conditions, VALUES};
use crate::math::Real;

/// Number of the slot of strength over direction; floats a, b, c, d, e, 0 of
/// strength × (1 + (a + e u) cos 2θ + b sin 2θ + c cos θ + d sin θ), u = ln(depth/0.9 mm) within −1.6 to 1.1 and θ the
/// direction of motion.
pub const DIRECTION: u32 = 32;

/// Number of the slot of normal force due to friction F; floats p, q, r, s_x, s_y, 0 of
/// normal × (1 + s_x m_x² + s_y m_y²) + (p + q depth) F_x + r F_y, m = F over the strength.
pub const SHEAR: u32 = 33;

/// Whether slots of this number are evaluated here.
pub(super) fn knows(kind: u32) -> bool {
    kind == DIRECTION || kind == SHEAR
}

/// Factor on the strength in a direction of motion.
pub(super) fn direction(&[a, b, c, d, e, _]: &[f32; VALUES], at: &Conditions<f32>) -> f32 {
    let ([cos2, sin2], [cos, sin]) = (at.double_angle, at.along);
    let mut factor = 1.0 + (a * cos2 + b * sin2 + c * cos + d * sin);
    if e != 0.0 && at.depth_mm > 0.0 {
        factor += e * Real::ln(at.depth_mm * (1.0 / 0.9)).clamp(-1.6, 1.1) * cos2;
    }
    factor
}

/// Normal force, N, from the normal force without the term due to friction.
///
/// * `friction_n`: friction, N
/// * `limit_n`: strength along x, N; nothing is changed where it is 0
pub(super) fn shear(
    &[p, q, r, s_x, s_y, _]: &[f32; VALUES],
    normal_n: f32,
    friction_n: [f32; 2],
    limit_n: f32,
    depth_mm: f32,
) -> f32 {
    if !(limit_n > 0.0) {
        return normal_n;
    }
    let [fx, fy] = friction_n;
    let (mx, my) = (fx / limit_n, fy / limit_n);
    normal_n * (1.0 + s_x * mx * mx + s_y * my * my) + ((p + q * depth_mm) * fx + r * fy)
}
