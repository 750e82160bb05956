//! Forces over time and against each other.

use super::figures::width;
use crate::axes::{Axis, Legend, Panel, Sample};
use crate::canvas::{Canvas, Figure, Line, Marker};
use crate::colour::{Colour, GREY, INK, MODEL, SERIES, rgb};
use fingerpad_diagnose::{ForceTrace, Plot};

/// Forces of the worst runs over time, measured and by the three models.
pub struct Traces<'a> {
    /// The plotted runs.
    pub traces: &'a [ForceTrace],
    /// Whether an effect is claimed; without one there are two models.
    pub claimed: bool,
    /// Whether it is for a narrow page: one panel below the other.
    pub narrow: bool,
}

/// Height of a panel with its labels, px.
const TRACE: f64 = 224.0;
/// Behind the time in which the plate slides.
const SLIDES: Colour = rgb(0xf0f2f5);

impl Traces<'_> {
    fn models(&self) -> &[(&'static str, Colour)] {
        const MODELS: [(&str, Colour); 3] =
            [("as calibrated", rgb(0xa3a8ae)), ("refitted", MODEL), ("with the effect", SERIES[1])];
        if self.claimed { &MODELS } else { &MODELS[..2] }
    }

    fn legend(&self) -> Legend<'_> {
        let mut entries = vec![(Sample::Point(Marker::Circle, true), "measured", INK)];
        entries.extend(self.models().iter().map(|(name, colour)| (Sample::Line, *name, *colour)));
        entries.push((Sample::Area, "the plate slides", SLIDES));
        Legend { width: f64::from(self.size_in(0.0).0), entries }
    }

    /// Width and height under a legend of a height.
    fn size_in(&self, legend: f64) -> (u32, u32) {
        let runs = self.traces.len().max(1) as f64;
        if self.narrow { (380, (legend + 2.0 * runs * TRACE) as u32) } else { (1120, (legend + 2.0 * TRACE) as u32) }
    }
}

impl Figure for Traces<'_> {
    fn size(&self) -> (u32, u32) {
        self.size_in(self.legend().height())
    }

    fn draw(&self, canvas: &mut Canvas) {
        let legend = self.legend();
        legend.draw(canvas);
        // A run is a column of two panels; on narrow pages all are in one column.
        let column = legend.width / if self.narrow { 1.0 } else { self.traces.len().max(3) as f64 };
        for (run, trace) in self.traces.iter().enumerate() {
            for (k, name) in ["normal force, N", "friction along the motion, N"].iter().enumerate() {
                let forces = trace.readings_n.iter().chain(trace.models_n.iter().flatten()).map(|f| f[k]);
                let place = if self.narrow { (0.0, (2 * run + k) as f64) } else { (run as f64, k as f64) };
                let ends = [0.0, trace.t_s.last().copied().unwrap_or(1.0)];
                let panel = Panel {
                    left: 50.0 + column * place.0,
                    top: legend.height() + 34.0 + TRACE * place.1,
                    width: column - 66.0,
                    height: TRACE - 90.0,
                    x: Axis::between("time since the run's first row, s", ends, 6),
                    y: Axis::covering(&format!("{}: {name}", trace.run), [0.0, 0.0], forces, 4),
                };
                for [from, to] in &trace.slides_s {
                    let ((left, top), (right, bottom)) = (panel.at(*from, panel.y.max()), panel.at(*to, panel.y.min()));
                    canvas.rect(left, top, right - left, bottom - top, SLIDES);
                }
                panel.draw(canvas);
                let points = |list: &[[f64; 2]]| panel.path(trace.t_s.iter().zip(list).map(|(t, f)| (*t, Some(f[k]))));
                for ((_, colour), model) in self.models().iter().zip(&trace.models_n) {
                    canvas.line(&points(model), Line::solid(*colour, 2.0));
                }
                for at in points(&trace.readings_n) {
                    canvas.marker(Marker::Circle, at, 2.0, INK, true);
                }
            }
        }
    }
}

/// Points and curves.
pub struct Scatter<'a> {
    /// The plotted quantity.
    pub plot: &'a Plot,
    /// Whether it is for a narrow page.
    pub narrow: bool,
}

impl Scatter<'_> {
    fn colour(curve: usize) -> Colour {
        SERIES[(curve + 1) % SERIES.len()]
    }

    fn legend(&self) -> Legend<'_> {
        let curves = self.plot.curves.iter().enumerate();
        let curves = curves.map(|(i, (name, _))| (Sample::Line, name.as_str(), Self::colour(i)));
        let points = self.plot.points.iter().enumerate();
        let points = points.map(|(i, (name, _))| {
            (Sample::Point(Marker::Circle, i == 0), name.as_str(), if i == 0 { INK } else { GREY })
        });
        Legend { width: width(self.narrow), entries: curves.chain(points).collect() }
    }

    /// Sides of the panel, px.
    fn panel(&self) -> (f64, f64) {
        let side = width(self.narrow) - 74.0;
        (side, if self.plot.square { side } else { 270.0 })
    }
}

impl Figure for Scatter<'_> {
    fn size(&self) -> (u32, u32) {
        (width(self.narrow) as u32, (self.legend().height() + 36.0 + self.panel().1 + 56.0) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
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
        let legend = self.legend();
        legend.draw(canvas);
        let (width, height) = self.panel();
        let panel = Panel {
            left: 58.0,
            top: legend.height() + 36.0,
            width,
            height,
            x: Axis::covering(&self.plot.x, x, std::iter::empty(), 5),
            y: Axis::covering(&self.plot.y, y, std::iter::empty(), 5),
        };
        panel.draw(canvas);
        if self.plot.square {
            let (low, high) = (panel.at(0.0, panel.y.min()), panel.at(0.0, panel.y.max()));
            let (left, right) = (panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0));
            canvas.line(&[low, high], Line::solid(GREY, 0.8));
            canvas.line(&[left, right], Line::solid(GREY, 0.8));
        }
        for (i, (_, points)) in self.plot.points.iter().enumerate() {
            for p in points {
                canvas.marker(Marker::Circle, panel.at(p[0], p[1]), 2.6, if i == 0 { INK } else { GREY }, i == 0);
            }
        }
        for (i, (_, curve)) in self.plot.curves.iter().enumerate() {
            let points: Vec<(f64, f64)> = curve.iter().map(|p| panel.at(p[0], p[1])).collect();
            canvas.line(&points, Line::solid(Self::colour(i), 2.2));
        }
    }
}
