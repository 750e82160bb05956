//! Stresses that belong to the logarithmic strain `E = ln(F^T F)/2`, in the undeformed frame, and their way to the current one.
//!
//! A stress `T` of that frame does the work `T : dE`. With the principal stretches `l_A` and axes `N_A`, `n_A` of the undeformed and
//! of the current frame, a constant `T` acts as the Kirchhoff stress `tau_AB = T_AB y_AB`, `y = d/sinh d`, `d = ln(l_A/l_B)`, and has the
//! moduli of the energy `T : E` [Miehe & Lambrecht 2001; Daleckii & Krein].

use wide::f64x8;

use super::eigen::jacobi;
use super::principal::{add_outer, dyad, symmetric_product};
use super::{COMPONENT, Moduli, PAIRS, Sym};

/// Principal stretches of eight points with their axes in both frames.
pub struct Stretches {
    /// Squares of the principal stretches.
    squares: [f64x8; 3],
    logarithms: [f64x8; 3],
    /// Unit vectors in the current frame.
    current: [[f64x8; 3]; 3],
    /// Unit vectors in the undeformed frame.
    undeformed: [[f64x8; 3]; 3],
}

/// Relative difference of two squares below which quotients are evaluated as series.
const NEAR: f64 = 1e-2;
/// The same for three squares: the whole spread.
const ALL_NEAR: f64 = 3e-2;

impl Stretches {
    /// Of a deformation gradient, with `b = F F^T`.
    pub fn new(f: &[[f64x8; 3]; 3], b: &Sym<f64x8>) -> Self {
        let (squares, current) = jacobi(b);
        let undeformed = std::array::from_fn(|a| {
            let over = f64x8::ONE / squares[a].sqrt();
            let n = &current[a];
            std::array::from_fn(|k| (f[0][k] * n[0] + f[1][k] * n[1] + f[2][k] * n[2]) * over)
        });
        Self { squares, logarithms: squares.map(f64x8::ln), current, undeformed }
    }

    /// The stress of the undeformed frame that a Kirchhoff stress on the axes of stretch is (MPa): that of an isotropic law.
    pub fn turned_back(&self, tau: &Sym<f64x8>) -> Sym<f64x8> {
        let mut out = [f64x8::ZERO; 6];
        for (n, undeformed) in self.current.iter().zip(&self.undeformed) {
            let principal = between(tau, n, n);
            for (out, m) in out.iter_mut().zip(dyad(undeformed)) {
                *out = m.mul_add(principal, *out);
            }
        }
        out
    }

    /// The logarithmic strain times a stress of the undeformed frame, MPa.
    pub fn energy(&self, stress: &Sym<f64x8>) -> f64x8 {
        let of_axis = |a: usize| between(stress, &self.undeformed[a], &self.undeformed[a]) * self.logarithms[a];
        (of_axis(0) + of_axis(1) + of_axis(2)) * f64x8::HALF
    }

    /// The Kirchhoff stress as which a stress of the undeformed frame acts, MPa.
    pub fn stress(&self, stress: &Sym<f64x8>) -> Sym<f64x8> {
        self.on_axes(&self.principal_stress(&self.on_undeformed(stress)))
    }

    /// The same with its moduli.
    pub fn moduli(&self, stress: &Sym<f64x8>) -> Moduli {
        let on_axes = self.on_undeformed(stress);
        let tau = self.on_axes(&self.principal_stress(&on_axes));
        // d : c : d = sum h_AB m_AGB d_AG d_GB on the axes.
        let mut k = [[f64x8::ZERO; 6]; 6];
        let second = self.second_differences();
        for a in 0..3 {
            for g in 0..3 {
                for e in 0..3 {
                    let part = on_axes[COMPONENT[a][e]] * second[a][g][e];
                    let (p, r) = (COMPONENT[a][g], COMPONENT[g][e]);
                    k[p][r] += part;
                    k[r][p] += part;
                }
            }
        }
        let n = &self.current;
        let dyads: [Sym<f64x8>; 6] = std::array::from_fn(|p| {
            let (a, e) = PAIRS[p];
            if a == e { dyad(&n[a]) } else { symmetric_product(&n[a], &n[e]).map(|s| s * f64x8::HALF) }
        });
        let mut c = [[f64x8::ZERO; 6]; 6];
        for p in 0..6 {
            let mut row = [f64x8::ZERO; 6];
            for r in 0..6 {
                for (row, d) in row.iter_mut().zip(&dyads[r]) {
                    *row = d.mul_add(k[p][r], *row);
                }
            }
            add_outer(&mut c, &dyads[p], &row);
        }
        Moduli { tau, c }
    }

    /// Components on the undeformed axes.
    fn on_undeformed(&self, stress: &Sym<f64x8>) -> Sym<f64x8> {
        PAIRS.map(|(a, e)| between(stress, &self.undeformed[a], &self.undeformed[e]))
    }

    /// The tensor with these components on the current axes.
    fn on_axes(&self, components: &Sym<f64x8>) -> Sym<f64x8> {
        let n = &self.current;
        let mut out = [f64x8::ZERO; 6];
        for ((a, e), value) in PAIRS.into_iter().zip(components) {
            let part = if a == e { dyad(&n[a]) } else { symmetric_product(&n[a], &n[e]) };
            for (out, part) in out.iter_mut().zip(part) {
                *out = part.mul_add(*value, *out);
            }
        }
        out
    }

