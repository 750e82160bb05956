//! How the forces would change with a further motion.
//!
//! Main type: [`Gradient`]. Uses model.

use crate::tune::Scaling;
use crate::{ModelOf, StateOf};

/// Derivatives of the forces for a motion that goes on in a given direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gradient {
    /// Of the normal force with depth, slide x and slide y, N/mm.
    pub normal_n_mm: [f32; 3],
    /// Of friction x and y with depth, slide x and slide y, N/mm.
    pub friction_n_mm: [[f32; 3]; 2],
}

/// Yield function from which an element counts as on its limit; a step leaves it there or a little above.
const ON_LIMIT: f32 = 1.0 - 1e-5;

impl<const M: usize, const N: usize, S: Scaling> ModelOf<'_, M, N, S> {
    /// The gradient at `state` for a motion that goes on in `direction` (depth, slide x, slide y; any length).
    ///
    /// One-sided where the law has kinks: elements on their limit slip if `direction` loads them further, and a
    /// growing contact keeps forces where a shrinking one may lose some. With a direction of zeros all
    /// elements stick. 0 without contact and 0 along depth beyond the tables. NaN in `direction` counts as 0.
    ///
    /// Costs 300 to 450 instructions.
    pub fn gradient(&self, state: &StateOf<M>, direction: [f32; 3]) -> Gradient {
        let (data, scale) = (self.data, &self.scale);
        if !state.in_contact() {
            return Gradient::default();
        }
        let direction = direction.map(|d| if d.is_finite() { d } else { 0.0 });
        let (row, t, per_mm) = self.cell(state.depth);
        let k = state.stiffness;
        let l = state.limit;
        let dk = scale.stiffness(row.stiffness.change) * per_mm;
        let dl = scale.limit(row.limit.change, scale.area(row.area.change)) * per_mm * state.strength_factor;
        let ratio = row.ratio.at(t);
        let press = row.press.at(t);
        let per_slip = k / l;
        let tilt = row.tilt.at(t);
        let keep = if direction[0] < 0.0 {
            let retraces = k > state.reference;
            dk / k * (data.fall_loss + if retraces { 0.0 } else { 1.0 }) - dl / l
        } else {
            -dl / l
        };

        let mut mean = [0.0f32; 2];
        let mut slope = [[0.0f32; 3]; 2];
        for (u, element) in state.force.iter().zip(&data.elements) {
            let [x, y] = *u;
            mean[0] += element.strength * x;
            mean[1] += element.strength * y;
            let slide = per_slip * element.inverse_yield;
            let mut rate = [[keep * x + press * slide, slide, 0.0], [keep * y, 0.0, ratio * slide]];
            let mut outward: [f32; 3] = core::array::from_fn(|i| (x - tilt) * rate[0][i] + y * rate[1][i]);
            outward[0] -= row.tilt.change * per_mm * x;
            let total: f32 = (0..3).map(|i| outward[i] * direction[i]).sum();
            if x * x + y * y - 2.0 * tilt * x >= ON_LIMIT && total > 0.0 {
                let flow = (x - tilt) * x + ratio * y * y;
                for i in 0..3 {
                    rate[0][i] -= outward[i] / flow * x;
                    rate[1][i] -= outward[i] / flow * ratio * y;
                }
            }
            for (sum, part) in slope.iter_mut().zip(&rate) {
                for (s, r) in sum.iter_mut().zip(part) {
                    *s += element.strength * r;
                }
            }
        }

        let [x, y] = mean.map(|m| l * m);
        let mut friction = slope.map(|row| row.map(|s| l * s));
        friction[0][0] += dl * mean[0];
        friction[1][0] += dl * mean[1];

        let (bx, by) = (scale.per_newton(row.shear_x.at(t)), scale.per_newton(row.shear_y.at(t)));
        let mut normal: [f32; 3] = core::array::from_fn(|i| {
            press * friction[0][i] + 2.0 * (bx * x * friction[0][i] + by * y * friction[1][i])
        });
        normal[0] += (scale.normal(row.normal.change)
            + row.press.change * x
            + scale.per_newton(row.shear_x.change * x * x + row.shear_y.change * y * y))
            * per_mm;
        Gradient { normal_n_mm: normal, friction_n_mm: friction }
    }
}
