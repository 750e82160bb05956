//! What the observer returns.
//!
//! Main types: [`Margin`], [`Known`].

use crate::Status;

/// What the readings say about the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u8)]
pub enum Known {
    /// The finger does not touch: no margin.
    #[default]
    NoContact,
    /// Nothing but the prior: the contact sticks, or the noise hides its slip.
    Prior,
    /// A part: surfaces are excluded, but the band is wider than half of that of the prior.
    Part,
    /// The curve of friction has bent: the strength is known within the band.
    Strength,
}

/// What is known of the surface after a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Margin {
    /// Strength factor of the surface: estimate and band.
    pub strength_factor: f32,
    /// Lower end of its band.
    pub strength_low: f32,
    /// Upper end of its band.
    pub strength_high: f32,
    /// Slip margin of the present friction, 0 to 1, as [`crate::Response::slip_margin`]; 0 without contact.
    pub slip_margin: f32,
    /// Lower end of its band: 0 announces slip.
    pub margin_low: f32,
    /// Upper end of its band.
    pub margin_high: f32,
    /// Chance of full slip within [`super::Settings::ahead_s`] if friction and normal force continue at their present rates.
    pub slip_chance: f32,
    /// Tangential stiffness of the finger over that of the model.
    pub stiffness_factor: f32,
    /// Standard deviation of the logarithm of the strength factor over that of the prior, subtracted from 1.
    pub information: f32,
    /// What kind of knowledge this is.
    pub known: Known,
    /// Whether this reading made clear that nothing expected explains the readings: the strength starts again from its prior.
    pub surface_changed: bool,
    /// [`Status::BAD_INPUT`] for a number or a covariance that is unsound, [`Status::BAD_TIME_STEP`] for a clock that stands still,
    /// [`Status::DEPTH_ABOVE_RANGE`] for a normal force beyond the model. The reading then taught nothing, and the bounds have widened.
    pub status: Status,
}
