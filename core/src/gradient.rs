//! How the forces would change with a further motion.
//!
//! Main type: [`Gradient`]. Uses data, state.

use crate::rescaling::Scaling;
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
    /// Costs 280 to 350 instructions.
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
        let (stiffness_anisotropy, strength_anisotropy) =
            (row.stiffness_anisotropy.at(t), row.strength_anisotropy.at(t));
        let press = row.press_coupling.at(t);
        let per_slip = k / l;
        let yield_shift = row.yield_shift.at(t);
        let mut energies = [0.0f32; 2];
        let [shear_x, shear_y] = [&row.normal_shear_x, &row.normal_shear_y].map(|line| scale.per_newton(line.at(t)));
        // A contact that shrinks loses what its rim carries.
        let shrinks = direction[0] < 0.0;
        let keep = if shrinks { dk / k - dl / l } else { -dl / l };
        let keep = [keep + shear_x * k, keep + shear_y * k];
        let returned =
            if shrinks && state.stored_energy > 0.0 { state.rim_lag.map(|lag| -lag * dk / k) } else { [0.0; 2] };
        let ease = 1.0 / (1.0 + scale.odd(data.twice_odd) * k * l / state.strength_factor * state.resultant[0]);

        let mut mean = [0.0f32; 2];
        let mut slope = [[0.0f32; 3]; 2];
        let mut energy = [[0.0f32; 3]; 2];
        for (u, element) in state.force.iter().zip(&data.elements) {
            let [x, y] = *u;
            mean[0] += element.strength * x;
            mean[1] += element.strength * y;
            energies[0] += l * l * element.energy * x * x;
            energies[1] += l * l * element.energy * y * y;
            let slide = per_slip * element.inverse_yield;
            let along = ease * slide;
            let mut rate = [
                [keep[0] * x + press * along + returned[0] * slide, along, 0.0],
                [keep[1] * y + returned[1] * slide, 0.0, stiffness_anisotropy * slide],
            ];
            let outward: [f32; 3] = {
                let by = |i: usize| {
                    (x - yield_shift) * rate[0][i] + strength_anisotropy * strength_anisotropy * y * rate[1][i]
                };
                [
                    by(0) - row.yield_shift.change * per_mm * x
                        + strength_anisotropy * row.strength_anisotropy.change * per_mm * y * y,
                    by(1),
                    by(2),
                ]
            };
            let total: f32 = (0..3).map(|i| outward[i] * direction[i]).sum();
            let level = x * x + strength_anisotropy * strength_anisotropy * y * y - 2.0 * yield_shift * x;
            if level >= ON_LIMIT && total > 0.0 {
                let ratio = stiffness_anisotropy * stiffness_anisotropy / ease;
                let flow = (x - yield_shift) * x + strength_anisotropy * strength_anisotropy * ratio * y * y;
                for i in 0..3 {
                    rate[0][i] -= outward[i] / flow * x;
                    rate[1][i] -= outward[i] / flow * ratio * y;
                }
            }
            for (((sum, energy), part), force) in slope.iter_mut().zip(&mut energy).zip(&rate).zip(u) {
                for ((s, e), r) in sum.iter_mut().zip(energy).zip(part) {
                    *s += element.strength * r;
                    *e += 2.0 * element.energy * force * r;
                }
            }
        }
        let [energy_x, energy_y] = energies;
        // From forces over the strength to forces; the energies' sums to N².
        let x = l * mean[0];
        let mut friction = [slope[0].map(|s| l * s), slope[1].map(|s| l * stiffness_anisotropy * s)];
        friction[0][0] += dl * mean[0];
        friction[1][0] += (dl * stiffness_anisotropy + l * row.stiffness_anisotropy.change * per_mm) * mean[1];
        let mut energy = energy.map(|row| row.map(|e| l * l * e));
        energy[0][0] += 2.0 * dl / l * energy_x;
        energy[1][0] += 2.0 * dl / l * energy_y;

        let mut normal: [f32; 3] =
            core::array::from_fn(|i| press * friction[0][i] + shear_x * energy[0][i] + shear_y * energy[1][i]);
        normal[0] += (scale.normal(row.normal.change)
            + row.press_coupling.change * x
            + scale.per_newton(row.normal_shear_x.change * energy_x + row.normal_shear_y.change * energy_y))
            * per_mm;
        Gradient { normal_n_mm: normal, friction_n_mm: friction }
    }
}
