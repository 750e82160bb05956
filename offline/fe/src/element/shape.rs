//! Shape functions of the 8-node hexahedron and the 4-node quadrilateral; Gauss-Legendre rules.

use fingerpad_mesh::HEX_CORNERS;

/// Abscissa of the two-point Gauss-Legendre rule on [−1, 1]; both weights are 1.
pub const GAUSS_1D_2: f64 = 0.577_350_269_189_625_8;

/// Gradients of the trilinear shape functions at `xi`, shape (8, 3), per unit of the reference cube.
pub fn hex8_gradient(xi: [f64; 3]) -> [[f64; 3]; 8] {
    HEX_CORNERS.map(|c| {
        let f = [0, 1, 2].map(|k| 1.0 + c[k] * xi[k]);
        [0.125 * c[0] * f[1] * f[2], 0.125 * f[0] * c[1] * f[2], 0.125 * f[0] * f[1] * c[2]]
    })
}

/// Bilinear shape functions at (xi, eta) in [−1, 1]², corners counter-clockwise from (−1, −1).
pub fn quad4(xi: f64, eta: f64) -> [f64; 4] {
    [
        0.25 * (1.0 - xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 + eta),
        0.25 * (1.0 - xi) * (1.0 + eta),
    ]
}

/// Derivatives of [`quad4`]: (d/dxi, d/deta) of each shape function.
pub fn quad4_gradient(xi: f64, eta: f64) -> [[f64; 2]; 4] {
    [
        [-0.25 * (1.0 - eta), -0.25 * (1.0 - xi)],
        [0.25 * (1.0 - eta), -0.25 * (1.0 + xi)],
        [0.25 * (1.0 + eta), 0.25 * (1.0 + xi)],
        [-0.25 * (1.0 + eta), 0.25 * (1.0 - xi)],
    ]
}

/// Points and weights of the `n`-point Gauss-Legendre rule on [−1, 1], ascending, to machine precision.
///
/// Newton's method on the Legendre polynomial from Tricomi's estimate of its roots.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .rev()
        .map(|k| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..8 {
                let (mut p, mut previous) = (1.0, 0.0);
                for j in 1..=n {
                    let j = j as f64;
                    (p, previous) = (((2.0 * j - 1.0) * x * p - (j - 1.0) * previous) / j, p);
                }
                slope = n as f64 * (x * p - previous) / (x * x - 1.0);
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rules_integrate_polynomials_exactly() {
        for n in 1..=6 {
            let rule = gauss_legendre(n);
            for degree in 0..2 * n {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                let exact = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "n {n} degree {degree}: {sum} against {exact}");
            }
        }
        assert!((gauss_legendre(2)[1].0 - GAUSS_1D_2).abs() < 1e-15);
    }

    #[test]
    fn hex_gradients_sum_to_zero_and_reproduce_coordinates() {
        let gradient = hex8_gradient([0.3, -0.7, 0.1]);
        for k in 0..3 {
            assert!(gradient.iter().map(|g| g[k]).sum::<f64>().abs() < 1e-15);
            for m in 0..3 {
                let d: f64 = gradient.iter().zip(HEX_CORNERS).map(|(g, c)| g[k] * c[m]).sum();
                assert!((d - f64::from(u8::from(k == m))).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn quad_functions_are_nodal_and_their_gradients_are_their_derivatives() {
        for (a, (xi, eta)) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate() {
            let n = quad4(xi, eta);
            for (b, value) in n.into_iter().enumerate() {
                assert_eq!(value, f64::from(u8::from(a == b)));
            }
        }
        let h = 1e-6;
        let gradient = quad4_gradient(0.2, -0.4);
        for a in 0..4 {
            let d_xi = (quad4(0.2 + h, -0.4)[a] - quad4(0.2 - h, -0.4)[a]) / (2.0 * h);
            let d_eta = (quad4(0.2, -0.4 + h)[a] - quad4(0.2, -0.4 - h)[a]) / (2.0 * h);
            assert!((gradient[a][0] - d_xi).abs() < 1e-10 && (gradient[a][1] - d_eta).abs() < 1e-10);
        }
    }
}
