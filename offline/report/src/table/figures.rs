//! The figures of a diagnosis of a table.

use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{ESTIMATE, FAINT, GREY, INK, MODEL, PAIR, WHITE};
use crate::numbers::fixed;
use fingerpad_identify::table_diagnosis::{CandidateReport, CellGap, QUANTITIES, TableSection};

/// Names of the axes, in the order of the quantities.
const LABELS: [&str; 3] = ["Normal force, N", "Contact area, mm²", "Friction coefficient F/N"];

/// Every quantity of the table over depth: measured, before, after.
pub struct Cells<'a> {
    /// The numbers.
    pub section: &'a TableSection,
}

impl Cells<'_> {
    fn measured(&self) -> Vec<(usize, Vec<&CellGap>)> {
        let of = |k: usize| self.section.cells.iter().filter(|c| c.quantity == QUANTITIES[k]).collect::<Vec<_>>();
        (0..3).map(|k| (k, of(k))).filter(|(_, cells)| !cells.is_empty()).collect()
    }
}

/// Width of one chart with its margins, px.
const CHART: f64 = 392.0;

impl Figure for Cells<'_> {
    fn size(&self) -> (u32, u32) {
        (60 + (CHART * self.measured().len() as f64) as u32, 400)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let series: [(Marker, _, fn(&CellGap) -> f64, &str); 3] = [
            (Marker::Triangle, PAIR, |c| c.as_given, "published, finger as given"),
            (Marker::Diamond, ESTIMATE, |c| c.calibrated, "published, calibrated"),
            (Marker::Square, MODEL, |c| c.corrected, "corrected model"),
        ];
        let mut x = 60.0;
        let names = [(Marker::Circle, INK, "measured")].into_iter().chain(series.map(|(m, c, _, n)| (m, c, n)));
        for (marker, colour, name) in names {
            canvas.marker(marker, (x, 20.0), 5.0, colour, true);
            canvas.text(name, (x + 10.0, 20.0), Text::BODY);
            x += 34.0 + 6.6 * name.len() as f64;
        }
        for (i, (quantity, cells)) in self.measured().into_iter().enumerate() {
            let bar = |c: &CellGap, side: f64| c.measured * (1.0 + side * c.relative_sd);
            let models = cells.iter().flat_map(|c| series.iter().map(|s| (s.2)(c)));
            let measured = cells.iter().flat_map(|c| [bar(c, -1.0), bar(c, 1.0)]);
            let depths = cells.iter().map(|c| c.depth_mm);
            let plot = Panel {
                left: 60.0 + CHART * i as f64,
                top: 74.0,
                width: 310.0,
                height: 262.0,
                x: Axis::covering("depth as measured, mm", [f64::INFINITY, f64::NEG_INFINITY], depths, 5),
                y: Axis::covering(LABELS[quantity], [0.0, 0.0], models.chain(measured), 6),
            };
            plot.draw(canvas);
            for c in &cells {
                for (marker, colour, of, _) in &series {
                    canvas.marker(*marker, plot.at(c.depth_mm, of(c)), 5.0, *colour, true);
                }
                let ends = [plot.at(c.depth_mm, bar(c, -1.0)), plot.at(c.depth_mm, bar(c, 1.0))];
                canvas.line(&ends, Line::solid(INK, 1.4));
                canvas.marker(Marker::Circle, plot.at(c.depth_mm, c.measured), 4.0, INK, true);
            }
        }
    }
}

/// Gap left and error of prediction of every candidate.
pub struct Candidates<'a> {
    /// The numbers.
    pub section: &'a TableSection,
}

/// Pairs that are shown.
const PAIRS: usize = 6;
const ROW: f64 = 24.0;

impl Candidates<'_> {
    /// The constants, the single effects from the best on, then the best pairs.
    fn shown(&self) -> Vec<&CandidateReport> {
        let of = |count: usize| self.section.candidates.iter().filter(move |c| c.effects.len() == count);
        let constants = ["depth_zero", "tissue_stiffness"];
        let mut out: Vec<&CandidateReport> = of(0).collect();
        let held = |c: &&CandidateReport| !c.effects.iter().any(|e| constants.contains(&e.as_str()));
        for (count, most) in [(1, usize::MAX), (2, PAIRS)] {
            let mut list: Vec<&CandidateReport> = of(count).filter(held).collect();
            let contends = |c: &CandidateReport| self.section.contenders.contains(&c.name);
            list.sort_by(|a, b| contends(b).cmp(&contends(a)).then(a.delta_2le.total_cmp(&b.delta_2le)));
            out.extend(list.into_iter().take(most));
        }
        out
    }
}

impl Figure for Candidates<'_> {
    fn size(&self) -> (u32, u32) {
        (940, (66.0 + ROW * self.shown().len() as f64) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let height = self.size().1;
        let shown = self.shown();
        let most = shown.iter().flat_map(|c| [c.rms_percent, c.left_out_rms_percent.unwrap_or(0.0)]);
        let most = most.fold(5.0, f64::max);
        let (left, right) = (300.0, 880.0);
        let at = |percent: f64| left + (right - left) * percent / most;
        canvas.text("gap left, %, and error at depths left out", (left, 16.0), Text { bold: true, ..Text::BODY });
        for (k, candidate) in shown.iter().enumerate() {
            let y = 40.0 + ROW * k as f64;
            let contends = self.section.contenders.contains(&candidate.name);
            let name = candidate.name.replace('+', " + ");
            let ink = if contends { INK } else { GREY };
            canvas.text(&name, (left - 10.0, y), Text { h: HPos::Right, colour: ink, bold: contends, ..Text::BODY });
            canvas.line(&[(left, y), (right, y)], Line::solid(FAINT, 0.8));
            let bar = if contends { MODEL } else { PAIR };
            canvas.rect(left, y - 7.0, at(candidate.rms_percent) - left, 14.0, bar);
            let number = fixed(candidate.rms_percent, 1);
            if let Some(left_out) = candidate.left_out_rms_percent {
                let x = at(left_out);
                canvas.line(&[(x, y - 8.0), (x, y + 8.0)], Line::solid(ESTIMATE, 2.2));
            }
            canvas.text(
                &number,
                (left + 5.0, y),
                Text { colour: if contends { WHITE } else { INK }, em: 11.0, ..Text::BODY },
            );
        }
        let y = f64::from(height) - 12.0;
        let small = Text { em: 11.0, colour: GREY, ..Text::BODY };
        canvas.text(
            "bar: remaining gap; line: depths left out and predicted; dark: the table cannot distinguish it from the best",
            (left, y),
            small,
        )
    }
}
