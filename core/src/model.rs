//! What bed and pad have in common.
//!
//! Main traits: [`FingerModel`], [`Drivable`]. Uses step, drive and gradient.

use bytemuck::Pod;

use crate::drive::driven;
use crate::memory::Memory;
use crate::{Drive, Driven, Error, Gradient, ModelOf, Motion, Response, StateOf, Tuning, step};

/// A model of a finger that touches one body; `S` is the state of a contact.
///
/// Implemented by a bed ([`ModelOf`]) and by a pad on a body in a pose ([`crate::pad::PadOn`]).
pub trait FingerModel<S>: Sized {
    /// A finger without contact.
    ///
    /// # Errors
    /// [`Error::Shape`] if the state has too little room.
    fn fresh(&self) -> Result<S, Error>;
    /// Advances a contact by one step. Cannot fail, panic or allocate, whatever the input.
    fn step(&self, state: &mut S, motion: Motion) -> Response;
    /// Whether the last step left the finger in contact.
    fn in_contact(&self, state: &S) -> bool;
    /// The depth of the last step, mm.
    fn depth_mm(&self, state: &S) -> f32;
    /// The largest depth of the fit, mm.
    fn depth_max_mm(&self) -> f32;
    /// Sets the factor of all strengths, as [`StateOf::set_strength_factor`]. Returns the one in use.
    fn set_strength_factor(&self, state: &mut S, factor: f32) -> f32;
    /// The same model for another finger, relative to the fitted one.
    ///
    /// # Errors
    /// [`Error::Range`] with the factor that is out of its range.
    fn tuned(&self, tuning: Tuning) -> Result<Self, Error>;
    /// Writes a state as bytes with a checksum of its own, to be read with the same `model` checksum. Returns their number.
    ///
    /// # Errors
    /// [`Error::Buffer`] if `out` is too small.
    fn save(&self, state: &S, model: u32, out: &mut [u8]) -> Result<usize, Error>;
    /// Reads a state that [`Self::save`] wrote.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    fn restore(&self, model: u32, bytes: &[u8]) -> Result<S, Error>;
}

/// A model that forces can drive.
pub trait Drivable<S: Clone>: FingerModel<S> {
    /// Error of the force in a driven step that is accepted, share of the target.
    const CONTENT: f32;
    /// What the search for a force needs to know of a contact.
    type Scale;

    /// Whether Newton's method changes depth and slide together, at an error of the force and if that has halved. At large errors, where
    /// full slip may intervene, separate changes may converge more often.
    fn together(error: f32, halves: bool) -> bool;
    /// What the search needs to know of a contact.
    fn scale(&self, state: &S) -> Self::Scale;
    /// About the normal force without shear at a depth, N: it rises with depth.
    fn normal_at(&self, scale: &Self::Scale, depth_mm: f32) -> f32;
    /// The depth of such a force, mm.
    fn depth_for_normal(&self, scale: &Self::Scale, force_n: f32) -> f32;
    /// About the stiffness of friction while everything sticks, N/mm.
    fn stiffness_at(&self, scale: &Self::Scale, depth_mm: f32) -> f32;
    /// The derivatives of the forces for a motion that continues in `direction` (depth, slide x, slide y; any length). With a direction of
    /// zeros everything sticks. Zeros without contact.
    fn gradient(&self, state: &S, direction: [f32; 3]) -> Gradient;

    /// Advances a contact by one step driven by displacement or force in each direction.
    ///
    /// The first attempt is no motion. It is accepted if the forces are within [`Self::CONTENT`] of the target, so that a constant load does not
    /// creep. For a force out of reach the result is the nearest state that was found, with [`crate::Status::LOAD_NOT_REACHED`]. For a normal
    /// force of 0 or less the finger lifts off; for NaN it does not move.
    fn step_driven(&self, state: &mut S, drive: Drive) -> Driven {
        driven(self, state, drive)
    }
}

impl<const M: usize, const N: usize, const P: usize, R: Memory<M, P, f32> + Pod> FingerModel<StateOf<M, P, f32, R>>
    for ModelOf<'_, M, N>
{
    fn fresh(&self) -> Result<StateOf<M, P, f32, R>, Error> {
        Ok(StateOf::default())
    }
    fn step(&self, state: &mut StateOf<M, P, f32, R>, motion: Motion) -> Response {
        step(self, state, motion)
    }
    fn in_contact(&self, state: &StateOf<M, P, f32, R>) -> bool {
        state.in_contact()
    }
    fn depth_mm(&self, state: &StateOf<M, P, f32, R>) -> f32 {
        state.depth_mm()
    }
    fn depth_max_mm(&self) -> f32 {
        ModelOf::depth_max_mm(self)
    }
    fn set_strength_factor(&self, state: &mut StateOf<M, P, f32, R>, factor: f32) -> f32 {
        state.set_strength_factor(factor)
    }
    fn tuned(&self, tuning: Tuning) -> Result<Self, Error> {
        ModelOf::tuned(self, tuning)
    }
    fn save(&self, state: &StateOf<M, P, f32, R>, model: u32, out: &mut [u8]) -> Result<usize, Error> {
        state.write_bytes(model, out)
    }
    fn restore(&self, model: u32, bytes: &[u8]) -> Result<StateOf<M, P, f32, R>, Error> {
        StateOf::read_bytes(model, bytes)
    }
}

impl<const M: usize, const N: usize, const P: usize, R: Memory<M, P, f32> + Pod> Drivable<StateOf<M, P, f32, R>>
    for ModelOf<'_, M, N>
{
    const CONTENT: f32 = 4e-6;
    type Scale = ();

    fn together(error: f32, halves: bool) -> bool {
        halves && error < 0.1
    }
    fn scale(&self, _: &StateOf<M, P, f32, R>) {}
    fn normal_at(&self, (): &(), depth_mm: f32) -> f32 {
        ModelOf::normal_at(self, depth_mm)
    }
    fn depth_for_normal(&self, (): &(), force_n: f32) -> f32 {
        ModelOf::depth_for_normal(self, force_n)
    }
    fn stiffness_at(&self, (): &(), depth_mm: f32) -> f32 {
        ModelOf::stiffness_at(self, depth_mm)
    }
    fn gradient(&self, state: &StateOf<M, P, f32, R>, direction: [f32; 3]) -> Gradient {
        ModelOf::gradient(self, state, direction)
    }
}
