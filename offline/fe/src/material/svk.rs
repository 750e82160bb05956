//! Saint Venant-Kirchhoff law: linear elasticity in a total-Lagrangian frame.

use wide::f64x8;

use super::{COMPONENT, Moduli, PAIRS, Sym, lame_from_young, square};

/// Linear elasticity between Green-Lagrange strain and second Piola-Kirchhoff stress: rotation is free of
/// stress, strain is meant to be small (bone, nail).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SaintVenantKirchhoff {
    /// Young's modulus, MPa, > 0.
    pub young_mpa: f64,
    /// Poisson's ratio, −1 to 0.5 exclusive.
    pub poisson: f64,
}

impl SaintVenantKirchhoff {
    /// The law all of whose stresses are `factor` (> 0) times as large at the same deformation.
    pub fn stiffened(self, factor: f64) -> Self {
        Self { young_mpa: self.young_mpa * factor, ..self }
    }

    /// Strain energy per undeformed volume, MPa.
    pub fn energy(&self, b: &Sym<f64x8>) -> f64x8 {
        // tr E and tr E² of E = (C − I)/2 from the invariants that b shares with C.
        let (lambda, mu) = lame_from_young(self.young_mpa, self.poisson);
        let trace = b[0] + b[1] + b[2];
        let b2 = square(b);
        let trace2 = b2[0] + b2[1] + b2[2];
        let three = f64x8::splat(3.0);
        let tr_e = (trace - three) * f64x8::splat(0.5);
        let tr_e2 = (trace2 - trace - trace + three) * f64x8::splat(0.25);
        tr_e * tr_e * f64x8::splat(0.5 * lambda) + tr_e2 * f64x8::splat(mu)
    }

    /// Kirchhoff stress, MPa.
    pub fn stress(&self, b: &Sym<f64x8>) -> Sym<f64x8> {
        let (lambda, mu) = lame_from_young(self.young_mpa, self.poisson);
        let trace = b[0] + b[1] + b[2];
        let factor = (trace - f64x8::splat(3.0)) * f64x8::splat(0.5 * lambda) - f64x8::splat(mu);
        let b2 = square(b);
        std::array::from_fn(|k| factor * b[k] + f64x8::splat(mu) * b2[k])
    }

    /// Kirchhoff stress with its moduli `c_ijkl = lambda b_ij b_kl + mu (b_ik b_jl + b_il b_jk)`.
    pub fn moduli(&self, b: &Sym<f64x8>) -> Moduli {
        let (lambda, mu) = lame_from_young(self.young_mpa, self.poisson);
        let (lambda, mu) = (f64x8::splat(lambda), f64x8::splat(mu));
        let full = |i: usize, j: usize| b[COMPONENT[i][j]];
        let mut c = [[f64x8::ZERO; 6]; 6];
        for (row, (i, j)) in PAIRS.into_iter().enumerate() {
            for (col, (k, l)) in PAIRS.into_iter().enumerate() {
                c[row][col] =
                    lambda * full(i, j) * full(k, l) + mu * (full(i, k) * full(j, l) + full(i, l) * full(j, k));
            }
        }
        Moduli { tau: self.stress(b), c }
    }
}
