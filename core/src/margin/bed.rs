//! A bed as the finger of the observer: its own tables give all that is asked.
//!
//! Uses stick, step and grip.

use super::finger::{Observable, TwinForces};
use super::stick::{Curves, stick_ratios};
use crate::step::share_of_limit;
use crate::{Error, ForceStateOf, ModelOf, Motion, StateOf};

impl<const M: usize, const N: usize> Observable<ForceStateOf<M>> for ModelOf<'_, M, N> {
    const TURNS: bool = false;
    type Tables = Curves;

    fn tables(&self) -> Result<Curves, Error> {
        Ok(Curves::of(|share| {
            let depth_mm = share * ModelOf::depth_max_mm(self);
            let mut state = StateOf::<M>::default();
            let (limit_n, stiffness_n_mm) = (ModelOf::limit_at(self, depth_mm), ModelOf::stiffness_at(self, depth_mm));
            stick_ratios(limit_n, stiffness_n_mm, |by| {
                let slide_increment_mm = [by, 0.0];
                self.step(&mut state, Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.0, dt_s: 1e-3 })
            })
        }))
    }
    fn twin(&self, strength_factor: f32) -> ForceStateOf<M> {
        let mut state = ForceStateOf::default();
        state.set_strength_factor(strength_factor);
        state
    }
    #[inline]
    fn strength_factor(twin: &ForceStateOf<M>) -> f32 {
        twin.strength_factor()
    }
    #[inline]
    fn step_twin(&self, twin: &mut ForceStateOf<M>, motion: Motion) -> TwinForces {
        let forces = self.step_forces(twin, motion);
        TwinForces {
            normal_force_n: forces.normal_force_n,
            friction_n: forces.friction_n,
            spin_moment_n_mm: 0.0,
            slip_margin: forces.slip_margin,
        }
    }
    #[inline]
    fn depth_max_mm(&self) -> f32 {
        ModelOf::depth_max_mm(self)
    }
    #[inline]
    fn normal_at(&self, _: &Curves, depth_mm: f32) -> f32 {
        ModelOf::normal_at(self, depth_mm)
    }
    #[inline]
    fn depth_for_normal(&self, _: &Curves, force_n: f32) -> f32 {
        ModelOf::depth_for_normal(self, force_n)
    }
    #[inline]
    fn limit_at(&self, _: &Curves, depth_mm: f32) -> f32 {
        ModelOf::limit_at(self, depth_mm)
    }
    #[inline]
    fn stiffness_at(&self, _: &Curves, depth_mm: f32) -> f32 {
        ModelOf::stiffness_at(self, depth_mm)
    }
    #[inline]
    fn used(&self, _: &Curves, _: Option<(&ForceStateOf<M>, f32)>, [normal, x, y]: [f32; 3], of_shear_n: f32) -> f32 {
        let depth = ModelOf::depth_for_normal(self, (normal - of_shear_n).max(0.2 * normal).max(1e-6));
        let limit = ModelOf::limit_at(self, depth);
        let (row, t) = self.cell(depth);
        share_of_limit(row, t, [x / limit, y / limit])
    }
    #[inline]
    fn stick_ratios_at(&self, tables: &Curves, depth_mm: f32) -> [f32; 5] {
        tables.at(depth_mm / ModelOf::depth_max_mm(self))
    }
}
