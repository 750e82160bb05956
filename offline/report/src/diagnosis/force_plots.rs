//! Forces over rows and against each other.

use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Figure, Line, Marker, Text};
use crate::colour::{GREY, INK, MODEL, SERIES, WHITE, mix};
use fingerpad_diagnose::{ForceTrace, Plot};

/// Forces of the worst runs, measured and by the three models.
pub struct Traces<'a> {
    /// The plotted runs.
    pub traces: &'a [ForceTrace],
    /// Whether an effect is claimed; without one there are two models.
    pub claimed: bool,
    /// Whether it is for a narrow page: one panel below the other.
    pub narrow: bool,
}

const TRACE: f64 = 214.0;

impl Figure for Traces<'_> {
    fn size(&self) -> (u32, u32) {
        let height = TRACE * self.traces.len().max(1) as f64;
        if self.narrow { (380, (68.0 + 2.0 * height) as u32) } else { (940, (48.0 + height) as u32) }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let models = [("as calibrated", mix(WHITE, GREY, 0.6)), ("refitted", MODEL), ("with the effect", SERIES[1])];
        let shown = if self.claimed { &models[..] } else { &models[..2] };
        // On a narrow page the legend has two rows of two.
        let place = |i: usize| {
            if self.narrow {
                (46.0 + 160.0 * (i % 2) as f64, 16.0 + 20.0 * (i / 2) as f64)
            } else {
                (70.0 + 130.0 * i as f64, 16.0)
            }
        };
        let (x, y) = place(0);
        canvas.marker(Marker::Circle, (x, y), 2.6, INK, true);
        canvas.text("measured", (x + 10.0, y), Text::BODY);
        for (i, (name, colour)) in shown.iter().enumerate() {
            let (x, y) = place(i + 1);
            canvas.line(&[(x, y), (x + 22.0, y)], Line::solid(*colour, 2.2));
            canvas.text(name, (x + 30.0, y), Text::BODY);
        }
        for (row, trace) in self.traces.iter().enumerate() {
            for (k, name) in ["normal force, N", "friction along the motion, N"].iter().enumerate() {
                let forces = trace.readings_n.iter().chain(trace.models_n.iter().flatten()).map(|f| f[k]);
                let (left, top, width) = if self.narrow {
                    (46.0, 82.0 + TRACE * (2 * row + k) as f64, 322.0)
                } else {
                    (70.0 + 450.0 * k as f64, 62.0 + TRACE * row as f64, 370.0)
                };
                let panel = Panel {
                    left,
                    top,
                    width,
                    height: TRACE - 74.0,
                    x: Axis::covering("row of the run", [1.0, trace.readings_n.len() as f64], std::iter::empty(), 6),
                    y: Axis::covering(&format!("{}: {name}", trace.run), [0.0, 0.0], forces, 4),
                };
                panel.draw(canvas);
                for ((_, colour), model) in shown.iter().zip(&trace.models_n) {
                    let points: Vec<(f64, f64)> =
                        (1..).zip(model).map(|(row, f)| panel.at(f64::from(row), f[k])).collect();
                    canvas.line(&points, Line::solid(*colour, 2.0));
                }
                for (row, f) in (1..).zip(&trace.readings_n).filter(|(_, f)| f[k].is_finite()) {
                    canvas.marker(Marker::Circle, panel.at(f64::from(row), f[k]), 2.4, INK, true);
                }
            }
        }
    }
}

/// Points and curves.
pub struct Scatter<'a> {
    /// The plotted quantity.
    pub plot: &'a Plot,
    /// Whether it is for a narrow page: the legend above the panel.
    pub narrow: bool,
}

impl Scatter<'_> {
    /// Height of the legend above the panel, px.
    fn above(&self) -> f64 {
        if self.narrow { 20.0 * (self.plot.curves.len() + self.plot.points.len()) as f64 } else { 0.0 }
    }
}

impl Figure for Scatter<'_> {
    fn size(&self) -> (u32, u32) {
        match (self.narrow, self.plot.square) {
            (true, square) => (380, self.above() as u32 + if square { 412 } else { 370 }),
            (_, true) => (760, 600),
            _ => (900, 430),
        }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let width = self.size().0;
        let all = || self.plot.points.iter().chain(&self.plot.curves).flat_map(|s| &s.1);
        let range = |k: usize| {
            let values = all().map(move |p| p[k]);
            [values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max)]
        };
        let (mut x, mut y) = (range(0), range(1));
        if self.plot.square {
            // Zero belongs to the picture: it is where the readings would lie around.
            let half = 0.52 * (x[1].max(0.0) - x[0].min(0.0)).max(y[1].max(0.0) - y[0].min(0.0));
            let middle = |r: [f64; 2]| 0.5 * (r[1].max(0.0) + r[0].min(0.0));
            (x, y) = ([middle(x) - half, middle(x) + half], [middle(y) - half, middle(y) + half]);
        }
        let (left, w, h) = match (self.narrow, self.plot.square) {
            (true, square) => (58.0, 308.0, if square { 308.0 } else { 266.0 }),
            (_, true) => (74.0, 480.0, 480.0),
            _ => (74.0, 600.0, 320.0),
        };
        let ticks = if self.narrow { 4 } else { 6 };
        let panel = Panel {
            left,
            top: 42.0 + self.above(),
            width: w,
            height: h,
            x: Axis::covering(&self.plot.x, x, std::iter::empty(), ticks),
            y: Axis::covering(&self.plot.y, y, std::iter::empty(), ticks),
        };
        panel.draw(canvas);
        if self.plot.square {
            let (low, high) = (panel.at(0.0, panel.y.min()), panel.at(0.0, panel.y.max()));
            let (left, right) = (panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0));
            canvas.line(&[low, high], Line::solid(GREY, 0.8));
            canvas.line(&[left, right], Line::solid(GREY, 0.8));
        }
        let (beside, mut legend) = if self.narrow { (14.0, 14.0) } else { (panel.left + w + 22.0, 60.0) };
        let most = f64::from(width) - beside - 30.0;
        for (i, (name, curve)) in self.plot.curves.iter().enumerate() {
            let colour = SERIES[(i + 1) % SERIES.len()];
            let points: Vec<(f64, f64)> = curve.iter().map(|p| panel.at(p[0], p[1])).collect();
            canvas.line(&points, Line::solid(colour, 2.0));
            let at = beside;
            canvas.line(&[(at, legend), (at + 20.0, legend)], Line::solid(colour, 2.0));
            canvas.text(name, (at + 28.0, legend), Text::BODY.within(name, most));
            legend += 20.0;
        }
        for (i, (name, points)) in self.plot.points.iter().enumerate() {
            let colour = if i == 0 { INK } else { GREY };
            for p in points {
                canvas.marker(Marker::Circle, panel.at(p[0], p[1]), 3.0, colour, i == 0);
            }
            let at = beside + 10.0;
            canvas.marker(Marker::Circle, (at, legend), 3.0, colour, i == 0);
            canvas.text(name, (at + 18.0, legend), Text::BODY.within(name, most));
            legend += 20.0;
        }
    }
}
