//! What the share of the contact that sticks says about the surface.
//!
//! Main types: [`Curves`] (what the model expects), [`Stick`] (what was measured). Uses the step and math.

use super::input::along;
use crate::Response;
use crate::math::Scalar;

/// Depths of the two pulls over the model's range, and most steps of a pull.
const DEPTHS: [f32; 2] = [0.25, 0.75];
const STEPS: u32 = 200;
/// Step of a pull over the limit over the stiffness.
const STEP: f32 = 0.05;
/// Largest logarithm of a likelihood by which a stick ratio speaks against a surface.
const MOST: f32 = 8.0;

/// Stick ratios of the model in a pull, where friction is 0, 1/4, 1/2, 3/4 of the limit and all of it, at two depths. They depend on the shape
/// of the finger, hardly on the surface.
#[derive(Clone, Copy, Debug)]
pub struct Curves([[f32; 5]; 2]);

impl Curves {
    /// Those of a finger that never slips.
    pub(super) const STICKS: Self = Self([[1.0; 5]; 2]);

    /// * `pull`: the curve of a pull at a share of the range of depths, by [`stick_ratios`]
    pub(super) fn of(pull: impl FnMut(f32) -> [f32; 5]) -> Self {
        Self(DEPTHS.map(pull))
    }

    /// The curve at a share of the model's range of depths.
    pub(super) fn at(&self, depth: f32) -> [f32; 5] {
        let [shallow, deep] = &self.0;
        let t = ((depth - DEPTHS[0]) / (DEPTHS[1] - DEPTHS[0])).not_negative().at_most(1.0);
        core::array::from_fn(|k| shallow[k] + t * (deep[k] - shallow[k]))
    }
}

/// Stick ratios along a pull.
///
/// * `limit_n`, `stiffness_n_mm`: largest friction, and its stiffness while everything sticks
/// * `step`: advances the contact by a slide along x, mm
pub(super) fn stick_ratios(limit_n: f32, stiffness_n_mm: f32, mut step: impl FnMut(f32) -> Response) -> [f32; 5] {
    let by = STEP * limit_n / stiffness_n_mm.max(1e-6);
    let mut curve = [1.0, 0.75, 0.5, 0.25, 0.0];
    let (mut next, mut before) = (1usize, (0.0, 1.0));
    for k in 0..STEPS {
        if next == 4 {
            break;
        }
        let r = step(if k == 0 { 0.0 } else { by });
        let now = (1.0 - r.slip_margin, r.stick_ratio);
        while next < 4 && now.0 >= 0.25 * next as f32 {
            let t = (0.25 * next as f32 - before.0) / (now.0 - before.0).max(1e-6);
            curve[next] = before.1 + t.not_negative().at_most(1.0) * (now.1 - before.1);
            next += 1;
        }
        before = now;
    }
    curve
}

/// A measured stick ratio. It tells how much of the limit is used, whatever the surface is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stick {
    pub(super) ratio: f32,
    pub(super) per_variance: f32,
    /// Friction over the limit at a strength factor of 1.
    pub(super) used: f32,
    /// What the model expects.
    pub(super) curve: [f32; 5],
}

impl Stick {
    /// Logarithm of the likelihood of a strength. It is bounded, so that a sensor that fails does not outweigh all else.
    pub(super) fn likelihood(&self, strength: f32) -> f32 {
        let off = self.ratio - along(&self.curve, self.used / strength.max(1e-3));
        let unlikely = 0.5 * off * off * self.per_variance;
        -unlikely / (1.0 + unlikely * (1.0 / MOST))
    }
}
