//! The tables of a model at the depth of a step.
//!
//! Main type: [`AtDepth`]. Uses data, rescaling and table.

use crate::math::{Arithmetic, Scalar};
use crate::rescaling::Scaling;
use crate::table::Row;
use crate::{ModelOf, StateOf, Status};

/// The tables at one depth, scaled to the finger and its strength.
pub(crate) struct AtDepth<'a, const M: usize, T> {
    pub(crate) row: &'a Row<M, T>,
    /// Place within the row's cell, 0 to 1.
    pub(crate) t: T,
    /// Depth in cells of the tables.
    pub(crate) cells: T,
    pub(crate) depth: T,
    /// Factor on the springs' radii, and the share by which it grows with depth, 1/mm.
    pub(crate) radius: T,
    pub(crate) growth: T,
    pub(crate) limit: T,
    pub(crate) stiffness: [T; 2],
}

impl<'a, const M: usize, T: Scalar> AtDepth<'a, M, T> {
    /// Reads the tables. A depth beyond them is limited to their end and flagged. Also returns the slide equivalent to the press,
    /// mm.
    #[inline(always)]
    pub(crate) fn look_up<const N: usize, const P: usize, S: Scaling<T>>(
        model: &ModelOf<'a, M, N, S, T>,
        state: &StateOf<M, P, T>,
        mut depth: T,
        status: &mut Status,
    ) -> (Self, T) {
        let (data, scale) = (model.data, &model.scale);
        let per_mm = scale.per_mm(data.cells_per_mm);
        let mut cells = depth * per_mm;
        let mut index = cells.index();
        let mut t = cells - T::of(index as f32);
        if index >= N - 1 {
            // The end of the last cell, with its slopes: the normal force does not jump there.
            index = N - 2;
            t = T::of(1.0);
            depth = scale.length(data.depth_max);
            let last = T::of((N - 1) as f32);
            if cells > last {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
            cells = last;
        }
        let row = &data.rows[index];
        let plain = row.limit.at(t);
        let limit = scale.limit(plain, scale.area(row.area.at(t)));
        let press_slide = scale.length(row.press_slide.at(t));
        let at = Self {
            row,
            t,
            cells,
            depth,
            radius: scale.radius(plain, limit) * state.strength_factor,
            growth: if S::RESCALED { growth(row, t, per_mm, scale) } else { T::of(0.0) },
            limit: limit * state.strength_factor,
            stiffness: [&row.stiffness_x, &row.stiffness_y].map(|k| scale.stiffness(k.at(t))),
        };
        (at, press_slide)
    }
}

impl<const M: usize, T: Arithmetic> AtDepth<'_, M, T> {
    /// Contact area without shear, mm².
    #[inline(always)]
    pub(crate) fn area<S: Scaling<T>>(&self, scale: &S) -> T {
        scale.area(self.row.area.at(self.t))
    }

    /// About the change of the limit with depth, N/mm: that of the fitted finger, in proportion.
    #[inline(always)]
    pub(crate) fn limit_slope<S: Scaling<T>>(&self, cells_per_mm: T, scale: &S) -> T {
        self.limit * (self.row.limit.change * scale.per_mm(cells_per_mm) / self.row.limit.at(self.t))
    }

    /// Change of the stiffness along x and y with depth, N/mm².
    #[inline(always)]
    pub(crate) fn stiffness_slope<S: Scaling<T>>(&self, cells_per_mm: T, scale: &S) -> [T; 2] {
        let per_mm = scale.per_mm(cells_per_mm);
        [&self.row.stiffness_x, &self.row.stiffness_y].map(|k| scale.stiffness(k.slope_at(self.t) * per_mm))
    }

    /// Slide along x that a depth increment amounts to, mm/mm.
    #[inline(always)]
    pub(crate) fn press_coupling(&self, cells_per_mm: T) -> T {
        self.row.press_slide.slope_at(self.t) * cells_per_mm
    }
}

/// Share by which the factor on the springs' radii grows with depth, 1/mm: that of a fraction of two lines.
#[inline(always)]
pub(crate) fn growth<const M: usize, T: Scalar, S: Scaling<T>>(row: &Row<M, T>, t: T, per_mm: T, scale: &S) -> T {
    let (plain, area) = (row.limit.at(t), row.area.at(t));
    let limit = |plain: T, area: T| scale.limit(plain, scale.area(area));
    let strength = limit(plain, area);
    let grown = limit(row.limit.change * per_mm, row.area.change * per_mm);
    grown / strength - row.limit.change * per_mm / plain
}
