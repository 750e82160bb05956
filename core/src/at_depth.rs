//! The tables of a model at the depth of a step.
//!
//! Main type: [`AtDepth`]. Uses data, tuning, memory and table.

use crate::math::Scalar;
use crate::memory::Pressure;
use crate::table::Row;
use crate::{ForceStateOf, ModelOf, Status};

/// The tables at one depth with the strength, in the units of the fitted finger; the depth alone is that of the finger.
pub(crate) struct AtDepth<'a, const M: usize, T> {
    pub(crate) row: &'a Row<M, T>,
    /// Place within the row's cell, 0 to 1.
    pub(crate) t: T,
    /// Depth in cells of the tables.
    pub(crate) cells: T,
    pub(crate) depth: T,
    /// Factor on the strength of relaxed tissue.
    pub(crate) strength: T,
    /// Factor on the springs' radii.
    pub(crate) radius: T,
    /// Normal force over that of the relaxed tissue; 1 where nothing relaxes.
    pub(crate) pressure: T,
    /// Strength over that of the relaxed tissue.
    pub(crate) gain: T,
    pub(crate) limit: T,
    pub(crate) stiffness: [T; 2],
}

impl<'a, const M: usize, T: Scalar> AtDepth<'a, M, T> {
    /// Reads the tables. A depth beyond them is limited to their end and flagged. Also returns the slide equivalent to the press,
    /// mm.
    #[inline(always)]
    pub(crate) fn look_up<const N: usize, const P: usize, R>(
        model: &ModelOf<'a, M, N, T>,
        state: &ForceStateOf<M, P, T, R>,
        mut depth: T,
        status: &mut Status,
    ) -> (Self, T) {
        let (data, units) = (model.data, &model.units);
        let mut cells = depth * model.cells_per_mm();
        let mut index = cells.index();
        let mut t = cells - T::of(index as f32);
        if index >= N - 1 {
            // The end of the last cell, with its slopes: the normal force does not jump there.
            index = N - 2;
            t = T::of(1.0);
            depth = model.depth_max_mm();
            let last = T::of((N - 1) as f32);
            if cells > last {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
            cells = last;
        }
        let row = &data.rows[index];
        let strength = state.strength_factor * units.strength;
        let at = Self {
            row,
            t,
            cells,
            depth,
            strength,
            radius: strength,
            pressure: T::of(1.0),
            gain: T::of(1.0),
            limit: row.limit.at(t) * strength,
            stiffness: [row.stiffness_x.at(t), row.stiffness_y.at(t)],
        };
        (at, row.press_slide.at(t))
    }

    /// The strength follows the pressure.
    #[inline(always)]
    pub(crate) fn press(&mut self, pressure: &Pressure<T>) {
        (self.pressure, self.gain) = (pressure.share, pressure.strength);
        self.radius *= self.gain;
        self.limit *= self.gain;
    }

    /// Change of the limit with depth, N/mm.
    #[inline(always)]
    pub(crate) fn limit_slope(&self, cells_per_mm: T) -> T {
        self.radius * (self.row.limit.change * cells_per_mm)
    }

    /// Change of the stiffness along x and y with depth, N/mm².
    #[inline(always)]
    pub(crate) fn stiffness_slope(&self, cells_per_mm: T) -> [T; 2] {
        [&self.row.stiffness_x, &self.row.stiffness_y].map(|k| k.slope_at(self.t) * cells_per_mm)
    }

    /// Slide along x that a depth increment amounts to, mm/mm.
    #[inline(always)]
    pub(crate) fn press_coupling(&self, cells_per_mm: T) -> T {
        self.row.press_slide.slope_at(self.t) * cells_per_mm
    }
}
