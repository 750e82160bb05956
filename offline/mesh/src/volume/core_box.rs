//! The box inside the bone, carried along when the bone's surface moves off the template.

use nalgebra::Vector3;

use super::super::Divisions;
use super::super::grid::Point;
use super::super::mapping::Mapping;
use super::super::surface::Body;
use super::grid::{FineGrid, Sheet};
use super::template::Template;

/// For each ring of the box, ratio of the bone to its template, by the angle about the axis.
///
/// The box is stretched along rays by the same ratio, which cannot fold it.
pub(super) struct Core {
    body: Body,
    rings: usize,
    /// Angle and ratio around each ring, by rising angle.
    ratios: Vec<Vec<(f64, f64)>>,
}

impl Core {
    pub(super) fn new(template: &Template, divisions: &Divisions, fine: &FineGrid, bone: &Sheet) -> Self {
        let body = Body::bone(&template.shape);
        let (columns, rows) = (divisions.columns, divisions.rows);
        let around = |i: usize| -> Vec<Point> {
            let sides = (0..=columns).flat_map(|j| [[i, j, 0], [i, j, rows]]);
            sides.chain((1..rows).flat_map(|k| [[i, 0, k], [i, columns, k]])).collect()
        };
        let ratio = |point: Point| {
            let place = fine.place(point);
            let [position, _] = bone.at(place);
            let (from, to) = (section(&body, &(position - bone.shift(place))), section(&body, &position));
            (from.1.atan2(from.0), to.0.hypot(to.1) / from.0.hypot(from.1))
        };
        let ring = |i: usize| {
            let mut ring: Vec<(f64, f64)> = around(i).into_iter().map(ratio).collect();
            ring.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            ring
        };
        let rings = divisions.rings();
        Self { body, rings, ratios: (0..rings).map(ring).collect() }
    }

    /// Image of a point of the template's box. The last ring is a smaller copy of the bone's tip and moves with it.
    pub(super) fn place(&self, point: Point, core: Vector3<f64>, fine: &FineGrid, bone: &Sheet) -> Vector3<f64> {
        if point[0] == self.rings {
            return core + Mapping::core_size() * bone.shift(fine.place(point));
        }
        let (u, v) = section(&self.body, &core);
        let ratio = at_angle(&self.ratios[point[0]], v.atan2(u));
        core + (ratio - 1.0) * Vector3::new(0.0, u, v)
    }
}

/// Place in a section relative to the bone's axis, mm.
fn section(body: &Body, p: &Vector3<f64>) -> (f64, f64) {
    (p.y, p.z - body.axis_z - body.taper.height(p.x))
}

/// Value between the angles of a full turn.
fn at_angle(ring: &[(f64, f64)], angle: f64) -> f64 {
    let after = ring.partition_point(|r| r.0 < angle);
    let turn = std::f64::consts::TAU;
    let below = if after == 0 { (ring[ring.len() - 1].0 - turn, ring[ring.len() - 1].1) } else { ring[after - 1] };
    let above = if after == ring.len() { (ring[0].0 + turn, ring[0].1) } else { ring[after] };
    let t = if above.0 > below.0 { (angle - below.0) / (above.0 - below.0) } else { 0.0 };
    below.1 + t * (above.1 - below.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_around() {
        let ring = [(-3.0, 1.0), (0.0, 2.0), (3.0, 3.0)];
        assert!((at_angle(&ring, 1.5) - 2.5).abs() < 1e-12 && (at_angle(&ring, -3.0) - 1.0).abs() < 1e-12);
        let seam = at_angle(&ring, std::f64::consts::PI);
        assert!((seam - 2.0).abs() < 1e-12, "{seam}");
    }
}
