//! The figures of a diagnosis.

use plotters_backend::{BackendColor, DrawingBackend};

use super::words::axis;
use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Drawn, Figure, HPos, Line, Marker, Text};
use crate::colour::{FAINT, GREY, INK, MODEL, SERIES, WHITE, mix, rgb};
use crate::numbers::fixed;
use fingerpad_diagnose::{CrossValidationError, Diagnosis, DriverPlot, FeConfirmation, ForceTrace, Plot, Region};

const MORE: BackendColor = rgb(0xb2182b);
const LESS: BackendColor = rgb(0x2166ac);

/// Relative residual at full colour: the map's largest, at least 5 %.
pub fn scale(map: &[Region]) -> f64 {
    map.iter().map(|r| r.mean_relative.abs()).fold(0.05, f64::max).min(0.5)
}

/// Residuals over the parts of every column.
pub struct ResidualMap<'a> {
    /// The map.
    pub map: &'a [Region],
    /// Relative residual at full colour.
    pub scale: f64,
}

impl ResidualMap<'_> {
    fn columns(&self) -> Vec<&str> {
        let mut list: Vec<&str> = Vec::new();
        for r in self.map {
            if !list.contains(&r.column.as_str()) {
                list.push(&r.column);
            }
        }
        list
    }
}

const ROW: f64 = 34.0;
const CELL: f64 = 46.0;

impl Figure for ResidualMap<'_> {
    fn size(&self) -> (u32, u32) {
        (1080, (96.0 + ROW * self.columns().len().max(1) as f64) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        let (width, height) = self.size();
        canvas.rect(0.0, 0.0, f64::from(width), f64::from(height), WHITE)?;
        let small = Text { em: 10.5, colour: GREY, ..Text::BODY };
        let channels = [
            ("normal", "normal force, %", 190.0),
            ("friction", "friction along the motion, %", 486.0),
            ("across", "friction across it, %", 782.0),
        ];
        for (channel, title, left) in channels {
            canvas.text(title, (left, 18.0), Text { bold: true, em: 12.5, ..Text::BODY })?;
            for (row, column) in self.columns().into_iter().enumerate() {
                let y = 36.0 + ROW * row as f64;
                if channel == "normal" {
                    let unit = self.map.iter().find(|r| r.column == column).map_or("", |r| r.unit.as_str());
                    canvas.text(&axis(column, unit), (178.0, y + 11.0), Text { h: HPos::Right, ..Text::BODY })?;
                }
                let bins: Vec<&Region> =
                    self.map.iter().filter(|r| r.column == column && r.channel == channel).collect();
                for (k, bin) in bins.iter().enumerate() {
                    let x = left + CELL * k as f64;
                    let s = (bin.mean_relative.abs() / self.scale).min(1.0);
                    let full = if bin.mean_relative > 0.0 { MORE } else { LESS };
                    canvas.rect(x, y, CELL - 2.0, 20.0, mix(rgb(0xf7f7f7), full, s))?;
                    let ink = if s > 0.55 { WHITE } else { INK };
                    let size = fixed(100.0 * bin.mean_relative.abs(), 1);
                    let sign = match bin.mean_relative {
                        _ if size == "0.0" => "",
                        m if m > 0.0 => "+",
                        _ => "−",
                    };
                    let text = format!("{sign}{size}");
                    canvas.text(
                        &text,
                        (x + 0.5 * CELL - 4.0, y + 10.0),
                        Text { em: 10.5, h: HPos::Center, colour: ink, ..Text::BODY },
                    )?;
                    if bin.z.abs() > 3.5 {
                        canvas.marker(Marker::Circle, (x + CELL - 7.0, y + 5.0), 1.8, ink, true)?;
                    }
                    canvas.text(&short(bin.from), (x, y + 26.0), Text { em: 9.0, ..small })?;
                }
                if let Some(last) = bins.last() {
                    let x = left + CELL * bins.len() as f64 - 4.0;
                    canvas.text(&short(last.to), (x, y + 26.0), Text { em: 9.0, h: HPos::Right, ..small })?;
                }
            }
        }
        let y = f64::from(height) - 22.0;
        canvas.text("less measured than predicted", (372.0, y), Text { h: HPos::Right, ..small })?;
        for k in 0..40 {
            let s = f64::from(k) / 19.5 - 1.0;
            let full = if s > 0.0 { MORE } else { LESS };
            canvas.rect(384.0 + 5.0 * f64::from(k), y - 6.0, 5.2, 12.0, mix(rgb(0xf7f7f7), full, s.abs()))?;
        }
        canvas.text(&format!("more (full colour: {} %)", fixed(100.0 * self.scale, 0)), (596.0, y), small)
    }
}

