//! Curves between equidistant depths, read in place from flash.
//!
//! A row contains the coefficients of every quantity over one cell: value and change of a straight line, one more number for a
//! parabola. Beyond the last node the last value holds. Uses math.

use bytemuck::{Pod, Zeroable};

use crate::math::Scalar;

/// Value at the left end of a cell and its change over the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Line<T = f32> {
    /// Value at the left node.
    pub value: T,
    /// Value at the right node less `value`, rounded toward 0 so that the line does not overshoot the right node.
    pub change: T,
}

impl<T: Scalar> Line<T> {
    /// The line from `left` to `right`.
    pub(crate) fn between(left: T, right: T) -> Self {
        let mut change = right - left;
        let overshoots = |change: T| {
            let end = left + change;
            if change > T::of(0.0) { end > right } else { end < right }
        };
        let mut rounds = 0;
        // A unit in the last place of the ends' difference is enough.
        while change.is_number() && change != T::of(0.0) && overshoots(change) && rounds < 4 {
            change = change - change * T::of(f32::EPSILON);
            rounds += 1;
        }
        Self { value: left, change }
    }
}

impl<T: Scalar> Line<T> {
    /// Value at `t`, 0 at the left node and 1 at the right one.
    #[inline(always)]
    pub(crate) fn at(&self, t: T) -> T {
        self.value + self.change * t
    }
}

/// A parabola over a cell: the integral of a straight line, so that it joins its neighbours with its slope.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Parabola<T = f32> {
    /// Value at the left node.
    pub value: T,
    /// Slope at the left node times the cell.
    pub slope: T,
    /// Half of the slope's change over the cell, times the cell.
    pub bend: T,
}

impl<T: Scalar> Parabola<T> {
    /// The parabola from `value` with slopes `left` and `right`, both times the cell.
    pub(crate) fn of_slopes(value: T, left: T, right: T) -> Self {
        Self { value, slope: left, bend: T::of(0.5) * (right - left) }
    }

    /// Value at `t`, 0 at the left node and 1 at the right one.
    #[inline(always)]
    pub(crate) fn at(&self, t: T) -> T {
        self.value + t * (self.slope + t * self.bend)
    }

    /// Slope at `t`, per cell.
    #[inline(always)]
    pub(crate) fn slope_at(&self, t: T) -> T {
        self.slope + (t + t) * self.bend
    }
}

/// One cell of all tables. The last row of a model has no cell: its changes are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "T: serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "T: Scalar + serde::Deserialize<'de>")))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Row<const M: usize, T = f32> {
    /// Normal force without shear, N.
    pub normal: Line<T>,
    /// Contact area without shear, mm².
    pub area: Line<T>,
    /// Stiffness of all springs together along x, N/mm.
    pub stiffness_x: Parabola<T>,
    /// The same along y, N/mm.
    pub stiffness_y: Parabola<T>,
    /// Slide along x that pressing to this depth amounts to, mm; its slope couples the normal force to friction along x.
    pub press_slide: Parabola<T>,
    /// Stiffness along y over that along x, over the ratio of the strengths.
    pub anisotropy: Line<T>,
    /// Share by which a spring's limit along +x exceeds that along −x, halved.
    pub yield_shift: Line<T>,
    /// Friction of all springs in full slip along x, the geometric mean of both directions, N.
    pub limit: Line<T>,
    /// Friction in full slip along y over that along x.
    pub limit_ratio: Line<T>,
    /// Share by which friction in full slip along +x exceeds that along −x, halved.
    pub limit_shift: Line<T>,
    /// Moment about the normal in full spin, N mm.
    pub spin_limit: Line<T>,
    /// Place of the centre of friction along x, mm.
    pub friction_centre: Line<T>,
    /// Place of the centre of pressure along x without shear, mm.
    pub pressure_centre: Line<T>,
    /// Half-width of the band of the normal force, N.
    pub band_normal: Line<T>,
    /// Elastic displacement at which each spring slips along y times the anisotropy, mm; 0 where it does not touch.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub radius: [Line<T>; M],
    /// Share of the contact area that each spring represents.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub area_share: [Line<T>; M],
}

