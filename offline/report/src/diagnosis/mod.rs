//! A diagnosis becomes a page, its numbers and its figures.
//!
//! Main functions: [`render`], [`summary`] (the lines that the command prints), [`plan_csv`] (the next experiment).
//! Computes nothing but sums of what it is given. May use: diagnose.

mod figures;
mod page;
mod words;

use super::{Rendered, ReportError, canvas, html::Picture};
use fingerpad_diagnose::{Diagnosis, Evidence, NextExperiment, ReducedDiagnosis};
pub use words::{summary, word};

/// Makes page, numbers and figures.
///
/// Errors: [`ReportError`] if a figure cannot be drawn.
pub fn render(report: &Diagnosis, evidence: &Evidence) -> Result<Rendered, ReportError> {
    let mut pictures = Vec::new();
    let mut files = Vec::new();
    let mut add = |name: &str, title: String, caption: String, png: Vec<u8>, svg: String| {
        files.push((format!("{name}.png"), png.clone()));
        pictures.push(Picture { name: name.to_owned(), title, caption, png, svg: Some(svg) });
    };
    let claimed = !report.effects.is_empty();
    let figure = figures::GapBars::held_out(&report.holdout, claimed, report.fe_confirmation.as_ref());
    add(
        "heldout",
        "The gap on runs that no fit saw: as calibrated, refitted, with the effect".into(),
        words::gap_caption(report),
        canvas::png(&figure)?,
        canvas::svg(&figure)?,
    );
    let figure = figures::Traces { traces: &evidence.traces, claimed };
    add(
        "traces",
        "Forces of the three worst runs".into(),
        words::traces_caption().into(),
        canvas::png(&figure)?,
        canvas::svg(&figure)?,
    );
    for (name, title, map, shown) in [
        ("map_before", "Where simulation and measurement disagree, before any effect", &evidence.map_before, true),
        ("map_after", "The same with the effect in the model", &evidence.map_after, claimed),
    ] {
        if shown {
            let figure = figures::ResidualMap { map, scale: figures::scale(&evidence.map_before) };
            add(name, title.into(), words::map_caption().into(), canvas::png(&figure)?, canvas::svg(&figure)?);
        }
    }
    for (i, plot) in evidence.drivers.iter().enumerate() {
        let figure = figures::Driver { plot, unit: words::unit(&plot.column, &evidence.own) };
        let name = format!("driver_{}", i + 1);
        let title = format!("What {} asks for, and the law through it", words::column(&plot.column));
        add(&name, title, words::driver_caption(plot), canvas::png(&figure)?, canvas::svg(&figure)?);
    }
    let figure = figures::Bars { report };
    add(
        "evidence",
        "Evidence for every law against the baseline alone".into(),
        words::bars_caption(report),
        canvas::png(&figure)?,
        canvas::svg(&figure)?,
    );
    if let Some(fe) = &report.fe_confirmation {
        let figure = figures::GapBars::confirmation(fe);
        add(
            "confirmation",
            "The finite elements with the effect inside their law".into(),
            words::confirmation_caption(fe),
            canvas::png(&figure)?,
            canvas::svg(&figure)?,
        );
    }
    let json = serde_json::to_string_pretty(report)? + "\n";
    Ok(Rendered { html: page::page(report, &pictures), json, figures: files })
}

/// Page, numbers and figure of a diagnosis of forces alone or of a table.
///
/// Errors: [`ReportError`] if the figure cannot be drawn.
pub fn render_reduced(reduced: &ReducedDiagnosis) -> Result<Rendered, ReportError> {
    let json = serde_json::to_string_pretty(&reduced.report)? + "\n";
    let mut files = Vec::new();
    let mut picture = None;
    if let Some(plot) = &reduced.plot {
        let figure = figures::Scatter { plot };
        let (png, svg) = (canvas::png(&figure)?, canvas::svg(&figure)?);
        files.push(("forces.png".to_owned(), png.clone()));
        let (title, caption) = (plot.title.clone(), plot.caption.clone());
        picture = Some(Picture { name: "forces".into(), title, caption, png, svg: Some(svg) });
    }
    Ok(Rendered { html: page::reduced(&reduced.report, &reduced.sentences, picture.as_ref()), json, figures: files })
}

/// Columns of the user's own that the strokes set.
fn own_columns(plan: &NextExperiment) -> Vec<&str> {
    let names = plan.runs.iter().flat_map(|r| r.own.keys()).map(String::as_str);
    names.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
}

/// The strokes of the next experiment as a CSV file; blank cells are the reference conditions.
pub fn plan_csv(plan: &NextExperiment) -> String {
    let own = own_columns(plan);
    let mut out = "run,depth_mm,speed_mm_s,direction_deg,dwell_s,hydration_au,temperature_c,length_mm,rest_before_s,new_block,reverse".to_owned();
    own.iter().for_each(|name| out += &format!(",{name}"));
    out.push('\n');
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    let flag = |v: Option<bool>| v.map_or_else(String::new, |v| v.to_string());
    for (i, r) in plan.runs.iter().enumerate() {
        let mut cells = vec![
            (i + 1).to_string(),
            number(r.depth_mm),
            number(r.speed_mm_s),
            number(r.direction_deg),
            number(r.dwell_s),
            number(r.hydration_au),
            number(r.temperature_c),
            number(r.length_mm),
            number(r.rest_before_s),
            flag(r.new_block),
            flag(r.reverse),
        ];
        cells.extend(own.iter().map(|name| number(r.own.get(*name).copied())));
        out += &(cells.join(",") + "\n");
    }
    out
}