/// A number in at most five characters.
fn short(v: f64) -> String {
    let decimals = if v.abs() >= 100.0 {
        0
    } else if v.abs() >= 10.0 {
        1
    } else {
        2
    };
    fixed(v, decimals)
}

/// Residual over a driver with the law through it.
pub struct Driver<'a> {
    /// What to show.
    pub plot: &'a DriverPlot,
    /// Unit of its column.
    pub unit: &'a str,
}

impl Figure for Driver<'_> {
    fn size(&self) -> (u32, u32) {
        (900, 400)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        canvas.rect(0.0, 0.0, 900.0, 400.0, WHITE)?;
        let points = &self.plot.points;
        let (first, last) = (points.first().map_or(0.0, |p| p[0]), points.last().map_or(1.0, |p| p[0]));
        // Single rows scatter far beyond what the eye needs; the axis covers all but the outermost in a hundred.
        let mut sizes: Vec<f64> = points.iter().map(|p| p[1]).collect();
        sizes.sort_by(f64::total_cmp);
        let cut =
            |share: f64| sizes.get((share * sizes.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0);
        let law = points.iter().map(|p| p[2]);
        let low = law.clone().fold(cut(0.01), f64::min);
        let high = law.fold(cut(0.99), f64::max);
        let (bottom, top) = (100.0 * low.min(0.0), 100.0 * high.max(0.0));
        let panel = Panel {
            left: 74.0,
            top: 42.0,
            width: 620.0,
            height: 290.0,
            x: Axis::covering(&axis(&self.plot.column, self.unit), [first, last], std::iter::empty(), 7),
            y: Axis::covering("Relative residual, %", [bottom, top], std::iter::empty(), 6),
        };
        panel.draw(canvas)?;
        canvas.line(&[panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0)], Line::solid(GREY, 1.0))?;
        let inside = |p: &[f64; 3]| 100.0 * p[1] >= panel.y.min() && 100.0 * p[1] <= panel.y.max();
        let dense = points.len() > 300;
        for p in points.iter().filter(|p| inside(p)) {
            canvas.marker(Marker::Circle, panel.at(p[0], 100.0 * p[1]), if dense { 1.6 } else { 3.2 }, INK, !dense)?;
        }
        // The law is drawn where it is wanted: at the points, joined if they are few, as dots where rows differ in
        // more than the driver.
        for p in points {
            canvas.marker(
                Marker::Square,
                panel.at(p[0], 100.0 * p[2]),
                if dense { 1.6 } else { 3.0 },
                SERIES[1],
                true,
            )?;
        }
        canvas.marker(Marker::Circle, (722.0, 60.0), 3.2, INK, !dense)?;
        canvas.text("measured less the model", (734.0, 60.0), Text::BODY)?;
        canvas.text("without the effect", (734.0, 75.0), Text::BODY)?;
        canvas.marker(Marker::Square, (722.0, 98.0), 3.0, SERIES[1], true)?;
        canvas.text("the fitted law there", (734.0, 98.0), Text::BODY)
    }
}

/// Evidence for all laws.
pub struct Bars<'a> {
    /// What to show.
    pub report: &'a Diagnosis,
}

impl Figure for Bars<'_> {
    fn size(&self) -> (u32, u32) {
        (900, (70 + 22 * self.report.tests.iter().filter(|t| t.testable).count().max(1)) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        let (width, height) = self.size();
        canvas.rect(0.0, 0.0, f64::from(width), f64::from(height), WHITE)?;
        let mut tests: Vec<_> = self.report.tests.iter().filter(|t| t.testable).collect();
        tests.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
        let most = tests.first().map_or(1.0, |t| t.gain_2ll).max(100.0);
        let place = |gain: f64| 190.0 + 560.0 * (1.0 + gain.max(0.0)).ln() / (1.0 + most).ln();
        let bottom = 24.0 + 22.0 * tests.len() as f64;
        let mut tick = 1.0;
        while tick <= most {
            let x = place(tick);
            canvas.line(&[(x, 18.0), (x, bottom)], Line::solid(FAINT, 0.8))?;
            canvas.text(
                &fixed(tick, 0),
                (x, bottom + 10.0),
                Text { em: 11.0, h: HPos::Center, colour: GREY, ..Text::BODY },
            )?;
            tick *= 10.0;
        }
        canvas.text("gain in 2 log likelihood", (190.0, bottom + 28.0), Text { em: 12.0, ..Text::BODY })?;
        let named: Vec<&str> = self.report.effects.iter().map(|e| e.law.as_str()).collect();
        for (i, t) in tests.iter().enumerate() {
            let y = 24.0 + 22.0 * i as f64;
            let colour = if named.contains(&t.law.as_str()) { SERIES[1] } else { MODEL };
            let style = Text { h: HPos::Right, bold: named.contains(&t.law.as_str()), ..Text::BODY };
            canvas.text(&t.law.replace('_', " "), (182.0, y + 8.0), style)?;
            let w = (place(t.gain_2ll) - 190.0).max(1.0);
            let fill = if t.significant { colour } else { mix(WHITE, colour, 0.25) };
            canvas.rect(190.0, y, w, 15.0, fill)?;
            canvas.text(&fixed(t.gain_2ll, 1), (196.0 + w, y + 8.0), Text { em: 11.0, colour: GREY, ..Text::BODY })?;
        }
        Ok(())
    }
}

