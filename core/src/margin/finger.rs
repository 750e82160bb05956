//! What the observer needs of a finger.
//!
//! Main trait: [`Observable`], implemented by a bed and by a pad on a body in a pose.

use crate::{Error, Motion};

/// Forces of a twin after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TwinForces {
    /// Normal force, N.
    pub normal_force_n: f32,
    /// Force along x and y, N.
    pub friction_n: [f32; 2],
    /// Moment about the normal, N mm; 0 where twins have no spin.
    pub spin_moment_n_mm: f32,
    /// 1 less the share of its limit that friction uses, 0 to 1.
    pub slip_margin: f32,
}

/// A finger whose contacts the observer compares with the measured one; `S` is the state of such a contact (twin).
///
/// Implemented by a bed ([`crate::ModelOf`]) and by a pad on a body in a pose ([`crate::pad::PadOn`]).
pub trait Observable<S>: Copy {
    /// Whether twins turn and have a moment about the normal.
    const TURNS: bool;
    /// What is computed once, when an observer is made.
    type Tables: Copy + core::fmt::Debug;

    /// Computes the tables.
    ///
    /// # Errors
    /// [`Error::Shape`] if the state of a twin has too little room.
    fn tables(&self) -> Result<Self::Tables, Error>;
    /// A twin without contact.
    ///
    /// * `strength_factor`: its factor of all strengths
    fn twin(&self, strength_factor: f32) -> S;
    /// The factor of all strengths of a twin.
    fn strength_factor(twin: &S) -> f32;
    /// Advances a twin by one step. Cannot fail, panic or allocate, whatever the input.
    fn step_twin(&self, twin: &mut S, motion: Motion) -> TwinForces;
    /// The largest depth of the fit, mm.
    fn depth_max_mm(&self) -> f32;
    /// The normal force without shear at a depth, N. It rises with depth.
    fn normal_at(&self, tables: &Self::Tables, depth_mm: f32) -> f32;
    /// The depth of such a force, mm; at most the largest one.
    fn depth_for_normal(&self, tables: &Self::Tables, force_n: f32) -> f32;
    /// Friction in full slip at a depth and a strength factor of 1, N.
    fn limit_at(&self, tables: &Self::Tables, depth_mm: f32) -> f32;
    /// Stiffness of friction while everything sticks at a depth, N/mm.
    fn stiffness_at(&self, tables: &Self::Tables, depth_mm: f32) -> f32;
    /// Friction over that of full slip at a strength factor of 1.
    ///
    /// * `twin`: the most likely twin, and the strength factor of the surface under it
    /// * `forces_n`: normal force and force along x and y
    /// * `of_shear_n`: part of the normal force that is due to shear
    fn used(&self, tables: &Self::Tables, twin: Option<(&S, f32)>, forces_n: [f32; 3], of_shear_n: f32) -> f32;
    /// Stick ratios in a pull at a depth, where friction is 0, 1/4, 1/2, 3/4 of the limit and all of it.
    fn stick_ratios_at(&self, tables: &Self::Tables, depth_mm: f32) -> [f32; 5];
}
