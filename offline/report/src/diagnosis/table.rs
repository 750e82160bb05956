//! What the page of a diagnosis of a table has beside that of every diagnosis: the cells and the candidates.
//!
//! Main function: [`render`].

use fingerpad_diagnose::FittedParameter;
use fingerpad_identify::table_diagnosis::{Candidate, CellGap, Finding, QUANTITIES, Step, TableSection};
use maud::{Markup, html};

use super::{figures, page};
use crate::html::listing;
use crate::numbers::{fixed, signed, significant};
use crate::traces::{Charts, Hue, Trace, TraceChart};
use crate::{Picture, Rendered, ReportError};

/// Names of the axes, in the order of the quantities.
const LABELS: [&str; 3] = ["Normal force, N", "Contact area, mm²", "Friction coefficient F/N"];

/// Makes page, numbers and figures.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render(finding: &Finding) -> Result<Rendered, ReportError> {
    let (report, section) = (&finding.report.diagnosis, &finding.report.table);
    let charts = charts(section);
    let evidence = Picture::wide_and_narrow(
        "candidates",
        "Evidence for every effect beside the finger's constants",
        "Each alone beside stiffness, touch point and strength. A long bar explains more than its priors cost.",
        |narrow| figures::Bars { report, narrow },
    );
    let compared = Picture::new(
        "table",
        "The table and the finite elements",
        "Circles: as measured, the bar its error. Published constants: with the finger as given, and calibrated; the corrected \
         model: what it reads.",
        &Charts { charts: &charts, columns: 1 },
    );
    let figures = vec![compared, evidence];
    let tables = html! {
        h2 { "The gap, step by step" } (steps(section))
        h2 { "Cell by cell" } (cells(section))
        h2 { "Every candidate, alone and in pairs" }
        section.pair { (crate::html::figures(2, &figures[1..])) }
        details { summary { "Table" } (candidates(section)) }
        (basis(section))
    };
    let html = page::reduced(report, &finding.sentences[1..], &figures[..1], &tables);
    Ok(Rendered { html, json: serde_json::to_string_pretty(&finding.report)? + "\n", figures })
}

/// Every quantity of the table over depth: measured with its error, before, after.
fn charts(section: &TableSection) -> Vec<TraceChart> {
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

fn steps(section: &TableSection) -> Markup {
    listing::<Step>(
        &section.steps,
        &[
            ("free parameters:", |s| s.words.clone()),
            ("numbers fitted", |s| s.freedoms.to_string()),
            ("gap, %", |s| fixed(s.rms_percent, 1)),
        ],
    )
}

fn cells(section: &TableSection) -> Markup {
    fn number(cell: &CellGap, value: f64) -> String {
        fixed(value, if cell.quantity == QUANTITIES[1] { 1 } else { 3 })
    }
    listing::<CellGap>(
        &section.cells,
        &[
            ("depth, mm", |c| fixed(c.depth_mm, 2)),
            ("quantity:", |c| c.quantity.into()),
            ("measured", |c| number(c, c.measured)),
            ("published", |c| number(c, c.as_given)),
            ("gap, %", |c| signed(c.as_given_percent, 1)),
            ("calibrated", |c| number(c, c.calibrated)),
            ("gap, %", |c| signed(c.calibrated_percent, 1)),
            ("corrected", |c| number(c, c.corrected)),
            ("gap, %", |c| signed(c.corrected_percent, 1)),
            ("measured without the instruments' share", |c| number(c, c.measured_corrected)),
        ],
    )
}

fn candidates(section: &TableSection) -> Markup {
    let mut list = section.candidates.clone();
    list.sort_by(|a, b| a.fitted.effects.len().cmp(&b.fitted.effects.len()).then(a.delta_2le.total_cmp(&b.delta_2le)));
    let values = |c: &Candidate| {
        let value = |p: &FittedParameter| format!("{} {}", p.name, signed(p.value, 3));
        c.fitted.parameters.iter().map(value).collect::<Vec<_>>().join(", ")
    };
    listing::<Candidate>(
        &list,
        &[
            ("candidate:", |c| c.name.replace('+', " + ")),
            ("values:", values),
            ("numbers fitted", |c| c.fitted.freedoms.to_string()),
            ("gap left, %", |c| fixed(c.fitted.rms_percent, 1)),
            ("alone, %", |c| fixed(c.alone_rms_percent, 1)),
            ("depths left out, %", |c| c.left_out_rms_percent.map_or_else(|| "–".into(), |v| fixed(v, 1))),
            ("evidence behind best", |c| fixed(c.delta_2le, 1)),
            ("explained as much by", |c| format!("{} others", c.explains_as_much.len())),
            ("ends by:", |c| if c.by_finite_elements { "finite elements" } else { "regression" }.into()),
        ],
    )
}

fn basis(section: &TableSection) -> Markup {
    let fe = &section.finite_elements;
    let [force, area, friction] = fe.regression_percent.map(|percent| significant(percent, 2));
    html! {
        footer {
            h2 { "Basis of this result" }
            p {
                "Shape " (fe.shape) ", mesh " (fe.mesh_preset) " (" (fe.nodes) " nodes): " (fe.computed) " steady slides by finite \
                 elements were computed; a regression through them (off by " (force) " % in normal force, " (area) " % in area, "
                (friction) " % in friction) carried the fits, whose ends were computed by finite elements again. Every number \
                 stands in " code { "report.json" } ", the table side by side in " code { "side_by_side.csv" } ", without what \
                 the instruments add in " code { "corrected_table.csv" } ", finger and law in " code { "corrected.toml" } "."
            }
        }
    }
}
