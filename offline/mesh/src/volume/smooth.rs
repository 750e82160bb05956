//! The smoothest surface that the labels allow.
//!
//! Labels only locate the border between two voxels, not its position between them. So the offset d from the template
//! is the one of least bending among those that stay within the slack:
//!
//! ```text
//! sum A max(|d - t| - s, 0)² + h⁴ sum A (Laplacian d)² + rest sum A d²  least over d
//! ```
//!
//! with t the measured offsets, s the slack, A areas, h the voxel size. The tiny `rest` pulls offsets that the labels
//! do not determine to the template. The method is that of Whitaker (2000, IEEE Symposium on Volume Visualization,
//! 23-32), constraints from the voxels and otherwise the smoothest surface, with two changes: the offset from a near
//! template is smoothed, so that the surface's own curvature does not pull it inward, and bending is minimised rather
//! than area. Terraces of voxels vanish without a filter's loss of shape.

use nalgebra::Vector3;

/// Weight of lying on the template: acts over (1/weight)^(1/4), about 18 voxels.
const REST: f64 = 1e-5;
/// Most rounds of finding out which constraints act.
const ROUNDS: usize = 30;
/// Most steps of conjugate gradients in a round. They need not converge: the remaining errors are long waves, which the
/// next round reduces. The first round starts at the template, so that the errors are smooth.
const STEPS: usize = 150;

/// Points of a surface joined by quadrilaterals.
pub(super) struct SurfaceGrid {
    /// Neighbours of each point with their weights in the Laplacian times area; of a point at an open edge, where the
    /// Laplacian is not known, those along the edge, so that it is smooth at least.
    neighbours: Vec<Vec<(usize, f64)>>,
    /// Area of each point, mm².
    area: Vec<f64>,
}

impl SurfaceGrid {
    pub(super) fn new(points: &[Vector3<f64>], quads: &[[usize; 4]]) -> Self {
        let mut area = vec![0.0; points.len()];
        let mut pairs: Vec<([usize; 2], f64)> = Vec::with_capacity(4 * quads.len());
        for quad in quads {
            let p = quad.map(|n| points[n]);
            let size = 0.5 * (p[2] - p[0]).cross(&(p[3] - p[1])).norm();
            for c in 0..4 {
                let (a, b) = (quad[c], quad[(c + 1) % 4]);
                area[a] += 0.25 * size;
                let square = (points[a] - points[b]).norm_squared().max(1e-12);
                pairs.push(([a.min(b), a.max(b)], 0.5 * size / square));
            }
        }
        pairs.sort_unstable_by_key(|pair| pair.0);
        let mut neighbours = vec![Vec::new(); points.len()];
        let mut edge = vec![false; points.len()];
        for pair in pairs.chunk_by(|a, b| a.0 == b.0).filter(|pair| pair.len() == 1) {
            pair[0].0.iter().for_each(|&n| edge[n] = true);
        }
        for pair in pairs.chunk_by(|a, b| a.0 == b.0) {
            let [a, b] = pair[0].0;
            let weight: f64 = pair.iter().map(|p| p.1).sum();
            for (from, to) in [(a, b), (b, a)] {
                if !edge[from] || pair.len() == 1 {
                    neighbours[from].push((to, weight));
                }
            }
        }
        Self { neighbours, area }
    }

    /// The Laplacian times area.
    fn laplacian(&self, d: &[f64]) -> Vec<f64> {
        (0..d.len()).map(|i| self.neighbours[i].iter().map(|&(j, w)| w * (d[j] - d[i])).sum()).collect()
    }

