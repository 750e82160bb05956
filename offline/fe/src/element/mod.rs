//! Element kernels: shape functions, quadrature, internal force, tangent; eight elements at a time.
//!
//! Main types: [`Batch`], [`Constitutive`], [`Hex8`], [`Tet4`], [`Tet10`], [`ElementStress`].
//! May use: nothing of this crate.

mod enclosed;
mod kernel;
mod shape;
mod stress;
mod tet10;

pub use kernel::{Batch, Constitutive, Forces, Gradient, Hex8, Tangent, Tet4};
pub use shape::{GAUSS_1D_2, gauss_legendre, hex8_gradient, quad4, quad4_gradient};
pub use stress::ElementStress;
pub use tet10::Tet10;
