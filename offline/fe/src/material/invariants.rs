//! Stress and moduli of isochoric laws in the invariants of `b' = J^(-2/3) b`.
//!
//! For an energy `W(I1, I2)`, `I1 = tr b'`, `I2 = (I1² − tr b'²)/2` [Holzapfel 2000, section 6.6]:
//! the Kirchhoff stress is the deviator of `t = 2 ((W_1 + I1 W_2) b' − W_2 b'²)`.

use wide::f64x8;

use super::{COMPONENT, Moduli, PAIRS, Sym, square};

/// Isochoric left Cauchy-Green tensor with its square and invariants.
pub struct Isochoric {
    b: Sym<f64x8>,
    b2: Sym<f64x8>,
    /// `tr b'`.
    pub i1: f64x8,
    /// `(I1² − tr b'²)/2`.
    pub i2: f64x8,
}

/// Derivatives of the energy over the invariants, MPa; W_2 is constant in all laws here.
pub struct Slopes {
    /// dW/dI1.
    pub w1: f64x8,
    /// dW/dI2.
    pub w2: f64x8,
    /// d²W/dI1².
    pub w11: f64x8,
}

impl Isochoric {
    /// Of `b = F F^T` and `j = det F`.
    pub fn new(b: &Sym<f64x8>, j: f64x8) -> Self {
        let factor = (j.ln() * f64x8::splat(-2.0 / 3.0)).exp();
        let b = b.map(|component| component * factor);
        let b2 = square(&b);
        let i1 = trace(&b);
        Self { b, b2, i1, i2: (i1 * i1 - trace(&b2)) * f64x8::splat(0.5) }
    }

    /// Kirchhoff stress, MPa.
    pub fn stress(&self, slopes: &Slopes) -> Sym<f64x8> {
        let t = self.fictitious(slopes);
        let mean = trace(&t) * f64x8::splat(1.0 / 3.0);
        std::array::from_fn(|k| if k < 3 { t[k] - mean } else { t[k] })
    }

    /// Kirchhoff stress with its moduli
    /// `P : h : P + 2/3 tr(t) (sym − I I/3) − 2/3 (tau I + I tau)`, P the projection on deviators and
    /// `h = 4 ((W_11 + W_2) b' b' − W_2 sym(b' b'))` with `sym(b' b')_ijkl = (b'_ik b'_jl + b'_il b'_jk)/2`.
    pub fn moduli(&self, slopes: &Slopes) -> Moduli {
        let Self { b, b2, i1, .. } = self;
        let (third, two_thirds) = (f64x8::splat(1.0 / 3.0), f64x8::splat(2.0 / 3.0));
        let outer = (slopes.w11 + slopes.w2) * f64x8::splat(4.0);
        let inner = slopes.w2 * f64x8::splat(2.0);
        // h : I and its trace.
        let h: Sym<f64x8> = std::array::from_fn(|k| outer * *i1 * b[k] - (inner + inner) * b2[k]);
        let h_trace = trace(&h) * f64x8::splat(1.0 / 9.0);
        let tau = self.stress(slopes);
        let spread = trace(&self.fictitious(slopes)) * two_thirds;
        let full = |i: usize, j: usize| b[COMPONENT[i][j]];
        let mut c = [[f64x8::ZERO; 6]; 6];
        for (row, (i, j)) in PAIRS.into_iter().enumerate() {
            for (col, (k, l)) in PAIRS.into_iter().enumerate().take(row + 1) {
                let mut entry = outer * b[row] * b[col] - inner * (full(i, k) * full(j, l) + full(i, l) * full(j, k));
                if k == l {
                    entry -= h[row] * third + tau[row] * two_thirds;
                }
                if i == j {
                    entry -= h[col] * third + tau[col] * two_thirds;
                }
                if i == j && k == l {
                    entry += h_trace - spread * third;
                }
                if row == col {
                    entry += spread * f64x8::splat(if row < 3 { 1.0 } else { 0.5 });
                }
                c[row][col] = entry;
                c[col][row] = entry;
            }
        }
        Moduli { tau, c }
    }

    /// `t = 2 ((W_1 + I1 W_2) b' − W_2 b'²)`, MPa.
    fn fictitious(&self, slopes: &Slopes) -> Sym<f64x8> {
        let two = f64x8::splat(2.0);
        let (first, second) = ((slopes.w1 + self.i1 * slopes.w2) * two, slopes.w2 * two);
        std::array::from_fn(|k| first * self.b[k] - second * self.b2[k])
    }
}

fn trace(b: &Sym<f64x8>) -> f64x8 {
    b[0] + b[1] + b[2]
}
