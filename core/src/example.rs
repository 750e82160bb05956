//! Example parameters: **not a fitted finger**.
//!
//! The numbers follow power laws of realistic size for the pad of an index finger, chosen by hand. Use a fitted model file for results.

use crate::math::pow;
use crate::params::{Node, Params, ParamsOf, SpringParams};

impl Params {
    /// Hand-made parameters of realistic size, for examples and tests. Not a fitted finger.
    pub fn example() -> Self {
        ParamsOf::example_with([(0.45, 0.0), (0.2, 0.15), (0.15, 0.5), (0.2, 1.1)])
    }
}

impl<const M: usize, const N: usize> ParamsOf<M, N> {
    /// The tables of [`Params::example`] with other springs: share of the stiffness, and depth at which it touches, mm.
    pub fn example_with(springs: [(f32, f32); M]) -> Self {
        let depth_max_mm = 2.5;
        let mut nodes = [Node::default(); N];
        for (i, node) in nodes.iter_mut().enumerate() {
            let d = depth_max_mm * i as f32 / (N - 1) as f32;
            let normal_force_n = 0.52 * pow(d, 1.9);
            let grown = |touch: f32| pow((d - touch).max(0.0), 0.8);
            *node = Node {
                normal_force_n,
                contact_area_mm2: 92.0 * pow(d, 0.9),
                stiffness_slope_n_mm2: [0.004, 0.002],
                yield_slide_mm: springs.map(|(_, touch)| 2.3 * grown(touch)),
                strength_ratio: 0.95,
                tilt_x: 0.02 * d,
                press_coupling: -0.0115,
                area_share: springs.map(|(share, touch)| if d > touch { share } else { 0.0 }),
                pressure_centre_mm: -0.4 * d,
                spin_limit_share: 0.95,
                band_normal_n: 0.004 + 0.006 * normal_force_n,
            };
        }
        Self {
            depth_max_mm,
            stiffness_n_mm: [0.28, 0.17],
            springs: core::array::from_fn(|j| {
                let arm = 2.5 + 1.5 * springs[j].1;
                SpringParams {
                    stiffness_share: springs[j].0,
                    sharpness: 0.2,
                    centre_mm: -0.3,
                    arm_mm: if j % 2 == 0 { [arm, 0.0] } else { [0.0, arm] },
                }
            }),
            nodes,
            odd_per_mm: 0.02,
            area_tilt: 0.1,
            pressure_centre_per_n: [1.0, 1.5],
            spin_cross: 0.24,
            slip_lead: [-0.2, 0.6],
            band_normal_middle: 1.25,
            band_normal_slip: 1.5,
            band_friction_stick: 0.01,
            band_friction_middle: 0.02,
            band_friction_slip: 0.03,
            pressure_exponent: 0.46,
            pose_deg: [30.0, 0.0],
        }
    }
}
