//! Area of a face inside the zero-gap contour.

use nalgebra::Vector3;

use crate::element::{quad4, quad4_gradient};

/// Cells along each edge of a face; the contour is straight within half a cell.
const CELLS: usize = 8;

/// Area inside the contour and area of the whole face, both projected on the plane, mm².
///
/// * `x`: corners, mm; `height`: the plane's z, mm.
/// * `penalty`: MPa/mm; `multipliers`: per quadrature point, MPa, first index along xi.
/// * `rule`: the one-dimensional rule of the quadrature points.
pub(super) fn inside_contour(
    x: &[Vector3<f64>; 4],
    height: f64,
    penalty: f64,
    multipliers: &[f64],
    rule: &[(f64, f64)],
) -> [f64; 2] {
    let augmented = multipliers.iter().any(|&m| m != 0.0);
    let coordinate = |k: usize| 2.0 * k as f64 / CELLS as f64 - 1.0;
    let field = |i: usize, j: usize| {
        let shape = quad4(coordinate(i), coordinate(j));
        let z: f64 = (0..4).map(|a| shape[a] * x[a].z).sum();
        let multiplier = if augmented { nearest(coordinate(i), coordinate(j), multipliers, rule) } else { 0.0 };
        multiplier + penalty * (height - z)
    };
    let values: Vec<f64> =
        (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (i, j))).map(|(i, j)| field(i, j)).collect();
    let at = |i: usize, j: usize| values[j * (CELLS + 1) + i];
    let cell = 4.0 / (CELLS * CELLS) as f64;
    let (mut inside, mut whole) = (0.0, 0.0);
    for j in 0..CELLS {
        for i in 0..CELLS {
            let middle = 1.0 / CELLS as f64;
            let area = projected_jacobian(x, coordinate(i) + middle, coordinate(j) + middle).max(0.0) * cell;
            let corner = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let part = triangle_fraction([corner[0], corner[1], corner[2]])
                + triangle_fraction([corner[0], corner[2], corner[3]]);
            whole += area;
            inside += 0.5 * part * area;
        }
    }
    [inside, whole]
}

fn projected_jacobian(x: &[Vector3<f64>; 4], xi: f64, eta: f64) -> f64 {
    let gradient = quad4_gradient(xi, eta);
    let (mut a, mut b) = (Vector3::zeros(), Vector3::zeros());
    for k in 0..4 {
        a += x[k] * gradient[k][0];
        b += x[k] * gradient[k][1];
    }
    a.y * b.x - a.x * b.y
}

/// Part of a triangle in which the linear function with these corner values is positive.
fn triangle_fraction(values: [f64; 3]) -> f64 {
    let positive = values.iter().filter(|&&v| v > 0.0).count();
    // Corner that stands alone on its side of the contour.
    let alone = |side: bool| {
        let k = values.iter().position(|&v| (v > 0.0) == side).expect("one is on that side");
        let (a, b, c) = (values[k], values[(k + 1) % 3], values[(k + 2) % 3]);
        (a / (a - b)) * (a / (a - c))
    };
    match positive {
        0 => 0.0,
        1 => alone(true),
        2 => 1.0 - alone(false),
        _ => 1.0,
    }
}

/// Value at the quadrature point next to (xi, eta). A polynomial through multipliers that end at the rim would
/// overshoot beyond it.
fn nearest(xi: f64, eta: f64, values: &[f64], rule: &[(f64, f64)]) -> f64 {
    let next = |x: f64| {
        let distance = |k: &usize| (rule[*k].0 - x).abs();
        (0..rule.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a rule has points")
    };
    values[next(eta) * rule.len() + next(xi)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disc_on_a_tilted_plane_is_half_inside() {
        // A face whose height runs from -1 to 1 along x, seen from below.
        let x = [
            Vector3::new(-1.0, -1.0, -1.0),
            Vector3::new(-1.0, 1.0, -1.0),
            Vector3::new(1.0, 1.0, 1.0),
            Vector3::new(1.0, -1.0, 1.0),
        ];
        let [inside, whole] = inside_contour(&x, 0.25, 20.0, &[0.0; 4], &[(-0.577, 1.0), (0.577, 1.0)]);
        assert!((whole - 4.0).abs() < 1e-12);
        assert!((inside - 2.5).abs() < 1e-12);
    }

    #[test]
    fn fraction_of_a_triangle() {
        assert_eq!(triangle_fraction([1.0, 1.0, 1.0]), 1.0);
        assert_eq!(triangle_fraction([-1.0, -1.0, -1.0]), 0.0);
        assert!((triangle_fraction([1.0, -1.0, -1.0]) - 0.25).abs() < 1e-15);
        assert!((triangle_fraction([-1.0, 1.0, 1.0]) - 0.75).abs() < 1e-15);
    }
}
