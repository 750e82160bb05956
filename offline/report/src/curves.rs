//! Charts: friction against force, force and area against depth, everything against travel.

use super::axes::{Axis, Panel, legend_text};
use super::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use super::colour::{Colour, ESTIMATE, GREY, INK, MODEL, PAIR, SERIES, WHITE};
use super::font;
use super::numbers::{DepthNumbers, Numbers, fixed};

/// Radius of a data point, px.
const R: f64 = 4.5;
/// Half the side of the model's open squares, px: a measured point inside leaves both visible.
const OPEN: f64 = 5.6;

fn nan(v: Option<f64>) -> f64 {
    v.unwrap_or(f64::NAN)
}

/// Figure 2 of the paper with our points in it.
pub struct Figure2<'a> {
    /// Numbers of the figure.
    pub numbers: &'a Numbers,
    /// Whether the page is narrow.
    pub narrow: bool,
}

impl Figure for Figure2<'_> {
    fn size(&self) -> (u32, u32) {
        (if self.narrow { 470 } else { 700 }, 500)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let depths = &self.numbers.depths;
        let force = |d: &DepthNumbers| [nan(d.normal_force_n.measured), nan(d.normal_force_n.model)];
        let friction = |d: &DepthNumbers| {
            let c = &d.friction_coefficient;
            [nan(c.measured), nan(c.model), nan(d.frictionless_friction_coefficient)]
        };
        let x = Axis::covering("Normal force N, newton", [0.0, 0.6], depths.iter().flat_map(force), 6);
        let panel = Panel {
            left: 56.0,
            top: 44.0,
            width: if self.narrow { 396.0 } else { 606.0 },
            height: 400.0,
            y: Axis::covering("Friction coefficient F/N", [0.0, 3.0], depths.iter().flat_map(friction), 6),
            x,
        };
        panel.draw(canvas);

        let fit = self.numbers.paper_fit;
        let value = |n: f64| fit.coefficient * n.powf(fit.exponent);
        let start = (panel.y.max() / fit.coefficient).powf(1.0 / fit.exponent);
        let curve: Vec<_> = (0..=200)
            .map(|i| start + (panel.x.max() - start) * (f64::from(i) / 200.0).powi(2))
            .map(|n| panel.at(n, value(n)))
            .collect();
        let fit_line = Line { colour: GREY, width: 1.6, dash: Some((6.0, 4.0)) };
        canvas.line(&curve, fit_line);

        let in_range = |n: f64, mu: f64| n >= panel.x.min() && n <= panel.x.max() && mu <= panel.y.max();
        let points = self.numbers.continuous.iter();
        let inside: Vec<_> = points
            .filter(|p| in_range(p.normal_force_n, p.friction_coefficient))
            .map(|p| panel.at(p.normal_force_n, p.friction_coefficient))
            .collect();
        let model_line = Line::solid(MODEL, 2.0);
        let ours = |of: fn(&DepthNumbers) -> Option<f64>| -> Vec<_> {
            depths.iter().map(|d| panel.at(nan(d.normal_force_n.model), nan(of(d)))).collect()
        };
        let model = ours(|d| d.friction_coefficient.model);
        let estimates = ours(|d| d.frictionless_friction_coefficient);
        for d in depths {
            let (c, n) = (&d.friction_coefficient, &d.normal_force_n);
            let ends = [panel.at(nan(n.measured), nan(c.measured)), panel.at(nan(n.model), nan(c.model))];
            canvas.line(&ends, Line::solid(PAIR, 1.2));
        }
        canvas.line(if inside.is_empty() { &model } else { &inside }, model_line);
        for at in &estimates {
            canvas.marker(Marker::Triangle, *at, R, ESTIMATE, false);
        }
        for at in &model {
            canvas.marker(Marker::Square, *at, OPEN, MODEL, false);
        }
        for d in depths {
            let at = panel.at(nan(d.normal_force_n.measured), nan(d.friction_coefficient.measured));
            canvas.marker(Marker::Circle, at, R, INK, true);
        }

        let shown = estimates.iter().any(|p| p.1.is_finite());
        let (x, mut y) = (panel.left + panel.width - 276.0, panel.top + 16.0);
        canvas.rect(x - 24.0, y - 12.0, 300.0, if shown { 112.0 } else { 90.0 }, WHITE);
        canvas.marker(Marker::Circle, (x, y), R, INK, true);
        legend_text(canvas, (x + 24.0, y), "measured (Table 1)");
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], fit_line);
        let name = "the paper's fit, F/N = 1.13 N";
        legend_text(canvas, (x + 24.0, y), name);
        let after = x + 25.0 + font::width(name, Text::BODY.em, false);
        canvas.text("−1/3", (after, y - 5.0), Text { em: 9.0, ..Text::BODY });
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], model_line);
        canvas.marker(Marker::Square, (x, y), OPEN, MODEL, false);
        legend_text(canvas, (x + 24.0, y), "this model, kinetic");
        if shown {
            y += 22.0;
            canvas.marker(Marker::Triangle, (x, y), R, ESTIMATE, false);
            legend_text(canvas, (x + 24.0, y), "the law over the frictionless pressure");
        }
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], Line::solid(PAIR, 1.2));
        legend_text(canvas, (x + 24.0, y), "same depth");
    }
}

