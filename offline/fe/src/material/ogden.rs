//! Isochoric Ogden law with one term.

use wide::f64x8;

use super::{Moduli, Sym, eigen::jacobi};

/// Deviatoric part of a one-term Ogden law (Ogden 1972), with the volumetric part kept apart because the
/// element averages it (mean dilatation).
///
/// `U = 2 mu/alpha² (l1^alpha + l2^alpha + l3^alpha − 3) + (J − 1)²/D`, `l_k = J^(-1/3) lambda_k` the isochoric
/// principal stretches. `alpha = 2` is the neo-Hookean law with shear modulus `mu`; the small-strain shear
/// modulus is `mu` for every `alpha`, the bulk modulus `2/D`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ogden {
    /// Shear modulus, MPa, > 0.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub mu_mpa: f64,
    /// Exponent, not 0.
    #[serde(deserialize_with = "fingerpad_formats::units::finite")]
    pub alpha: f64,
    /// Compressibility, 1/MPa, > 0.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub d_per_mpa: f64,
}

impl Ogden {
    /// Volumetric pressure-like derivative `dU/dJ = 2 (J − 1)/D`, MPa, tension positive.
    pub fn volumetric_slope(&self, j: f64x8) -> f64x8 {
        (j - f64x8::ONE) * f64x8::splat(2.0 / self.d_per_mpa)
    }

    /// `d²U/dJ²`, MPa.
    pub fn volumetric_curvature(&self) -> f64 {
        2.0 / self.d_per_mpa
    }

    /// Poisson's ratio of the small-strain law.
    pub fn poisson(&self) -> f64 {
        let bulk = 2.0 / self.d_per_mpa;
        (3.0 * bulk - 2.0 * self.mu_mpa) / (6.0 * bulk + 2.0 * self.mu_mpa)
    }

