//! The body without its contact: materials on elements, supports, degrees of freedom, residual and tangent.
//!
//! Main types: [`Body`], [`Configuration`], [`Material`], [`Supports`], [`DofMap`].
//! May use: mesh, element, material.

mod body;
mod configuration;
mod constitutive;
mod dofs;
mod group;
mod relaxing;

pub use body::{Body, BodyError, Joint};
pub use configuration::{Configuration, rotation_vector};
pub use dofs::{DofMap, Supports};
pub use fingerpad_linear::Pattern;
pub use relaxing::{Deformed, TissueMemory, TissueStep};

pub use crate::material::Material;
