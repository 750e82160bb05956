//! Figures beside the table: before and after, left out and predicted, the curve, sensitivities, a population.

use super::super::axes::{Axis, Legend, Panel, Sample};
use super::super::canvas::{Canvas, Figure, HPos, Line, Marker, Text, VPos};
use super::super::colour::{ESTIMATE, GREY, INK, MODEL, PAIR};
use super::super::numbers::{fixed, signed};
use super::super::traces::{Hue, Trace, TraceChart};
use fingerpad_identify::{
    Outcome, Point,
    outcome::{ModelDataComparison, Modelled, Sensitivity},
    population::Population,
};

/// Normal force, area and friction coefficient against depth: measured, before and after.
pub fn table_fit(o: &Outcome) -> Vec<TraceChart> {
    type Pick = (&'static str, fn(&Point) -> f64, fn(&Modelled) -> f64);
    let picks: [Pick; 3] = [
        ("Normal force, N", |p| p.normal_force_n, |m| m.normal_force_n),
        ("Contact area, mm²", |p| p.contact_area_mm2.unwrap_or(f64::NAN), |m| m.contact_area_mm2),
        ("Friction coefficient F/N", |p| p.friction_coefficient, |m| m.friction_coefficient),
    ];
    let calibrated = o.calibration.as_ref().map(|_| &o.published);
    let models = [
        ("published constants, finger as given", Some(&o.published_before), Hue::Series(5)),
        ("published constants, finger calibrated", calibrated, Hue::Series(1)),
        ("identified law", o.law.as_ref().map(|law| &law.comparison), Hue::Series(0)),
        ("joint fit", o.joint.as_ref().map(|joint| &joint.comparison), Hue::Series(2)),
    ];
    let chart = |(label, measured, modelled): Pick| {
        let points = |c: &ModelDataComparison| c.rows.iter().map(|r| [r.depth_mm, modelled(r)]).collect();
        let model = |(name, comparison, hue): (&str, Option<&ModelDataComparison>, Hue)| {
            Some(Trace { name: name.into(), points: points(comparison?), hue, ..Trace::default() })
        };
        let dots = o.table.iter().map(|p| [p.depth_mm, measured(p)]).collect();
        let measured = Trace { name: "measured".into(), points: dots, is_dots: true, ..Trace::default() };
        TraceChart {
            labels: ["Depth in the table, mm".into(), label.into()],
            least: [0.0, 0.1],
            traces: models.into_iter().filter_map(model).chain([measured]).collect(),
            ..TraceChart::default()
        }
    };
    picks.map(chart).into()
}

/// Errors of predictions of depths that were left out.
pub fn left_out_errors(o: &Outcome) -> TraceChart {
    const LOOKS: [(&str, usize); 4] = [
        ("finite elements at the depth", 0),
        ("finite elements at the measured N", 2),
        ("F = c N^(2/3)", 1),
        ("F = c N^n, n fitted", 3),
    ];
    let trace = |(k, (name, hue)): (usize, (&str, usize))| {
        let points = o.left_out.iter().filter_map(|r| Some([r.depth_mm, r.differences_percent[k]?])).collect();
        Trace { name: name.into(), points, is_dots: true, hue: Hue::Series(hue), ..Trace::default() }
    };
    TraceChart {
        labels: ["Depth left out, mm".into(), "Error of the predicted F/N, % of the measured F/N".into()],
        least: [-5.0, 5.0],
        traces: LOOKS.into_iter().enumerate().map(trace).collect(),
        ..TraceChart::default()
    }
}

/// F/N over N.
pub struct CurveFigure<'a> {
    pub outcome: &'a Outcome,
}