/// Root mean square residuals per channel, beside each other.
pub struct GapBars<'a> {
    /// Name, values of normal, x and y in N, colour.
    pub series: Vec<(&'a str, [f64; 3], BackendColor)>,
}

impl<'a> GapBars<'a> {
    /// Held-out runs under the three models; without a claimed effect there are two. The finite elements with the effect
    /// stand beside them where they were run, on their own strokes.
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
        Self { series }
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
        Self { series }
    }
}

impl Figure for GapBars<'_> {
    fn size(&self) -> (u32, u32) {
        (900, 290)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        canvas.rect(0.0, 0.0, 900.0, 290.0, WHITE)?;
        let values = self.series.iter().flat_map(|s| s.1).map(|v| 1000.0 * v);
        let panel = Panel {
            left: 74.0,
            top: 42.0,
            width: 620.0,
            height: 200.0,
            x: Axis { ticks: vec![0.0, 3.0], decimals: 0, label: String::new() },
            y: Axis::covering("Root mean square residual, mN", [0.0, 1.0], values, 5),
        };
        for tick in &panel.y.ticks {
            let y = panel.at(0.0, *tick).1;
            canvas.line(&[(panel.left, y), (panel.left + panel.width, y)], Line::solid(FAINT, 0.8))?;
            let text = fixed(*tick, panel.y.decimals);
            canvas.text(&text, (panel.left - 8.0, y), Text { em: 11.5, h: HPos::Right, colour: GREY, ..Text::BODY })?;
        }
        canvas.text(
            &panel.y.label,
            (panel.left - 34.0, panel.top - 18.0),
            Text { bold: true, em: 12.5, ..Text::BODY },
        )?;
        let pitch = if self.series.len() > 3 { 37.0 } else { 42.0 };
        for (channel, name) in ["normal", "x", "y"].iter().enumerate() {
            let centre = panel.at(channel as f64 + 0.5, 0.0);
            canvas.text(name, (centre.0, centre.1 + 16.0), Text { h: HPos::Center, ..Text::BODY })?;
            for (k, (_, rms, colour)) in self.series.iter().enumerate() {
                let x = centre.0 + pitch * (k as f64 - 0.5 * self.series.len() as f64);
                let top = panel.at(0.0, 1000.0 * rms[channel]).1;
                canvas.rect(x, top, pitch - 6.0, centre.1 - top, *colour)?;
                let text = fixed(1000.0 * rms[channel], 1);
                let middle = x + 0.5 * (pitch - 6.0);
                canvas.text(&text, (middle, top - 9.0), Text { em: 10.5, h: HPos::Center, ..Text::BODY })?;
            }
        }
        for (k, (name, _, colour)) in self.series.iter().enumerate() {
            let y = 60.0 + 20.0 * k as f64;
            canvas.rect(722.0, y - 6.0, 14.0, 12.0, *colour)?;
            canvas.text(name, (744.0, y), Text::BODY)?;
        }
        Ok(())
    }
}

/// Forces of the worst runs, measured and by the three models.
pub struct Traces<'a> {
    /// What to show.
    pub traces: &'a [ForceTrace],
    /// Whether an effect is claimed; without one there are two models.
    pub claimed: bool,
}

const TRACE: f64 = 214.0;

