//! What goes into a step and what comes out of it.
//!
//! Main types: [`Motion`], [`Response`]. Uses regime.

use crate::{Regime, Status};

/// What the plane does in one step.
///
/// The slide is an increment because an absolute one would lose microns in 32 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion {
    /// Depth at the end of the step, mm, positive into the finger; 0 or less is no contact.
    pub depth_mm: f32,
    /// Slide of the plane against the finger's base during the step, mm.
    pub slide_increment_mm: [f32; 2],
    /// Length of the step, s, > 0. The law itself is rate-independent.
    pub dt_s: f32,
}

/// Forces that the plane exerts on the finger, and how far the contact is from slipping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Response {
    /// Normal force, N, >= 0.
    pub normal_force_n: f32,
    /// Friction along x and y, N; points along the plane's motion.
    pub friction_n: [f32; 2],
    /// Stuck area over contact area: 1 in a fresh contact, 0 in full slip and without contact.
    pub stick_ratio: f32,
    /// Largest friction in the direction of the present one, N.
    pub friction_limit_n: f32,
    /// 1 − |friction| / friction_limit, 0 to 1; 1 without contact.
    pub slip_margin: f32,
    /// Contact area, mm².
    pub contact_area_mm2: f32,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: f32,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: f32,
    /// What the contact as a whole does.
    pub regime: Regime,
    /// Remarks.
    pub status: Status,
}