/// Normal force and contact area against depth.
pub struct NormalArea<'a> {
    /// Numbers of the figure.
    pub numbers: &'a Numbers,
    /// Charts in a row.
    pub columns: usize,
}

impl Figure for NormalArea<'_> {
    fn size(&self) -> (u32, u32) {
        (456 * self.columns as u32, 390 * (2 / self.columns as u32))
    }

    fn draw(&self, canvas: &mut Canvas) {
        let depths = &self.numbers.depths;
        type Pick = fn(&DepthNumbers) -> [Option<f64>; 2];
        let panels: [(&str, f64, Pick); 2] = [
            ("Normal force, N", 0.5, |d| [d.normal_force_n.measured, d.normal_force_n.model]),
            ("Contact area, mm²", 100.0, |d| [d.contact_area_mm2.measured, d.contact_area_mm2.model]),
        ];
        for (i, (label, least, of)) in panels.into_iter().enumerate() {
            let panel = Panel {
                left: 56.0 + 456.0 * (i % self.columns) as f64,
                top: 66.0 + 390.0 * (i / self.columns) as f64,
                width: 370.0,
                height: 264.0,
                x: Axis::covering("Depth, mm", [0.5, 1.5], depths.iter().map(|d| d.depth_mm), 4),
                y: Axis::covering(label, [0.0, least], depths.iter().flat_map(|d| of(d).map(nan)), 5),
            };
            panel.draw(canvas);
            let model = panel.path(depths.iter().map(|d| (d.depth_mm, of(d)[1])));
            canvas.line(&model, Line::solid(MODEL, 2.0));
            for at in model {
                canvas.marker(Marker::Square, at, OPEN, MODEL, false);
            }
            for at in panel.path(depths.iter().map(|d| (d.depth_mm, of(d)[0]))) {
                canvas.marker(Marker::Circle, at, R, INK, true);
            }
        }
        let y = 16.0;
        canvas.marker(Marker::Circle, (34.0, y), R, INK, true);
        legend_text(canvas, (48.0, y), "measured (Table 1)");
        canvas.line(&[(196.0, y), (224.0, y)], Line::solid(MODEL, 2.0));
        canvas.marker(Marker::Square, (210.0, y), OPEN, MODEL, false);
        legend_text(canvas, (234.0, y), "this model, kinetic");
    }
}

/// Friction, friction coefficient and stick ratio against travel; normal force during the press.
pub struct Travel<'a> {
    /// Numbers of the figure.
    pub numbers: &'a Numbers,
    /// Charts in a row.
    pub columns: usize,
}

impl Travel<'_> {
    fn look(i: usize) -> (Colour, Marker) {
        (SERIES[i % SERIES.len()], Marker::SERIES[i % Marker::SERIES.len()])
    }

    fn series(&self, canvas: &mut Canvas, panel: &Panel, of: impl Fn(&DepthNumbers) -> Vec<(f64, Option<f64>)>) {
        panel.draw(canvas);
        let mut ends = Vec::new();
        for (i, depth) in self.numbers.depths.iter().enumerate() {
            let (colour, marker) = Self::look(i);
            let path = panel.path(of(depth).into_iter());
            canvas.line(&path, Line::solid(colour, 1.9));
            for at in spaced(&path, 46.0, 12.0 * i as f64) {
                canvas.marker(marker, at, 3.4, colour, false);
            }
            let end = path.iter().rev().find(|p| p.1.is_finite()).map_or(f64::NAN, |p| p.1);
            ends.push((end, format!("{} mm", fixed(depth.depth_mm, 2)), colour));
        }
        panel.label_ends(canvas, ends);
    }
}

