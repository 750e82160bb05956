//! A height field on a regular grid, smoothed by cubic splines.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::rigid::{BodyShapeError, Spot, spot_of_graph};

/// Heights over the tangent plane at the nodes of a regular grid, interpolated by a bicubic spline, which is smooth in its
/// second derivatives. Beyond the grid the heights of its border go on.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Nodes along x and along y, at least 4 each.
    pub nodes: [usize; 2],
    /// Distance of the nodes along x and along y, mm.
    pub spacing_mm: [f64; 2],
    /// Place of the first node, mm.
    pub origin_mm: [f64; 2],
    /// Heights, mm; x runs fastest.
    pub heights_mm: Vec<f64>,
    /// Coefficients of the spline; made from the heights by [`Self::new`].
    coefficients: Vec<f64>,
}

impl HeightField {
    /// The field of these heights.
    ///
    /// # Errors
    /// [`BodyShapeError`] for too few nodes, another number of heights than of nodes, or a value that is not finite.
    pub fn new(
        nodes: [usize; 2],
        spacing_mm: [f64; 2],
        origin_mm: [f64; 2],
        heights_mm: Vec<f64>,
    ) -> Result<Self, BodyShapeError> {
        let mut field = Self { nodes, spacing_mm, origin_mm, heights_mm, coefficients: Vec::new() };
        field.check()?;
        field.coefficients = field.heights_mm.clone();
        let [nx, ny] = nodes;
        for row in field.coefficients.chunks_exact_mut(nx) {
            interpolating(row);
        }
        let mut column = vec![0.0; ny];
        for i in 0..nx {
            for j in 0..ny {
                column[j] = field.coefficients[j * nx + i];
            }
            interpolating(&mut column);
            for j in 0..ny {
                field.coefficients[j * nx + i] = column[j];
            }
        }
        Ok(field)
    }

    pub(super) fn check(&self) -> Result<(), BodyShapeError> {
        let [nx, ny] = self.nodes;
        if nx < 4 || ny < 4 {
            return Err(BodyShapeError::Heights(format!("{nx} x {ny} heights: at least 4 x 4 are needed")));
        }
        if self.heights_mm.len() != nx * ny {
            let found = self.heights_mm.len();
            return Err(BodyShapeError::Heights(format!("{found} heights in place of {nx} x {ny}")));
        }
        if let Some(step) = self.spacing_mm.iter().find(|step| !(**step > 0.0 && step.is_finite())) {
            return Err(BodyShapeError::Heights(format!("spacing {step} mm: must be more than 0")));
        }
        if let Some(place) = self.heights_mm.iter().position(|height| !height.is_finite()) {
            let (i, j) = (place % nx + 1, place / nx + 1);
            let height = self.heights_mm[place];
            return Err(BodyShapeError::Heights(format!("height {height} at node {i}, {j}: must be a number")));
        }
        Ok(())
    }

    /// Height over the tangent plane, mm.
    pub fn height_mm(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).0
    }

    /// Whether (x, y) lies within the grid.
    pub fn covers(&self, x: f64, y: f64) -> bool {
        [x, y].iter().enumerate().all(|(k, place)| {
            let end = self.origin_mm[k] + self.spacing_mm[k] * (self.nodes[k] - 1) as f64;
            (self.origin_mm[k]..=end).contains(place)
        })
    }

    /// Least radius of curvature at the nodes, mm; infinite for a flat field.
    pub fn least_radius_mm(&self) -> f64 {
        let [nx, ny] = self.nodes;
        let place = |k: usize, i: usize| self.origin_mm[k] + self.spacing_mm[k] * i as f64;
        let nodes = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        let curvatures = nodes.map(|(i, j)| {
            let (x, y) = (place(0, i), place(1, j));
            self.spot(&Vector3::new(x, y, self.height_mm(x, y))).most_curvature()
        });
        1.0 / curvatures.fold(0.0, f64::max)
    }

    /// The spot of a place.
    pub(super) fn spot(&self, y: &Vector3<f64>) -> Spot {
        spot_of_graph(|x, y| self.at(x, y), y)
    }

    /// Height, gradient and second derivatives.
    fn at(&self, x: f64, y: f64) -> (f64, Vector2<f64>, Matrix2<f64>) {
        let of_axis = |k: usize, place: f64| {
            let last = (self.nodes[k] - 1) as f64;
            let raw = (place - self.origin_mm[k]) / self.spacing_mm[k];
            let inside = raw.clamp(0.0, last);
            // Beyond the border nothing changes across it.
            let changes = f64::from(u8::from(raw == inside)) / self.spacing_mm[k];
            let cell = inside.floor().min(last - 1.0);
            (cell as usize, Weights::at(inside - cell), changes)
        };
        let (i, wx, per_x) = of_axis(0, x);
        let (j, wy, per_y) = of_axis(1, y);
        let [nx, ny] = self.nodes;
        let mut sums = [0.0; 6];
        for b in 0..4 {
            // The coefficients beyond the border are the mirror images of those within.
            let row = mirrored(j + b, ny) * nx;
            let mut along = [0.0; 3];
            for a in 0..4 {
                let c = self.coefficients[row + mirrored(i + a, nx)];
                along[0] += c * wx.value[a];
                along[1] += c * wx.slope[a];
                along[2] += c * wx.bend[a];
            }
            sums[0] += along[0] * wy.value[b];
            sums[1] += along[1] * wy.value[b];
            sums[2] += along[0] * wy.slope[b];
            sums[3] += along[2] * wy.value[b];
            sums[4] += along[1] * wy.slope[b];
            sums[5] += along[0] * wy.bend[b];
        }
        let mixed = sums[4] * per_x * per_y;
        (
            sums[0],
            Vector2::new(sums[1] * per_x, sums[2] * per_y),
            Matrix2::new(sums[3] * per_x * per_x, mixed, mixed, sums[5] * per_y * per_y),
        )
    }
}

