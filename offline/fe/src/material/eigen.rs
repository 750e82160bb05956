//! Eigenvalues and eigenvectors of eight symmetric 3x3 matrices at once, by cyclic Jacobi rotations.

use wide::f64x8;

use super::Sym;

/// Eigenvalues (unordered) and eigenvectors (`vectors[k]` belongs to `values[k]`, unit length, orthogonal).
///
/// Five sweeps without branches; the off-diagonal left is below 1e-15 of the largest eigenvalue for any
/// matrix whose eigenvalues span less than 1e8. Equal eigenvalues are no special case.
pub fn jacobi(a: &Sym<f64x8>) -> ([f64x8; 3], [[f64x8; 3]; 3]) {
    let (zero, one) = (f64x8::ZERO, f64x8::ONE);
    let mut d = [a[0], a[1], a[2]];
    // Off-diagonals by the index that they do not touch: o[2] = xy, o[0] = yz, o[1] = xz.
    let mut o = [a[4], a[5], a[3]];
    let mut v = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    for _sweep in 0..4 {
        for (p, q, r) in [(0usize, 1usize, 2usize), (0, 2, 1), (1, 2, 0)] {
            // Rotation in the p-q plane that zeroes o[r]; q's partner off-diagonals are o[p] (q,r), o[q] (p,r).
            let apq = o[r];
            let diff = d[q] - d[p];
            let two_apq = apq + apq;
            let root = (diff * diff + two_apq * two_apq).sqrt();
            // t = sign(diff) * 2 apq / (|diff| + root); safe when everything is zero.
            let denom = diff.abs() + root;
            let safe = denom.simd_eq(zero).select(one, denom);
            let t = two_apq.copysign_of(diff) / safe;
            let c = one / (t * t + one).sqrt();
            let s = t * c;
            d[p] -= t * apq;
            d[q] += t * apq;
            o[r] = zero;
            let (arp, arq) = (o[q], o[p]);
            o[q] = c * arp - s * arq;
            o[p] = s * arp + c * arq;
            for k in 0..3 {
                let (vp, vq) = (v[p][k], v[q][k]);
                v[p][k] = c * vp - s * vq;
                v[q][k] = s * vp + c * vq;
            }
        }
    }
    (d, v)
}

trait CopySign {
    fn copysign_of(self, sign: Self) -> Self;
}

impl CopySign for f64x8 {
    /// `self` with its sign flipped where `sign` is negative.
    fn copysign_of(self, sign: f64x8) -> f64x8 {
        sign.is_sign_negative().select(-self, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rebuilds_the_matrix() {
        // Separated, twice equal, thrice equal, nearly equal, sheared strongly.
        let cases = [
            [2.0, 1.0, 0.5, 0.3, -0.2, 0.1],
            [1.0, 1.0, 2.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0 + 1e-9, 1.0, 1e-10, 0.0, 1e-9],
            [5.0, 1.0, 1.0, 2.0, 0.0, 0.0],
            [1e-3, 4.0, 9.0, 0.01, 5.0, 0.02],
            [1.1, 0.9, 1.0, 0.4, 0.4, 0.4],
            [3.0, 0.2, 0.7, -0.5, 0.1, 0.9],
        ];
        let packed: Sym<f64x8> = std::array::from_fn(|k| f64x8::new(std::array::from_fn(|lane| cases[lane][k])));
        let (values, vectors) = jacobi(&packed);
        let index = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
        for (k, (i, j)) in index.into_iter().enumerate() {
            let mut rebuilt = f64x8::ZERO;
            for e in 0..3 {
                rebuilt += values[e] * vectors[e][i] * vectors[e][j];
            }
            let error = (rebuilt - packed[k]).to_array();
            for (lane, e) in error.iter().enumerate() {
                assert!(e.abs() < 5e-14, "case {lane} component {k}: error {e:e}");
            }
        }
    }
}
