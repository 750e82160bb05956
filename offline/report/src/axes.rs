//! Axes, ticks and the frame of a chart.

use super::canvas::{Canvas, HPos, Line, Marker, Text, VPos};
use super::colour::{Colour, FAINT, GREY};
use super::font;
use super::numbers::fixed;

/// An axis, linear or logarithmic.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    log: bool,
    /// Positions of lines and numbers, rising, and the numbers.
    pub ticks: Vec<(f64, String)>,
    /// Quantity and unit.
    pub label: String,
}

impl Axis {
    /// A linear axis between two values, without ticks.
    pub fn bare([low, high]: [f64; 2]) -> Self {
        Self { low, high, log: false, ticks: Vec::new(), label: String::new() }
    }

    /// A linear axis that covers the finite ones of the values, and `least`, in about `count` steps of 1, 2, 2.5 or 5.
    ///
    /// Values may go below the first tick by a twentieth of a step.
    pub fn covering(label: &str, least: [f64; 2], values: impl Iterator<Item = f64>, count: usize) -> Self {
        let [mut lo, mut hi] = least;
        for v in values.filter(|v| v.is_finite()) {
            (lo, hi) = (lo.min(v), hi.max(v));
        }
        let span = if hi > lo { hi - lo } else { 1.0 };
        let raw = span / count.max(1) as f64;
        let power = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 2.5, 5.0, 10.0].iter().map(|m| m * power).find(|s| *s >= raw * 0.999).unwrap_or(raw);
        let (first, last) = ((lo / step + 0.05).floor() as i64, (hi / step - 1e-9).ceil() as i64);
        let last = last.max(first + 1);
        let whole =
            |decimals: i32| (step * 10f64.powi(decimals)).fract().min(1.0 - (step * 10f64.powi(decimals)).fract());
        let decimals = (0..6).find(|d| whole(*d).abs() < 1e-6).unwrap_or(6) as usize;
        let at = |i: i64| i as f64 * step;
        let ticks = (first..=last).map(|i| (at(i), fixed(at(i), decimals))).collect();
        Self { ticks, label: label.to_owned(), ..Self::bare([at(first), at(last)]) }
    }

    /// A linear axis from `low` to `high`, ticks at round values inside.
    pub fn between(label: &str, [low, high]: [f64; 2], count: usize) -> Self {
        let mut axis = Self::covering(label, [low, high], std::iter::empty(), count);
        axis.ticks.retain(|(tick, _)| (low..=high).contains(tick));
        Self { low, high, ..axis }
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

    /// Its first value.
    pub fn min(&self) -> f64 {
        self.low
    }

    /// Its last value.
    pub fn max(&self) -> f64 {
        self.high
    }

    fn share(&self, v: f64) -> f64 {
        if self.log {
            (v / self.low).ln() / (self.high / self.low).ln()
        } else {
            (v - self.low) / (self.high - self.low)
        }
    }

    fn holds(&self, v: f64) -> bool {
        v >= self.low && v <= self.high
    }
}

/// A chart's rectangle and its axes.
pub struct Panel {
    /// Left edge, px.
    pub left: f64,
    /// Upper edge, px.
    pub top: f64,
    /// Width, px.
    pub width: f64,
    /// Height, px.
    pub height: f64,
    /// Axis to the right.
    pub x: Axis,
    /// Axis upwards.
    pub y: Axis,
}

impl Panel {
    /// Position of a value.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (self.left + self.x.share(x) * self.width, self.top + (1.0 - self.y.share(y)) * self.height)
    }

    /// Pixel positions of values; missing values are not finite.
    pub fn path(&self, values: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<(f64, f64)> {
        values.map(|(x, y)| self.at(x, y.unwrap_or(f64::NAN))).collect()
    }

    /// Whether a value lies on the chart.
    pub fn holds(&self, x: f64, y: f64) -> bool {
        self.x.holds(x) && self.y.holds(y)
    }

    /// Draws the parts of a line that lie on the chart; a point off it breaks the line.
    pub fn line(&self, canvas: &mut Canvas, points: impl Iterator<Item = (f64, f64)>, line: Line) {
        let place = |(x, y)| if self.holds(x, y) { self.at(x, y) } else { (f64::NAN, f64::NAN) };
        canvas.line(&points.map(place).collect::<Vec<_>>(), line);
    }

    /// Draws the grid and the numbers of the upward axis, and its label above it.
    pub fn grid(&self, canvas: &mut Canvas) {
        for (tick, number) in &self.y.ticks {
            let y = self.at(self.x.min(), *tick).1;
            canvas.line(&[(self.left, y), (self.left + self.width, y)], Line::solid(FAINT, 0.8));
            let style = Text { em: 11.5, colour: GREY, h: HPos::Right, ..Text::BODY };
            canvas.text(number, (self.left - 8.0, y), style);
        }
        let style = Text { em: 12.5, bold: true, ..Text::BODY };
        canvas.text(&self.y.label, (self.left - 34.0, self.top - 18.0), style);
    }

    /// Draws grid, ticks, numbers and the axes' labels.
    pub fn draw(&self, canvas: &mut Canvas) {
        self.grid(canvas);
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        canvas.line(&[(self.left, bottom), (right, bottom)], Line::solid(GREY, 1.0));
        for (tick, number) in &self.x.ticks {
            let x = self.at(*tick, self.y.min()).0;
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], Line::solid(GREY, 1.0));
            let style = Text { em: 11.5, colour: GREY, h: HPos::Center, v: VPos::Top, ..Text::BODY };
            canvas.text(number, (x, bottom + 8.0), style);
        }
        let style = Text { em: 12.5, h: HPos::Center, v: VPos::Top, ..Text::BODY };
        canvas.text(&self.x.label, (self.left + self.width / 2.0, bottom + 25.0), style);
    }

    /// Names series right of the panel at the heights of their ends, moved apart where they would touch.
    pub fn label_ends(&self, canvas: &mut Canvas, mut ends: Vec<(f64, String, Colour)>) {
        const APART: f64 = 15.0;
        ends.retain(|e| e.0.is_finite());
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        for i in 1..ends.len() {
            ends[i].0 = ends[i].0.max(ends[i - 1].0 + APART);
        }
        let mut limit = self.top + self.height;
        for end in ends.iter_mut().rev() {
            end.0 = end.0.min(limit);
            limit = end.0 - APART;
        }
        for (y, text, colour) in ends {
            canvas.text(&text, (self.left + self.width + 9.0, y), Text { bold: true, colour, ..Text::BODY });
        }
    }
}