    fn principal_stress(&self, on_axes: &Sym<f64x8>) -> Sym<f64x8> {
        std::array::from_fn(|p| {
            let (a, e) = PAIRS[p];
            if a == e { on_axes[p] } else { on_axes[p] * self.quotient(a, e) }
        })
    }

    /// `l_A l_B (ln c_A − ln c_B)/(c_A − c_B)`.
    fn quotient(&self, a: usize, e: usize) -> f64x8 {
        let [a, e] = [a, e].map(|k| (self.squares[k], self.logarithms[k]));
        first_difference(a, e) * (a.0 * e.0).sqrt()
    }

    /// `2 l_A l_G² l_B` times the second divided difference of the logarithm at the squares: half of `m_AGB`.
    fn second_differences(&self) -> [[[f64x8; 3]; 3]; 3] {
        let point = |k: usize| (self.squares[k], self.logarithms[k]);
        let roots = self.squares.map(f64x8::sqrt);
        let two = f64x8::splat(2.0);
        // Two equal squares, and all different.
        let same: [[f64x8; 3]; 3] =
            std::array::from_fn(|a| std::array::from_fn(|e| second_difference(point(a), point(a), point(e))));
        let [low, middle, high] = sorted([point(0), point(1), point(2)]);
        let different = second_difference(low, middle, high);
        let mut out = [[[f64x8::ZERO; 3]; 3]; 3];
        for a in 0..3 {
            for g in 0..3 {
                for e in 0..3 {
                    let difference = if a == g {
                        same[a][e]
                    } else if g == e {
                        same[g][a]
                    } else if a == e {
                        same[a][g]
                    } else {
                        different
                    };
                    out[a][g][e] = two * roots[a] * self.squares[g] * roots[e] * difference;
                }
            }
        }
        out
    }
}

/// `u stress v`.
fn between(stress: &Sym<f64x8>, u: &[f64x8; 3], v: &[f64x8; 3]) -> f64x8 {
    let row =
        |i: usize| stress[COMPONENT[i][0]] * v[0] + stress[COMPONENT[i][1]] * v[1] + stress[COMPONENT[i][2]] * v[2];
    u[0] * row(0) + u[1] * row(1) + u[2] * row(2)
}

/// A number with its logarithm.
type Point = (f64x8, f64x8);

/// `(ln a − ln b)/(a − b)`, smooth through equal numbers.
fn first_difference((a, ln_a): Point, (b, ln_b): Point) -> f64x8 {
    let (difference, sum) = (a - b, a + b);
    let near = difference.abs().simd_lt(sum * f64x8::splat(NEAR));
    let direct = (ln_a - ln_b) / near.select(f64x8::ONE, difference);
    // ln(a/b) = 2 artanh x with x = (a − b)/(a + b).
    let x2 = (difference / sum) * (difference / sum);
    let [third, fifth, seventh] = [3.0, 5.0, 7.0].map(|n| f64x8::splat(1.0 / n));
    let series = (f64x8::ONE + x2 * (third + x2 * (fifth + x2 * seventh))) * f64x8::splat(2.0) / sum;
    near.select(series, direct)
}

/// Second divided difference of the logarithm; `middle` lies between the others.
fn second_difference(low: Point, middle: Point, high: Point) -> f64x8 {
    let mean = (low.0 + middle.0 + high.0) * f64x8::splat(1.0 / 3.0);
    let spread = high.0 - low.0;
    let near = spread.abs().simd_lt(mean * f64x8::splat(ALL_NEAR));
    let direct = (first_difference(middle, high) - first_difference(low, middle)) / near.select(f64x8::ONE, spread);
    // About the mean: −sum_k (−1)^k h_k/((k + 2) mean²), h_k the complete symmetric polynomials of the relative deviations; h_1 = 0.
    let [x, y, z] = [low, middle, high].map(|p| p.0 / mean - f64x8::ONE);
    let (e2, e3) = (x * y + y * z + z * x, x * y * z);
    // With e_1 = 0: h_2 = −e_2, h_3 = e_3, h_4 = e_2², h_5 = −2 e_2 e_3.
    let terms = [(0.5, f64x8::ONE), (0.25, -e2), (-0.2, e3), (1.0 / 6.0, e2 * e2), (2.0 / 7.0, e2 * e3)];
    let series = terms.into_iter().fold(f64x8::ZERO, |sum, (factor, h)| h.mul_add(f64x8::splat(factor), sum));
    near.select(-series / (mean * mean), direct)
}

/// Three numbers, rising.
fn sorted([a, b, c]: [Point; 3]) -> [Point; 3] {
    let order = |a: Point, b: Point| {
        let rises = a.0.simd_lt(b.0);
        ((rises.select(a.0, b.0), rises.select(a.1, b.1)), (rises.select(b.0, a.0), rises.select(b.1, a.1)))
    };
    let (a, b) = order(a, b);
    let (b, c) = order(b, c);
    let (a, b) = order(a, b);
    [a, b, c]
}
