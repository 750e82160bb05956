//! Axes, ticks and the frame of a chart.

use plotters_backend::BackendColor;

use super::canvas::{Canvas, Drawn, HPos, Line, Text, VPos};
use super::colour::{FAINT, GREY, INK};
use super::numbers::fixed;

/// A linear axis from the first to the last of its ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Positions of lines and numbers, rising; at least two.
    pub ticks: Vec<f64>,
    /// Decimals of the numbers.
    pub decimals: usize,
    /// Quantity and unit.
    pub label: String,
}

impl Axis {
    /// An axis that covers the finite ones of the values, and `least`, in about `count` steps of 1, 2, 2.5 or 5.
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
        let ticks: Vec<_> = (first..=last.max(first + 1)).map(|i| i as f64 * step).collect();
        let whole =
            |decimals: i32| (step * 10f64.powi(decimals)).fract().min(1.0 - (step * 10f64.powi(decimals)).fract());
        let decimals = (0..6).find(|d| whole(*d).abs() < 1e-6).unwrap_or(6) as usize;
        Self { ticks, decimals, label: label.to_owned() }
    }

    /// First tick.
    pub fn min(&self) -> f64 {
        self.ticks[0]
    }

    /// Last tick.
    pub fn max(&self) -> f64 {
        self.ticks[self.ticks.len() - 1]
    }

    fn share(&self, v: f64) -> f64 {
        (v - self.min()) / (self.max() - self.min())
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

    /// Draws grid, ticks, numbers and the axes' labels; the upward axis is named above it.
    pub fn draw(&self, canvas: &mut Canvas<'_>) -> Drawn {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let small = Text { em: 11.5, colour: GREY, ..Text::BODY };
        for tick in &self.y.ticks {
            let y = self.at(self.x.min(), *tick).1;
            canvas.line(&[(self.left, y), (right, y)], Line::solid(FAINT, 0.8))?;
            let style = Text { h: HPos::Right, ..small };
            canvas.text(&fixed(*tick, self.y.decimals), (self.left - 8.0, y), style)?;
        }
        canvas.line(&[(self.left, bottom), (right, bottom)], Line::solid(GREY, 1.0))?;
        for tick in &self.x.ticks {
            let x = self.at(*tick, self.y.min()).0;
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], Line::solid(GREY, 1.0))?;
            let style = Text { h: HPos::Center, v: VPos::Top, ..small };
            canvas.text(&fixed(*tick, self.x.decimals), (x, bottom + 8.0), style)?;
        }
        let name = Text { em: 12.5, ..Text::BODY };
        let style = Text { h: HPos::Center, v: VPos::Top, ..name };
        canvas.text(&self.x.label, (self.left + self.width / 2.0, bottom + 25.0), style)?;
        canvas.text(&self.y.label, (self.left - 34.0, self.top - 18.0), Text { bold: true, ..name })
    }

    /// Names series right of the panel at the heights of their ends, moved apart where they would touch.
    pub fn label_ends(&self, canvas: &mut Canvas<'_>, mut ends: Vec<(f64, String, BackendColor)>) -> Drawn {
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
            canvas.text(&text, (self.left + self.width + 9.0, y), Text { bold: true, colour, ..Text::BODY })?;
        }
        Ok(())
    }
}

/// A name in a legend, beside its sample.
pub fn legend_text(canvas: &mut Canvas<'_>, at: (f64, f64), text: &str) -> Drawn {
    canvas.text(text, at, Text { colour: INK, ..Text::BODY })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_cover_their_values_in_round_steps() {
        let axis = Axis::covering("x", [0.0, 0.6], [0.47, f64::NAN].into_iter(), 6);
        assert!((axis.max() - 0.6).abs() < 1e-12);
        assert_eq!((axis.min(), axis.decimals, axis.ticks.len()), (0.0, 1, 7));
        let axis = Axis::covering("x", [0.0, 0.0], std::iter::empty(), 5);
        assert!(axis.max() > axis.min());
        let axis = Axis::covering("x", [0.0, 0.0], [-0.3, 1.1].into_iter(), 5);
        assert!(axis.min() <= -0.3 && axis.max() >= 1.1);
        let axis = Axis::covering("x", [0.0, 0.0], [-0.005, 0.8].into_iter(), 5);
        assert_eq!(axis.min(), 0.0);
        let axis = Axis::covering("x", [0.0, 1.5], [1.5].into_iter(), 6);
        assert_eq!((axis.max(), axis.decimals), (1.5, 2));
    }
}