/// Place in the grid of the coefficient `k - 1`, mirrored at the border.
fn mirrored(k: usize, count: usize) -> usize {
    match k {
        0 => 1,
        k if k > count => 2 * count - k - 1,
        k => k - 1,
    }
}

/// Values of the four cubic B-splines over a cell, and their derivatives over its width.
struct Weights {
    value: [f64; 4],
    slope: [f64; 4],
    bend: [f64; 4],
}

impl Weights {
    fn at(t: f64) -> Self {
        let s = 1.0 - t;
        Self {
            value: [
                s * s * s / 6.0,
                (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                t * t * t / 6.0,
            ],
            slope: [-0.5 * s * s, 0.5 * (3.0 * t * t - 4.0 * t), 0.5 * (4.0 * s - 3.0 * s * s), 0.5 * t * t],
            bend: [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t],
        }
    }
}

/// Coefficients of the cubic B-splines that pass through these values, with mirror images beyond both ends: the tridiagonal
/// system (1, 4, 1)/6, by elimination.
fn interpolating(values: &mut [f64]) {
    let count = values.len();
    let mut upper = vec![0.0; count];
    for k in 0..count {
        let before = match k {
            0 => 0.0,
            k if k + 1 == count => 2.0,
            _ => 1.0,
        };
        let after = if k == 0 { 2.0 } else { 1.0 };
        let pivot = 4.0 - before * if k > 0 { upper[k - 1] } else { 0.0 };
        upper[k] = after / pivot;
        let last = if k > 0 { values[k - 1] } else { 0.0 };
        values[k] = (6.0 * values[k] - before * last) / pivot;
    }
    for k in (0..count - 1).rev() {
        values[k] -= upper[k] * values[k + 1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spline passes through the heights and follows a smooth surface between them, in value, slope and curvature.
    #[test]
    fn a_smooth_surface_is_followed() {
        let f = |x: f64, y: f64| 0.1 * (1.3 * x + 0.2).sin() * (0.9 * y).cos();
        let (n, h, from) = ([41, 31], [0.2, 0.25], [-4.0, -3.75]);
        let place = |i: usize, j: usize| (from[0] + h[0] * i as f64, from[1] + h[1] * j as f64);
        let heights: Vec<f64> = (0..31).flat_map(|j| (0..41).map(move |i| place(i, j))).map(|(x, y)| f(x, y)).collect();
        let field = HeightField::new(n, h, from, heights).unwrap();
        for (i, j) in [(0, 0), (3, 7), (40, 30), (20, 0)] {
            let (x, y) = place(i, j);
            assert!((field.height_mm(x, y) - f(x, y)).abs() < 1e-12, "{x} {y}");
        }
        for (x, y) in [(0.03, 0.41), (-1.31, 1.12), (1.77, -1.93)] {
            let (value, slope, bend) = field.at(x, y);
            assert!((value - f(x, y)).abs() < 2e-5);
            let e = 1e-5;
            let numeric =
                |dx: f64, dy: f64| (field.height_mm(x + dx, y + dy) - field.height_mm(x - dx, y - dy)) / (2.0 * e);
            assert!((slope - Vector2::new(numeric(e, 0.0), numeric(0.0, e))).norm() < 1e-8);
            let turned = |dx: f64, dy: f64| (field.at(x + dx, y + dy).1 - field.at(x - dx, y - dy).1) / (2.0 * e);
            assert!((bend.column(0) - turned(e, 0.0)).norm() < 1e-6 && (bend.column(1) - turned(0.0, e)).norm() < 1e-6);
        }
        // Beyond the border its heights go on.
        assert_eq!(field.height_mm(90.0, 0.1), field.height_mm(4.0, 0.1));
    }

    #[test]
    fn its_least_radius_is_that_of_a_ball_and_it_covers_its_grid() {
        let place = |k: usize| 0.25 * k as f64 - 2.5;
        let ball = |x: f64, y: f64| (64.0 - x * x - y * y).sqrt() - 8.0;
        let heights = (0..21).flat_map(|j| (0..21).map(move |i| (i, j))).map(|(i, j)| ball(place(i), place(j)));
        // A height more at a middle node: a peak that is much sharper.
        let heights: Vec<f64> = heights.collect();
        let field = |heights| HeightField::new([21; 2], [0.25; 2], [-2.5; 2], heights).unwrap();
        let inner = field(heights.clone());
        let at = inner.spot(&Vector3::new(0.3, 0.4, inner.height_mm(0.3, 0.4)));
        assert!((at.most_curvature() - 1.0 / 8.0).abs() < 1e-3, "{}", at.most_curvature());
        let mut peaked = heights;
        peaked[10 * 21 + 10] += 0.1;
        let least_mm = field(peaked).least_radius_mm();
        assert!(least_mm < 0.25, "{least_mm}");
        assert!(inner.covers(2.5, -2.5) && !inner.covers(2.6, 0.0) && !inner.covers(0.0, -2.51));
    }

    #[test]
    fn what_is_no_field_is_refused() {
        let refused =
            |nodes, heights: Vec<f64>| HeightField::new(nodes, [0.1; 2], [0.0; 2], heights).unwrap_err().to_string();
        assert!(refused([3, 4], vec![0.0; 12]).contains("at least 4 x 4"));
        assert!(refused([4, 4], vec![0.0; 15]).contains("15 heights"));
        let mut heights = vec![0.0; 16];
        heights[6] = f64::NAN;
        assert!(refused([4, 4], heights).contains("node 3, 2"));
    }
}