    /// The transposed of [`Self::laplacian`].
    fn transposed(&self, r: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; r.len()];
        for i in 0..r.len() {
            for &(j, w) in &self.neighbours[i] {
                out[j] += w * r[i];
                out[i] -= w * r[i];
            }
        }
        out
    }

    /// (weights + h⁴ bending) d.
    fn apply(&self, d: &[f64], weight: &[f64], h4: f64) -> Vec<f64> {
        let bend: Vec<f64> = self.laplacian(d).iter().zip(&self.area).map(|(l, a)| h4 * l / a).collect();
        let bend = self.transposed(&bend);
        (0..d.len()).map(|i| weight[i] * self.area[i] * d[i] + bend[i]).collect()
    }

    fn diagonal(&self, weight: &[f64], h4: f64) -> Vec<f64> {
        let mut diagonal: Vec<f64> = weight.iter().zip(&self.area).map(|(w, a)| w * a).collect();
        for i in 0..diagonal.len() {
            let own: f64 = self.neighbours[i].iter().map(|n| n.1).sum();
            diagonal[i] += h4 * own * own / self.area[i];
            self.neighbours[i].iter().for_each(|&(j, w)| diagonal[j] += h4 * w * w / self.area[i]);
        }
        diagonal
    }

    /// Twice the energy that [`Self::smooth`] makes least.
    fn energy(&self, d: &[f64], measured: &[Option<(f64, f64)>], h4: f64) -> f64 {
        let bend: f64 = self.laplacian(d).iter().zip(&self.area).map(|(l, a)| h4 * l * l / a).sum();
        let hold = |i: usize| {
            measured[i]
                .map_or(0.0, |(t, s)| self.area[i] * (((d[i] - t).abs() - s).max(0.0).powi(2) + REST * d[i] * d[i]))
        };
        bend + (0..d.len()).map(hold).sum::<f64>()
    }

    /// Least bending within the slack: Newton's method on the piecewise quadratic energy, with step halving.
    ///
    /// * `measured`: offset t and slack s of each point, mm; None if nothing is known
    /// * `voxel_mm`: h
    pub(super) fn smooth(&self, measured: &[Option<(f64, f64)>], voxel_mm: f64) -> Vec<f64> {
        let h4 = voxel_mm.powi(4);
        let mut d = vec![0.0; measured.len()];
        let mut before = self.energy(&d, measured, h4);
        for _ in 0..ROUNDS {
            let mut weight = vec![0.0; d.len()];
            let mut right = vec![0.0; d.len()];
            for (i, m) in measured.iter().enumerate() {
                let Some((t, s)) = *m else { continue };
                let outside = (d[i] - t).abs() > s;
                weight[i] = REST + if outside { 1.0 } else { 0.0 };
                let held = if outside { d[i].clamp(t - s, t + s) } else { 0.0 };
                right[i] = self.area[i] * held;
            }
            let full = self.solve(d.clone(), &weight, &right, h4);
            let mut share = 1.0;
            let (next, after) = loop {
                let next: Vec<f64> = d.iter().zip(&full).map(|(d, f)| d + share * (f - d)).collect();
                let after = self.energy(&next, measured, h4);
                if after < before || share < 1e-3 {
                    break (next, after);
                }
                share *= 0.5;
            };
            if !(after < before) {
                break;
            }
            let moved = next.iter().zip(&d).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            (d, before) = (next, after);
            if moved < 5e-3 * voxel_mm {
                break;
            }
        }
        d
    }

    /// Conjugate gradients with the diagonal as preconditioner.
    fn solve(&self, mut d: Vec<f64>, weight: &[f64], right: &[f64], h4: f64) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let diagonal = self.diagonal(weight, h4);
        let divide = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d.max(1e-300)).collect::<Vec<_>>();
        let mut r: Vec<f64> = self.apply(&d, weight, h4).iter().zip(right).map(|(a, b)| b - a).collect();
        let mut z = divide(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let goal = 1e-8 * rz;
        for _ in 0..STEPS {
            if !(rz > goal) {
                break;
            }
            let q = self.apply(&p, weight, h4);
            let step = rz / dot(&p, &q);
            for i in 0..d.len() {
                d[i] += step * p[i];
                r[i] -= step * q[i];
            }
            z = divide(&r);
            let next = dot(&r, &z);
            (0..p.len()).for_each(|i| p[i] = z[i] + next / rz * p[i]);
            rz = next;
        }
        d
    }
}

