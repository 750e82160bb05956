//! Points evenly or gradually spaced along the outlines of a body: around its section and along its
//! palmar or dorsal meridian.

use std::f64::consts::{FRAC_PI_2, PI};

use super::surface::Body;

/// Length along a curve of one parameter, tabled.
#[derive(Clone, Debug)]
pub(super) struct ArcTable {
    parameter: Vec<f64>,
    length: Vec<f64>,
}

impl ArcTable {
    fn new(from: f64, to: f64, curve: impl Fn(f64) -> [f64; 2]) -> Self {
        let count = 4000;
        let parameter: Vec<f64> = (0..=count).map(|i| from + (to - from) * f64::from(i) / f64::from(count)).collect();
        let mut length = vec![0.0];
        let mut last = curve(from);
        for &t in &parameter[1..] {
            let next = curve(t);
            length.push(length[length.len() - 1] + (next[0] - last[0]).hypot(next[1] - last[1]));
            last = next;
        }
        Self { parameter, length }
    }

    /// Length of the whole curve, mm.
    pub(super) fn total(&self) -> f64 {
        self.length[self.length.len() - 1]
    }

    /// Parameter at a length from the start.
    pub(super) fn parameter_at(&self, length: f64) -> f64 {
        interpolate(&self.length, &self.parameter, length)
    }

    /// Length from the start at a parameter.
    pub(super) fn length_at(&self, parameter: f64) -> f64 {
        interpolate(&self.parameter, &self.length, parameter)
    }
}

fn interpolate(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let at = xs.partition_point(|&v| v < x).clamp(1, xs.len() - 1);
    let t = ((x - xs[at - 1]) / (xs[at] - xs[at - 1])).clamp(0.0, 1.0);
    ys[at - 1] + t * (ys[at] - ys[at - 1])
}

/// Half the outline of the shaft's section, from palmar over lateral (y > 0) to dorsal.
#[derive(Clone, Debug)]
pub(super) struct SectionArc {
    body: Body,
    table: ArcTable,
}

impl SectionArc {
    pub(super) fn new(body: &Body) -> Self {
        let table = ArcTable::new(0.0, PI, |angle| {
            let [p, q] = Self::outline(body, angle);
            [body.a * p, body.b * q]
        });
        Self { body: *body, table }
    }

    /// Point of the outline (p, q) in the direction `angle` from palmar.
    fn outline(body: &Body, angle: f64) -> [f64; 2] {
        let (p, q) = (angle.sin() / body.a, -angle.cos() / body.b);
        let norm = body.section_norm(p, q);
        [p / norm, q / norm]
    }

    /// Relative position (p, q) at a fraction of the half outline; negative fractions lie at y < 0.
    pub(super) fn at(&self, fraction: f64) -> [f64; 2] {
        let angle = self.table.parameter_at(fraction.abs() * self.table.total());
        let [p, q] = Self::outline(&self.body, angle);
        [p * fraction.signum(), q]
    }

    /// Fraction of the half outline at a polar angle from palmar, 0 to pi.
    pub(super) fn fraction_at(&self, angle: f64) -> f64 {
        self.table.length_at(angle) / self.table.total()
    }

    /// Length of the half outline, mm.
    pub(super) fn length(&self) -> f64 {
        self.table.total()
    }
}

/// Palmar or dorsal outline of a body from some x of its shaft to its tip.
#[derive(Clone, Debug)]
pub(super) struct Meridian {
    body: Body,
    from_x: f64,
    table: ArcTable,
}

impl Meridian {
    /// `side` is -1 for palmar, 1 for dorsal.
    pub(super) fn new(body: &Body, from_x: f64, side: f64) -> Self {
        let table = ArcTable::new(0.0, 2.0, |t| {
            let (x, scale) = Self::place(body, from_x, t);
            [x, side * body.b * scale + body.taper.height(x)]
        });
        Self { body: *body, from_x, table }
    }

    /// (x, scale of the section) at the parameter: 0..1 along the shaft, 1..2 along the cap.
    fn place(body: &Body, from_x: f64, t: f64) -> (f64, f64) {
        if t <= 1.0 {
            return (from_x + t * (body.cap_x() - from_x), 1.0);
        }
        let (sin, cos) = ((t - 1.0).min(1.0) * FRAC_PI_2).sin_cos();
        let cos = cos.max(0.0);
        let norm = (sin.powf(body.m) + cos.powf(body.m)).powf(1.0 / body.m);
        (body.cap_x() + body.cap * sin / norm, cos / norm)
    }

    /// (x, scale of the section) at a length from the start, mm.
    pub(super) fn at(&self, length: f64) -> (f64, f64) {
        Self::place(&self.body, self.from_x, self.table.parameter_at(length))
    }

    /// Length up to x, mm.
    pub(super) fn length_to_x(&self, x: f64) -> f64 {
        let cap_x = self.body.cap_x();
        let t = if x <= cap_x {
            (x - self.from_x) / (cap_x - self.from_x)
        } else {
            1.0 + ((x - cap_x) / self.body.cap).atan2(self.body.scale_at(x)) / FRAC_PI_2
        };
        self.table.length_at(t)
    }

    /// Length up to the section of the cap with this scale, mm.
    pub(super) fn length_to_scale(&self, scale: f64) -> f64 {
        self.length_to_x(self.body.x_at_scale(scale))
    }
}

/// `count` + 1 positions over 0..`length`, spaced in proportion to sqrt(1 + ((s - center)/reach)²): finest
/// at `center`. Refining keeps the ratios.
pub(super) fn graded(count: usize, length: f64, center: f64, reach: f64) -> Vec<f64> {
    let (from, to) = ((-center / reach).asinh(), ((length - center) / reach).asinh());
    (0..=count)
        .map(|i| match i {
            0 => 0.0,
            _ if i == count => length,
            _ => center + reach * (from + (to - from) * i as f64 / count as f64).sinh(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FingertipShape;

    #[test]
    fn circle_and_meridian() {
        let shape = FingertipShape::round(8.0);
        let body = Body::outer(&shape);
        let section = SectionArc::new(&body);
        assert!((section.length() - 8.0 * PI).abs() < 1e-5);
        let [p, q] = section.at(-0.25);
        assert!((p + 0.5f64.sqrt()).abs() < 1e-6 && (q + 0.5f64.sqrt()).abs() < 1e-6);
        let meridian = Meridian::new(&body, 9.0, -1.0);
        let (x, scale) = meridian.at(8.0 + 8.0 * PI / 6.0);
        assert!((x - 21.0).abs() < 1e-5 && (scale - 0.75f64.sqrt()).abs() < 1e-6);
        assert!((meridian.length_to_x(21.0) - 8.0 - 8.0 * PI / 6.0).abs() < 1e-5);
    }

    #[test]
    fn graded_is_finest_at_its_center() {
        let s = graded(10, 20.0, 14.0, 5.0);
        let steps: Vec<f64> = s.windows(2).map(|w| w[1] - w[0]).collect();
        let finest = steps.iter().cloned().fold(f64::INFINITY, f64::min);
        assert!((s[0], s[10]) == (0.0, 20.0) && steps[0] > 2.0 * finest && steps[9] > finest);
    }
}
