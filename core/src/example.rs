//! An example to try things with: **not a fitted finger**.
//!
//! The numbers follow power laws of the right size for the pad of an index finger, written by hand. Use a fitted
//! model file for anything that matters.

use crate::math::pow;
use crate::params::{Node, Params, ParamsOf, Slider};

impl Params {
    /// Hand-made parameters of realistic size, for examples and tests. Not a fitted finger.
    pub fn example() -> Self {
        ParamsOf::example_with([slider(0.75, 0.45), slider(2.20, 0.55)])
    }
}

fn slider(yield_position: f32, strength_share: f32) -> Slider {
    Slider { yield_position, strength_share }
}

impl<const M: usize, const N: usize> ParamsOf<M, N> {
    /// The tables of [`Params::example`] with other elements.
    pub fn example_with(sliders: [Slider; M]) -> Self {
        let depth_max_mm = 2.5;
        let mut nodes = [Node::default(); N];
        for (i, node) in nodes.iter_mut().enumerate() {
            let d = depth_max_mm * i as f32 / (N - 1) as f32;
            let normal_force_n = 0.52 * pow(d, 1.9);
            *node = Node {
                normal_force_n,
                contact_area_mm2: 92.0 * pow(d, 0.9),
                friction_limit_n: 0.66 * pow(d, 1.37),
                tangential_stiffness_n_mm: 0.22 * pow(d, 0.4),
                stiffness_ratio: 0.6,
                strength_ratio: 0.95,
                press_coupling: -0.0115,
                normal_shear_x_n: 0.05 * normal_force_n,
                normal_shear_y_n: 0.03 * normal_force_n,
                tilt_x: 0.08 * d,
                band_normal_n: 0.004 + 0.006 * normal_force_n,
            };
        }
        Self {
            depth_max_mm,
            sliders,
            nodes,
            turn_slip: 0.1,
            full_slip: 0.99,
            odd_compliance_mm_n2: 0.2,
            area_tilt: 0.1,
            band_normal_middle: 1.25,
            band_normal_slip: 1.5,
            band_friction_stick: 0.01,
            band_friction_middle: 0.02,
            band_friction_slip: 0.03,
            pressure_exponent: 0.46,
        }
    }
}