/// Outward unit normals of points, from their quadrilaterals weighted by area.
pub(super) fn normals(points: &[Vector3<f64>], quads: &[[usize; 4]]) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); points.len()];
    for quad in quads {
        let p = quad.map(|n| points[n]);
        let area = (p[2] - p[0]).cross(&(p[3] - p[1]));
        quad.iter().for_each(|&n| normals[n] += area);
    }
    normals.iter().map(|n| n.normalize()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of `n` x `n` points, `step` apart.
    fn plane(n: usize, step: f64) -> (Vec<Vector3<f64>>, Vec<[usize; 4]>) {
        let at = |k: usize| Vector3::new((k % n) as f64 * step, (k / n) as f64 * step, 0.0);
        let quad = |k: usize| [k, k + 1, k + n + 1, k + n];
        let inside = |k: &usize| k % n + 1 < n && k / n + 1 < n;
        ((0..n * n).map(at).collect(), (0..n * n).filter(inside).map(quad).collect())
    }

    /// Largest error of the smoothed staircase of a surface, away from the edge, in voxels.
    fn error_of(surface: impl Fn(f64, f64) -> f64) -> f64 {
        let h = 0.25;
        let (points, quads) = plane(61, h);
        let grid = SurfaceGrid::new(&points, &quads);
        let stairs = |p: &Vector3<f64>| Some((((surface(p.x, p.y) / h).round()) * h, 0.5 * h));
        let smooth = grid.smooth(&points.iter().map(stairs).collect::<Vec<_>>(), h);
        let inner = |p: &Vector3<f64>| (1.5..13.5).contains(&p.x) && (1.5..13.5).contains(&p.y);
        let errors = points.iter().zip(&smooth).filter(|(p, _)| inner(p));
        errors.map(|(p, d)| (d - surface(p.x, p.y)).abs() / h).fold(0.0, f64::max)
    }

    #[test]
    fn stairs_become_planes_and_bumps_stay() {
        for (name, error) in [
            ("plane", error_of(|x, y| 0.07 * x - 0.03 * y)),
            ("dome", error_of(|x, y| -((x - 7.0).powi(2) + (y - 7.0).powi(2)) / 40.0)),
            ("bump", error_of(|x, y| 0.8 * (-((x - 7.0).powi(2) + (y - 8.0).powi(2)) / 8.0).exp())),
        ] {
            println!("{name}: {error:.3} voxels");
            // Slack of the labels.
            assert!(error < 0.5, "{name}: {error} voxels");
        }
    }

    #[test]
    fn unknown_points_are_bridged() {
        let (points, quads) = plane(21, 0.3);
        let slope = |p: &Vector3<f64>| 0.05 * p.x + 0.1;
        let hole = |p: &Vector3<f64>| (2.0..4.0).contains(&p.x) && (2.0..4.0).contains(&p.y);
        let measured: Vec<_> = points.iter().map(|p| (!hole(p)).then(|| (slope(p), 0.01))).collect();
        let smooth = SurfaceGrid::new(&points, &quads).smooth(&measured, 0.3);
        let worst = points.iter().zip(&smooth).map(|(p, d)| (d - slope(p)).abs()).fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst} mm");
    }

    #[test]
    fn laplacian_and_its_transposed_agree() {
        let (points, quads) = plane(6, 0.5);
        let grid = SurfaceGrid::new(&points, &quads);
        let (a, b): (Vec<f64>, Vec<f64>) = (0..36).map(|i| ((i * 7 % 11) as f64, (i * 5 % 13) as f64)).unzip();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&grid.laplacian(&a), &b) - dot(&a, &grid.transposed(&b))).abs() < 1e-9);
        let up = normals(&points, &quads);
        assert!(up.iter().all(|n| (n - Vector3::z()).norm() < 1e-12));
    }
}
