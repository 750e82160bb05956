//! A diagnosis becomes a page, its numbers and its figures.
//!
//! Main functions: [`render`], [`summary`] and [`repetitions`] (the lines that the command prints), [`plan_csv`] (the next
//! experiment).
//! Computes only sums of its inputs. May use: diagnose, identify (`table`).

mod captions;
mod figures;
mod force_plots;
pub mod group;
mod page;
mod repeated;
mod residual_map;
pub mod table;
mod words;

use super::{Picture, Rendered, ReportError};
use fingerpad_diagnose::{Diagnosis, Evidence, FACTORS, NextExperiment, Plot, ReducedDiagnosis, Verdict};
use maud::html;
pub use repeated::sentences as repetitions;
pub use words::{cautions, summary, word};

/// Makes page, numbers and figures.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render(report: &Diagnosis, evidence: &Evidence) -> Result<Rendered, ReportError> {
    let claimed = !report.effects.is_empty();
    let fe = report.fe_confirmation.as_ref();
    let mut figures = Vec::new();
    for (i, plot) in evidence.drivers.iter().enumerate() {
        let unit = words::unit(&plot.column, &evidence.own);
        let title =
            format!("{} over {}, and the law {}", plot.channel, words::axis(&plot.column, ""), words::plain(&plot.law));
        let title = title[..1].to_uppercase() + &title[1..];
        let figure = |narrow| figures::Driver { plot, unit, narrow };
        let caption = captions::driver_caption(plot);
        figures.push(Picture::wide_and_narrow(&format!("driver_{}", i + 1), title, caption, figure));
    }
    let rms = |narrow| figures::GapBars::held_out(&report.holdout, claimed, fe, narrow);
    let gap = Picture::wide_and_narrow("heldout", captions::gap_title(report), captions::gap_caption(report), rms);
    let bars = Picture::wide_and_narrow(
        "evidence",
        "Evidence for every law against the baseline alone",
        captions::bars_caption(report),
        |narrow| figures::Bars { report, narrow },
    );
    let scale = residual_map::scale(&evidence.maps.before);
    let map = |name, title, map| {
        let figure = |narrow| residual_map::ResidualMap { map, named: &evidence.maps.named, scale, narrow };
        Picture::wide_and_narrow(name, title, captions::map_caption(claimed), figure)
    };
    let before = map("map_before", captions::map_title(claimed), &evidence.maps.before);
    // The map shows where something is; without it the gap says that there is nothing.
    let nothing = report.verdict == Verdict::None;
    figures.extend(if nothing { [gap, bars, before] } else { [before, gap, bars] });
    if claimed {
        figures.push(map("map_after", "The same with the effect in the model", &evidence.maps.after));
    }
    figures.push(Picture::wide_and_narrow(
        "traces",
        "Forces of the three worst runs over time",
        captions::traces_caption(),
        |narrow| force_plots::Traces { traces: &evidence.traces, claimed, narrow },
    ));
    figures.extend(fe.map(|fe| {
        let title = "The finite elements with the effect inside their law";
        let figure = |narrow| figures::GapBars::confirmation(fe, narrow);
        Picture::wide_and_narrow("confirmation", title, captions::confirmation_caption(fe), figure)
    }));
    figures.extend(report.stability.iter().map(repeated::stability_picture));
    let json = serde_json::to_string_pretty(&Diagnosis { title: words::headline(report), ..report.clone() })? + "\n";
    Ok(Rendered { html: page::page(report, &evidence.drivers, &figures), json, figures })
}

/// Page, numbers and figure of a diagnosis of forces alone.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render_reduced(reduced: &ReducedDiagnosis) -> Result<Rendered, ReportError> {
    let titled = Diagnosis { title: words::headline(&reduced.report), ..reduced.report.clone() };
    let json = serde_json::to_string_pretty(&titled)? + "\n";
    let picture = |plot: &Plot| {
        let Plot { title, caption, .. } = plot;
        Picture::wide_and_narrow("forces", title, caption, |narrow| force_plots::Scatter { plot, narrow })
    };
    let figures: Vec<_> = reduced.plot.iter().map(picture).collect();
    Ok(Rendered { html: page::reduced(&reduced.report, &reduced.sentences, &figures, &html! {}), json, figures })
}

