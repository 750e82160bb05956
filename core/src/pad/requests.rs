//! Results of a pad after a step: the state of each patch, the limit surface, the stored energy.
//!
//! Main functions: [`Pad::patch_states`], [`Pad::full_slip`], [`Pad::energy_mj`]. Uses step and equilibrium.

use heapless::Vec;

use nalgebra::Vector3;

use crate::math::Elementary;
use crate::relaxation::Perhaps;
use crate::tuning::Units;

use super::Pad;
use super::body::{InUnits, Surface};
use super::equilibrium::{ActivePatch, Equations, Stiffening};
use super::memory::Memory;
use super::outcome::{Loads, slipping};
use super::state::{PadState, PatchState};
use super::step::Candidates;

/// The equations of a step, and the patches at its solution.
type AfterStep<'a, const P: usize, T, B, W> = (Equations<'a, P, T, InUnits<'a, B, T>, W>, Vec<ActivePatch<'a, T>, P>);

impl<T: Elementary> Pad<'_, T> {
    /// The depth of the last step, mm.
    pub fn depth_mm<const P: usize, M: Memory<P, T>>(&self, state: &PadState<P, T, M>) -> T {
        state.depth * self.units.length
    }

    /// Pitch and roll of the last step as the pad followed them, degrees.
    pub fn pose_deg<const P: usize, M: Memory<P, T>>(&self, state: &PadState<P, T, M>) -> [T; 2] {
        let degrees = T::of(180.0) / T::half_turn();
        [self.numbers.neutral_pitch_deg + state.tilt[0] * degrees, state.tilt[1] * degrees]
    }

    /// The equations of the last step and the contact of each patch, in the units of the fitted finger. None without contact, or for a pad
    /// of more than `P` patches.
    fn after_step<'a, const P: usize, B: Surface<T>, M: Memory<P, T>>(
        &'a self,
        state: &PadState<P, T, M>,
        body: &'a InUnits<'a, B, T>,
    ) -> Option<AfterStep<'a, P, T, B, M::Weights>> {
        if !state.in_contact() || !state.is_consistent(self.patches.len()) {
            return None;
        }
        let equations = self.equations(state, body);
        let mut active = Vec::new();
        self.collect_active(state, &equations, Candidates::All, &mut active);
        equations.residual(&state.bulk, &mut active);
        Some((equations, active))
    }

    /// Pressure, traction, area and stick ratio of each patch after the last step.
    ///
    /// Costs as much as one iteration of a step.
    pub fn patch_states<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        body: &impl Surface<T>,
    ) -> [PatchState<T>; P] {
        let mut out = [PatchState::default(); P];
        self.visit_patches(state, body, |index, patch, _| {
            if let Some(out) = out.get_mut(index) {
                *out = patch;
            }
        });
        out
    }

    /// Visits the patches of a contact after the last step: their index and state; and of those that touch force, N, and moment, N mm, on the
    /// finger. The axes are those of the plane, and the moment is about the point of the plane under the centre of rotation of poses, as in
    /// a response: over all patches they add up to it.
    #[inline(always)]
    pub(crate) fn visit_patches<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        body: &impl Surface<T>,
        mut visit: impl FnMut(usize, PatchState<T>, [Vector3<T>; 2]),
    ) {
        let Units { length, per_length, force, .. } = self.units;
        let pressure = force * per_length * per_length;
        let blunt = self.blunted(body);
        let body = InUnits::new(blunt.as_ref().unwrap_or(body), &self.units);
        let Some((equations, active)) = self.after_step(state, &body) else { return };
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: Vector3<T>| [cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z];
        let law = &self.numbers.law;
        let (apex, soft) = Loads::constants(&equations, law);
        let memory = state.reserve.iter().zip(&state.turn);
        for (ActivePatch { index, patch, placed, contact }, (reserve, turn)) in active.iter().zip(memory) {
            let mut out = PatchState {
                place_mm: back(contact.place + equations.frame.apex).map(|x| x * length),
                ..PatchState::default()
            };
            if !contact.touches {
                visit(*index, out, [Vector3::zeros(); 2]);
                continue;
            }
            let traction = back(contact.stretch * (contact.grip / patch.area_mm2));
            out.pressure_mpa = contact.force * equations.frame.approach.rate / patch.area_mm2 * pressure;
            out.traction_mpa = [traction[0] * pressure, traction[1] * pressure];
            let contact_share = placed.compressed.contact_share(contact.below, law);
            out.contact_area_mm2 = placed.compressed.full_area * contact_share * (length * length);
            out.used = (contact.length / (contact.bound + T::of(f32::MIN_POSITIVE))).at_most(T::of(1.0));
            let falls = !(*reserve < T::of(0.0));
            let slipping = if falls { slipping(contact, turn, contact_share, law) } else { T::of(0.0) };
            out.stick_ratio = T::of(1.0) - slipping;
            let mut loads = Loads::none();
            loads.add(&equations, law, &apex, &soft, patch, placed, contact);
            let [on_skin, moment] = self.wrench(state.angle[0], &equations.frame, &loads);
            visit(*index, out, [on_skin * force, moment * (force * length)]);
        }
    }

    /// Friction along x and y, N, and its moment about the normal, N mm, in full slip: all patches that touch after the last step slip under
    /// a motion of the body (slides along x and y, mm, and an angle, rad, per any unit of time). The results over all motions form the limit
    /// surface.
    ///
    /// The moment is about the centre of rotation of poses, as in a response. Returns 0 without contact or without motion. Costs as much as
    /// one iteration of a step.
    pub fn full_slip<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        body: &impl Surface<T>,
        [along_x, along_y, turn]: [T; 3],
    ) -> [T; 3] {
        let mut limit = [T::of(0.0); 3];
        let Units { length, per_length, force, .. } = self.units;
        // Only the direction counts; the square of a huge motion would be infinite.
        let largest =
            [along_x, along_y, turn].map(T::magnitude).into_iter().fold(T::of(0.0), |a, b| if b > a { b } else { a });
        if !(largest > T::of(f32::MIN_POSITIVE) && largest.is_number()) {
            return limit;
        }
        let [along_x, along_y] = [along_x, along_y].map(|slide| slide / largest * per_length);
        let turn = turn / largest;
        let blunt = self.blunted(body);
        let body = InUnits::new(blunt.as_ref().unwrap_or(body), &self.units);
        let Some((equations, active)) = self.after_step(state, &body) else { return limit };
        let (sin, cos) = state.angle[0].sin_cos();
        let turned = |x: T, y: T, sin: T| [cos * x - sin * y, sin * x + cos * y];
        for contact in active.iter().map(|patch| &patch.contact).filter(|contact| contact.touches) {
            let [x, y] = [0, 1].map(|k| contact.place[k] + equations.frame.apex[k]);
            let [x, y] = turned(x, y, sin);
            let velocity = [along_x - turn * y, along_y + turn * x];
            let speed = (velocity[0] * velocity[0] + velocity[1] * velocity[1]).magnitude().sqrt();
            if !(speed > T::of(f32::MIN_POSITIVE)) {
                continue;
            }
            let [fx, fy] = match &equations.axis {
                None => velocity.map(|part| part * (contact.strength / speed)),
                Some(axis) => {
                    let [x, y] = turned(velocity[0], velocity[1], -sin).map(|part| part / speed);
                    let along = axis
                        .sliding(&Vector3::new(x, y, T::of(0.0)), &Vector3::new(T::of(0.0), T::of(0.0), T::of(1.0)))
                        * contact.strength;
                    turned(along.x, along.y, sin)
                }
            };
            limit = [limit[0] + fx, limit[1] + fy, limit[2] + (x * fy - y * fx)];
        }
        [limit[0] * force, limit[1] * force, limit[2] * (force * length)]
    }

    #[cfg(test)]
    pub(crate) fn residual<const P: usize, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        body: &impl Surface<T>,
    ) -> [T; super::MODES] {
        let blunt = self.blunted(body);
        let body = InUnits::new(blunt.as_ref().unwrap_or(body), &self.units);
        let equations = self.equations(state, &body);
        let mut active = Vec::<_, P>::new();
        self.collect_active(state, &equations, Candidates::All, &mut active);
        equations.residual(&state.bulk, &mut active)
    }

    /// Energy stored after the last step, mJ.
    ///
    /// Tissue that relaxes stores more. This is the part that it keeps when it has relaxed at the present place.
    pub fn energy_mj<const P: usize, M: Memory<P, T>>(&self, state: &PadState<P, T, M>, body: &impl Surface<T>) -> T {
        let mut sum = T::of(0.0);
        let blunt = self.blunted(body);
        let body = InUnits::new(blunt.as_ref().unwrap_or(body), &self.units);
        let Some((equations, active)) = self.after_step(state, &body) else { return sum };
        for x in &state.bulk {
            sum += T::of(0.5) * *x * *x;
        }
        sum += Stiffening::at(&self.numbers.squash, &state.bulk, &self.numbers.law).energy;
        for ActivePatch { index, patch, placed, contact } in &active {
            if contact.touches {
                let relaxed = equations.stiff().map_or(contact.force, |_| contact.relaxed);
                let (energy, _) = placed.compressed.energy(contact.overlap, relaxed, T::of(0.0));
                let mut square = contact.length.at_most(contact.bound);
                square *= square;
                if let Some(weights) = equations.weights.get() {
                    let share = (contact.bound / contact.length).at_most(T::of(1.0));
                    let held = contact.stretch * share + weights.across(*index, &placed.inward);
                    square = held.dot(&held) / (weights.stiff * weights.stiff);
                }
                sum += energy + T::of(0.5) * square / patch.compliance_mm_per_n[1];
            }
        }
        sum * (self.units.force * self.units.length)
    }
}
