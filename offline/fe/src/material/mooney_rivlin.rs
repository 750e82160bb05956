//! Isochoric Mooney-Rivlin law.

use wide::f64x8;

use super::invariants::{Isochoric, Slopes};
use super::{Hyperelastic, Moduli, Sym};

/// Mooney-Rivlin (Mooney 1940, Rivlin 1948): `U = C10 (I1 − 3) + C01 (I2 − 3) + (J − 1)²/D`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MooneyRivlin {
    /// Constant of the first invariant, MPa.
    pub c10_mpa: f64,
    /// Constant of the second invariant, MPa; `C10 + C01 > 0`.
    pub c01_mpa: f64,
    /// Compressibility, 1/MPa, > 0.
    pub d_per_mpa: f64,
}

impl MooneyRivlin {
    fn slopes(&self) -> Slopes {
        Slopes { w1: f64x8::splat(self.c10_mpa), w2: f64x8::splat(self.c01_mpa), w11: f64x8::ZERO }
    }
}

impl Hyperelastic for MooneyRivlin {
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        let state = Isochoric::new(b, j);
        let three = f64x8::splat(3.0);
        (state.i1 - three) * f64x8::splat(self.c10_mpa) + (state.i2 - three) * f64x8::splat(self.c01_mpa)
    }

    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        Isochoric::new(b, j).stress(&self.slopes())
    }

    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        Isochoric::new(b, j).moduli(&self.slopes())
    }

    fn shear_mpa(&self) -> f64 {
        2.0 * (self.c10_mpa + self.c01_mpa)
    }

    fn d_per_mpa(&self) -> f64 {
        self.d_per_mpa
    }

    fn stiffened(self, factor: f64) -> Self {
        Self { c10_mpa: self.c10_mpa * factor, c01_mpa: self.c01_mpa * factor, d_per_mpa: self.d_per_mpa / factor }
    }
}
