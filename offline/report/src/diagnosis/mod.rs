//! A diagnosis becomes a page, its numbers and its figures.
//!
//! Main functions: [`render`], [`summary`] and [`repetitions`] (the lines that the command prints), [`plan_csv`] (the next
//! experiment).
//! Computes only sums of its inputs. May use: diagnose.

mod figures;
mod force_plots;
pub mod group;
mod page;
mod repeated;
mod residual_map;
mod words;

use super::html::{Picture, wide_and_narrow};
use super::{Rendered, ReportError, canvas, canvas::Figure};
use fingerpad_diagnose::{Diagnosis, Evidence, NextExperiment, ReducedDiagnosis};
pub use repeated::sentences as repetitions;
pub use words::{cautions, summary, word};

/// A figure as a PNG file and as an image in the page: once for wide windows, once for narrow ones.
fn drawn<F: Figure>(figure: impl Fn(bool) -> F) -> Result<(Vec<u8>, String), ReportError> {
    let (wide, narrow) = (figure(false), figure(true));
    Ok((canvas::png(&wide)?, wide_and_narrow(canvas::svg(&wide)?, canvas::svg(&narrow)?)))
}

/// Makes page, numbers and figures.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn render(report: &Diagnosis, evidence: &Evidence) -> Result<Rendered, ReportError> {
    let mut pictures = Vec::new();
    let mut files = Vec::new();
    let mut add = |name: &str, title: String, caption: String, (png, svg): (Vec<u8>, String)| {
        files.push((format!("{name}.png"), png));
        pictures.push(Picture { name: name.to_owned(), title, caption, png: Vec::new(), svg: Some(svg) });
    };
    let claimed = !report.effects.is_empty();
    let fe = report.fe_confirmation.as_ref();
    let figure = |narrow| figures::GapBars { narrow, ..figures::GapBars::held_out(&report.holdout, claimed, fe) };
    add(
        "heldout",
        "The gap on runs that no fit saw: as calibrated, refitted, with the effect".into(),
        words::gap_caption(report),
        drawn(figure)?,
    );
    let figure = |narrow| force_plots::Traces { traces: &evidence.traces, claimed, narrow };
    add("traces", "Forces of the three worst runs".into(), words::traces_caption().into(), drawn(figure)?);
    for (name, title, map, shown) in [
        ("map_before", "Where simulation and measurement disagree, before any effect", &evidence.map_before, true),
        ("map_after", "The same with the effect in the model", &evidence.map_after, claimed),
    ] {
        if shown {
            let scale = residual_map::scale(&evidence.map_before);
            let figure = |narrow| residual_map::ResidualMap { map, scale, narrow };
            add(name, title.into(), words::map_caption().into(), drawn(figure)?);
        }
    }
    for (i, plot) in evidence.drivers.iter().enumerate() {
        let unit = words::unit(&plot.column, &evidence.own);
        let figure = |narrow| figures::Driver { plot, unit, narrow };
        let name = format!("driver_{}", i + 1);
        let title = format!("Residual against {}, with the fitted law", words::column(&plot.column));
        add(&name, title, words::driver_caption(plot), drawn(figure)?);
    }
    let figure = |narrow| figures::Bars { report, narrow };
    add(
        "evidence",
        "Evidence for every law against the baseline alone".into(),
        words::bars_caption(report),
        drawn(figure)?,
    );
    if let Some(fe) = &report.fe_confirmation {
        let figure = |narrow| figures::GapBars { narrow, ..figures::GapBars::confirmation(fe) };
        add(
            "confirmation",
            "The finite elements with the effect inside their law".into(),
            words::confirmation_caption(fe),
            drawn(figure)?,
        );
    }
    files.extend(
        report.stability.iter().map(|s| ("stability.svg".to_owned(), repeated::stability_picture(s).into_bytes())),
    );
    let json = serde_json::to_string_pretty(report)? + "\n";
    Ok(Rendered { html: page::page(report, &pictures), json, figures: files })
}

