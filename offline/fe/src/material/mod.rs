//! Constitutive laws: deformation in, stress and moduli out, eight points at a time.
//!
//! Main types: [`Ogden`], [`SaintVenantKirchhoff`], [`Moduli`].
//! Every law answers in the current configuration: Kirchhoff stress `tau = J sigma` (MPa) and the moduli `c`
//! that belong to it, so that the internal force of a node with spatial shape gradient `g` is `w tau g` and
//! the tangent `w (g_a . c . g_b + (g_a . tau g_b) I)`, `w` the undeformed volume of the point.
//! Symmetric tensors are stored as six components in the order xx, yy, zz, xy, yz, xz.
//! May use: nothing of this crate.

mod eigen;
mod ogden;
pub(crate) mod partly;
mod svk;

pub use ogden::Ogden;
pub use svk::SaintVenantKirchhoff;
use wide::f64x8;

/// Symmetric tensor: xx, yy, zz, xy, yz, xz.
pub type Sym<T> = [T; 6];

/// Kirchhoff stress with its consistent moduli at eight points.
#[derive(Clone, Copy)]
pub struct Moduli {
    /// Kirchhoff stress, MPa.
    pub tau: Sym<f64x8>,
    /// Spatial moduli c_ijkl in the same six-component order, MPa, shape (6, 6), symmetric.
    pub c: [[f64x8; 6]; 6],
}

/// Young's modulus and Poisson's ratio as Lamé constants (lambda, mu), MPa.
pub fn lame_from_young(young_mpa: f64, poisson: f64) -> (f64, f64) {
    (young_mpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young_mpa / (2.0 * (1.0 + poisson)))
}