impl Figure for CurveFigure<'_> {
    fn size(&self) -> (u32, u32) {
        (600, 480)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let Some(curve) = &self.outcome.curve else { return };
        let forces = || {
            let points = curve.points.iter().map(|p| p.normal_force_n).chain(curve.continued.iter().map(|c| c[0]));
            points.chain(self.outcome.table.iter().map(|p| p.normal_force_n))
        };
        let low = forces().fold(f64::INFINITY, f64::min) * 0.9;
        let high = forces().fold(0.0, f64::max) * 1.1;
        let two_thirds = |n: f64| 1.13 * n.powf(-1.0 / 3.0);
        let mu = || {
            let points =
                curve.points.iter().map(|p| p.friction_coefficient).chain(curve.continued.iter().map(|c| c[1]));
            points.chain(self.outcome.table.iter().map(|p| p.friction_coefficient)).chain([two_thirds(low)])
        };
        let plot = Panel {
            left: 60.0,
            top: 68.0,
            width: 510.0,
            height: 346.0,
            x: Axis::log("Normal force N, newton", [low, high]),
            y: Axis::log(
                "Friction coefficient F/N",
                [mu().fold(f64::INFINITY, f64::min).min(two_thirds(high)) * 0.9, mu().fold(0.0, f64::max) * 1.1],
            ),
        };
        plot.draw(canvas);
        let grey = Line { colour: GREY, width: 1.5, dash: Some((6.0, 4.0)) };
        plot.line(
            canvas,
            (0..=40).map(|i| low * (high / low).powf(f64::from(i) / 40.0)).map(|n| (n, two_thirds(n))),
            grey,
        );
        let beyond = Line { colour: MODEL, width: 1.5, dash: Some((3.0, 4.0)) };
        for c in &curve.continued {
            let ends = [&curve.points[0], &curve.points[curve.points.len() - 1]];
            let near = if c[0] < ends[0].normal_force_n { ends[0] } else { ends[1] };
            plot.line(canvas, [(near.normal_force_n, near.friction_coefficient), (c[0], c[1])].into_iter(), beyond);
        }
        let line = || curve.points.iter().map(|p| (p.normal_force_n, p.friction_coefficient));
        plot.line(canvas, line(), Line::solid(MODEL, 2.0));
        for (n, mu) in line() {
            canvas.marker(Marker::Square, plot.at(n, mu), 3.6, MODEL, false);
        }
        for p in &self.outcome.table {
            canvas.marker(Marker::Circle, plot.at(p.normal_force_n, p.friction_coefficient), 4.5, INK, true);
        }
        let entries = vec![
            (Sample::Point(Marker::Circle, true), "measured", INK),
            (Sample::Line, "identified law; dashed: its continuation", MODEL),
            (Sample::Line, "F = 1.13 N^(2/3)", GREY),
        ];
        Legend { width: 600.0, entries }.draw(canvas);
    }
}

/// Sensitivities at the deepest point, largest first.
pub struct Tornado<'a> {
    pub outcome: &'a Outcome,
}

impl Figure for Tornado<'_> {
    fn size(&self) -> (u32, u32) {
        (1180, 118 + 27 * self.rows().len() as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let rows = self.rows();
        type Of = fn(&Sensitivity) -> [Option<f64>; 2];
        let panels: [(&str, Of); 3] = [
            ("Normal force, %", |s| s.normal_force_percent),
            ("Contact area, %", |s| s.contact_area_percent),
            ("F/N, %", |s| s.friction_coefficient_percent),
        ];
        let (top, pitch) = (66.0, 27.0);
        let height = pitch * rows.len() as f64;
        for (k, row) in rows.iter().enumerate() {
            let y = top + pitch * (k as f64 + 0.5);
            canvas.text(&row.input, (192.0, y - 1.0), Text { h: HPos::Right, ..Text::BODY });
            let decimals = if row.unit == "%" {
                0
            } else if row.change[1] < 0.095 {
                2
            } else {
                1
            };
            let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
            let change = format!("±{}{unit}", fixed(row.change[1], decimals));
            canvas.text(&change, (262.0, y - 1.0), Text { h: HPos::Right, colour: GREY, em: 11.0, ..Text::BODY });
        }
        for (i, (label, of)) in panels.into_iter().enumerate() {
            let values = rows.iter().flat_map(|r| of(r)).flatten();
            let plot = Panel {
                left: 290.0 + 300.0 * i as f64,
                top,
                width: 250.0,
                height,
                x: Axis::covering(label, [-1.0, 1.0], values, 4),
                y: Axis::bare([0.0, 1.0]),
            };
            let bottom = top + height;
            for (tick, text) in &plot.x.ticks {
                let x = plot.at(*tick, 0.0).0;
                let line =
                    if *tick == 0.0 { Line::solid(GREY, 1.2) } else { Line::solid(super::super::colour::FAINT, 0.8) };
                canvas.line(&[(x, top), (x, bottom)], line);
                let small = Text { em: 11.5, colour: GREY, h: HPos::Center, v: VPos::Top, ..Text::BODY };
                canvas.text(text, (x, bottom + 6.0), small);
            }
            canvas.text(label, (plot.left, top - 20.0), Text { bold: true, em: 12.5, ..Text::BODY });
            let zero = plot.at(0.0, 0.0).0;
            for (k, row) in rows.iter().enumerate() {
                let y = top + pitch * k as f64 + 5.0;
                for (side, value) in of(row).into_iter().enumerate() {
                    let colour = [ESTIMATE, MODEL][side];
                    match value {
                        Some(v) => {
                            let x = plot.at(v, 0.0).0;
                            // The two sides share a bar's height if they have the same sign.
                            let (dy, h) = (8.5 * side as f64, 8.0);
                            canvas.rect(zero.min(x), y + dy, (x - zero).abs().max(0.6), h, colour);
                        }
                        None => {
                            let note = Text { em: 9.5, colour, ..Text::BODY };
                            canvas.text("no slide found", (zero + 6.0, y + 4.0 + 8.5 * side as f64), note);
                        }
                    }
                }
            }
        }
        let entries = vec![(Sample::Area, "input less", ESTIMATE), (Sample::Area, "input more", MODEL)];
        Legend { width: 1180.0, entries }.draw(canvas);
    }
}

