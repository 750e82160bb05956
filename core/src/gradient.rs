//! Derivatives of the forces over a further motion.
//!
//! Main type: [`Gradient`]. Uses data, state and memory.

use crate::math::Scalar;
use crate::memory::Memory;
use crate::plane::spring_positions;
use crate::relaxation::Perhaps;
use crate::spring::{DIV_EPS, QuadraticStiffness, SLACK_MM, Sums};
use crate::{ModelOf, StateOf};

/// Derivatives of the forces for a motion that continues in a given direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gradient<T = f32> {
    /// Of the normal force with depth, slide x and slide y, N/mm.
    pub normal_n_mm: [T; 3],
    /// Of friction x and y with depth, slide x and slide y, N/mm.
    pub friction_n_mm: [[T; 3]; 2],
}

/// A spring counts as on its limit if the square of its displacement is at most this share below that of the limit.
const ON_LIMIT: f32 = 1.0 / (1 << 13) as f32;

impl<const M: usize, const N: usize, T: Scalar> ModelOf<'_, M, N, T> {
    /// The gradient at `state` for a motion that continues in `direction` (depth, slide x, slide y; any length).
    ///
    /// One-sided where the law has kinks: springs on their limit slip if `direction` loads them further. With a direction
    /// of zeros all springs stick. 0 without contact and 0 along depth beyond the tables. NaN in `direction` counts as 0.
    /// With spin: at a fixed angle. Where the tissue relaxes: for another motion in the last step, without the dependence of strength on
    /// pressure.
    pub fn gradient<const P: usize, R: Memory<M, P, T>>(
        &self,
        state: &StateOf<M, P, T, R>,
        direction: [T; 3],
    ) -> Gradient<T> {
        let (data, units) = (self.data, &self.units);
        let (zero, one, two) = (T::of(0.0), T::of(1.0), T::of(2.0));
        if !state.in_contact() {
            return Gradient::default();
        }
        let direction = direction.map(|d| if d.is_number() { d } else { zero });
        let (row, t) = self.cell(state.forces.depth);
        let per_mm = data.cells_per_mm;
        let stiffness = [&row.stiffness_x, &row.stiffness_y];
        let [kx, ky] = stiffness.map(|k| k.at(t));
        let [dkx, dky] = stiffness.map(|k| k.slope_at(t) * per_mm);
        let [ddkx, ddky] = stiffness.map(|k| two * k.bend * per_mm * per_mm);
        let press = row.press_slide.slope_at(t) * per_mm;
        let dpress = two * row.press_slide.bend * per_mm * per_mm;
        let press_slide = row.press_slide.at(t);
        let mut memory = state.forces.memory;
        let (weights, stiff) = memory.of_last_step(self.relaxation);
        let factor = units.strength * state.forces.strength_factor;
        let odd = QuadraticStiffness(data.odd / factor);
        let pressure = memory.press(&weights, row.normal.at(t), data.pressure_exponent);
        let radius_factor = pressure.map_or(factor, |pressure| factor * pressure.strength);
        let (shift, dshift) = (row.yield_shift.at(t), row.yield_shift.change * per_mm);
        let (anisotropy, danisotropy) = (row.anisotropy.at(t), row.anisotropy.change * per_mm);
        let ratio = ky / kx;
        let wide = one + shift * shift;
        let share = T::of(1.0 / P as f32);
        let here = [state.forces.position[0][0] + press_slide, state.forces.position[0][1], state.forces.angle[0]];

        // Sums over the springs, over the stiffness, and their rates along depth, slide x and slide y.
        let mut sums = Sums::new();
        let (mut force_rate, mut energy_rate) = ([[zero; 3]; 2], [[zero; 3]; 2]);
        for (j, ((pair, spring), line)) in state.forces.anchor.iter().zip(&data.springs).zip(&row.radius).enumerate() {
            let radius = line.at(t) * radius_factor;
            let dradius = line.change * per_mm * radius_factor;
            // A spring that does not touch follows without force.
            if !(radius > zero) {
                continue;
            }
            for (k, (anchor, [x, y])) in pair.iter().zip(spring_positions::<P, T>(here, spring)).enumerate() {
                let mut u = [x - anchor[0], y - anchor[1]];
                if let (Some(weights), Some(memory)) = (weights.get(), memory.get()) {
                    u = memory.hold(weights, j, k).pulling(u);
                }
                let [ux, uy] = u;
                let (vx, vy) = (ux - shift * radius, uy * anisotropy);
                let mut rate = [[press * stiff, stiff, zero], [zero, zero, stiff]];
                // Half of the rate of v² − R² (1 + alpha²).
                let outward = [
                    vx * (press * stiff - dshift * radius - shift * dradius) + vy * (uy * danisotropy)
                        - radius * dradius * wide
                        - radius * radius * shift * dshift,
                    vx * stiff,
                    vy * anisotropy * stiff,
                ];
                let total = outward[0] * direction[0] + outward[1] * direction[1] + outward[2] * direction[2];
                let square = radius * radius * wide;
                let near = radius * (radius * T::of(ON_LIMIT) + T::of(SLACK_MM));
                if vx * vx + vy * vy >= square - near && total > zero {
                    let flow = ux * vx + ratio * (vy * (uy * anisotropy));
                    let safe = flow.magnitude() + T::of(DIV_EPS);
                    for i in 0..3 {
                        let back = outward[i] / safe;
                        rate[0][i] -= back * ux;
                        rate[1][i] -= back * ratio * uy;
                    }
                }
                let weight = share * spring.stiffness;
                let (along, slope) = (odd.force(ux), odd.slope(ux));
                sums.add(weight, [ux, uy]);
                for i in 0..3 {
                    force_rate[0][i] += weight * slope * rate[0][i];
                    force_rate[1][i] += weight * rate[1][i];
                    energy_rate[0][i] += weight * along * rate[0][i];
                    energy_rate[1][i] += weight * uy * rate[1][i];
                }
            }
        }
        let (force, energy) = (sums.force(&odd), sums.energy(&odd));
        let mut friction = [force_rate[0].map(|f| kx * f), force_rate[1].map(|f| ky * f)];
        friction[0][0] += dkx * force[0];
        friction[1][0] += dky * force[1];
        let mut normal: [T; 3] = core::array::from_fn(|i| {
            press * friction[0][i] + (dkx * energy_rate[0][i] + dky * energy_rate[1][i]) / stiff
        });
        normal[0] += stiff * row.normal.change * per_mm + dpress * kx * force[0] + ddkx * energy[0] + ddky * energy[1];
        if state.forces.depth >= self.depth_max_mm() {
            (normal[0], friction[0][0], friction[1][0]) = (zero, zero, zero);
        }
        let stiffness = units.force * units.per_length;
        Gradient {
            normal_n_mm: normal.map(|k| k * stiffness),
            friction_n_mm: friction.map(|row| row.map(|k| k * stiffness)),
        }
    }
}