// SAFETY: `repr(C)` structs of `T` and arrays of them throughout: no padding, and zeros are one where they are a `T`.
#[allow(unsafe_code)]
unsafe impl<const M: usize, T: Pod> Zeroable for Row<M, T> {}
// SAFETY: as above; any bits are one where they are a `T`.
#[allow(unsafe_code)]
unsafe impl<const M: usize, T: Pod> Pod for Row<M, T> {}

impl<const M: usize, T: Scalar> Default for Row<M, T> {
    fn default() -> Self {
        let (line, parabola) = (Line::default(), Parabola::default());
        Self {
            normal: line,
            area: line,
            stiffness_x: parabola,
            stiffness_y: parabola,
            press_slide: parabola,
            anisotropy: line,
            yield_shift: line,
            limit: line,
            limit_ratio: line,
            limit_shift: line,
            spin_limit: line,
            friction_centre: line,
            pressure_centre: line,
            band_normal: line,
            radius: [line; M],
            area_share: [line; M],
        }
    }
}

impl Line {
    /// The same line in another scalar.
    fn cast<U: Scalar>(&self) -> Line<U> {
        Line { value: U::of(self.value), change: U::of(self.change) }
    }
}

impl Parabola {
    /// The same parabola in another scalar.
    fn cast<U: Scalar>(&self) -> Parabola<U> {
        Parabola { value: U::of(self.value), slope: U::of(self.slope), bend: U::of(self.bend) }
    }
}

impl<const M: usize> Row<M> {
    /// The same row in another scalar.
    pub(crate) fn cast<U: Scalar>(&self) -> Row<M, U> {
        Row {
            normal: self.normal.cast(),
            area: self.area.cast(),
            stiffness_x: self.stiffness_x.cast(),
            stiffness_y: self.stiffness_y.cast(),
            press_slide: self.press_slide.cast(),
            anisotropy: self.anisotropy.cast(),
            yield_shift: self.yield_shift.cast(),
            limit: self.limit.cast(),
            limit_ratio: self.limit_ratio.cast(),
            limit_shift: self.limit_shift.cast(),
            spin_limit: self.spin_limit.cast(),
            friction_centre: self.friction_centre.cast(),
            pressure_centre: self.pressure_centre.cast(),
            band_normal: self.band_normal.cast(),
            radius: self.radius.each_ref().map(Line::cast),
            area_share: self.area_share.each_ref().map(Line::cast),
        }
    }

    /// All numbers of a row, in the order of a file.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        let line = |l: &Line| [l.value, l.change];
        let parabola = |p: &Parabola| [p.value, p.slope, p.bend];
        let head = [&self.normal, &self.area].into_iter().flat_map(line);
        let curves = [&self.stiffness_x, &self.stiffness_y, &self.press_slide].into_iter().flat_map(parabola);
        let rest = [
            &self.anisotropy,
            &self.yield_shift,
            &self.limit,
            &self.limit_ratio,
            &self.limit_shift,
            &self.spin_limit,
            &self.friction_centre,
            &self.pressure_centre,
            &self.band_normal,
        ];
        head.chain(curves).chain(rest.into_iter().chain(&self.radius).chain(&self.area_share).flat_map(line))
    }
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
            assert!((end - right).abs() <= 4.0 * f32::EPSILON * right.max(left));
        }
    }

    #[test]
    fn a_parabola_joins_the_next_with_value_and_slope() {
        let p = Parabola::of_slopes(0.3f32, 0.1, -0.2);
        assert_eq!((p.at(0.0), p.slope_at(0.0)), (0.3, 0.1));
        assert!((p.slope_at(1.0) + 0.2).abs() < 1e-7 && (p.at(1.0) - (0.3 - 0.05)).abs() < 1e-7);
    }
}