/// What stands beside a name in a legend.
#[derive(Clone, Copy)]
pub enum Sample {
    /// A data point, filled or with a rim.
    Point(Marker, bool),
    /// A line.
    Line,
    /// A coloured area.
    Area,
}

/// Names of what a figure shows, in rows above it.
pub struct Legend<'a> {
    /// Width of the figure, px.
    pub width: f64,
    /// Samples with names and colours, in their order.
    pub entries: Vec<(Sample, &'a str, Colour)>,
}

impl Legend<'_> {
    /// Height of a row, of the space around all rows, and the left edge, px.
    const ROW: f64 = 20.0;
    const AROUND: f64 = 14.0;
    const LEFT: f64 = 14.0;

    /// Left end of each entry, and the middle of its row.
    fn places(&self) -> Vec<(f64, f64)> {
        let (mut x, mut y) = (Self::LEFT, Self::AROUND);
        let mut place = |(_, name, _): &(Sample, &str, Colour)| {
            let width = 28.0 + font::width(name, Text::BODY.em, false);
            if x > Self::LEFT && x + width > self.width - Self::LEFT {
                (x, y) = (Self::LEFT, y + Self::ROW);
            }
            let at = (x, y);
            x += width + 20.0;
            at
        };
        self.entries.iter().map(&mut place).collect()
    }

    /// Height of all rows, px.
    pub fn height(&self) -> f64 {
        self.places().last().map_or(0.0, |(_, y)| y + Self::AROUND)
    }

    /// Draws it from the figure's upper edge on.
    pub fn draw(&self, canvas: &mut Canvas) {
        for ((sample, name, colour), (x, y)) in self.entries.iter().zip(self.places()) {
            match sample {
                Sample::Point(marker, filled) => canvas.marker(*marker, (x + 10.0, y), 3.4, *colour, *filled),
                Sample::Line => canvas.line(&[(x, y), (x + 20.0, y)], Line::solid(*colour, 2.2)),
                Sample::Area => canvas.rect(x + 2.0, y - 6.0, 16.0, 12.0, *colour),
            }
            canvas.text(name, (x + 28.0, y), Text::BODY.within(name, self.width - x - 28.0 - 4.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_cover_their_values_in_round_steps() {
        let axis = Axis::covering("x", [0.0, 0.6], [0.47, f64::NAN].into_iter(), 6);
        assert!((axis.max() - 0.6).abs() < 1e-12);
        assert_eq!((axis.min(), axis.ticks[1].1.as_str(), axis.ticks.len()), (0.0, "0.1", 7));
        let axis = Axis::covering("x", [0.0, 0.0], std::iter::empty(), 5);
        assert!(axis.max() > axis.min());
        let axis = Axis::covering("x", [0.0, 0.0], [-0.3, 1.1].into_iter(), 5);
        assert!(axis.min() <= -0.3 && axis.max() >= 1.1);
        let axis = Axis::covering("x", [0.0, 0.0], [-0.005, 0.8].into_iter(), 5);
        assert_eq!(axis.min(), 0.0);
        let axis = Axis::covering("x", [0.0, 1.5], [1.5].into_iter(), 6);
        assert_eq!((axis.max(), axis.ticks[1].1.as_str()), (1.5, "0.25"));
    }

    #[test]
    fn logarithmic_ticks_are_round() {
        let axis = Axis::log("N", [0.05, 5.0]);
        let texts: Vec<&str> = axis.ticks.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(texts, ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"]);
        assert!((axis.share(0.5) - 0.5).abs() < 1e-12);
    }
}
