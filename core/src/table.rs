//! Straight lines between equidistant depths, read in place from flash.
//!
//! A row holds value and slope of every quantity over one cell, so that a quantity costs one multiply-add. Beyond
//! the last node the last value holds. Uses nothing of this crate.

use bytemuck::{Pod, Zeroable};

/// Value at the left end of a cell and its change over the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Line {
    /// Value at the left node.
    pub value: f32,
    /// Value at the right node less `value`, rounded toward 0 so that the line does not overshoot the right node.
    pub change: f32,
}

impl Line {
    /// The line from `left` to `right`.
    pub(crate) fn between(left: f32, right: f32) -> Self {
        let mut change = right - left;
        // One unit in the last place is enough: the difference and the sum are each off by half a unit at most.
        while change.is_finite() && change != 0.0 && overshoots(left, change, right) {
            change = f32::from_bits(change.to_bits() - 1);
        }
        Self { value: left, change }
    }

    /// Value at `t`, 0 at the left node and 1 at the right one.
    #[inline(always)]
    pub(crate) fn at(&self, t: f32) -> f32 {
        self.value + self.change * t
    }
}

fn overshoots(left: f32, change: f32, right: f32) -> bool {
    if change > 0.0 { left + change > right } else { left + change < right }
}

/// One cell of all tables. The last row of a model has no cell: its changes are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Row {
    /// Normal force without shear, N.
    pub normal: Line,
    /// Contact area without shear, mm².
    pub area: Line,
    /// Strength of all elements together, N.
    pub limit: Line,
    /// Tangential stiffness of the sticking contact along x, N/mm.
    pub stiffness: Line,
    /// Square root of the tangential stiffness along y over that along x.
    pub stiffness_anisotropy: Line,
    /// The same over the ratio of the strength along y to that along x.
    pub strength_anisotropy: Line,
    /// Normal force added per elastic energy of shear along x times the stiffness twice, 1/N.
    pub normal_shear_x: Line,
    /// The same along y, 1/N.
    pub normal_shear_y: Line,
    /// Share by which the limit along +x exceeds that along y.
    pub yield_shift: Line,
    /// Half-width of the band of the normal force, N.
    pub band_normal: Line,
    /// Slide per depth that pressing causes, mm/mm.
    pub press_coupling: Line,
    /// The same summed up from depth 0 to the left node, half cells.
    pub press_slide: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_do_not_overshoot() {
        let mut seed = 1u32;
        for _ in 0..100_000 {
            let mut next = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 8) as f32 * 1e-7
            };
            let (left, right) = (next(), next());
            let end = Line::between(left, right).at(1.0);
            assert!(if right >= left { end <= right } else { end >= right });
            assert!((end - right).abs() <= 2.0 * f32::EPSILON * right.max(left));
        }
    }
}