    /// Isochoric strain energy per undeformed volume, MPa; `b = F F^T`, `j = det F`.
    pub fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        let (squares, _) = jacobi(b);
        let power = self.isochoric_powers(&squares, j);
        (power[0] + power[1] + power[2] - f64x8::splat(3.0))
            * f64x8::splat(2.0 * self.mu_mpa / (self.alpha * self.alpha))
    }

    /// Isochoric Kirchhoff stress, MPa (traceless).
    pub fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        let (squares, axes) = jacobi(b);
        let (tau, _) = self.principal_stress(&squares, j);
        let mut out = [f64x8::ZERO; 6];
        for (t, n) in tau.iter().zip(&axes) {
            let m = dyad(n);
            for k in 0..6 {
                out[k] = m[k].mul_add(*t, out[k]);
            }
        }
        out
    }

    /// Isochoric Kirchhoff stress with its moduli.
    ///
    /// Principal-axis form (Simo & Taylor 1991); the quotient that becomes 0/0 at equal stretches is
    /// evaluated as a ratio of hyperbolic sines, so that no stretch state is special.
    pub fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        let (squares, axes) = jacobi(b);
        let (tau, beta) = self.principal_stress(&squares, j);
        let alpha = f64x8::splat(self.alpha);
        let third = f64x8::splat(1.0 / 3.0);
        let sum_ninth = (beta[0] + beta[1] + beta[2]) * f64x8::splat(1.0 / 9.0);
        let m: [Sym<f64x8>; 3] = std::array::from_fn(|a| dyad(&axes[a]));
        let mut c = [[f64x8::ZERO; 6]; 6];
        // sum_AB c_AABB m_A m_B, as m_A (sum_B c_AABB m_B).
        for a in 0..3 {
            let mut row = [f64x8::ZERO; 6];
            for e in 0..3 {
                let mut modulus = alpha * (sum_ninth - (beta[a] + beta[e]) * third);
                if a == e {
                    modulus += alpha * beta[a] - (tau[a] + tau[a]);
                }
                for k in 0..6 {
                    row[k] = m[e][k].mul_add(modulus, row[k]);
                }
            }
            add_outer(&mut c, &m[a], &row);
        }
        for (a, e) in [(0, 1), (1, 2), (0, 2)] {
            let shear = self.divided_difference(squares[a], squares[e], beta[a], beta[e]) * squares[e] - tau[e];
            let s = symmetric_product(&axes[a], &axes[e]);
            let scaled: Sym<f64x8> = std::array::from_fn(|k| s[k] * shear);
            add_outer(&mut c, &s, &scaled);
        }
        let mut stress = [f64x8::ZERO; 6];
        for a in 0..3 {
            for k in 0..6 {
                stress[k] = m[a][k].mul_add(tau[a], stress[k]);
            }
        }
        Moduli { tau: stress, c }
    }

    /// `l_k^alpha` of the isochoric stretches.
    fn isochoric_powers(&self, squares: &[f64x8; 3], j: f64x8) -> [f64x8; 3] {
        let half = f64x8::splat(0.5 * self.alpha);
        let mean = j.ln() * f64x8::splat(2.0 / 3.0);
        std::array::from_fn(|k| ((squares[k].ln() - mean) * half).exp())
    }

    /// Principal Kirchhoff stresses and `beta_A = (2 mu/alpha) l_A^alpha`.
    fn principal_stress(&self, squares: &[f64x8; 3], j: f64x8) -> ([f64x8; 3], [f64x8; 3]) {
        let factor = f64x8::splat(2.0 * self.mu_mpa / self.alpha);
        let power = self.isochoric_powers(squares, j);
        let beta: [f64x8; 3] = std::array::from_fn(|k| power[k] * factor);
        let mean = (beta[0] + beta[1] + beta[2]) * f64x8::splat(1.0 / 3.0);
        (std::array::from_fn(|k| beta[k] - mean), beta)
    }

    /// `(beta_A − beta_B)/(lambda_A² − lambda_B²)`, smooth through equal stretches.
    fn divided_difference(&self, a: f64x8, b: f64x8, beta_a: f64x8, beta_b: f64x8) -> f64x8 {
        // With half the log difference d = (ln l_A − ln l_B)/2 and geometric means:
        // (beta_A − beta_B)/(a − b) = sqrt(beta_A beta_B/(a b)) sinh(alpha d)/sinh(2 d).
        let diff = a - b;
        let near = diff.abs().simd_lt((a + b) * f64x8::splat(0.5e-2));
        let direct = (beta_a - beta_b) / near.select(f64x8::ONE, diff);
        let x = diff / (a + b); // = tanh(2 d)
        let two_d = x * (f64x8::ONE + x * x * (f64x8::splat(1.0 / 3.0) + x * x * f64x8::splat(0.2)));
        let d2 = two_d * two_d * f64x8::splat(0.25);
        let al2 = self.alpha * self.alpha;
        let numerator = f64x8::ONE + d2 * (f64x8::splat(al2 / 6.0) + d2 * f64x8::splat(al2 * al2 / 120.0));
        let denominator = f64x8::ONE + d2 * (f64x8::splat(4.0 / 6.0) + d2 * f64x8::splat(16.0 / 120.0));
        // 2 mu/alpha must keep its sign under the root.
        let sign = f64x8::splat(self.alpha.signum());
        let series =
            sign * (beta_a * beta_b / (a * b)).sqrt() * f64x8::splat(0.5 * self.alpha) * numerator / denominator;
        near.select(series, direct)
    }
}

fn dyad(n: &[f64x8; 3]) -> Sym<f64x8> {
    [n[0] * n[0], n[1] * n[1], n[2] * n[2], n[0] * n[1], n[1] * n[2], n[0] * n[2]]
}

/// `n m + m n`, components.
fn symmetric_product(n: &[f64x8; 3], m: &[f64x8; 3]) -> Sym<f64x8> {
    let two = f64x8::splat(2.0);
    [
        two * n[0] * m[0],
        two * n[1] * m[1],
        two * n[2] * m[2],
        n[0] * m[1] + n[1] * m[0],
        n[1] * m[2] + n[2] * m[1],
        n[0] * m[2] + n[2] * m[0],
    ]
}

fn add_outer(c: &mut [[f64x8; 6]; 6], left: &Sym<f64x8>, right: &Sym<f64x8>) {
    for i in 0..6 {
        for k in 0..6 {
            c[i][k] = left[i].mul_add(right[k], c[i][k]);
        }
    }
}
