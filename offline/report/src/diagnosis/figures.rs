//! Bars of residuals and of evidence, and residuals over a driver.

use super::words::axis;
use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{Colour, FAINT, GREY, INK, MODEL, SERIES, WHITE, mix};
use crate::numbers::fixed;
use fingerpad_diagnose::{CrossValidationError, Diagnosis, DriverPlot, FeConfirmation};

/// Residual over a driver with the law through it.
pub struct Driver<'a> {
    /// The plotted driver and its residuals.
    pub plot: &'a DriverPlot,
    /// Unit of its column.
    pub unit: &'a str,
    /// Whether it is for a narrow page: the legend above the panel.
    pub narrow: bool,
}

impl Figure for Driver<'_> {
    fn size(&self) -> (u32, u32) {
        if self.narrow { (380, 400) } else { (900, 400) }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let points = &self.plot.points;
        let (first, last) = (points.first().map_or(0.0, |p| p[0]), points.last().map_or(1.0, |p| p[0]));
        // Single rows scatter widely; the axis covers all but the outermost in a hundred.
        let mut sizes: Vec<f64> = points.iter().map(|p| p[1]).collect();
        sizes.sort_by(f64::total_cmp);
        let cut =
            |share: f64| sizes.get((share * sizes.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0);
        let law = points.iter().map(|p| p[2]);
        let low = law.clone().fold(cut(0.01), f64::min);
        let high = law.fold(cut(0.99), f64::max);
        let residuals = [100.0 * low.min(0.0), 100.0 * high.max(0.0)];
        let (left, top, width, ticks) = if self.narrow { (58.0, 84.0, 308.0, 4) } else { (74.0, 42.0, 620.0, 7) };
        let panel = Panel {
            left,
            top,
            width,
            height: 332.0 - top,
            x: Axis::covering(&axis(&self.plot.column, self.unit), [first, last], std::iter::empty(), ticks),
            y: Axis::covering("Relative residual, %", residuals, std::iter::empty(), 6),
        };
        panel.draw(canvas);
        canvas.line(&[panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0)], Line::solid(GREY, 1.0));
        let inside = |p: &[f64; 3]| 100.0 * p[1] >= panel.y.min() && 100.0 * p[1] <= panel.y.max();
        let dense = points.len() > 300;
        for p in points.iter().filter(|p| inside(p)) {
            canvas.marker(Marker::Circle, panel.at(p[0], 100.0 * p[1]), if dense { 1.6 } else { 3.2 }, INK, !dense);
        }
        // The law is drawn at the points, joined if they are few, as dots if rows differ in more than the driver.
        for p in points {
            canvas.marker(Marker::Square, panel.at(p[0], 100.0 * p[2]), if dense { 1.6 } else { 3.0 }, SERIES[1], true);
        }
        let labels: [&[&str]; 2] = if self.narrow {
            [&["measured less the model without the effect"], &["the fitted law there"]]
        } else {
            [&["measured less the model", "without the effect"], &["the fitted law there"]]
        };
        let places = if self.narrow { [(24.0, 16.0), (24.0, 38.0)] } else { [(722.0, 60.0), (722.0, 98.0)] };
        canvas.marker(Marker::Circle, places[0], 3.2, INK, !dense);
        canvas.marker(Marker::Square, places[1], 3.0, SERIES[1], true);
        for ((x, y), lines) in places.into_iter().zip(labels) {
            for (k, line) in lines.iter().enumerate() {
                canvas.text(line, (x + 12.0, y + 15.0 * k as f64), Text::BODY);
            }
        }
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
        (
            if self.narrow { 380 } else { 900 },
            (70 + 22 * self.report.tests.iter().filter(|t| t.testable).count().max(1)) as u32,
        )
    }

    fn draw(&self, canvas: &mut Canvas) {
        let mut tests: Vec<_> = self.report.tests.iter().filter(|t| t.testable).collect();
        tests.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
        let most = tests.first().map_or(1.0, |t| t.gain_2ll).max(100.0);
        let (left, longest) = if self.narrow { (132.0, 190.0) } else { (190.0, 560.0) };
        let place = |gain: f64| left + longest * (1.0 + gain.max(0.0)).ln() / (1.0 + most).ln();
        let bottom = 24.0 + 22.0 * tests.len() as f64;
        let mut tick = 1.0;
        while tick <= most {
            let x = place(tick);
            canvas.line(&[(x, 18.0), (x, bottom)], Line::solid(FAINT, 0.8));
            canvas.text(
                &fixed(tick, 0),
                (x, bottom + 10.0),
                Text { em: 11.0, h: HPos::Center, colour: GREY, ..Text::BODY },
            );
            tick *= 10.0;
        }
        canvas.text("gain in 2 log likelihood", (left, bottom + 28.0), Text { em: 12.0, ..Text::BODY });
        let named: Vec<&str> = self.report.effects.iter().map(|e| e.law.as_str()).collect();
        for (i, t) in tests.iter().enumerate() {
            let y = 24.0 + 22.0 * i as f64;
            let colour = if named.contains(&t.law.as_str()) { SERIES[1] } else { MODEL };
            let style = Text { h: HPos::Right, bold: named.contains(&t.law.as_str()), ..Text::BODY };
            let name = t.law.replace('_', " ");
            canvas.text(&name, (left - 8.0, y + 8.0), style.within(&name, left - 10.0));
            let w = (place(t.gain_2ll) - left).max(1.0);
            let fill = if t.significant { colour } else { mix(WHITE, colour, 0.25) };
            canvas.rect(left, y, w, 15.0, fill);
            canvas.text(
                &fixed(t.gain_2ll, 1),
                (left + 6.0 + w, y + 8.0),
                Text { em: 11.0, colour: GREY, ..Text::BODY },
            );
        }
    }
}

