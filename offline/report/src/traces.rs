//! Charts of traces in rows, for pages and for pictures without a page.
//!
//! Main types: [`TraceChart`], [`Charts`]; main function: [`traces_svg`]. Uses axes and canvas.

use serde::Serialize;

use super::axes::{Axis, Panel};
use super::canvas::{Canvas, Figure, Line, Marker, Text, svg};
use super::colour::{Colour, GREY, INK, SERIES};

const WIDTH: f64 = 470.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = 18.0;
/// Height of a chart's title and legend, of the chart, and of the labels below it, px; a line of the legend.
const ABOVE: f64 = 58.0;
const HEIGHT: f64 = 250.0;
const BELOW: f64 = 56.0;
const LEGEND: f64 = 17.0;

/// Space right of a chart for the names of its traces' ends, px.
const ENDS: f64 = 68.0;

/// The colour of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Hue {
    /// That of its number among the chart's traces; of dots that of text.
    #[default]
    Next,
    /// That of text.
    Ink,
    /// A number in the series of colours.
    Series(usize),
}

/// One quantity over another.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Trace {
    /// Name in the legend; without one the trace is not in it.
    pub name: String,
    /// Name at its last point.
    pub end: String,
    /// Points; one that is not finite breaks the line.
    pub points: Vec<[f64; 2]>,
    /// Whether points are drawn in place of a line.
    pub is_dots: bool,
    /// Whether the line is dashed.
    pub is_dashed: bool,
    /// Its colour.
    pub hue: Hue,
}

/// A chart of traces.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TraceChart {
    /// Title.
    pub title: String,
    /// Quantity and unit to the right and upwards.
    pub labels: [String; 2],
    /// Values that the vertical axis covers at least.
    pub least: [f64; 2],
    /// Whether both axes have 0 in the middle and the same scale.
    pub is_round: bool,
    /// The traces.
    pub traces: Vec<Trace>,
}

/// Charts side by side as an SVG file.
pub fn traces_svg(charts: &[TraceChart]) -> String {
    super::standalone(&svg(&Charts { charts, columns: charts.len() }))
}

/// Charts in rows.
pub struct Charts<'a> {
    /// The charts.
    pub charts: &'a [TraceChart],
    /// Charts in a row.
    pub columns: usize,
}

impl Charts<'_> {
    fn legend_height(&self) -> f64 {
        LEGEND * self.charts.iter().map(|chart| chart.legend().count()).max().unwrap_or(0) as f64
    }

    fn row_height(&self) -> f64 {
        ABOVE + self.legend_height() + HEIGHT + BELOW
    }
}

impl Figure for Charts<'_> {
    fn size(&self) -> (u32, u32) {
        let rows = self.charts.len().div_ceil(self.columns.max(1));
        ((WIDTH * self.columns as f64) as u32, (self.row_height() * rows as f64) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        for (i, chart) in self.charts.iter().enumerate() {
            let (row, column) = (i / self.columns.max(1), i % self.columns.max(1));
            chart.draw(canvas, (WIDTH * column as f64, self.row_height() * row as f64), self.legend_height());
        }
    }
}

impl TraceChart {
    fn legend(&self) -> impl Iterator<Item = (usize, &Trace)> {
        self.traces.iter().enumerate().filter(|(_, trace)| !trace.name.is_empty())
    }

    fn axes(&self, [width, height]: [f64; 2]) -> [Axis; 2] {
        let of = |k: usize| self.traces.iter().flat_map(move |trace| trace.points.iter().map(move |p| p[k]));
        if self.is_round {
            let reach =
                of(0).chain(of(1)).filter(|v| v.is_finite()).fold(1e-9, |most: f64, v| most.max(1.06 * v.abs()));
            let axis = |k: usize, reach: f64| Axis::between(&self.labels[k], [-reach, reach], 6);
            return [axis(0, reach * width / height), axis(1, reach)];
        }
        let first = of(0).find(|x| x.is_finite()).unwrap_or(0.0);
        [Axis::covering(&self.labels[0], [first; 2], of(0), 6), Axis::covering(&self.labels[1], self.least, of(1), 5)]
    }

    fn draw(&self, canvas: &mut Canvas, (left, top): (f64, f64), legend: f64) {
        let ends = if self.traces.iter().any(|trace| !trace.end.is_empty()) { ENDS } else { RIGHT };
        let [width, height] = [WIDTH - LEFT - ends, HEIGHT];
        let [x, y] = self.axes([width, height]);
        let panel = Panel { left: left + LEFT, top: top + ABOVE + legend, width, height, x, y };
        panel.draw(canvas);
        canvas.text(&self.title, (left + 18.0, top + 13.0), Text { em: 14.0, bold: true, ..Text::BODY });
        let mut ends = Vec::new();
        for (k, trace) in self.traces.iter().enumerate() {
            let points: Vec<_> = trace.points.iter().map(|[x, y]| panel.at(*x, *y)).collect();
            trace.draw(canvas, &points, trace.colour(k));
            if let (Some(last), false) = (points.last(), trace.end.is_empty()) {
                ends.push((last.1, trace.end.clone(), trace.colour(k)));
            }
        }
        panel.label_ends(canvas, ends);
        for (line, (k, trace)) in self.legend().enumerate() {
            let (x, y) = (panel.left, top + 31.0 + LEGEND * line as f64);
            let sample = if trace.is_dots { vec![(x + 10.0, y)] } else { vec![(x, y), (x + 20.0, y)] };
            trace.draw(canvas, &sample, trace.colour(k));
            canvas.text(&trace.name, (x + 27.0, y), Text::BODY);
        }
        if self.traces.is_empty() {
            canvas.text("no data", panel.at(panel.x.min(), panel.y.max()), Text { colour: GREY, ..Text::BODY });
        }
    }
}

impl Trace {
    /// * `number`: among the chart's traces
    fn colour(&self, number: usize) -> Colour {
        match self.hue {
            Hue::Ink => INK,
            Hue::Next if self.is_dots => INK,
            Hue::Next => SERIES[number % SERIES.len()],
            Hue::Series(number) => SERIES[number % SERIES.len()],
        }
    }

    /// * `points`: px
    fn draw(&self, canvas: &mut Canvas, points: &[(f64, f64)], colour: Colour) {
        if self.is_dots {
            points.iter().for_each(|at| canvas.marker(Marker::Circle, *at, 2.4, colour, false));
        } else {
            canvas.line(points, Line { dash: self.is_dashed.then_some((5.0, 3.0)), ..Line::solid(colour, 1.6) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_stand_side_by_side_and_gaps_break_lines() {
        let trace = |is_dots| Trace {
            name: "a".into(),
            points: vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]],
            is_dots,
            ..Trace::default()
        };
        let chart = TraceChart {
            title: "t".into(),
            labels: ["x".into(), "y".into()],
            traces: vec![trace(false), trace(true)],
            ..TraceChart::default()
        };
        let one = traces_svg(std::slice::from_ref(&chart));
        assert!(one.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"470\""), "{one}");
        assert!(traces_svg(&[chart.clone(), chart]).contains("width=\"940\""));
    }
}