/// Columns of the user's own that the strokes set.
fn own_columns(plan: &NextExperiment) -> Vec<&str> {
    let names = plan.runs.iter().flat_map(|r| r.own.keys()).map(String::as_str);
    names.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
}

/// The strokes of the next experiment as a CSV file; blank cells are the reference conditions.
pub fn plan_csv(plan: &NextExperiment) -> String {
    let own = own_columns(plan);
    let mut out = ["run"]
        .into_iter()
        .chain(FACTORS.iter().map(|f| f.name))
        .chain(["new_block", "reverse"])
        .collect::<Vec<_>>()
        .join(",");
    own.iter().for_each(|name| out += &format!(",{name}"));
    out.push('\n');
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| ((1e6 * v).round() / 1e6).to_string());
    let flag = |v: Option<bool>| v.map_or_else(String::new, |v| v.to_string());
    for (i, r) in plan.runs.iter().enumerate() {
        let mut cells = vec![(i + 1).to_string()];
        cells.extend(FACTORS.iter().map(|f| number(f.value(r))));
        cells.extend([flag(r.new_block), flag(r.reverse)]);
        cells.extend(own.iter().map(|name| number(r.own.get(*name).copied())));
        out += &(cells.join(",") + "\n");
    }
    out
}

#[cfg(test)]
mod tests {
    use fingerpad_diagnose::{DriverPlot, ForceTrace, Region};

    use super::*;
    use crate::canvas::{Canvas, Figure};

    /// Whether all that a figure draws lies within it.
    fn stays_within(figure: &impl Figure) -> bool {
        let mut canvas = Canvas::default();
        figure.draw(&mut canvas);
        let [width, height] = [figure.size().0, figure.size().1].map(f64::from);
        let within =
            |[left, top, right, bottom]: [f64; 4]| left >= 0.0 && top >= 0.0 && right <= width && bottom <= height;
        canvas.boxes.iter().all(|(drawn, _)| within(*drawn))
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
            run_sd: 0.1,
            curve: (0..60).map(|k| [30.0 + 0.1 * f64::from(k), 0.008 * f64::from(k), 0.3]).collect(),
        };
        let trace = || ForceTrace {
            run: "measured13".into(),
            t_s: (0..30).map(|k| 0.37 * f64::from(k)).collect(),
            slides_s: vec![[1.0, 4.0], [6.0, 10.73]],
            readings_n: vec![[0.5, -0.4]; 30],
            models_n: [vec![[0.5, -0.3]; 30], vec![[0.5, -0.3]; 30], vec![[0.5, -0.3]; 30]],
        };
        let names = ["as calibrated", "refitted", "with the effect", "finite elements with it", "noise floor"];
        for narrow in [false, true] {
            assert!(
                stays_within(&residual_map::ResidualMap { map: &map, named: &["depth_mm"], scale: 0.2, narrow }),
                "map, {narrow}"
            );
            assert!(stays_within(&force_plots::Scatter { plot: &plot, narrow }), "scatter, {narrow}");
            assert!(stays_within(&figures::Driver { plot: &driver, unit: "°C", narrow }), "driver, {narrow}");
            let traces = &[trace(), trace(), trace()];
            assert!(stays_within(&force_plots::Traces { traces, claimed: true, narrow }), "traces, {narrow}");
            let series = names.iter().map(|name| (*name, [0.0137, 0.0911, 0.3214], crate::colour::INK)).collect();
            assert!(stays_within(&figures::GapBars { series, narrow }), "bars, {narrow}");
        }
    }
}
