//! One substep of the elements of eight runs.
//!
//! Main type: [`ElementState`].

use bytemuck::cast;
use wide::f64x8;

use crate::model::{ELEMENTS, SmoothModel};
use crate::trajectory::{DepthLanes, LANES, Substep};

/// Factor on the strength in a direction of motion.
///
/// * `heading`: cosine and sine of twice the direction, then of the direction
pub fn direction_factor(model: &SmoothModel, depth: &DepthLanes, heading: &[f64x8; 4]) -> f64x8 {
    let [c2, s2, c, s] = heading;
    let slope = f64x8::splat(model.even_direction_slope).mul_add(depth.inside, f64x8::splat(model.even_direction[0]));
    let even = slope * *c2 + f64x8::splat(model.even_direction[1]) * *s2;
    f64x8::ONE + (even + f64x8::splat(model.odd_direction[0]) * *c + f64x8::splat(model.odd_direction[1]) * *s)
}

/// 1/√x of normal numbers, within 5e-16: half the exponent for a start [Lomont 2003, "Fast inverse square root"], then
/// Newton's steps. Square root and quotient would take most of a simulation's time.
pub fn inverse_square_root(x: f64x8) -> f64x8 {
    let bits: [u64; LANES] = cast(x);
    let mut y: f64x8 = cast(bits.map(|b| 0x5FE6_EB50_C7B5_37A9u64.wrapping_sub(b >> 1)));
    let half = x * f64x8::HALF;
    for _ in 0..4 {
        y *= (half * y).mul_neg_add(y, f64x8::splat(1.5));
    }
    y
}

/// The model's curves at eight depths, without factors.
struct CurvesAtDepth {
    /// The depths, mm.
    depth_mm: f64x8,
    /// Friction in full slip, N.
    strength_n: f64x8,
    /// Tangential stiffness along x, N/mm.
    stiffness_n_mm: f64x8,
    /// Stiffness along y over that along x.
    ratio: f64x8,
    /// Slide along x and y that pressing to there amounts to, mm.
    pressed_mm: [f64x8; 2],
}

impl CurvesAtDepth {
    fn of(model: &SmoothModel, depth: &DepthLanes) -> Self {
        let [at_middle, over_u] = model.ln_stiffness_ratio_y.map(f64x8::splat);
        let [press, press_slope] = model.press_coupling;
        Self {
            depth_mm: depth.mm,
            strength_n: depth.curve(&model.ln_strength).exp(),
            stiffness_n_mm: depth.curve(&model.ln_tangential).exp(),
            ratio: over_u.mul_add(depth.inside, at_middle).exp(),
            pressed_mm: [
                depth.mm * f64x8::splat(0.5 * press_slope).mul_add(depth.mm, f64x8::splat(press)),
                depth.mm * f64x8::splat(model.press_coupling_y),
            ],
        }
    }
}

/// State of the elements of eight runs.
pub struct ElementState {
    /// The curves at the depths of the last substep; most samples slide at one depth.
    curves: Option<CurvesAtDepth>,
    /// Force of each element along x and y over its strength.
    force: [[f64x8; 2]; ELEMENTS],
    /// Friction in full slip, N.
    pub strength_n: f64x8,
    /// Tangential stiffness, N/mm.
    stiffness_n_mm: f64x8,
    /// Slide along x and y that the pressing so far amounts to, mm.
    pressed_mm: [f64x8; 2],
}

impl ElementState {
    /// The state before touch.
    pub const IN_AIR: Self = Self {
        curves: None,
        force: [[f64x8::ZERO; 2]; ELEMENTS],
        strength_n: f64x8::ZERO,
        stiffness_n_mm: f64x8::ZERO,
        pressed_mm: [f64x8::ZERO; 2],
    };

    /// Advances all elements by one substep; a growing contact keeps their forces, a shrinking one their displacements.
    ///
    /// * `elements`: 1/yield position and share of the strength
    /// * `slide_mm`: displacement of the plane over the whole sample
    /// * `factors`: on strength and stiffness
    /// * `was_in_contact`: 0 if the finger was in the air, else 1
    pub fn advance(
        &mut self,
        model: &SmoothModel,
        elements: &[[f64x8; 2]; ELEMENTS],
        substep: &Substep,
        slide_mm: [f64x8; 2],
        factors: (f64x8, f64x8),
        was_in_contact: f64x8,
    ) {
        let depth = &substep.depth;
        let curves = self.curves.take().filter(|curves| curves.depth_mm == depth.mm);
        let curves = self.curves.insert(curves.unwrap_or_else(|| CurvesAtDepth::of(model, depth)));
        let &mut CurvesAtDepth { strength_n, stiffness_n_mm, ratio, pressed_mm: pressed, .. } = curves;
        let (limit, stiffness) = (strength_n * factors.0, stiffness_n_mm * factors.1);
        let softer = stiffness.simd_lt(self.stiffness_n_mm);
        let softer = if softer.any() { softer.select(stiffness / self.stiffness_n_mm, f64x8::ONE) } else { f64x8::ONE };
        let keep = self.strength_n / limit * softer * was_in_contact;
        let per_slip = stiffness / limit;
        let [x, y] =
            [0, 1].map(|k| slide_mm[k] * substep.slide_share + pressed[k] - self.pressed_mm[k] * was_in_contact);
        let (x, y) = (x * per_slip, y * per_slip * ratio);
        (self.strength_n, self.stiffness_n_mm, self.pressed_mm) = (limit, stiffness, pressed);
        // An element beyond its yield circle returns along the slip of an element whose stiffness along y is `ratio`
        // times that along x.
        let lack = f64x8::ONE - ratio;
        let moves = substep.slide_share.simd_gt(f64x8::ZERO);
        for (u, element) in self.force.iter_mut().zip(elements) {
            let ux = u[0].mul_add(keep, x * element[0]);
            let uy = u[1].mul_add(keep, y * element[0]);
            let square = ux.mul_add(ux, uy * uy);
            let slips = square.simd_gt(f64x8::ONE) & moves;
            *u = [ux, uy];
            if slips.any() {
                let fourth = square * square;
                let along_y = fourth + square - (lack + lack) * uy * uy;
                let along_x = along_y - lack * (fourth - square);
                let (sx, sy) = (ux * along_x, uy * along_y);
                let scale = inverse_square_root(sx.mul_add(sx, sy * sy));
                *u = [slips.select(sx * scale, ux), slips.select(sy * scale, uy)];
            }
        }
    }

    /// Mean force of the elements over the strength, along x and y.
    pub fn mean_force(&self, elements: &[[f64x8; 2]; ELEMENTS]) -> [f64x8; 2] {
        let mut mean = [f64x8::ZERO; 2];
        for (u, element) in self.force.iter().zip(elements) {
            mean = [element[1].mul_add(u[0], mean[0]), element[1].mul_add(u[1], mean[1])];
        }
        mean
    }
}
