//! The tables of a model at the depth of a step.
//!
//! Main type: [`AtDepth`]. Uses data, rescaling and table.

use crate::math::Scalar;
use crate::rescaling::Scaling;
use crate::table::Row;
use crate::{ModelOf, StateOf, Status};

/// The tables at one depth, for the finger and the strength at hand.
pub(crate) struct AtDepth<'a, const M: usize, T> {
    pub(crate) row: &'a Row<M, T>,
    /// Place within the row's cell, 0 to 1.
    pub(crate) t: T,
    /// [`crate::ParamsOf::slip_lead`] at the depth, 1.
    pub(crate) slip_lead: T,
    pub(crate) depth: T,
    pub(crate) area: T,
    /// Factor on the springs' radii, and the share by which it grows with depth, 1/mm.
    pub(crate) radius: T,
    pub(crate) growth: T,
    pub(crate) limit: T,
    pub(crate) stiffness: [T; 2],
    /// Change of the stiffness with depth, N/mm².
    pub(crate) stiffness_slope: [T; 2],
    pub(crate) press_coupling: [T; 2],
    pub(crate) press_slide: [T; 2],
}

impl<'a, const M: usize, T: Scalar> AtDepth<'a, M, T> {
    /// Reads the tables; a depth beyond them is held at their end and flagged.
    #[inline(always)]
    pub(crate) fn look_up<const N: usize, const P: usize, S: Scaling<T>>(
        model: &ModelOf<'a, M, N, S, T>,
        state: &StateOf<M, P, T>,
        mut depth: T,
        status: &mut Status,
    ) -> Self {
        let (data, scale) = (model.data, &model.scale);
        let per_mm = scale.per_mm(data.cells_per_mm);
        let mut x = if S::POSED { (depth - scale.touch()) * per_mm } else { depth * per_mm };
        let mut index = x.index();
        let mut t = x - T::of(index as f32);
        if index >= N - 1 {
            // The end of the last cell, with its slopes: the normal force does not jump there.
            index = N - 2;
            t = T::of(1.0);
            depth = scale.depth(data.depth_max);
            if S::POSED {
                depth += scale.touch();
            }
            let last = T::of((N - 1) as f32);
            if x > last {
                *status = status.with(Status::DEPTH_ABOVE_RANGE);
            }
            x = last;
        }
        let row = &data.rows[index];
        let area = scale.area(row.area.at(t), depth);
        let plain = row.limit.at(t);
        let limit = scale.limit(plain, area, depth);
        let [press_x, press_y] = scale.press();
        let [slide_x, slide_y] = scale.slide();
        Self {
            row,
            t,
            slip_lead: data.slip_lead[0] + data.slip_lead[1] * x,
            depth,
            area,
            radius: scale.radius(plain, limit) * state.strength_factor,
            growth: if S::RESCALED { growth(row, t, depth, per_mm, scale) } else { T::of(0.0) },
            limit: limit * state.strength_factor,
            stiffness: scale.stiffnesses([&row.stiffness_x, &row.stiffness_y].map(|k| k.at(t))),
            stiffness_slope: scale
                .stiffnesses([&row.stiffness_x, &row.stiffness_y].map(|k| k.slope_at(t)))
                .map(|k| k * per_mm),
            press_coupling: [row.press_slide.slope_at(t) * data.cells_per_mm + press_x, press_y],
            press_slide: [scale.depth(row.press_slide.at(t)) + press_x * depth + slide_x, press_y * depth + slide_y],
        }
    }
}

/// Share by which the factor on the springs' radii grows with depth, 1/mm: that of a fraction of two lines.
#[inline(always)]
pub(crate) fn growth<const M: usize, T: Scalar, S: Scaling<T>>(
    row: &Row<M, T>,
    t: T,
    depth: T,
    per_mm: T,
    scale: &S,
) -> T {
    let (plain, area) = (row.limit.at(t), row.area.at(t));
    let limit = |plain: T, area: T| scale.limit(plain, scale.area(area, depth), depth);
    let strength = limit(plain, area);
    let grown = limit(row.limit.change * per_mm, row.area.change * per_mm) + scale.limit_slope(plain, area, depth);
    grown / strength - row.limit.change * per_mm / plain
}
