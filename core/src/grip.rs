//! The inverse problem of a grip controller: the least normal force at which a load does not slip.
//!
//! Main type: [`Grip`]. Uses data, yield_surface.

use crate::math::sqrt;
use crate::memory::Memory;
use crate::step::share_of_limit;
use crate::{ModelOf, StateOf, Status};

/// The least grip that holds a load.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Grip {
    /// Depth to press to, mm.
    pub depth_mm: f32,
    /// Normal force there with the load applied, N.
    pub normal_force_n: f32,
    /// [`Status::LOAD_NOT_REACHED`] if even the largest depth does not hold the load, [`Status::BAD_INPUT`] if a
    /// number of the input is not finite.
    pub status: Status,
}

impl<const M: usize, const N: usize> ModelOf<'_, M, N> {
    /// Normal force without shear at `depth`, N.
    pub(crate) fn normal_at(&self, depth: f32) -> f32 {
        let (row, t) = self.cell(depth);
        row.normal.at(t) * self.units.force
    }

    /// Friction in full slip along x at `depth`, the geometric mean of both directions, at a strength factor of 1, N.
    pub(crate) fn limit_at(&self, depth: f32) -> f32 {
        let (row, t) = self.cell(depth);
        row.limit.at(t) * (self.units.strength * self.units.force)
    }

    /// Strength in the last step over that of relaxed tissue; 1 where nothing relaxes.
    pub(crate) fn gain_of_last_step<const P: usize, R: Memory<M, P, f32>>(&self, state: &StateOf<M, P, f32, R>) -> f32 {
        let (row, t) = self.cell(state.forces.depth);
        let mut memory = state.forces.memory;
        let (weights, _) = memory.of_last_step(self.relaxation);
        let pressure = memory.press(&weights, row.normal.at(t), self.data.pressure_exponent);
        pressure.map_or(1.0, |pressure| pressure.strength)
    }

    /// Stiffness along x while everything sticks at `depth`, N/mm.
    pub(crate) fn stiffness_at(&self, depth: f32) -> f32 {
        let (row, t) = self.cell(depth);
        row.stiffness_x.at(t) * self.stiffness_unit()
    }

    /// Stiffness over that of the fitted finger.
    pub(crate) fn stiffness_unit(&self) -> f32 {
        self.units.force * self.units.per_length
    }

    /// The depth at which the normal force without shear is `force`, mm; at most that of the last node.
    pub(crate) fn depth_for_normal(&self, force: f32) -> f32 {
        let cell_mm = 1.0 / self.cells_per_mm();
        let normal = |index: usize, t: f32| self.data.rows[index.min(N - 1)].normal.at(t) * self.units.force;
        let (mut low, mut high) = (0, N - 1);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if normal(middle, 0.0) <= force {
                low = middle;
            } else {
                high = middle;
            }
        }
        let [begin, end] = [0.0, 1.0].map(|t| normal(low, t));
        let t = if end > begin { ((force - begin) / (end - begin)).min(1.0) } else { 1.0 };
        ((low as f32 + t) * cell_mm).max(1e-6)
    }

    /// The least depth and normal force at which friction of `load_n` leaves a slip margin of at least `margin`, even if the
    /// limit of the finger is below that of the model by the half-width of friction's 95 % band in full slip
    /// ([`crate::build::ParamsOf::band_friction_slip`] times the friction limit). A step then shows a margin that is larger by about
    /// that share.
    ///
    /// * `load_n`: friction that the contact has to carry, N
    /// * `margin`: share of the limit kept in reserve, 0 to 0.95 (moved into that range)
    /// * `strength_factor`: as in [`crate::StateOf::set_strength_factor`]
    ///
    /// By bisection to 1 part in 2^24 of the depth range, rounded up. Costs about 1180 instructions.
    pub fn least_grip(&self, load_n: [f32; 2], margin: f32, strength_factor: f32) -> Grip {
        let [x, y] = load_n;
        let load = sqrt(x * x + y * y);
        if !(load <= f32::MAX && margin.is_finite() && strength_factor.is_finite()) {
            return Grip { status: Status::BAD_INPUT, ..self.grip_at(self.depth_max_mm(), [0.0; 2], 0.0) };
        }
        if load == 0.0 {
            return Grip::default();
        }
        let need = load / (1.0 - margin.clamp(0.0, 0.95));
        let band = self.data.band_friction[0];
        let factor = strength_factor.clamp(0.1, 5.0);
        let strength = |depth: f32| {
            let (row, t) = self.cell(depth);
            self.limit_at(depth) * factor / share_of_limit(row, t, [x / load, y / load])
        };
        let holds = |depth: f32| strength(depth) - band * self.limit_at(depth) * factor >= need;
        let at = |depth: f32| self.grip_at(depth, load_n, (load / strength(depth)).min(1.0));
        let deepest = self.depth_max_mm();
        if !holds(deepest) {
            return Grip { status: Status::LOAD_NOT_REACHED, ..at(deepest) };
        }
        let (mut low, mut high) = (0.0, deepest);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if holds(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        at(high)
    }

    /// Depth and normal force under friction `load_n` that was applied without a reversal and uses `share` of the limit.
    fn grip_at(&self, depth: f32, load_n: [f32; 2], share: f32) -> Grip {
        let (row, t) = self.cell(depth);
        // Energy of the springs over what one that only sticks would hold: near full slip the first have slipped for long.
        let grown = 0.5 + 0.25 * share * share;
        let stiffness = [&row.stiffness_x, &row.stiffness_y];
        let now = stiffness.map(|k| k.at(t) * self.stiffness_unit());
        let slope = stiffness.map(|k| k.slope_at(t) * self.cells_per_mm() * self.stiffness_unit());
        let sheared = |axis: usize| {
            let displacement = load_n[axis] / now[axis];
            slope[axis] * grown * displacement * displacement
        };
        let press = row.press_slide.slope_at(t) * self.data.cells_per_mm * load_n[0];
        let shear = sheared(0) + sheared(1);
        let normal = row.normal.at(t) * self.units.force + press + shear;
        Grip { depth_mm: depth, normal_force_n: normal.max(0.0), status: Status::OK }
    }
}