impl Figure for Traces<'_> {
    fn size(&self) -> (u32, u32) {
        (940, (48.0 + TRACE * self.traces.len().max(1) as f64) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        let (width, height) = self.size();
        canvas.rect(0.0, 0.0, f64::from(width), f64::from(height), WHITE)?;
        let models = [("as calibrated", mix(WHITE, GREY, 0.6)), ("refitted", MODEL), ("with the effect", SERIES[1])];
        let shown = if self.claimed { &models[..] } else { &models[..2] };
        let mut x = 70.0;
        canvas.marker(Marker::Circle, (x, 16.0), 2.6, INK, true)?;
        canvas.text("measured", (x + 10.0, 16.0), Text::BODY)?;
        for (name, colour) in shown {
            x += 130.0;
            canvas.line(&[(x, 16.0), (x + 22.0, 16.0)], Line::solid(*colour, 2.2))?;
            canvas.text(name, (x + 30.0, 16.0), Text::BODY)?;
        }
        for (row, trace) in self.traces.iter().enumerate() {
            for (k, name) in ["normal force, N", "friction along the motion, N"].iter().enumerate() {
                let forces = trace.readings_n.iter().chain(trace.models_n.iter().flatten()).map(|f| f[k]);
                let panel = Panel {
                    left: 70.0 + 450.0 * k as f64,
                    top: 62.0 + TRACE * row as f64,
                    width: 370.0,
                    height: TRACE - 74.0,
                    x: Axis::covering("row of the run", [1.0, trace.readings_n.len() as f64], std::iter::empty(), 6),
                    y: Axis::covering(&format!("{}: {name}", trace.run), [0.0, 0.0], forces, 4),
                };
                panel.draw(canvas)?;
                for ((_, colour), model) in shown.iter().zip(&trace.models_n) {
                    let points: Vec<(f64, f64)> =
                        (1..).zip(model).map(|(row, f)| panel.at(f64::from(row), f[k])).collect();
                    canvas.line(&points, Line::solid(*colour, 2.0))?;
                }
                for (row, f) in (1..).zip(&trace.readings_n).filter(|(_, f)| f[k].is_finite()) {
                    canvas.marker(Marker::Circle, panel.at(f64::from(row), f[k]), 2.4, INK, true)?;
                }
            }
        }
        Ok(())
    }
}

/// Points and curves.
pub struct Scatter<'a> {
    /// What to show.
    pub plot: &'a Plot,
}

impl Figure for Scatter<'_> {
    fn size(&self) -> (u32, u32) {
        if self.plot.square { (760, 600) } else { (900, 430) }
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        let (width, height) = self.size();
        canvas.rect(0.0, 0.0, f64::from(width), f64::from(height), WHITE)?;
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
        let (w, h) = if self.plot.square { (480.0, 480.0) } else { (600.0, 320.0) };
        let panel = Panel {
            left: 74.0,
            top: 42.0,
            width: w,
            height: h,
            x: Axis::covering(&self.plot.x, x, std::iter::empty(), 6),
            y: Axis::covering(&self.plot.y, y, std::iter::empty(), 6),
        };
        panel.draw(canvas)?;
        if self.plot.square {
            let (low, high) = (panel.at(0.0, panel.y.min()), panel.at(0.0, panel.y.max()));
            let (left, right) = (panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0));
            canvas.line(&[low, high], Line::solid(GREY, 0.8))?;
            canvas.line(&[left, right], Line::solid(GREY, 0.8))?;
        }
        let mut legend = 60.0;
        for (i, (name, curve)) in self.plot.curves.iter().enumerate() {
            let colour = SERIES[(i + 1) % SERIES.len()];
            let points: Vec<(f64, f64)> = curve.iter().map(|p| panel.at(p[0], p[1])).collect();
            canvas.line(&points, Line::solid(colour, 2.0))?;
            let at = panel.left + w + 22.0;
            canvas.line(&[(at, legend), (at + 20.0, legend)], Line::solid(colour, 2.0))?;
            canvas.text(name, (at + 28.0, legend), Text::BODY)?;
            legend += 20.0;
        }
        for (i, (name, points)) in self.plot.points.iter().enumerate() {
            let colour = if i == 0 { INK } else { GREY };
            for p in points {
                canvas.marker(Marker::Circle, panel.at(p[0], p[1]), 3.0, colour, i == 0)?;
            }
            let at = panel.left + w + 32.0;
            canvas.marker(Marker::Circle, (at, legend), 3.0, colour, i == 0)?;
            canvas.text(name, (at + 18.0, legend), Text::BODY)?;
            legend += 20.0;
        }
        Ok(())
    }
}
