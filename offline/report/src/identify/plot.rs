//! A chart whose axes may be logarithmic, and contours of a grid.

use super::super::axes::Axis;
use super::super::canvas::{Canvas, Drawn, HPos, Line, Text, VPos};
use super::super::colour::{FAINT, GREY};
use super::super::numbers::fixed;

/// An axis with its ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    log: bool,
    ticks: Vec<(f64, String)>,
    label: String,
}

impl Scale {
    /// A linear axis that covers the values.
    pub fn linear(label: &str, least: [f64; 2], values: impl Iterator<Item = f64>, count: usize) -> Self {
        let axis = Axis::covering(label, least, values, count);
        let ticks = axis.ticks.iter().map(|t| (*t, fixed(*t, axis.decimals))).collect();
        Self { low: axis.min(), high: axis.max(), log: false, ticks, label: label.to_owned() }
    }

    /// A linear axis from `low` to `high`, ticks at round values inside.
    pub fn between(label: &str, [low, high]: [f64; 2], count: usize) -> Self {
        let axis = Axis::covering(label, [low, high], std::iter::empty(), count);
        let inside = axis.ticks.iter().filter(|t| (low..=high).contains(*t));
        let ticks = inside.map(|t| (*t, fixed(*t, axis.decimals))).collect();
        Self { low, high, log: false, ticks, label: label.to_owned() }
    }

    /// A logarithmic axis from `low` to `high`, both above 0.
    pub fn log(label: &str, [low, high]: [f64; 2]) -> Self {
        let decades = (high / low).log10();
        let steps: &[f64] = if decades > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let first = low.log10().floor() as i32;
        let mut ticks = Vec::new();
        for power in first..=high.log10().ceil() as i32 {
            for step in steps {
                let v = step * 10f64.powi(power);
                if v >= low * 0.999 && v <= high * 1.001 {
                    let decimals = (-power).max(0) as usize;
                    let text = if power < -3 { format!("{step:.0}e−{}", -power) } else { fixed(v, decimals) };
                    ticks.push((v, text));
                }
            }
        }
        Self { low, high, log: true, ticks, label: label.to_owned() }
    }

    fn share(&self, v: f64) -> f64 {
        if self.log {
            (v / self.low).ln() / (self.high / self.low).ln()
        } else {
            (v - self.low) / (self.high - self.low)
        }
    }

    /// Positions of numbers, and their format.
    pub fn ticks(&self) -> &[(f64, String)] {
        &self.ticks
    }

    fn holds(&self, v: f64) -> bool {
        v >= self.low && v <= self.high
    }
}

/// A chart's rectangle with its axes.
pub struct Plot {
    /// Left edge, px.
    pub left: f64,
    /// Upper edge, px.
    pub top: f64,
    /// Width, px.
    pub width: f64,
    /// Height, px.
    pub height: f64,
    /// To the right.
    pub x: Scale,
    /// Upwards.
    pub y: Scale,
}

impl Plot {
    /// Position of a value; not finite outside the axes' range of numbers.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (self.left + self.x.share(x) * self.width, self.top + (1.0 - self.y.share(y)) * self.height)
    }

    /// Whether a value lies on the chart.
    pub fn holds(&self, x: f64, y: f64) -> bool {
        self.x.holds(x) && self.y.holds(y)
    }

    /// The parts of a line that lie on the chart; a point off it breaks the line.
    pub fn line(&self, canvas: &mut Canvas<'_>, points: impl Iterator<Item = (f64, f64)>, line: Line) -> Drawn {
        let path: Vec<_> =
            points.map(|(x, y)| if self.holds(x, y) { self.at(x, y) } else { (f64::NAN, f64::NAN) }).collect();
        canvas.line(&path, line)
    }

    /// Draws grid, ticks, numbers and labels; the upward axis is named above it.
    pub fn draw(&self, canvas: &mut Canvas<'_>) -> Drawn {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let small = Text { em: 11.5, colour: GREY, ..Text::BODY };
        for (tick, text) in &self.y.ticks {
            let y = self.at(self.x.low, *tick).1;
            canvas.line(&[(self.left, y), (right, y)], Line::solid(FAINT, 0.8))?;
            canvas.text(text, (self.left - 8.0, y), Text { h: HPos::Right, ..small })?;
        }
        canvas.line(&[(self.left, bottom), (right, bottom)], Line::solid(GREY, 1.0))?;
        for (tick, text) in &self.x.ticks {
            let x = self.at(*tick, self.y.low).0;
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], Line::solid(GREY, 1.0))?;
            canvas.text(text, (x, bottom + 8.0), Text { h: HPos::Center, v: VPos::Top, ..small })?;
        }
        let name = Text { em: 12.5, ..Text::BODY };
        let below = Text { h: HPos::Center, v: VPos::Top, ..name };
        canvas.text(&self.x.label, (self.left + self.width / 2.0, bottom + 25.0), below)?;
        canvas.text(&self.y.label, (self.left - 40.0, self.top - 18.0), Text { bold: true, ..name })
    }
}

/// Pieces of the line where a grid's values pass `level`; shape of `values` (y, x). Cells with a value that is not
/// finite are left out.
pub fn contour(xs: &[f64], ys: &[f64], values: &[Vec<f64>], level: f64) -> Vec<[(f64, f64); 2]> {
    let mut pieces = Vec::new();
    for j in 1..ys.len() {
        for i in 1..xs.len() {
            let corner = |a: usize, b: usize| (xs[i - 1 + a], ys[j - 1 + b], values[j - 1 + b][i - 1 + a] - level);
            let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if ring.iter().any(|c| !c.2.is_finite()) {
                continue;
            }
            let mut crossings = Vec::new();
            for k in 0..4 {
                let (a, b) = (ring[k], ring[(k + 1) % 4]);
                if (a.2 < 0.0) != (b.2 < 0.0) {
                    let s = a.2 / (a.2 - b.2);
                    crossings.push((a.0 + s * (b.0 - a.0), a.1 + s * (b.1 - a.1)));
                }
            }
            pieces.extend(crossings.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contour_of_a_cone_is_a_circle() {
        let along: Vec<f64> = (0..41).map(|i| -1.0 + f64::from(i) / 20.0).collect();
        let values: Vec<Vec<f64>> = along.iter().map(|y| along.iter().map(|x: &f64| x.hypot(*y)).collect()).collect();
        let pieces = contour(&along, &along, &values, 0.7);
        let length: f64 = pieces.iter().map(|[a, b]| (a.0 - b.0).hypot(a.1 - b.1)).sum();
        assert!((length / (2.0 * std::f64::consts::PI * 0.7) - 1.0).abs() < 0.01, "{length}");
    }

    #[test]
    fn logarithmic_ticks_are_round() {
        let scale = Scale::log("N", [0.05, 5.0]);
        let texts: Vec<&str> = scale.ticks.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(texts, ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"]);
        assert!((scale.share(0.5) - 0.5).abs() < 1e-12);
    }
}
