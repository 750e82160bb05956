//! Charts: friction against force, force and area against depth, everything against travel.

use super::axes::{Axis, Panel};
use super::canvas::{Canvas, Figure, Line, Marker, Text};
use super::colour::{ESTIMATE, GREY, INK, MODEL, PAIR, WHITE};
use super::font;
use super::numbers::{DepthNumbers, Numbers, fixed};
use super::traces::{Trace, TraceChart};

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
        canvas.text("measured (Table 1)", (x + 24.0, y), Text::BODY);
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], fit_line);
        let name = "the paper's fit, F/N = 1.13 N";
        canvas.text(name, (x + 24.0, y), Text::BODY);
        let after = x + 25.0 + font::width(name, Text::BODY.em, false);
        canvas.text("−1/3", (after, y - 5.0), Text { em: 9.0, ..Text::BODY });
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], model_line);
        canvas.marker(Marker::Square, (x, y), OPEN, MODEL, false);
        canvas.text("this model, kinetic", (x + 24.0, y), Text::BODY);
        if shown {
            y += 22.0;
            canvas.marker(Marker::Triangle, (x, y), R, ESTIMATE, false);
            canvas.text("the law over the frictionless pressure", (x + 24.0, y), Text::BODY);
        }
        y += 22.0;
        canvas.line(&[(x - 14.0, y), (x + 14.0, y)], Line::solid(PAIR, 1.2));
        canvas.text("same depth", (x + 24.0, y), Text::BODY);
    }
}

/// Normal force and contact area against depth.
pub fn normal_area(numbers: &Numbers) -> Vec<TraceChart> {
    type Pick = fn(&DepthNumbers) -> [Option<f64>; 2];
    let charts: [(&str, f64, Pick); 2] = [
        ("Normal force, N", 0.5, |d| [d.normal_force_n.measured, d.normal_force_n.model]),
        ("Contact area, mm²", 100.0, |d| [d.contact_area_mm2.measured, d.contact_area_mm2.model]),
    ];
    let chart = |(label, least, of): (&str, f64, Pick)| {
        let points = |k: usize| numbers.depths.iter().map(|d| [d.depth_mm, nan(of(d)[k])]).collect();
        let model = Trace { name: "this model, kinetic".into(), points: points(1), ..Trace::default() };
        TraceChart {
            labels: ["Depth, mm".into(), label.into()],
            least: [0.0, least],
            traces: vec![model, measured(points(0))],
            ..TraceChart::default()
        }
    };
    charts.map(chart).into()
}

/// Table 1 as dots.
fn measured(points: Vec<[f64; 2]>) -> Trace {
    Trace { name: "measured (Table 1)".into(), points, is_dots: true, ..Trace::default() }
}

/// Friction, friction coefficient and stick ratio against travel; normal force during the press.
pub fn travel(numbers: &Numbers) -> Vec<TraceChart> {
    type Pick = fn(&DepthNumbers) -> Vec<[f64; 2]>;
    let charts: [([&str; 2], f64, Pick); 4] = [
        (["Slide, mm", "Friction F, N"], 0.5, |d| d.slide.iter().map(|p| [p.travel_mm, nan(p.friction_n)]).collect()),
        (["Slide, mm", "Friction over normal force, F/N"], 1.0, |d| {
            d.slide.iter().map(|p| [p.travel_mm, nan(p.friction_coefficient)]).collect()
        }),
        (["Slide, mm", "Stick ratio (stuck area over contact area)"], 1.0, |d| {
            d.slide.iter().map(|p| [p.travel_mm, nan(p.stick_ratio)]).collect()
        }),
        (["Depth, mm", "Normal force N during the press, N"], 0.5, |d| {
            d.press.iter().map(|p| [p.depth_mm, nan(p.normal_force_n)]).collect()
        }),
    ];
    let chart = |(labels, least, of): ([&str; 2], f64, Pick)| {
        let end = |d: &DepthNumbers| format!("{} mm", fixed(d.depth_mm, 2));
        let traces = numbers.depths.iter().map(|d| Trace { end: end(d), points: of(d), ..Trace::default() }).collect();
        TraceChart { labels: labels.map(str::to_owned), least: [0.0, least], traces, ..TraceChart::default() }
    };
    let mut out: Vec<TraceChart> = charts.map(chart).into();
    let points = numbers.depths.iter().map(|d| [d.depth_mm, nan(d.normal_force_n.measured)]).collect();
    out[3].traces.push(measured(points));
    out
}
