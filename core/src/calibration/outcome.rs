//! Input and result of a calibration.
//!
//! Main types: [`Settings`], [`Measured`], [`Calibrated`], [`NotCalibrated`]. Uses rescaling.

use super::{SLIPPED_MM, UNKNOWNS};
use crate::Tuning;

/// Prior of the finger, errors of the readings, and the required accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Standard deviation of fingers' size, share; 0 if the size is known to be that of the model.
    pub size: f32,
    /// That of the tissue's stiffness, share.
    pub stiffness: f32,
    /// That of lambda, share.
    pub lambda: f32,
    /// That of the depth at which the finger touches, mm; 0 if the zero of the depth is known. Otherwise three presses are required
    /// instead of two.
    pub depth_offset_mm: f32,
    /// Systematic error of the force readings, N.
    pub force_error_n: f32,
    /// That of the depth readings, mm.
    pub depth_error_mm: f32,
    /// Largest standard error, share, with which [`super::Calibration::result`] returns a result.
    pub wanted: f32,
}

impl Default for Settings {
    /// Size within 25 %, stiffness and lambda within a factor of two, touch within 0.1 mm; errors of 2 mN and 5 µm; results with standard
    /// errors up to 15 %.
    fn default() -> Self {
        Self {
            size: 0.25,
            stiffness: 0.7,
            lambda: 0.7,
            depth_offset_mm: 0.1,
            force_error_n: 2e-3,
            depth_error_mm: 5e-3,
            wanted: 0.15,
        }
    }
}

/// Forces that the plane exerts on the finger, as measured at the end of a step, N; signs as in [`crate::Response`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measured {
    /// Normal force.
    pub normal_force_n: f32,
    /// Friction along x and y.
    pub friction_n: [f32; 2],
}

/// An unknown of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Unknown {
    /// [`Tuning::size`].
    Size,
    /// [`Tuning::stiffness`].
    Stiffness,
    /// [`Tuning::lambda`].
    Lambda,
    /// [`Calibrated::depth_offset_mm`].
    DepthOffset,
}

pub(super) const NAMES: [Unknown; UNKNOWNS] =
    [Unknown::Size, Unknown::Stiffness, Unknown::Lambda, Unknown::DepthOffset];

/// Result of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Calibrated {
    /// For [`crate::ModelOf::tuned`].
    pub tuning: Tuning,
    /// Correction to add to the measured depths, mm: negative if the finger touches at a positive measured depth.
    pub depth_offset_mm: f32,
    /// Relative standard errors of size, stiffness and lambda. The errors of size and stiffness are correlated; the forces are more accurate
    /// than either.
    pub tuning_error: [f32; 3],
    /// Standard error of the depth offset, mm.
    pub depth_offset_error_mm: f32,
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum NotCalibrated {
    /// No reading with contact.
    NoContact,
    /// Contact at one depth only, or nearly.
    OneDepth {
        /// Shallowest depth with a reading, mm.
        shallowest_mm: f32,
        /// Deepest, mm.
        deepest_mm: f32,
    },
    /// Fewer presses from the air than are needed: two, three if the zero of the depth is unknown.
    FewPresses {
        /// Presses seen.
        presses: u8,
        /// Presses needed.
        needed: u8,
    },
    /// No slide in full slip that was long enough.
    NoSlip {
        /// Slide in full slip, mm.
        slipped_mm: f32,
    },
    /// The estimate still changes: continue with [`super::Calibration::step`] or [`super::Calibration::work`].
    Unsettled,
    /// An unknown at the end of its range: not a finger like the model's, or forces in other units.
    OutOfRange {
        /// Which.
        what: Unknown,
        /// Its value: a factor, or mm.
        value: f32,
    },
    /// The standard error of an unknown is too large.
    Uncertain {
        /// Which.
        what: Unknown,
        /// Its standard error: a share, or mm.
        standard_error: f32,
    },
}

impl core::fmt::Display for NotCalibrated {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::NoContact => f.write_str("no reading with contact"),
            Self::OneDepth { shallowest_mm, deepest_mm } => {
                write!(f, "readings from {shallowest_mm} to {deepest_mm} mm of depth only: press to different depths")
            }
            Self::FewPresses { presses, needed } => {
                write!(f, "{presses} presses from the air where {needed} are needed")
            }
            Self::NoSlip { slipped_mm } => {
                write!(f, "{slipped_mm} mm of slide in full slip where {SLIPPED_MM} mm are needed: slide on")
            }
            Self::Unsettled => f.write_str("the estimate still changes"),
            Self::OutOfRange { what, value } => write!(f, "{what:?} is at the end of its range: {value}"),
            Self::Uncertain { what, standard_error } => {
                write!(f, "{what:?} is uncertain: standard error {standard_error}")
            }
        }
    }
}

impl core::error::Error for NotCalibrated {}
