//! Isochoric Yeoh law.

use wide::f64x8;

use super::invariants::{Isochoric, Slopes};
use super::{Hyperelastic, Moduli, Sym};

/// Yeoh (1993): `U = C10 (I1 − 3) + C20 (I1 − 3)² + C30 (I1 − 3)³ + (J − 1)²/D`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Yeoh {
    /// Constant of the first power, MPa, > 0.
    pub c10_mpa: f64,
    /// Constant of the second power, MPa.
    pub c20_mpa: f64,
    /// Constant of the third power, MPa.
    pub c30_mpa: f64,
    /// Compressibility, 1/MPa, > 0.
    pub d_per_mpa: f64,
}

impl Yeoh {
    fn slopes(&self, i1: f64x8) -> Slopes {
        let [c10, c20, c30] = [self.c10_mpa, self.c20_mpa, self.c30_mpa].map(f64x8::splat);
        let x = i1 - f64x8::splat(3.0);
        let (two, three) = (f64x8::splat(2.0), f64x8::splat(3.0));
        Slopes { w1: c10 + x * (c20 * two + x * c30 * three), w2: f64x8::ZERO, w11: two * (c20 + x * c30 * three) }
    }
}

impl Hyperelastic for Yeoh {
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        let [c10, c20, c30] = [self.c10_mpa, self.c20_mpa, self.c30_mpa].map(f64x8::splat);
        let x = Isochoric::new(b, j).i1 - f64x8::splat(3.0);
        x * (c10 + x * (c20 + x * c30))
    }

    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        let state = Isochoric::new(b, j);
        state.stress(&self.slopes(state.i1))
    }

    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        let state = Isochoric::new(b, j);
        state.moduli(&self.slopes(state.i1))
    }

    fn shear_mpa(&self) -> f64 {
        2.0 * self.c10_mpa
    }

    fn d_per_mpa(&self) -> f64 {
        self.d_per_mpa
    }

    fn stiffened(self, factor: f64) -> Self {
        Self {
            c10_mpa: self.c10_mpa * factor,
            c20_mpa: self.c20_mpa * factor,
            c30_mpa: self.c30_mpa * factor,
            d_per_mpa: self.d_per_mpa / factor,
        }
    }
}
