//! The figures of a diagnosis of a table.

use crate::canvas::{Canvas, Figure, HPos, Line, Text};
use crate::colour::{ESTIMATE, FAINT, GREY, INK, MODEL, PAIR, WHITE};
use crate::diagnosis::width;
use crate::numbers::fixed;
use crate::traces::{Hue, Trace, TraceChart};
use fingerpad_identify::table_diagnosis::{CandidateReport, CellGap, QUANTITIES, TableSection};

/// Names of the axes, in the order of the quantities.
const LABELS: [&str; 3] = ["Normal force, N", "Contact area, mm²", "Friction coefficient F/N"];

/// Every quantity of the table over depth: measured with its error, before, after.
pub fn cells(section: &TableSection) -> Vec<TraceChart> {
    let models: [(&str, usize, fn(&CellGap) -> f64); 3] = [
        ("published, finger as given", 5, |c| c.as_given),
        ("published, calibrated", 1, |c| c.calibrated),
        ("corrected model", 0, |c| c.corrected),
    ];
    let chart = |k: usize| {
        let cells = || section.cells.iter().filter(move |c| c.quantity == QUANTITIES[k]);
        let trace = |name: &str, hue, of: fn(&CellGap) -> f64| {
            let points = cells().map(|c| [c.depth_mm, of(c)]).collect();
            Trace { name: name.into(), points, hue, ..Trace::default() }
        };
        let mut traces: Vec<Trace> = models.iter().map(|(name, hue, of)| trace(name, Hue::Series(*hue), *of)).collect();
        traces.push(Trace { is_dots: true, ..trace("measured", Hue::Ink, |c| c.measured) });
        traces.extend(cells().map(|c| {
            let end = |side: f64| [c.depth_mm, c.measured * (1.0 + side * c.relative_sd)];
            Trace { points: vec![end(-1.0), end(1.0)], hue: Hue::Ink, ..Trace::default() }
        }));
        let labels = ["depth as measured, mm".into(), LABELS[k].into()];
        cells().next().map(|_| TraceChart { labels, traces, ..TraceChart::default() })
    };
    (0..3).filter_map(chart).collect()
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
