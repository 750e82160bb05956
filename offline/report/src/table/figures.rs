//! The figures of a diagnosis of a table.

use crate::axes::{Axis, Legend, Panel, Sample};
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{Colour, ESTIMATE, FAINT, GREY, INK, MODEL, PAIR, WHITE};
use crate::diagnosis::width;
use crate::numbers::fixed;
use fingerpad_identify::table_diagnosis::{CandidateReport, CellGap, QUANTITIES, TableSection};

/// Names of the axes, in the order of the quantities.
const LABELS: [&str; 3] = ["Normal force, N", "Contact area, mm²", "Friction coefficient F/N"];

/// Every quantity of the table over depth: measured, before, after.
pub struct Cells<'a> {
    /// The numbers.
    pub section: &'a TableSection,
    /// Whether it is for a narrow page: one chart below the other.
    pub narrow: bool,
}

impl Cells<'_> {
    fn measured(&self) -> Vec<(usize, Vec<&CellGap>)> {
        let of = |k: usize| self.section.cells.iter().filter(|c| c.quantity == QUANTITIES[k]).collect::<Vec<_>>();
        (0..3).map(|k| (k, of(k))).filter(|(_, cells)| !cells.is_empty()).collect()
    }

    fn legend(&self) -> Legend<'static> {
        let charts = if self.narrow { 1 } else { self.measured().len() };
        let models = SERIES.map(|(marker, colour, _, name)| (Sample::Point(marker, true), name, colour));
        let measured = (Sample::Point(Marker::Circle, true), "measured", INK);
        Legend { width: CHART[0] * charts as f64, entries: [measured].into_iter().chain(models).collect() }
    }
}

/// Width and height of one chart with its margins, px.
const CHART: [f64; 2] = [380.0, 350.0];

/// The models of a cell.
const SERIES: [(Marker, Colour, fn(&CellGap) -> f64, &str); 3] = [
    (Marker::Triangle, PAIR, |c| c.as_given, "published, finger as given"),
    (Marker::Diamond, ESTIMATE, |c| c.calibrated, "published, calibrated"),
    (Marker::Square, MODEL, |c| c.corrected, "corrected model"),
];

impl Figure for Cells<'_> {
    fn size(&self) -> (u32, u32) {
        let [columns, rows] = if self.narrow { [1, self.measured().len()] } else { [self.measured().len(), 1] };
        ((CHART[0] * columns as f64) as u32, (self.legend().height() + CHART[1] * rows as f64) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let legend = self.legend();
        legend.draw(canvas);
        for (i, (quantity, cells)) in self.measured().into_iter().enumerate() {
            let bar = |c: &CellGap, side: f64| c.measured * (1.0 + side * c.relative_sd);
            let models = cells.iter().flat_map(|c| SERIES.iter().map(|s| (s.2)(c)));
            let measured = cells.iter().flat_map(|c| [bar(c, -1.0), bar(c, 1.0)]);
            let depths = cells.iter().map(|c| c.depth_mm);
            let plot = Panel {
                left: 54.0 + if self.narrow { 0.0 } else { CHART[0] * i as f64 },
                top: legend.height() + 36.0 + if self.narrow { CHART[1] * i as f64 } else { 0.0 },
                width: 310.0,
                height: 262.0,
                x: Axis::covering("depth as measured, mm", [f64::INFINITY, f64::NEG_INFINITY], depths, 5),
                y: Axis::covering(LABELS[quantity], [0.0, 0.0], models.chain(measured), 6),
            };
            plot.draw(canvas);
            for c in &cells {
                for (marker, colour, of, _) in &SERIES {
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
    /// Whether it is for a narrow page.
    pub narrow: bool,
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
        (width(self.narrow) as u32, (40.0 + ROW * self.shown().len() as f64) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let shown = self.shown();
        let most = shown.iter().flat_map(|c| [c.rms_percent, c.left_out_rms_percent.unwrap_or(0.0)]);
        let most = most.fold(5.0, f64::max);
        let (left, right) = (170.0, width(self.narrow) - 14.0);
        let at = |percent: f64| left + (right - left) * percent / most;
        let title = Text { bold: true, h: HPos::Right, ..Text::BODY };
        canvas.text("gap left, %, and error at depths left out", (right, 16.0), title);
        for (k, candidate) in shown.iter().enumerate() {
            let y = 40.0 + ROW * k as f64;
            let contends = self.section.contenders.contains(&candidate.name);
            let name = candidate.name.replace('+', " + ").replace('_', " ");
            let ink = if contends { INK } else { GREY };
            let style = Text { h: HPos::Right, colour: ink, bold: contends, ..Text::BODY };
            canvas.text(&name, (left - 10.0, y), style.within(&name, left - 14.0));
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
    }
}