/// Page, numbers and figure of a diagnosis of forces alone or of a table.
///
/// # Errors
/// [`ReportError`] if the figure cannot be drawn.
pub fn render_reduced(reduced: &ReducedDiagnosis) -> Result<Rendered, ReportError> {
    let json = serde_json::to_string_pretty(&reduced.report)? + "\n";
    let mut files = Vec::new();
    let mut picture = None;
    if let Some(plot) = &reduced.plot {
        let (png, svg) = drawn(|narrow| force_plots::Scatter { plot, narrow })?;
        files.push(("forces.png".to_owned(), png));
        let (title, caption) = (plot.title.clone(), plot.caption.clone());
        picture = Some(Picture { name: "forces".into(), title, caption, png: Vec::new(), svg: Some(svg) });
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

#[cfg(test)]
mod tests {
    use fingerpad_diagnose::{DriverPlot, ForceTrace, Plot, Region};

    use super::*;

    /// Whether all that a figure draws lies within it.
    fn stays_within(figure: &impl Figure) -> bool {
        let tree = canvas::tree(figure).unwrap();
        let (size, drawn) = (tree.size(), tree.root().abs_bounding_box());
        drawn.left() >= 0.0 && drawn.right() <= size.width() && drawn.top() >= 0.0 && drawn.bottom() <= size.height()
    }

    #[test]
    fn nothing_is_cut_at_the_edge_of_a_wide_or_a_narrow_figure() {
        let region = |column: &str, channel: &str, k: usize| Region {
            column: column.into(),
            from: k as f64,
            to: k as f64 + 1.0,
            unit: "°C".into(),
            channel: channel.into(),
            mean_relative: -0.123,
            z: 4.0,
            runs: 10,
            outside_calibration: false,
        };
        let mut map = Vec::new();
        for column in ["depth_mm", "occlusion_time_s", "temperature_of_the_inner_frame_at_its_far_end"] {
            for channel in ["normal", "friction", "across"] {
                map.extend((0..6).map(|k| region(column, channel, k)));
            }
        }
        let plot = Plot {
            title: String::new(),
            caption: String::new(),
            x: "normal force, N".into(),
            y: "tangential force, N".into(),
            points: vec![("readings before the first touch, both directions".into(), vec![[0.0, -0.2], [1.5, 0.8]])],
            curves: vec![("the friction law that fits the readings best of all".into(), vec![[0.0, 0.0], [1.5, 0.7]])],
            square: true,
        };
        let driver = DriverPlot {
            law: "temperature".into(),
            column: "temperature_c".into(),
            channel: "friction".into(),
            points: (0..60).map(|k| [30.0 + 0.1 * f64::from(k), 0.01 * f64::from(k), 0.008 * f64::from(k)]).collect(),
        };
        let trace = || ForceTrace {
            run: "measured13".into(),
            readings_n: vec![[0.5, -0.4]; 30],
            models_n: [vec![[0.5, -0.3]; 30], vec![[0.5, -0.3]; 30], vec![[0.5, -0.3]; 30]],
        };
        let names = ["as calibrated", "refitted", "with the effect", "finite elements with it", "noise floor"];
        for narrow in [false, true] {
            assert!(stays_within(&residual_map::ResidualMap { map: &map, scale: 0.2, narrow }), "map, {narrow}");
            assert!(stays_within(&force_plots::Scatter { plot: &plot, narrow }), "scatter, {narrow}");
            assert!(stays_within(&figures::Driver { plot: &driver, unit: "°C", narrow }), "driver, {narrow}");
            let traces = &[trace(), trace(), trace()];
            assert!(stays_within(&force_plots::Traces { traces, claimed: true, narrow }), "traces, {narrow}");
            let series = names.iter().map(|name| (*name, [0.0137, 0.0911, 0.3214], crate::colour::INK)).collect();
            assert!(stays_within(&figures::GapBars { series, narrow }), "bars, {narrow}");
        }
    }
}
