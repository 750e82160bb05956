//! Isochoric laws in principal stretches: from principal values to tensors [Simo & Taylor 1991].

use wide::f64x8;

use super::{Moduli, Sym};

/// Principal Kirchhoff stresses of an isochoric law and the moduli on its principal axes, MPa.
#[derive(Clone, Copy)]
pub struct Principal {
    /// Stresses tau_A.
    pub tau: [f64x8; 3],
    /// Moduli c_AABB, the geometric part −2 tau_A on the diagonal included.
    pub normal: [[f64x8; 3]; 3],
    /// Moduli c_ABAB of the pairs of axes in the order of [`AXIS_PAIRS`].
    pub shear: [f64x8; 3],
}

/// Pairs of axes in the order of [`Principal::shear`].
pub const AXIS_PAIRS: [(usize, usize); 3] = [(0, 1), (1, 2), (0, 2)];

impl Principal {
    /// Sum of two laws on the same axes.
    pub fn plus(mut self, other: &Self) -> Self {
        for a in 0..3 {
            self.tau[a] += other.tau[a];
            self.shear[a] += other.shear[a];
            for e in 0..3 {
                self.normal[a][e] += other.normal[a][e];
            }
        }
        self
    }

    /// Stress and moduli with the principal axes (unit vectors).
    pub fn on(&self, axes: &[[f64x8; 3]; 3]) -> Moduli {
        let m: [Sym<f64x8>; 3] = std::array::from_fn(|a| dyad(&axes[a]));
        let mut c = [[f64x8::ZERO; 6]; 6];
        // sum_AB c_AABB m_A m_B, as m_A (sum_B c_AABB m_B).
        for a in 0..3 {
            let mut row = [f64x8::ZERO; 6];
            for e in 0..3 {
                for k in 0..6 {
                    row[k] = m[e][k].mul_add(self.normal[a][e], row[k]);
                }
            }
            add_outer(&mut c, &m[a], &row);
        }
        for ((a, e), shear) in AXIS_PAIRS.into_iter().zip(self.shear) {
            let s = symmetric_product(&axes[a], &axes[e]);
            let scaled: Sym<f64x8> = std::array::from_fn(|k| s[k] * shear);
            add_outer(&mut c, &s, &scaled);
        }
        Moduli { tau: stress_on(&self.tau, axes), c }
    }
}

/// Stress tensor with principal values `tau` on `axes` (unit vectors).
pub fn stress_on(tau: &[f64x8; 3], axes: &[[f64x8; 3]; 3]) -> Sym<f64x8> {
    let mut out = [f64x8::ZERO; 6];
    for (t, n) in tau.iter().zip(axes) {
        let m = dyad(n);
        for k in 0..6 {
            out[k] = m[k].mul_add(*t, out[k]);
        }
    }
    out
}

pub(super) fn dyad(n: &[f64x8; 3]) -> Sym<f64x8> {
    [n[0] * n[0], n[1] * n[1], n[2] * n[2], n[0] * n[1], n[1] * n[2], n[0] * n[2]]
}

/// `n m + m n`, components.
pub(super) fn symmetric_product(n: &[f64x8; 3], m: &[f64x8; 3]) -> Sym<f64x8> {
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

pub(super) fn add_outer(c: &mut [[f64x8; 6]; 6], left: &Sym<f64x8>, right: &Sym<f64x8>) {
    for i in 0..6 {
        for k in 0..6 {
            c[i][k] = left[i].mul_add(right[k], c[i][k]);
        }
    }
}
