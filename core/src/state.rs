//! All that a contact remembers.
//!
//! Main type: [`StateOf`]. Uses data.

use crate::data::ELEMENTS;

/// The memory of the default model; see [`StateOf`].
pub type State = StateOf<ELEMENTS>;

/// All that a contact remembers. `Default` is a finger in the air.
///
/// Plain data of `2 M + 13` words: copy it to save it, or use [`StateOf::write_bytes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateOf<const M: usize> {
    /// Force of each element over its strength; along y over the root of the stiffness ratio as well.
    pub(crate) force: [[f32; 2]; M],
    /// The resultant of the elements' forces over the strength; along y over the root of the stiffness ratio as well.
    pub(crate) resultant: [f32; 2],
    /// Change of the resultant since the motion last reversed, or since touch in a fresh contact and after full slip.
    pub(crate) path_since_reversal: [f32; 2],
    pub(crate) depth: f32,
    pub(crate) limit: f32,
    /// Tangential stiffness, N/mm.
    pub(crate) stiffness: f32,
    /// Twice the elements' elastic energy, mJ.
    pub(crate) energy: f32,
    /// Twice the energy that the contact stores beyond that of its elements, mJ.
    pub(crate) stored_energy: f32,
    /// Elastic displacement of the contact as a whole less that of its rim, which came later, mm; along y times the root
    /// of the stiffness ratio.
    pub(crate) rim_lag: [f32; 2],
    /// Slide that pressing amounts to, half cells.
    pub(crate) press_slide: f32,
    pub(crate) strength_factor: f32,
}

impl<const M: usize> Default for StateOf<M> {
    fn default() -> Self {
        Self {
            force: [[0.0; 2]; M],
            resultant: [0.0; 2],
            path_since_reversal: [0.0; 2],
            depth: 0.0,
            limit: 0.0,
            stiffness: 0.0,
            energy: 0.0,
            stored_energy: 0.0,
            rim_lag: [0.0; 2],
            press_slide: 0.0,
            strength_factor: 1.0,
        }
    }
}

impl<const M: usize> StateOf<M> {
    /// Whether the last step left the finger in contact.
    pub(crate) fn in_contact(&self) -> bool {
        self.limit > 0.0
    }

    /// The depth of the last step, mm.
    pub fn depth_mm(&self) -> f32 {
        self.depth
    }

    /// The factor on the strength; 1 unless set.
    pub fn strength_factor(&self) -> f32 {
        self.strength_factor
    }

    /// Sets the factor by which all strengths are multiplied from the next step on: the product of what moisture,
    /// speed, dwell or another finger make of the friction. Elements keep their force while it fits.
    ///
    /// Range 0.2 to 5; anything else is moved to the nearer end and NaN changes nothing. Returns the factor in use.
    pub fn set_strength_factor(&mut self, factor: f32) -> f32 {
        if !factor.is_nan() {
            self.strength_factor = factor.clamp(0.2, 5.0);
        }
        self.strength_factor
    }
}