/// Root mean square residuals per channel, beside each other.
pub struct GapBars<'a> {
    /// Name, values of normal, x and y in N, colour.
    pub series: Vec<(&'a str, [f64; 3], Colour)>,
    /// Whether it is for a narrow page: the legend above the panel.
    pub narrow: bool,
}

impl<'a> GapBars<'a> {
    /// Held-out runs under the three models; without a claimed effect there are two. Bars of the finite elements with
    /// the effect are beside them if there are any, for their own strokes.
    pub fn held_out(gap: &CrossValidationError, claimed: bool, fe: Option<&FeConfirmation>) -> Self {
        let mut series =
            vec![("as calibrated", gap.rms_calibrated_n, mix(WHITE, GREY, 0.5)), ("refitted", gap.rms_before_n, GREY)];
        if claimed {
            series.push(("with the effect", gap.rms_after_n, SERIES[1]));
        }
        if let Some(fe) = fe {
            series.push(("finite elements with it", fe.rms_after_n, mix(WHITE, SERIES[1], 0.5)));
        }
        series.push(("noise floor", gap.floor_rms_n, MODEL));
        Self { series, narrow: false }
    }

    /// The finite elements beside the reduced model.
    pub fn confirmation(fe: &FeConfirmation) -> Self {
        let series = vec![
            ("finite elements before", fe.rms_before_n, GREY),
            ("finite elements after", fe.rms_after_n, SERIES[1]),
            ("reduced before", fe.reduced_before_n, mix(WHITE, GREY, 0.5)),
            ("reduced after", fe.reduced_after_n, mix(WHITE, SERIES[1], 0.5)),
            ("noise floor", fe.floor_rms_n, MODEL),
        ];
        Self { series, narrow: false }
    }
}

impl Figure for GapBars<'_> {
    fn size(&self) -> (u32, u32) {
        if self.narrow { (380, 290 + 20 * self.series.len() as u32) } else { (900, 290) }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let values = self.series.iter().flat_map(|s| s.1).map(|v| 1000.0 * v);
        let above = if self.narrow { 20.0 * self.series.len() as f64 } else { 0.0 };
        let (left, width) = if self.narrow { (52.0, 316.0) } else { (74.0, 620.0) };
        let panel = Panel {
            left,
            top: 42.0 + above,
            width,
            height: 200.0,
            x: Axis::bare([0.0, 3.0]),
            y: Axis::covering("Root mean square residual, mN", [0.0, 1.0], values, 5),
        };
        panel.grid(canvas);
        let pitch = match self.series.len() {
            n if self.narrow => 100.0 / n as f64,
            n if n > 3 => 37.0,
            _ => 42.0,
        };
        let (gap, em) = if self.narrow { (2.0, 8.0) } else { (6.0, 10.5) };
        for (channel, name) in ["normal", "x", "y"].iter().enumerate() {
            let centre = panel.at(channel as f64 + 0.5, 0.0);
            canvas.text(name, (centre.0, centre.1 + 16.0), Text { h: HPos::Center, ..Text::BODY });
            for (k, (_, rms, colour)) in self.series.iter().enumerate() {
                let x = centre.0 + pitch * (k as f64 - 0.5 * self.series.len() as f64);
                let top = panel.at(0.0, 1000.0 * rms[channel]).1;
                canvas.rect(x, top, pitch - gap, centre.1 - top, *colour);
                let text = fixed(1000.0 * rms[channel], if self.narrow && rms[channel] >= 0.1 { 0 } else { 1 });
                let middle = x + 0.5 * (pitch - gap);
                canvas.text(&text, (middle, top - 9.0), Text { em, h: HPos::Center, ..Text::BODY });
            }
        }
        let (x, top) = if self.narrow { (18.0, 14.0) } else { (722.0, 60.0) };
        for (k, (name, _, colour)) in self.series.iter().enumerate() {
            let y = top + 20.0 * k as f64;
            canvas.rect(x, y - 6.0, 14.0, 12.0, *colour);
            canvas.text(name, (x + 22.0, y), Text::BODY);
        }
    }
}
