//! Volume inside an element's surface of triangles.

use wide::f64x8;

use super::kernel::{Batch, Tangent};

impl<const N: usize, const Q: usize> Batch<N, Q> {
    /// Volume that the surface's triangles enclose, mm³, and its derivatives over the nodes' places, mm².
    pub(super) fn enclosed(&self, x: &[[f64x8; 3]; N]) -> (f64x8, [[f64x8; 3]; N]) {
        let sixth = f64x8::splat(1.0 / 6.0);
        let (mut volume, mut slope) = (f64x8::ZERO, [[f64x8::ZERO; 3]; N]);
        for triangle in self.surface {
            // From the first node, so that little cancels; the surface is closed, so that all origins give the same.
            let at = triangle.map(|n| from_first(x, n));
            for corner in 0..3 {
                let opposite = cross(&at[(corner + 1) % 3], &at[(corner + 2) % 3]).map(|c| c * sixth);
                if corner == 0 {
                    volume += at[0][0] * opposite[0] + at[0][1] * opposite[1] + at[0][2] * opposite[2];
                }
                slope[triangle[corner]].iter_mut().zip(opposite).for_each(|(s, c)| *s += c);
            }
        }
        (volume, slope)
    }

    /// Adds `p` times the second derivatives of the enclosed volume.
    pub(super) fn add_curvature_of_enclosed(&self, x: &[[f64x8; 3]; N], p: f64x8, out: &mut Tangent<N>) {
        let scale = p * f64x8::splat(1.0 / 6.0);
        for triangle in self.surface {
            for corner in 0..3 {
                let [a, b, other] = [0, 1, 2].map(|k| triangle[(corner + k) % 3]);
                let at = from_first(x, other).map(|c| c * scale);
                for i in 0..3 {
                    let (next, last) = ((i + 1) % 3, (i + 2) % 3);
                    // d²v/dx_a dx_b is antisymmetric: e_ikl of the third corner.
                    if a > b {
                        out.block[a][b][i][next] += at[last];
                        out.block[a][b][i][last] -= at[next];
                    } else {
                        out.block[b][a][next][i] += at[last];
                        out.block[b][a][last][i] -= at[next];
                    }
                }
            }
        }
    }
}

fn cross(a: &[f64x8; 3], b: &[f64x8; 3]) -> [f64x8; 3] {
    std::array::from_fn(|i| {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    })
}

/// Place of a node relative to the first, mm.
fn from_first<const N: usize>(x: &[[f64x8; 3]; N], node: usize) -> [f64x8; 3] {
    std::array::from_fn(|i| x[node][i] - x[0][i])
}
