//! Saint Venant-Kirchhoff law: linear elasticity in a total-Lagrangian frame.

use wide::f64x8;

use super::{Moduli, Sym, lame_from_young};

/// Linear elasticity between Green-Lagrange strain and second Piola-Kirchhoff stress: rotation is free of
/// stress, strain is meant to be small (bone, nail).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SaintVenantKirchhoff {
    /// Young's modulus, MPa, > 0.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub young_mpa: f64,
    /// Poisson's ratio, −1 to 0.5 exclusive; 0.3 where a file leaves it out.
    #[serde(default = "usual_poisson", deserialize_with = "fingerpad_formats::units::poisson")]
    pub poisson: f64,
}

fn usual_poisson() -> f64 {
    0.3
}

impl SaintVenantKirchhoff {
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

const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
const COMPONENT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

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
