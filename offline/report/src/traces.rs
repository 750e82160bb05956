//! Charts of traces side by side, for pictures without a page.
//!
//! Main function: [`traces_svg`]. Uses axes and canvas.

use super::axes::{Axis, Panel, legend_text};
use super::canvas::{Canvas, Figure, Line, Marker, Text, svg};
use super::colour::{GREY, INK, SERIES};

const WIDTH: f64 = 470.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = 18.0;
/// Height of a chart's title and legend, of the chart, and of the labels below it, px; a line of the legend.
const ABOVE: f64 = 58.0;
const HEIGHT: f64 = 250.0;
const BELOW: f64 = 56.0;
const LEGEND: f64 = 17.0;

/// One quantity over another.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Name in the legend.
    pub name: String,
    /// Points; one that is not finite breaks the line.
    pub points: Vec<[f64; 2]>,
    /// Whether points are drawn in place of a line.
    pub is_dots: bool,
}

/// A chart of traces.
#[derive(Clone, Debug)]
pub struct TraceChart {
    /// Title.
    pub title: String,
    /// Quantity and unit to the right and upwards.
    pub labels: [String; 2],
    /// Values that the vertical axis covers at least.
    pub least: [f64; 2],
    /// The traces.
    pub traces: Vec<Trace>,
}

/// Charts side by side as an SVG file.
pub fn traces_svg(charts: &[TraceChart]) -> String {
    super::standalone(&svg(&Charts(charts)))
}

struct Charts<'a>(&'a [TraceChart]);

impl Charts<'_> {
    fn legend_height(&self) -> f64 {
        LEGEND * self.0.iter().map(|chart| chart.traces.len()).max().unwrap_or(0) as f64
    }
}

impl Figure for Charts<'_> {
    fn size(&self) -> (u32, u32) {
        let width = WIDTH * self.0.len() as f64;
        (width as u32, (ABOVE + self.legend_height() + HEIGHT + BELOW) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        for (i, chart) in self.0.iter().enumerate() {
            chart.draw(canvas, WIDTH * i as f64, self.legend_height());
        }
    }
}

impl TraceChart {
    fn draw(&self, canvas: &mut Canvas, left: f64, legend: f64) {
        let of = |k: usize| self.traces.iter().flat_map(move |trace| trace.points.iter().map(move |p| p[k]));
        let first = of(0).find(|x| x.is_finite()).unwrap_or(0.0);
        let panel = Panel {
            left: left + LEFT,
            top: ABOVE + legend,
            width: WIDTH - LEFT - RIGHT,
            height: HEIGHT,
            x: Axis::covering(&self.labels[0], [first; 2], of(0), 6),
            y: Axis::covering(&self.labels[1], self.least, of(1), 5),
        };
        panel.draw(canvas);
        canvas.text(&self.title, (left + 18.0, 13.0), Text { em: 14.0, bold: true, ..Text::BODY });
        for (k, trace) in self.traces.iter().enumerate() {
            let colour = if trace.is_dots { INK } else { SERIES[k % SERIES.len()] };
            let points: Vec<_> = trace.points.iter().map(|[x, y]| panel.at(*x, *y)).collect();
            let sample = (panel.left, 31.0 + LEGEND * k as f64);
            if trace.is_dots {
                for at in points.iter().chain([&(sample.0 + 10.0, sample.1)]) {
                    canvas.marker(Marker::Circle, *at, 2.4, colour, false);
                }
            } else {
                canvas.line(&points, Line::solid(colour, 1.6));
                canvas.line(&[sample, (sample.0 + 20.0, sample.1)], Line::solid(colour, 2.0));
            }
            legend_text(canvas, (sample.0 + 27.0, sample.1), &trace.name);
        }
        if self.traces.is_empty() {
            canvas.text("no data", panel.at(panel.x.min(), panel.y.max()), Text { colour: GREY, ..Text::BODY });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_stand_side_by_side_and_gaps_break_lines() {
        let trace =
            |is_dots| Trace { name: "a".into(), points: vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]], is_dots };
        let chart = TraceChart {
            title: "t".into(),
            labels: ["x".into(), "y".into()],
            least: [0.0; 2],
            traces: vec![trace(false), trace(true)],
        };
        let one = traces_svg(std::slice::from_ref(&chart));
        assert!(one.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"470\""), "{one}");
        assert!(traces_svg(&[chart.clone(), chart]).contains("width=\"940\""));
    }
}
