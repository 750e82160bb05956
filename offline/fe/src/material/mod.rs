//! Constitutive laws: deformation in, stress and moduli out, eight points at a time.
//!
//! Main types: [`Material`] (the law of a region, any of them), [`Hyperelastic`] (common parts of the soft laws),
//! [`Moduli`]. Every law works in the current configuration: it returns the Kirchhoff stress `tau = J sigma` (MPa) and
//! the corresponding moduli `c`, so that the internal force of a node with spatial shape gradient `g` is `w tau g` and
//! the tangent `w (g_a . c . g_b + (g_a . tau g_b) I)`, `w` the undeformed volume of the point. Symmetric tensors are
//! stored as six components in the order xx, yy, zz, xy, yz, xz. May use: nothing of this crate.

mod eigen;
mod hyperelastic;
mod invariants;
pub(crate) mod logarithmic;
mod mooney_rivlin;
mod neo_hooke;
mod ogden;
pub(crate) mod partly;
mod plausible;
pub(crate) mod presets;
mod principal;
pub mod relaxation;
mod stability;
mod svk;
mod yeoh;

pub use hyperelastic::Hyperelastic;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hooke::NeoHooke;
pub use ogden::{MOST_OGDEN_TERMS, Ogden, OgdenSeries, OgdenTerm};
pub use plausible::{Doubt, Stiffness};
pub use presets::{ASSUMED_POISSON, PRESETS, Preset};
pub use stability::{STABLE_STRETCHES, first_instability};
pub use svk::SaintVenantKirchhoff;
use wide::f64x8;
pub use yeoh::Yeoh;

/// The law of a region.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Material {
    /// Isochoric neo-Hooke with mean dilatation; also the law given by Young's modulus and Poisson's ratio.
    NeoHooke(NeoHooke),
    /// Isochoric Mooney-Rivlin with mean dilatation.
    MooneyRivlin(MooneyRivlin),
    /// Isochoric Yeoh with mean dilatation.
    Yeoh(Yeoh),
    /// Isochoric Ogden of several terms with mean dilatation.
    #[serde(rename = "ogden")]
    OgdenSeries(OgdenSeries),
    /// Bone, nail: linear elasticity in a total-Lagrangian frame.
    #[serde(rename = "saint_venant_kirchhoff")]
    Linear(SaintVenantKirchhoff),
    /// Isochoric Ogden of one term with mean dilatation; a file gives its constants alone.
    #[serde(untagged)]
    Ogden(Ogden),
}

impl Material {
    /// Shear modulus at small strain, MPa.
    pub fn shear_mpa(&self) -> f64 {
        match self {
            Self::NeoHooke(law) => law.shear_mpa(),
            Self::MooneyRivlin(law) => law.shear_mpa(),
            Self::Yeoh(law) => law.shear_mpa(),
            Self::OgdenSeries(law) => law.shear_mpa(),
            Self::Linear(law) => lame_from_young(law.young_mpa, law.poisson).1,
            Self::Ogden(law) => law.shear_mpa(),
        }
    }

    /// Young's modulus at small strain, MPa.
    pub fn young_mpa(&self) -> f64 {
        let poisson = match self {
            Self::NeoHooke(law) => law.poisson(),
            Self::MooneyRivlin(law) => law.poisson(),
            Self::Yeoh(law) => law.poisson(),
            Self::OgdenSeries(law) => law.poisson(),
            Self::Linear(law) => law.poisson,
            Self::Ogden(law) => law.poisson(),
        };
        2.0 * (1.0 + poisson) * self.shear_mpa()
    }

    /// The law all of whose stresses are `factor` (> 0) times as large at the same deformation.
    pub fn stiffened(self, factor: f64) -> Self {
        match self {
            Self::NeoHooke(law) => Self::NeoHooke(law.stiffened(factor)),
            Self::MooneyRivlin(law) => Self::MooneyRivlin(law.stiffened(factor)),
            Self::Yeoh(law) => Self::Yeoh(law.stiffened(factor)),
            Self::OgdenSeries(law) => Self::OgdenSeries(law.stiffened(factor)),
            Self::Linear(law) => Self::Linear(law.stiffened(factor)),
            Self::Ogden(law) => Self::Ogden(law.stiffened(factor)),
        }
    }
}

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

/// Indices of the six components.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
/// Place of component (i, j) among the six.
const COMPONENT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// `b b`, components.
fn square(b: &Sym<f64x8>) -> Sym<f64x8> {
    std::array::from_fn(|n| {
        let (i, j) = PAIRS[n];
        let mut sum = f64x8::ZERO;
        for k in 0..3 {
            sum += b[COMPONENT[i][k]] * b[COMPONENT[k][j]];
        }
        sum
    })
}
