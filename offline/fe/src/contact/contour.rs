//! Area inside a contour: the part of a face where a field, given at its corners, is positive.
//!
//! A face of four corners is taken as four triangles that meet in the mean of its corners, so that the field is linear
//! in each and its contour a straight line.

use nalgebra::Vector2;

/// A face of the surface: three or four corners, counter-clockwise seen from the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facet {
    /// Linear triangle.
    Triangle([usize; 3]),
    /// Bilinear quadrilateral.
    Quad([usize; 4]),
}

impl Facet {
    /// Surface nodes at the corners.
    pub fn corners(&self) -> &[usize] {
        match self {
            Self::Triangle(nodes) => nodes,
            Self::Quad(nodes) => nodes,
        }
    }

    /// Area of the smallest of the triangles that the face is taken as, mm²; negative where they overlap.
    pub fn least_triangle_area(&self, place: &[Vector2<f64>]) -> f64 {
        match self {
            Self::Triangle(_) => triangle_area([place[0], place[1], place[2]]),
            Self::Quad(_) => {
                let centre = (place[0] + place[1] + place[2] + place[3]) * 0.25;
                let areas = (0..4).map(|k| triangle_area([place[k], place[(k + 1) % 4], centre]));
                areas.fold(f64::INFINITY, f64::min)
            }
        }
    }

    /// Area of the part of the face where `level` (one value a corner) is positive, as shares of the corners: the
    /// integrals of their shape functions over that part. `place` are the corners in the plane, mm; shares are mm².
    pub fn shares(&self, place: &[Vector2<f64>], level: &[f64]) -> [f64; 4] {
        let mut shares = [0.0; 4];
        if level.iter().all(|l| !(*l > 0.0)) {
            return shares;
        }
        match self {
            Self::Triangle(_) => {
                let area = triangle_area([place[0], place[1], place[2]]);
                let parts = positive_part([level[0], level[1], level[2]]);
                for (share, part) in shares.iter_mut().zip(parts) {
                    *share = part * area;
                }
            }
            Self::Quad(_) => {
                let centre = (place[0] + place[1] + place[2] + place[3]) * 0.25;
                let mean = 0.25 * (level[0] + level[1] + level[2] + level[3]);
                for k in 0..4 {
                    let next = (k + 1) % 4;
                    let area = triangle_area([place[k], place[next], centre]);
                    let parts = positive_part([level[k], level[next], mean]);
                    shares[k] += parts[0] * area;
                    shares[next] += parts[1] * area;
                    for share in &mut shares {
                        *share += 0.25 * parts[2] * area;
                    }
                }
            }
        }
        shares
    }
}

/// Signed area of a triangle whose corners run clockwise in the plane's frame (counter-clockwise seen from the plane's
/// side of the finger), mm².
fn triangle_area([a, b, c]: [Vector2<f64>; 3]) -> f64 {
    0.5 * (c - a).perp(&(b - a))
}

/// Integrals of the three shape functions over the part of a triangle of area 1 where the linear field is positive.
fn positive_part(level: [f64; 3]) -> [f64; 3] {
    const WHOLE: f64 = 1.0 / 3.0;
    let positive = level.map(|l| l > 0.0);
    match positive.iter().filter(|p| **p).count() {
        0 => [0.0; 3],
        3 => [WHOLE; 3],
        1 => corner_part(level, positive.iter().position(|p| *p).expect("one of them")),
        _ => {
            let negative = positive.iter().position(|p| !*p).expect("one of them");
            corner_part(level, negative).map(|part| WHOLE - part)
        }
    }
}

/// The same of the part that the contour cuts off at one corner, whose sign is not that of the others.
fn corner_part(level: [f64; 3], corner: usize) -> [f64; 3] {
    let (left, right) = ((corner + 1) % 3, (corner + 2) % 3);
    // Points where the contour crosses the two edges, as shares of the edge from the corner.
    let cut = |other: usize| level[corner] / (level[corner] - level[other]);
    let (to_left, to_right) = (cut(left), cut(right));
    let area = to_left * to_right;
    let mut part = [0.0; 3];
    part[corner] = area * (3.0 - to_left - to_right) / 3.0;
    part[left] = area * to_left / 3.0;
    part[right] = area * to_right / 3.0;
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clockwise in the plane's frame.
    fn rectangle(width: f64, height: f64) -> Vec<Vector2<f64>> {
        [[0.0, 0.0], [0.0, height], [width, height], [width, 0.0]].map(Vector2::from).to_vec()
    }

    #[test]
    fn a_linear_field_cuts_a_rectangle_exactly() {
        let place = rectangle(2.0, 3.0);
        let facet = Facet::Quad([0, 1, 2, 3]);
        for edge in [0.1, 0.5, 1.0, 1.3, 1.9] {
            let level: Vec<f64> = place.iter().map(|p| edge - p.x).collect();
            let shares = facet.shares(&place, &level);
            assert!((shares.iter().sum::<f64>() - 3.0 * edge).abs() < 1e-12, "{edge}: {shares:?}");
            // First moment over x: the shape functions of the corners reproduce a linear field in each triangle.
            let moment: f64 = shares.iter().zip(&place).map(|(s, p)| s * p.x).sum();
            assert!((moment - 1.5 * edge * edge).abs() < 1e-12, "{edge}: {moment}");
        }
        assert_eq!(facet.shares(&place, &[-1.0; 4]), [0.0; 4]);
        assert!(facet.shares(&place, &[1.0; 4]).iter().all(|s| (s - 1.5).abs() < 1e-12));
    }

    #[test]
    fn a_triangle_and_its_mirror_make_the_whole() {
        let place = [[0.0, 0.0], [0.3, 1.7], [2.0, 0.4]].map(Vector2::from);
        let facet = Facet::Triangle([0, 1, 2]);
        let area = triangle_area(place);
        assert!(area > 0.0);
        for level in [[1.0, -0.5, 2.0], [0.2, 0.3, -4.0], [-1.0, -1.0, 0.1]] {
            let inside = facet.shares(&place, &level);
            let outside = facet.shares(&place, &level.map(|l| -l));
            for k in 0..3 {
                assert!((inside[k] + outside[k] - area / 3.0).abs() < 1e-14);
            }
        }
    }
}
