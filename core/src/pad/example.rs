//! An example pad: **not a fitted finger**.

use crate::math::Scalar;

use super::vector::{add_square, zeros};
use super::{FIRST_TOUCH_TERMS, Law, MODES, Numbers, Pad, Patch};

/// Patches of the example.
pub const EXAMPLE_PATCHES: usize = 24;

/// Numbers of a pad of realistic size, chosen by hand: a paraboloid whose bulk has rigid motions and local indentations as modes.
///
/// It serves examples and tests. Use a fitted model file for results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExamplePad<T = f32> {
    /// The patches.
    pub patches: [Patch<T>; EXAMPLE_PATCHES],
    /// Numbers of the finger as a whole.
    pub numbers: Numbers<T>,
}

/// Radii of curvature along x and y, mm.
const RADII_MM: [f32; 2] = [13.0, 9.0];
/// Number of patches along x and y.
const ROWS: [usize; 2] = [6, 4];
/// Distance of their middles, mm.
const PITCH_MM: [f32; 2] = [2.0, 2.2];

impl ExamplePad {
    /// The example.
    pub fn new() -> Self {
        let patches = core::array::from_fn(|k| {
            let (i, j) = (k % ROWS[0], k / ROWS[0]);
            let x = (i as f32 - 0.5 * (ROWS[0] as f32 - 1.0)) * PITCH_MM[0];
            let y = (j as f32 - 0.5 * (ROWS[1] as f32 - 1.0)) * PITCH_MM[1];
            let z = 0.5 * (x * x / RADII_MM[0] + y * y / RADII_MM[1]);
            let mut modes = [[0.0; MODES]; 3];
            modes[0][0] = 1.6;
            modes[1][1] = 2.2;
            modes[2][2] = 0.7;
            // Turns about x, y and z.
            let turn = 0.12;
            (modes[1][3], modes[2][3]) = (-turn * z, turn * y);
            (modes[0][4], modes[2][4]) = (turn * z, -turn * x);
            (modes[0][5], modes[1][5]) = (-turn * y, turn * x);
            for dent in 0..MODES - 6 {
                let middle = [(dent % 5) as f32 * 2.4 - 4.8, (dent / 5) as f32 * 4.4 - 2.2];
                let (dx, dy) = (x - middle[0], y - middle[1]);
                let near = 1.0 / (1.0 + (dx * dx + dy * dy) / 6.0);
                modes[2][6 + dent] = 0.75 * near * near;
                modes[0][6 + dent] = 0.05 * dx * near * near;
                modes[1][6 + dent] = 0.05 * dy * near * near;
            }
            let (sx, sy) = (PITCH_MM[0] * PITCH_MM[0] / 12.0, PITCH_MM[1] * PITCH_MM[1] / 12.0);
            let (kx, ky) = (x / RADII_MM[0], y / RADII_MM[1]);
            let (sx, sy) = (crate::math::sqrt(sx), crate::math::sqrt(sy));
            Patch {
                middle_mm: [x, y, z],
                area_mm2: PITCH_MM[0] * PITCH_MM[1],
                spread_mm: [sx, 0.0, sy, kx * sx, ky * sy, 0.1],
                modes,
                compliance_mm_per_n: [0.6, 0.9],
            }
        });
        let mut first_touch_mm = [0.0; FIRST_TOUCH_TERMS];
        let [a, b] = RADII_MM.map(|r| 0.5 * r);
        (first_touch_mm[2], first_touch_mm[7]) = (-a, -b);
        (first_touch_mm[4], first_touch_mm[9], first_touch_mm[12]) = (-0.5 * a, -0.5 * (a + b), -0.5 * b);
        let mut rigid = [[0.0; MODES]; 6];
        (rigid[0][0], rigid[1][1], rigid[2][2]) = (1.6, 2.2, 0.7);
        (rigid[3][3], rigid[4][4], rigid[5][5]) = (0.12, 0.12, 0.12);
        let mut lift = [[0.0; 12]; 2];
        (lift[0][0], lift[0][2], lift[0][6], lift[1][3]) = (0.04, -1.0, -0.05, 0.06);
        let mut reach = 0.0;
        let mut squash = zeros();
        for patch in &patches {
            let patch: &Patch = patch;
            reach = patch.reach().max(reach);
            add_square(&mut squash, &patch.modes[2], 1.0 / EXAMPLE_PATCHES as f32);
        }
        let numbers = Numbers {
            rigid,
            squash,
            reach,
            middle_mm: [0.0, 0.0, 1.0],
            first_touch_mm,
            neutral_pitch_deg: 30.0,
            pitch_range_deg: [10.0, 60.0],
            roll_max_deg: 25.0,
            depth_max_mm: 3.0,
            band_normal: [[0.03, 0.0, 0.0], [0.05, 0.0, 0.0]],
            band_friction: [[0.05, 0.0, 0.0], [0.1, 0.0, 0.0]],
            band_body: [0.5, 0.5],
            band_deep: [0.02, 0.02],
            band_light_n: [[0.0005, 0.001]; 2],
            law: Law {
                softness: [1.0, 1.0],
                stiffening: [0.15, 0.1],
                flattening_mpa: [0.0005, 0.027],
                area: [1.06, 1.8, 0.9],
                friction: [0.084, 0.46],
                onset: 6.0,
                lift,
                turn: 1.0,
            },
        };
        Self { patches, numbers }
    }

    /// The same in another scalar.
    pub fn cast<U: Scalar>(&self) -> ExamplePad<U> {
        ExamplePad { patches: self.patches.each_ref().map(Patch::cast), numbers: self.numbers.cast() }
    }
}

impl Default for ExamplePad {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> ExamplePad<T> {
    /// The pad with these numbers.
    pub fn pad(&self) -> Pad<'_, T> {
        Pad::new(&self.patches, &self.numbers)
    }
}
