//! Residuals over a driver with the law through them, bars of residuals and of evidence.

use super::words::axis;
use crate::axes::{Axis, Legend, Panel, Sample};
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{Colour, FAINT, GREY, INK, MODEL, SERIES, WHITE, mix, rgb};
use crate::numbers::{fixed, significant};
use fingerpad_diagnose::{CrossValidationError, Diagnosis, DriverPlot, FeConfirmation};

/// Width of a figure that stands beside another one on wide pages, and of one on narrow pages, px.
pub const fn width(narrow: bool) -> f64 {
    if narrow { 380.0 } else { 560.0 }
}

/// Colour of the band around a law.
const BAND: Colour = rgb(0xf7dcc8);

/// Residual over a driver with the law and its band through it; below, what the law leaves of it.
pub struct Driver<'a> {
    /// The plotted driver and its residuals.
    pub plot: &'a DriverPlot,
    /// Unit of its column.
    pub unit: &'a str,
    /// Whether it is for a narrow page.
    pub narrow: bool,
}

/// Heights of the panel of the law and of that below it, and what lies between and below, px.
const LAW: f64 = 220.0;
const LEFT_OVER: f64 = 90.0;
const BETWEEN: f64 = 44.0;
const BELOW: f64 = 56.0;
/// Points that a figure has at most; single rows scatter so that a part shows the same.
const MOST_POINTS: usize = 1200;

impl Driver<'_> {
    fn legend(&self) -> Legend<'_> {
        let points = if self.plot.run_sd > 0.0 {
            "measured less the model without it (bar: scatter)"
        } else {
            "measured less the model without it"
        };
        let entries = vec![
            (Sample::Point(Marker::Circle, true), points, INK),
            (Sample::Line, "the fitted law", SERIES[1]),
            (Sample::Area, "its 95 % band", BAND),
        ];
        Legend { width: width(self.narrow), entries }
    }
}

impl Figure for Driver<'_> {
    fn size(&self) -> (u32, u32) {
        let height = self.legend().height() + 36.0 + LAW + BETWEEN + LEFT_OVER + BELOW;
        (width(self.narrow) as u32, height as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let (legend, points) = (self.legend(), &self.plot.points);
        legend.draw(canvas);
        // Rows are many; runs are few.
        let dense = self.plot.run_sd == 0.0;
        let [low, high] = [points.first(), points.last()].map(|p| p.map_or(0.0, |p| p[0]));
        let around = (0.03 * (high - low)).max(1e-9);
        let x = Axis::between(&axis(&self.plot.column, self.unit), [low - around, high + around], 6);
        // Single rows scatter widely; the axes cover all but the outermost in a hundred.
        let covered = |label: &str, of: &dyn Fn(&[f64; 3]) -> f64, also: &[f64], ticks| {
            let mut sizes: Vec<f64> = points.iter().map(of).collect();
            sizes.sort_by(f64::total_cmp);
            let end = |share: f64, side: f64| {
                let value = sizes.get((share * sizes.len().saturating_sub(1) as f64) as usize);
                value.map(|v| v + side * self.plot.run_sd)
            };
            let outer = [end(0.01, -1.0), end(0.99, 1.0)].into_iter().flatten().chain(also.iter().copied());
            Axis::covering(label, [0.0; 2], outer.map(|v| 100.0 * v), ticks)
        };
        let law: Vec<f64> = self.plot.curve.iter().map(|c| c[1]).collect();
        let top = legend.height() + 36.0;
        let (left, right) = (54.0, 16.0);
        let panel = |top: f64, height: f64, y: Axis| {
            let x = x.clone();
            Panel { left, top, width: width(self.narrow) - left - right, height, x, y }
        };
        let above = panel(top, LAW, covered(&format!("{}, %", self.plot.channel), &|p| p[1], &law, 6));
        let left_over = covered("left with it in the model, %", &|p| p[1] - p[2], &[], 3);
        let below = panel(top + LAW + BETWEEN, LEFT_OVER, left_over);
        above.grid(canvas);
        below.draw(canvas);
        let held = |v: f64| (100.0 * v).clamp(above.y.min(), above.y.max());
        let edge = |side: f64| self.plot.curve.iter().map(move |c| (c[0], c[1] + side * c[2]));
        let band: Vec<_> = edge(1.0).chain(edge(-1.0).rev()).map(|(x, v)| above.at(x, held(v))).collect();
        canvas.area(&band, BAND);
        for part in [&above, &below] {
            canvas.line(&[part.at(part.x.min(), 0.0), part.at(part.x.max(), 0.0)], Line::solid(GREY, 1.0));
        }
        let (r, ink) = if dense { (1.6, mix(WHITE, INK, 0.5)) } else { (3.2, INK) };
        for p in points.iter().step_by(points.len().div_ceil(MOST_POINTS).max(1)) {
            for (part, v) in [(&above, p[1]), (&below, p[1] - p[2])] {
                let bar =
                    [-1.0, 1.0].map(|side| (100.0 * (v + side * self.plot.run_sd)).clamp(part.y.min(), part.y.max()));
                if part.holds(p[0], 100.0 * v) {
                    canvas.line(&bar.map(|v| part.at(p[0], v)), Line::solid(mix(WHITE, INK, 0.5), 1.0));
                    canvas.marker(Marker::Circle, part.at(p[0], 100.0 * v), r, ink, true);
                }
            }
        }
        above.line(canvas, self.plot.curve.iter().map(|c| (c[0], 100.0 * c[1])), Line::solid(SERIES[1], 2.2));
    }
}

/// Evidence for all laws.
pub struct Bars<'a> {
    /// The plotted diagnosis.
    pub report: &'a Diagnosis,
    /// Whether it is for a narrow page.
    pub narrow: bool,
}

