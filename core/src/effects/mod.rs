//! The effects beyond the plain model, one a file: the one library that the core's step with effects, the diagnosis and the
//! confirmation by finite elements share.
//!
//! A file has an effect's formula, its parameters with ranges, its source, its drivers and the laws that it may be confused with
//! ([`Effect`], [`Law`]). The formula reads [`Conditions`] and writes a [`Change`], and is generic over the precision:
//! `f32` on a microcontroller, `f64` in the diagnosis ([`Real`] explains why this is a trait and no macro). [`LAWS`]
//! describes all effects; [`Effects`] runs those whose slots a model file has, with the clocks of [`Contact`] and the
//! caller's [`Surroundings`]. The plain step is not touched by them. An effect more is one file, one line in the list below
//! and its lines in `data/law-vectors.csv`: see `core/docs/add-an-effect.md`. Uses model, model_file, math.

pub mod baseline;
mod change;
mod conditions;
mod contact;
mod law;
mod library;
mod step;
mod surroundings;
pub mod tables;
pub use change::{Change, LEAST_FACTOR, REFERENCE_AREA_MM2};
pub use conditions::{Conditions, OWN};
pub use contact::Contact;
pub use law::{Axis, Column, Effect, Law, Parameter, Place, Reported, VALUES};
use library::effects;
pub use library::{Library, SlotRules};
pub use step::Effects;
pub use surroundings::Surroundings;

pub use crate::math::Real;

// The list, by file and type; a new effect goes to the end, under the next number (`kind`).
effects! {
    hydration_bell::HydrationBell,
    speed_log::SpeedLog,
    speed_stribeck::SpeedStribeck,
    viscous_drag::ViscousDrag,
    anisotropy::Anisotropy,
    normal_relaxation::NormalRelaxation,
    contact_ageing::ContactAgeing,
    static_peak::StaticPeak,
    occlusion_growth::OcclusionGrowth,
    adhesion::Adhesion,
    depth_zero_offset::DepthZeroOffset,
    tare_bias::TareBias,
    cross_talk::CrossTalk,
    stiffness_drift::StiffnessDrift,
    subject_size::SubjectSize,
    strain_stiffening::StrainStiffening,
    temperature::Temperature,
    strength_drift::StrengthDrift,
    strength_run_in::StrengthRunIn,
    force_gain::ForceGain,
}

/// The law of a name.
pub fn find(name: &str) -> Option<&'static Law> {
    LAWS.iter().copied().find(|law| law.name == name)
}