impl Figure for Travel<'_> {
    fn size(&self) -> (u32, u32) {
        (470 * self.columns as u32, 366 * (4 / self.columns as u32))
    }

    fn draw(&self, canvas: &mut Canvas) {
        let depths = &self.numbers.depths;
        let place = |i: usize, x: &Axis, y: Axis| Panel {
            left: 54.0 + 470.0 * (i % self.columns) as f64,
            top: 46.0 + 366.0 * (i / self.columns) as f64,
            width: 332.0,
            height: 254.0,
            x: x.clone(),
            y,
        };
        let slides = || depths.iter().flat_map(|d| &d.slide);
        let travel = Axis::covering("Slide, mm", [0.0, 1.0], slides().map(|p| p.travel_mm), 6);
        let friction = slides().map(|p| nan(p.friction_n));
        let panel = place(0, &travel, Axis::covering("Friction F, N", [0.0, 0.5], friction, 5));
        self.series(canvas, &panel, |d| d.slide.iter().map(|p| (p.travel_mm, p.friction_n)).collect());

        let ratio = slides().map(|p| nan(p.friction_coefficient));
        let panel = place(1, &travel, Axis::covering("Friction over normal force, F/N", [0.0, 1.0], ratio, 5));
        self.series(canvas, &panel, |d| d.slide.iter().map(|p| (p.travel_mm, p.friction_coefficient)).collect());

        let stick = slides().map(|p| nan(p.stick_ratio));
        let panel =
            place(2, &travel, Axis::covering("Stick ratio (stuck area over contact area)", [0.0, 1.0], stick, 5));
        self.series(canvas, &panel, |d| d.slide.iter().map(|p| (p.travel_mm, p.stick_ratio)).collect());

        let depth = depths.iter().flat_map(|d| d.press.iter().map(|p| p.depth_mm).chain([d.depth_mm]));
        let depth = Axis::covering("Depth, mm", [0.0, 1.5], depth, 6);
        let pressed = depths.iter().flat_map(|d| d.press.iter().map(|p| nan(p.normal_force_n)));
        let measured = depths.iter().map(|d| nan(d.normal_force_n.measured));
        let force = Axis::covering("Normal force N during the press, N", [0.0, 0.5], pressed.chain(measured), 5);
        let panel = place(3, &depth, force);
        panel.draw(canvas);
        for (i, d) in depths.iter().enumerate() {
            let (colour, marker) = Self::look(i);
            let path = panel.path(d.press.iter().map(|p| (p.depth_mm, p.normal_force_n)));
            canvas.line(&path, Line::solid(colour, 1.9));
            if let Some(at) = path.last() {
                canvas.marker(marker, *at, R, colour, false);
            }
        }
        for d in depths {
            canvas.marker(Marker::Circle, panel.at(d.depth_mm, nan(d.normal_force_n.measured)), R, INK, true);
        }
        let (x, y) = (panel.left + 16.0, panel.top + 14.0);
        canvas.marker(Marker::Circle, (x, y), R, INK, true);
        legend_text(canvas, (x + 14.0, y), "measured (Table 1)");
        let line = Line::solid(GREY, 1.9);
        canvas.line(&[(x - 8.0, y + 20.0), (x + 8.0, y + 20.0)], line);
        canvas.text("this model, before the slide", (x + 14.0, y + 20.0), Text { h: HPos::Left, ..Text::BODY });
    }
}

/// Points of the path about `every` px apart in x, the first `first` px from its start.
fn spaced(path: &[(f64, f64)], every: f64, first: f64) -> Vec<(f64, f64)> {
    let Some(start) = path.first() else { return Vec::new() };
    let mut next = start.0 + 14.0 + first;
    let mut points = Vec::new();
    for pair in path.windows(2) {
        while pair[1].0 >= next && pair[1].0 > pair[0].0 {
            let s = ((next - pair[0].0) / (pair[1].0 - pair[0].0)).max(0.0);
            points.push((next, pair[0].1 + s * (pair[1].1 - pair[0].1)));
            next += every;
        }
    }
    points
}
