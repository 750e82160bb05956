//! Random effects: quantities that differ from run to run, beside the noise of the rows.
//!
//! Main types: [`RandomEffect`] (the name of one), [`PerEffect`] (a vector over them), [`RandomEffects`] (predicted values
//! of each run).

/// A quantity that each run draws once from a normal distribution of mean 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RandomEffect {
    /// Logarithm of the factor on the tissue's stiffness.
    Stiffness,
    /// Logarithm of the factor on the strength of friction.
    Strength,
    /// Error of the touch point, added to the depth, mm.
    DepthZero,
    /// Offset of the normal force, N.
    OffsetNormal,
    /// Offset of the friction along x, N.
    OffsetX,
    /// Offset of the friction along y, N.
    OffsetY,
}

/// Number of random effects of a run.
pub const RANDOM_EFFECTS: usize = RandomEffect::OffsetY as usize + 1;
/// Number of random effects that act inside the model: stiffness, strength, touch point.
pub const MODEL_EFFECTS: usize = RandomEffect::DepthZero as usize + 1;

/// A vector over the random effects (values, or variances between runs), indexed by [`RandomEffect::index`].
pub type PerEffect = [f64; RANDOM_EFFECTS];

/// Values of the random effects inside the model, one entry a run; empty where all are taken as 0.
pub type RandomEffects = Vec<[f64; MODEL_EFFECTS]>;

impl RandomEffect {
    /// Place in a [`PerEffect`].
    pub const fn index(self) -> usize {
        self as usize
    }
}
