//! The inverse that a grip controller needs: how hard to press so that a load does not slip.
//!
//! Main type: [`Grip`]. Uses data, yield_surface.

use crate::math::sqrt;
use crate::rescaling::Scaling;
use crate::table::Row;
use crate::yield_surface::limit_share;
use crate::{ModelOf, Status};

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
    /// number was none.
    pub status: Status,
}

impl<'a, const M: usize, const N: usize, S: Scaling> ModelOf<'a, M, N, S> {
    /// The table's row at `depth`, the place within the cell, and cells per mm (0 beyond the last node).
    pub(crate) fn cell(&self, depth: f32) -> (&'a Row, f32, f32) {
        let per_mm = self.scale.per_mm(self.data.cells_per_mm);
        let x = depth * per_mm;
        let index = (x as u32 as usize).min(N - 1);
        let row = &self.data.rows[index];
        if index == N - 1 { (row, 0.0, 0.0) } else { (row, x - index as f32, per_mm) }
    }

    /// Normal force without shear at `depth`, N.
    pub(crate) fn normal_at(&self, depth: f32) -> f32 {
        let (row, t, _) = self.cell(depth);
        self.scale.normal(row.normal.at(t))
    }

    /// The depth at which the normal force without shear is `force`, mm; at most that of the last node.
    pub(crate) fn depth_for_normal(&self, force: f32) -> f32 {
        let plain = force / self.scale.normal(1.0);
        let (mut low, mut high) = (0, N - 1);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if self.data.rows[middle.min(N - 1)].normal.value <= plain {
                low = middle;
            } else {
                high = middle;
            }
        }
        let line = &self.data.rows[low.min(N - 1)].normal;
        let t = if line.change > 0.0 { ((plain - line.value) / line.change).min(1.0) } else { 1.0 };
        ((low as f32 + t) / self.scale.per_mm(self.data.cells_per_mm)).max(1e-6)
    }

    /// The least depth and normal force at which friction of `load_n` leaves a slip margin of at least `margin`.
    ///
    /// * `load_n`: friction that the contact has to carry, N
    /// * `margin`: share of the limit kept in reserve, 0 to 0.95 (moved into that range)
    /// * `strength_factor`: as in [`crate::StateOf::set_strength_factor`]
    ///
    /// By bisection to 1 part in 2^24 of the depth range, rounded up. Costs about 1410 instructions.
    pub fn least_grip(&self, load_n: [f32; 2], margin: f32, strength_factor: f32) -> Grip {
        let [x, y] = load_n;
        let load = sqrt(x * x + y * y);
        if !(load <= f32::MAX && margin.is_finite() && strength_factor.is_finite()) {
            return Grip { status: Status::BAD_INPUT, ..self.grip_at(self.depth_max_mm(), [0.0; 2], 0.0) };
        }
        if load == 0.0 {
            return Grip::default();
        }
        let [cosine, sine] = [x / load, y / load];
        let need = load / (1.0 - margin.clamp(0.0, 0.95));
        let factor = strength_factor.clamp(0.2, 5.0);
        let strength = |depth: f32| {
            let (row, t, _) = self.cell(depth);
            let plain = self.scale.limit(row.limit.at(t), self.scale.area(row.area.at(t)));
            let [yield_shift, strength_anisotropy, stiffness_anisotropy] =
                [&row.yield_shift, &row.strength_anisotropy, &row.stiffness_anisotropy].map(|line| line.at(t));
            // The load's direction where the limit is a circle.
            let sine = sine * strength_anisotropy / stiffness_anisotropy;
            let length = sqrt(cosine * cosine + sine * sine);
            plain * factor / length * limit_share(yield_shift * cosine / length)
        };
        let holds = |depth: f32| strength(depth) >= need;
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

    /// Depth and normal force under friction `load_n` that came without turning back and uses `share` of the limit.
    fn grip_at(&self, depth: f32, load_n: [f32; 2], share: f32) -> Grip {
        let (row, t, _) = self.cell(depth);
        let [x, y] = load_n;
        let stiffness_anisotropy = row.stiffness_anisotropy.at(t);
        let energy = self.energy_at(share);
        let along_x = row.normal_shear_x.at(t) * energy * x * x;
        let along_y = row.normal_shear_y.at(t) * energy * (y / stiffness_anisotropy) * (y / stiffness_anisotropy);
        let shear = self.scale.per_newton(along_x + along_y);
        let normal = self.scale.normal(row.normal.at(t)) + row.press_coupling.at(t) * x + shear;
        Grip { depth_mm: depth, normal_force_n: normal.max(0.0), status: Status::OK }
    }

    /// Energy of the elements, loaded from rest to that share of the strength, over that of one that only sticks.
    fn energy_at(&self, share: f32) -> f32 {
        // Elements yield one after the other: what they carry then, their energy, the stiffness of the rest.
        let (mut carried, mut energy, mut stiffness) = (0.0, 0.0, 1.0);
        for e in &self.data.elements {
            let slide = (share - carried) / stiffness;
            if slide * e.inverse_yield <= 1.0 {
                break;
            }
            carried += e.strength;
            energy += e.energy;
            stiffness = (stiffness - e.strength * e.inverse_yield).max(1e-3);
        }
        let rest = (share - carried).max(0.0);
        (energy + rest * rest / stiffness) / (share * share).max(1e-12)
    }
}