impl Tornado<'_> {
    /// Inputs at the last depth, those that move most first.
    fn rows(&self) -> Vec<&Sensitivity> {
        let Some(last) = self.outcome.sensitivities.last() else { return Vec::new() };
        let mut rows: Vec<_> = self.outcome.sensitivities.iter().filter(|s| s.depth_mm == last.depth_mm).collect();
        let size = |s: &Sensitivity| {
            let all =
                s.normal_force_percent.iter().chain(&s.contact_area_percent).chain(&s.friction_coefficient_percent);
            all.flatten().map(|v| v.abs()).fold(0.0, f64::max)
        };
        rows.sort_by(|a, b| size(b).total_cmp(&size(a)));
        rows
    }
}

/// Constants of several subjects.
pub struct Subjects<'a> {
    pub population: &'a Population,
}

impl Figure for Subjects<'_> {
    fn size(&self) -> (u32, u32) {
        (720, 480)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let subjects = &self.population.subjects;
        let ends = |v: f64, e: Option<f64>| [v - e.unwrap_or(0.0), v + e.unwrap_or(0.0)];
        let xs = subjects.iter().flat_map(|s| ends(s.tau_ref_kpa, s.tau_ref_error_kpa));
        let ys = subjects.iter().flat_map(|s| ends(s.beta, s.beta_error));
        let middle = (subjects[0].tau_ref_kpa, subjects[0].beta);
        let plot = Panel {
            left: 60.0,
            top: 44.0,
            width: 600.0,
            height: 370.0,
            x: Axis::covering("strength at 5 kPa, kPa", [middle.0 - 0.1, middle.0 + 0.1], xs, 6),
            y: Axis::covering("β", [middle.1 - 0.05, middle.1 + 0.05], ys, 6),
        };
        plot.draw(canvas);
        for s in subjects {
            let at = plot.at(s.tau_ref_kpa, s.beta);
            let [a, b] = ends(s.tau_ref_kpa, s.tau_ref_error_kpa);
            canvas.line(&[plot.at(a, s.beta), plot.at(b, s.beta)], Line::solid(PAIR, 1.4));
            let [a, b] = ends(s.beta, s.beta_error);
            canvas.line(&[plot.at(s.tau_ref_kpa, a), plot.at(s.tau_ref_kpa, b)], Line::solid(PAIR, 1.4));
            canvas.marker(Marker::Circle, at, 4.5, MODEL, true);
            canvas.text(&s.name, (at.0 + 8.0, at.1 - 9.0), Text { em: 11.0, colour: GREY, ..Text::BODY });
        }
    }
}

/// Difference in percent, as text of a table.
pub fn percent(v: Option<f64>) -> String {
    signed(v.unwrap_or(f64::NAN), 1)
}
