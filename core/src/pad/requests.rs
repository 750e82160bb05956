//! What a contact of a pad bears after a step: each patch, the limit surface, the energy.
//!
//! Main functions: [`Pad::patch_states`], [`Pad::full_slip`], [`Pad::energy_mj`]. Uses step and equilibrium.

use heapless::Vec;

use crate::math::Elementary;
use crate::tuning::Units;

use super::Pad;
use super::body::{InUnits, Surface};
use super::equilibrium::{Awake, Equations, Stiffening};
use super::state::{PadState, PatchState};
use super::step::{Wake, slipping};
use super::vector::{Vec3, plus, times};

/// The equations of a step and its patches in the solution.
type AfterStep<'a, const P: usize, T, B> = (Equations<'a, T, InUnits<'a, B, T>>, Vec<Awake<'a, T>, P>);

impl<T: Elementary> Pad<'_, T> {
    /// The depth of the last step, mm.
    pub fn depth_mm<const P: usize>(&self, state: &PadState<P, T>) -> T {
        state.depth * self.units.length
    }

    /// The equations of the last step and what acts on each patch, in the units of the fitted finger; None without contact, or for a
    /// pad of more than `P` patches.
    fn after_step<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        body: &'a InUnits<'a, B, T>,
    ) -> Option<AfterStep<'a, P, T, B>> {
        if !state.in_contact() || self.patches.len() > P {
            return None;
        }
        let equations = self.equations(state, body);
        let mut awake = Vec::new();
        self.wake(state, &equations, Wake::All, &mut awake);
        equations.misfit(&state.bulk, &mut awake);
        Some((equations, awake))
    }

    /// What each patch bears after the last step: pressure, traction, area and stick.
    ///
    /// Costs as much as a round of a step.
    pub fn patch_states<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> [PatchState<T>; P] {
        let Units { length, per_length, force, .. } = self.units;
        let pressure = force * per_length * per_length;
        let body = InUnits::new(body, &self.units);
        let mut out = [PatchState::default(); P];
        let Some((equations, awake)) = self.after_step(state, &body) else { return out };
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: &Vec3<T>| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]];
        let law = &self.numbers.law;
        for ((Awake { patch, placed, acting, .. }, used), out) in awake.iter().zip(&state.used).zip(&mut out) {
            let apex = &equations.frame.apex;
            out.place_mm = back(&plus(&acting.place, apex)).map(|x| x * length);
            if !acting.touches {
                continue;
            }
            let traction = back(&times(&acting.stretch, acting.grip / patch.area_mm2));
            out.pressure_mpa = acting.force / patch.area_mm2 * pressure;
            out.traction_mpa = [traction[0] * pressure, traction[1] * pressure];
            out.contact_area_mm2 = placed.compressed.area(acting.below, law) * (length * length);
            out.used = used.magnitude();
            let growing = !(*used < T::of(0.0));
            out.stick_ratio = if growing { T::of(1.0) - slipping(out.used, law.onset) } else { T::of(1.0) };
        }
        out
    }

    /// Friction along x and y, N, and its moment about the normal, N mm, if all patches that touch after the last step slipped under a
    /// motion of the body: slides along x and y and an angle, in any unit of time. The points over all motions are the limit surface.
    ///
    /// The moment counts about the point about which poses turn, as that of a response. 0 without contact, and of no motion. Costs as much
    /// as a round of a step.
    pub fn full_slip<const P: usize>(
        &self,
        state: &PadState<P, T>,
        body: &impl Surface<T>,
        [along_x, along_y, turn]: [T; 3],
    ) -> [T; 3] {
        let mut limit = [T::of(0.0); 3];
        let Units { length, per_length, force, .. } = self.units;
        let [along_x, along_y] = [along_x, along_y].map(|slide| slide * per_length);
        let body = InUnits::new(body, &self.units);
        let Some((equations, awake)) = self.after_step(state, &body) else { return limit };
        let (sin, cos) = state.angle[0].sin_cos();
        for acting in awake.iter().map(|patch| &patch.acting).filter(|acting| acting.touches) {
            let [x, y] = [0, 1].map(|k| acting.place[k] + equations.frame.apex[k]);
            let [x, y] = [cos * x - sin * y, sin * x + cos * y];
            let way = [along_x - turn * y, along_y + turn * x];
            let size = (way[0] * way[0] + way[1] * way[1]).magnitude().sqrt();
            if !(size > T::of(f32::MIN_POSITIVE)) {
                continue;
            }
            let [fx, fy] = way.map(|part| part * (acting.strength / size));
            limit = [limit[0] + fx, limit[1] + fy, limit[2] + (x * fy - y * fx)];
        }
        [limit[0] * force, limit[1] * force, limit[2] * (force * length)]
    }

    #[cfg(test)]
    pub(crate) fn misfit<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> [T; super::MODES] {
        let body = InUnits::new(body, &self.units);
        let equations = self.equations(state, &body);
        let mut awake = Vec::<_, P>::new();
        self.wake(state, &equations, Wake::All, &mut awake);
        equations.misfit(&state.bulk, &mut awake)
    }

    /// Energy stored after the last step, mJ.
    pub fn energy_mj<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> T {
        let mut sum = T::of(0.0);
        let body = InUnits::new(body, &self.units);
        let Some((_, awake)) = self.after_step(state, &body) else { return sum };
        for x in &state.bulk {
            sum += T::of(0.5) * *x * *x;
        }
        sum += Stiffening::at(&self.numbers.squash, &state.bulk, &self.numbers.law).energy;
        for Awake { patch, placed, acting, .. } in &awake {
            if acting.touches {
                let (energy, _) = placed.compressed.energy(acting.overlap, acting.force, T::of(0.0));
                let stretch = acting.length.at_most(acting.bound);
                sum += energy + T::of(0.5) * stretch * stretch / patch.compliance_mm_per_n[1];
            }
        }
        sum * (self.units.force * self.units.length)
    }
}