impl Figure for Bars<'_> {
    fn size(&self) -> (u32, u32) {
        let tests = self.report.tests.iter().filter(|t| t.testable).count().max(1);
        (width(self.narrow) as u32, (70 + 22 * tests) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let mut tests: Vec<_> = self.report.tests.iter().filter(|t| t.testable).collect();
        tests.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
        let most = tests.first().map_or(1.0, |t| t.gain_2ll).max(100.0);
        let left = 132.0;
        let longest = width(self.narrow) - left - 58.0;
        let place = |gain: f64| left + longest * (1.0 + gain.max(0.0)).ln() / (1.0 + most).ln();
        let bottom = 24.0 + 22.0 * tests.len() as f64;
        let small = Text { em: 11.0, colour: GREY, ..Text::BODY };
        let mut tick = 1.0;
        while tick <= most {
            let x = place(tick);
            canvas.line(&[(x, 18.0), (x, bottom)], Line::solid(FAINT, 0.8));
            canvas.text(&fixed(tick, 0), (x, bottom + 10.0), Text { h: HPos::Center, ..small });
            tick *= 10.0;
        }
        canvas.text("gain in 2 log likelihood", (left, bottom + 28.0), Text::BODY);
        let named: Vec<&str> = self.report.effects.iter().map(|e| e.law.as_str()).collect();
        for (i, t) in tests.iter().enumerate() {
            let y = 24.0 + 22.0 * i as f64;
            let named = named.contains(&t.law.as_str());
            let style = Text { h: HPos::Right, bold: named, ..Text::BODY };
            let name = t.law.replace('_', " ");
            canvas.text(&name, (left - 8.0, y + 8.0), style.within(&name, left - 10.0));
            let w = (place(t.gain_2ll) - left).max(1.0);
            let colour = if named { SERIES[1] } else { MODEL };
            canvas.rect(left, y, w, 15.0, if t.significant { colour } else { mix(WHITE, colour, 0.25) });
            canvas.text(&significant(t.gain_2ll, 3), (left + 6.0 + w, y + 8.0), small);
        }
    }
}

/// Root mean square residuals per channel, beside each other.
pub struct GapBars<'a> {
    /// Name, values of normal, x and y in N, colour.
    pub series: Vec<(&'a str, [f64; 3], Colour)>,
    /// Whether it is for a narrow page.
    pub narrow: bool,
}

impl<'a> GapBars<'a> {
    /// Held-out runs under the three models; without a claimed effect there are two. Bars of the finite elements with
    /// the effect are beside them if there are any, for their own strokes.
    pub fn held_out(gap: &CrossValidationError, claimed: bool, fe: Option<&FeConfirmation>, narrow: bool) -> Self {
        let mut series =
            vec![("as calibrated", gap.rms_calibrated_n, mix(WHITE, GREY, 0.5)), ("refitted", gap.rms_before_n, GREY)];
        if claimed {
            series.push(("with the effect", gap.rms_after_n, SERIES[1]));
        }
        if let Some(fe) = fe {
            series.push(("finite elements with it", fe.rms_after_n, mix(WHITE, SERIES[1], 0.5)));
        }
        series.push(("noise floor", gap.floor_rms_n, MODEL));
        Self { series, narrow }
    }

    /// The finite elements beside the reduced model.
    pub fn confirmation(fe: &FeConfirmation, narrow: bool) -> Self {
        let series = vec![
            ("finite elements before", fe.rms_before_n, GREY),
            ("finite elements after", fe.rms_after_n, SERIES[1]),
            ("reduced before", fe.reduced_before_n, mix(WHITE, GREY, 0.5)),
            ("reduced after", fe.reduced_after_n, mix(WHITE, SERIES[1], 0.5)),
            ("noise floor", fe.floor_rms_n, MODEL),
        ];
        Self { series, narrow }
    }

    fn legend(&self) -> Legend<'_> {
        let entries = self.series.iter().map(|(name, _, colour)| (Sample::Area, *name, *colour)).collect();
        Legend { width: width(self.narrow), entries }
    }
}

impl Figure for GapBars<'_> {
    fn size(&self) -> (u32, u32) {
        (width(self.narrow) as u32, (self.legend().height() + 268.0) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let legend = self.legend();
        legend.draw(canvas);
        let values = self.series.iter().flat_map(|s| s.1).map(|v| 1000.0 * v);
        let panel = Panel {
            left: 52.0,
            top: legend.height() + 36.0,
            width: width(self.narrow) - 64.0,
            height: 200.0,
            x: Axis::bare([0.0, 3.0]),
            y: Axis::covering("Root mean square residual, mN", [0.0, 1.0], values, 5),
        };
        panel.grid(canvas);
        let bars = self.series.len() as f64;
        let pitch = 0.94 * panel.width / 3.0 / bars.max(4.0);
        for (channel, name) in ["normal", "x", "y"].iter().enumerate() {
            let centre = panel.at(channel as f64 + 0.5, 0.0);
            canvas.text(name, (centre.0, centre.1 + 16.0), Text { h: HPos::Center, ..Text::BODY });
            for (k, (_, rms, colour)) in self.series.iter().enumerate() {
                let x = centre.0 + pitch * (k as f64 - 0.5 * bars);
                let top = panel.at(0.0, 1000.0 * rms[channel]).1;
                canvas.rect(x, top, 0.9 * pitch, centre.1 - top, *colour);
                let text = significant(1000.0 * rms[channel], 3);
                let style = Text { em: 10.5, h: HPos::Center, ..Text::BODY };
                canvas.text(&text, (x + 0.45 * pitch, top - 9.0), style.within(&text, 0.96 * pitch));
            }
        }
    }
}
