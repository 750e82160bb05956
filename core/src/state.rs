//! The memory of a contact.
//!
//! Main types: [`StateOf`], [`ForceStateOf`]. Uses data, math, memory and stick_ratio.

use crate::data::SPRINGS;
use crate::math::{Elementary, Scalar};
use crate::memory::BedMemory;
use crate::stick_ratio::SlipHistory;

/// The memory of the default model; see [`StateOf`].
pub type State = StateOf<SPRINGS>;
/// The memory of the default model with spin.
pub type SpinState = StateOf<SPRINGS, 2>;

/// The memory of the default model where only forces are needed; see [`ForceStateOf`].
pub type ForceState = ForceStateOf<SPRINGS>;

/// The memory of a contact of a finger whose tissue relaxes; made by [`StateOf::relaxing`].
pub type RelaxingStateOf<const M: usize, const P: usize = 1, T = f32> = StateOf<M, P, T, BedMemory<M, P, T>>;
/// The same for the default model.
pub type RelaxingState<const P: usize = 1> = RelaxingStateOf<SPRINGS, P>;

/// Least and largest strength factor.
const STRENGTH_FACTOR: [f32; 2] = [0.1, 5.0];

/// The state of a contact: that of its forces, and the history from which the stick ratio follows. `Default` is a finger without
/// contact.
///
/// `P` is 1 for a contact that slides, 2 for one that also spins: a spring is then a pair. Plain data: copy it to save it,
/// or use [`StateOf::write_bytes`].
///
/// `R` is the memory of the tissue. `()`: the finger follows its relaxed tissue, and the time step has no influence; see
/// [`RelaxingState`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StateOf<const M: usize, const P: usize = 1, T: Scalar = f32, R = ()> {
    pub(crate) forces: ForceStateOf<M, P, T, R>,
    pub(crate) history: SlipHistory<T>,
}

/// The state of a contact of which only forces are needed: 64 bytes of the default model in place of 108. `Default` is a finger
/// without contact.
///
/// [`crate::ModelOf::step_forces`] advances it. Plain data: copy it to save it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ForceStateOf<const M: usize, const P: usize = 1, T = f32, R = ()> {
    /// Anchor of each spring on the plane, mm.
    pub(crate) anchor: [[[T; 2]; P]; M],
    /// Slide of the plane since an origin of the state's own choice, mm, as a compensated sum: high and low part.
    pub(crate) position: [[T; 2]; 2],
    /// Angle of the plane in the same form, rad; 0 without spin.
    pub(crate) angle: [T; 2],
    pub(crate) depth: T,
    pub(crate) strength_factor: T,
    /// What the tissue remembers.
    pub(crate) memory: R,
}

impl<const M: usize, const P: usize, T: Scalar, R: Default> Default for ForceStateOf<M, P, T, R> {
    fn default() -> Self {
        let zero = T::of(0.0);
        Self {
            anchor: [[[zero; 2]; P]; M],
            position: [[zero; 2]; 2],
            angle: [zero; 2],
            depth: zero,
            strength_factor: T::of(1.0),
            memory: R::default(),
        }
    }
}

impl<const M: usize, const P: usize, T: Elementary> RelaxingStateOf<M, P, T> {
    /// A finger without contact whose tissue relaxes.
    pub fn relaxing() -> Self {
        Self::default()
    }
}

impl<const M: usize, const P: usize, T: Scalar, R> StateOf<M, P, T, R> {
    /// Whether the last step left the finger in contact.
    pub(crate) fn in_contact(&self) -> bool {
        self.forces.in_contact()
    }

    /// The depth of the last step, mm.
    pub fn depth_mm(&self) -> T {
        self.forces.depth
    }

    /// The factor on the strength; 1 unless set.
    pub fn strength_factor(&self) -> T {
        self.forces.strength_factor
    }

    /// See [`ForceStateOf::set_strength_factor`].
    pub fn set_strength_factor(&mut self, factor: T) -> T {
        self.forces.set_strength_factor(factor)
    }
}

impl<const M: usize, const P: usize, T: Scalar, R> ForceStateOf<M, P, T, R> {
    /// Whether the last step left the finger in contact.
    pub(crate) fn in_contact(&self) -> bool {
        self.depth > T::of(0.0)
    }

    /// The depth of the last step, mm.
    pub fn depth_mm(&self) -> T {
        self.depth
    }

    /// The factor on the strength; 1 unless set.
    pub fn strength_factor(&self) -> T {
        self.strength_factor
    }

    /// Whether the number by which a step multiplies is within its range. A step and a restored state are both checked with it. No
    /// other finite number makes a response leave its bounds.
    #[inline(always)]
    pub(crate) fn is_consistent(&self) -> bool {
        let [least, most] = STRENGTH_FACTOR;
        self.strength_factor.is_between(least, most)
    }

    /// Sets the factor of all strengths from the next step on: the product of the influences of moisture, speed, dwell or another finger on
    /// friction. Springs keep their force as long as it is within the new limit.
    ///
    /// Range 0.1 to 5; a value outside is replaced by the nearer end, and NaN changes nothing. Returns the factor in use.
    pub fn set_strength_factor(&mut self, factor: T) -> T {
        if factor.partial_cmp(&factor).is_some() {
            let [least, most] = STRENGTH_FACTOR.map(T::of);
            self.strength_factor = if factor < least { least } else { factor.at_most(most) };
        }
        self.strength_factor
    }
}
