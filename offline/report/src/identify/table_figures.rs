//! Figures beside the table: before and after, left out and predicted, the curve, sensitivities, a population.

use super::super::axes::{Axis, Panel, legend_text};
use super::super::canvas::{Canvas, Figure, HPos, Line, Marker, Text, VPos};
use super::super::colour::{Colour, ESTIMATE, GREY, INK, MODEL, PAIR, SERIES};
use super::super::numbers::{fixed, signed};
use fingerpad_identify::{
    Outcome, Point,
    outcome::{ModelDataComparison, Modelled, Sensitivity},
    population::Population,
};

type Pick = (&'static str, fn(&Point) -> f64, fn(&Modelled) -> f64);

/// Normal force, area and friction coefficient against depth: measured, before and after.
pub struct TableFit<'a> {
    pub outcome: &'a Outcome,
}

impl TableFit<'_> {
    fn series(&self) -> Vec<(&'static str, &ModelDataComparison, Colour, Marker)> {
        let o = self.outcome;
        let mut all = vec![("published constants, finger as given", &o.published_before, PAIR, Marker::Triangle)];
        if o.calibration.is_some() {
            all.push(("published constants, finger calibrated", &o.published, ESTIMATE, Marker::Diamond));
        }
        if let Some(law) = &o.law {
            all.push(("identified law", &law.comparison, MODEL, Marker::Square));
        }
        if let Some(joint) = &o.joint {
            all.push(("joint fit", &joint.comparison, SERIES[2], Marker::Circle));
        }
        all
    }
}

impl Figure for TableFit<'_> {
    fn size(&self) -> (u32, u32) {
        (1180, 420)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let picks: [Pick; 3] = [
            ("Normal force, N", |p| p.normal_force_n, |m| m.normal_force_n),
            ("Contact area, mm²", |p| p.contact_area_mm2.unwrap_or(f64::NAN), |m| m.contact_area_mm2),
            ("Friction coefficient F/N", |p| p.friction_coefficient, |m| m.friction_coefficient),
        ];
        let series = self.series();
        for (i, (label, measured, modelled)) in picks.into_iter().enumerate() {
            let values = self.outcome.table.iter().map(measured);
            let models = series.iter().flat_map(|s| s.1.rows.iter().map(modelled));
            let depths = self.outcome.table.iter().map(|p| p.depth_mm);
            let plot = Panel {
                left: 60.0 + 392.0 * i as f64,
                top: 86.0,
                width: 310.0,
                height: 270.0,
                x: Axis::covering("Depth in the table, mm", [0.75, 1.25], depths, 4),
                y: Axis::covering(label, [0.0, 0.1], values.chain(models), 5),
            };
            plot.draw(canvas);
            for (_, against, colour, marker) in &series {
                let path: Vec<_> = against.rows.iter().map(|r| plot.at(r.depth_mm, modelled(r))).collect();
                canvas.line(&path, Line::solid(*colour, 1.8));
                for at in path {
                    canvas.marker(*marker, at, 4.6, *colour, false);
                }
            }
            for p in &self.outcome.table {
                canvas.marker(Marker::Circle, plot.at(p.depth_mm, measured(p)), 4.5, INK, true);
            }
        }
        canvas.marker(Marker::Circle, (34.0, 18.0), 4.5, INK, true);
        legend_text(canvas, (46.0, 18.0), "measured");
        let mut x = 136.0;
        for (name, _, colour, marker) in &series {
            canvas.line(&[(x, 18.0), (x + 24.0, 18.0)], Line::solid(*colour, 1.8));
            canvas.marker(*marker, (x + 12.0, 18.0), 4.6, *colour, false);
            legend_text(canvas, (x + 32.0, 18.0), name);
            x += 60.0 + super::super::font::width(name, Text::BODY.em, false);
        }
    }
}

/// Errors of predictions of depths that were left out.
pub struct LeftOutErrors<'a> {
    pub outcome: &'a Outcome,
}

impl Figure for LeftOutErrors<'_> {
    fn size(&self) -> (u32, u32) {
        (760, 420)
    }

    fn draw(&self, canvas: &mut Canvas) {
        const LOOKS: [(&str, Colour, Marker); 4] = [
            ("finite elements at the depth", SERIES[0], Marker::Square),
            ("finite elements at the measured N", SERIES[2], Marker::Circle),
            ("F = c N^(2/3)", SERIES[1], Marker::Triangle),
            ("F = c N^n, n fitted", SERIES[3], Marker::Diamond),
        ];
        let rows = &self.outcome.left_out;
        let depth = |pick: fn(f64, f64) -> f64| rows.iter().map(|r| r.depth_mm).reduce(pick).unwrap_or(1.0);
        // Room for the markers beside and beyond their depth and value.
        let x = Axis::between("Depth left out, mm", [depth(f64::min) - 0.12, depth(f64::max) + 0.12], 4);
        let plot = Panel {
            left: 60.0,
            top: 46.0,
            width: 420.0,
            height: 310.0,
            x,
            y: Axis::covering(
                "Error of the predicted F/N, % of the measured F/N",
                [-5.0, 5.0],
                rows.iter().flat_map(|r| r.differences_percent.into_iter().flatten()).map(|d| 1.08 * d),
                6,
            ),
        };
        plot.draw(canvas);
        let zero = [plot.at(0.0, 0.0).1; 2];
        canvas.line(&[(plot.left, zero[0]), (plot.left + plot.width, zero[1])], Line::solid(GREY, 1.2));
        for (k, (name, colour, marker)) in LOOKS.into_iter().enumerate() {
            let dx = 6.0 * (k as f64 - 1.5);
            for r in rows {
                let Some(difference) = r.differences_percent[k] else { continue };
                let (x, y) = plot.at(r.depth_mm, difference);
                canvas.line(&[(x + dx, zero[0]), (x + dx, y)], Line::solid(colour, 1.4));
                canvas.marker(marker, (x + dx, y), 4.4, colour, true);
            }
            let y = plot.top + 14.0 + 24.0 * k as f64;
            canvas.marker(marker, (510.0, y), 4.4, colour, true);
            legend_text(canvas, (522.0, y), name);
        }
    }
}

/// F/N over N.
pub struct CurveFigure<'a> {
    pub outcome: &'a Outcome,
}

impl Figure for CurveFigure<'_> {
    fn size(&self) -> (u32, u32) {
        (820, 480)
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
            top: 44.0,
            width: 500.0,
            height: 370.0,
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
        let (x, mut y) = (plot.left + plot.width + 20.0, plot.top + 10.0);
        canvas.marker(Marker::Circle, (x + 12.0, y), 4.5, INK, true);
        legend_text(canvas, (x + 32.0, y), "measured");
        for (name, line) in
            [("identified law", Line::solid(MODEL, 2.0)), ("its continuation", beyond), ("F = 1.13 N^(2/3)", grey)]
        {
            y += 24.0;
            canvas.line(&[(x, y), (x + 24.0, y)], line);
            legend_text(canvas, (x + 32.0, y), name);
        }
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
        canvas.rect(290.0, 8.0, 12.0, 9.0, ESTIMATE);
        legend_text(canvas, (308.0, 12.0), "input less");
        canvas.rect(390.0, 8.0, 12.0, 9.0, MODEL);
        legend_text(canvas, (408.0, 12.0), "input more");
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
