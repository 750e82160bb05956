//! What a contact of a pad bears after a step: each patch, the limit surface, the energy.
//!
//! Main functions: [`Pad::patch_states`], [`Pad::full_slip`], [`Pad::energy_mj`]. Uses step and equilibrium.

use heapless::Vec;

use crate::math::Elementary;

use super::Pad;
use super::body::Surface;
use super::equilibrium::{Awake, Equations, Stiffening};
use super::state::{PadState, PatchState};
use super::step::{Wake, slipping};
use super::vector::{Vec3, plus, times};

/// The equations of a step and its patches in the solution.
type AfterStep<'a, const P: usize, T, B> = (Equations<'a, T, B>, Vec<Awake<'a, T>, P>);

impl<T: Elementary> Pad<'_, T> {
    /// The equations of the last step and what acts on each patch; None without contact, or for a pad of more than `P` patches.
    fn after_step<'a, const P: usize, B: Surface<T>>(
        &'a self,
        state: &PadState<P, T>,
        body: &'a B,
        strength: T,
    ) -> Option<AfterStep<'a, P, T, B>> {
        if !state.in_contact() || self.patches.len() > P {
            return None;
        }
        let equations = self.equations(state, body, strength);
        let mut awake = Vec::new();
        self.wake(state, &equations, Wake::All, &mut awake);
        equations.misfit(&state.bulk, &mut awake);
        Some((equations, awake))
    }

    /// What each patch bears after the last step: pressure, traction, area and stick.
    ///
    /// Costs as much as a round of a step.
    pub fn patch_states<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> [PatchState<T>; P] {
        self.patch_states_with(state, body, T::of(1.0))
    }

    pub(crate) fn patch_states_with<const P: usize>(
        &self,
        state: &PadState<P, T>,
        body: &impl Surface<T>,
        strength: T,
    ) -> [PatchState<T>; P] {
        let mut out = [PatchState::default(); P];
        let Some((equations, awake)) = self.after_step(state, body, strength) else { return out };
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: &Vec3<T>| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]];
        let law = &self.numbers.law;
        for ((Awake { patch, placed, acting, .. }, used), out) in awake.iter().zip(&state.used).zip(&mut out) {
            let apex = &equations.frame.apex;
            out.place_mm = back(&plus(&acting.place, apex));
            if !acting.touches {
                continue;
            }
            let traction = back(&times(&acting.stretch, acting.grip / patch.area_mm2));
            out.pressure_mpa = acting.force / patch.area_mm2;
            out.traction_mpa = [traction[0], traction[1]];
            out.contact_area_mm2 = placed.compressed.area(acting.below, law);
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
    pub fn full_slip<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>, motion: [T; 3]) -> [T; 3] {
        self.full_slip_with(state, body, motion, T::of(1.0))
    }

    pub(crate) fn full_slip_with<const P: usize>(
        &self,
        state: &PadState<P, T>,
        body: &impl Surface<T>,
        [along_x, along_y, turn]: [T; 3],
        strength: T,
    ) -> [T; 3] {
        let mut limit = [T::of(0.0); 3];
        let Some((equations, awake)) = self.after_step(state, body, strength) else { return limit };
        let (sin, cos) = state.angle[0].sin_cos();
        for acting in awake.iter().map(|patch| &patch.acting).filter(|acting| acting.touches) {
            let [x, y] = [0, 1].map(|k| acting.place[k] + equations.frame.apex[k]);
            let [x, y] = [cos * x - sin * y, sin * x + cos * y];
            let way = [along_x - turn * y, along_y + turn * x];
            let length = (way[0] * way[0] + way[1] * way[1]).magnitude().sqrt();
            if !(length > T::of(f32::MIN_POSITIVE)) {
                continue;
            }
            let [fx, fy] = way.map(|part| part * (acting.strength / length));
            limit = [limit[0] + fx, limit[1] + fy, limit[2] + (x * fy - y * fx)];
        }
        limit
    }

    #[cfg(test)]
    pub(crate) fn misfit<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> [T; super::MODES] {
        let equations = self.equations(state, body, T::of(1.0));
        let mut awake = Vec::<_, P>::new();
        self.wake(state, &equations, Wake::All, &mut awake);
        equations.misfit(&state.bulk, &mut awake)
    }

    /// Energy stored after the last step, mJ.
    pub fn energy_mj<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> T {
        let mut sum = T::of(0.0);
        let Some((_, awake)) = self.after_step(state, body, T::of(1.0)) else { return sum };
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
        sum
    }
}
