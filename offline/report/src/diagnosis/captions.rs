//! Titles and captions of the figures of a diagnosis.

use super::words::{confirmation, plain};
use crate::numbers::fixed;
use fingerpad_diagnose::{Diagnosis, DriverPlot, FeConfirmation};

/// Under the figure of the finite elements.
pub fn confirmation_caption(fe: &FeConfirmation) -> String {
    format!(
        "{} Strokes: {}. The finger was first fitted to the calibration strokes {}: tissue {} times as stiff and tau_crit \
         {} times as strong at 0.9 mm, both over depth, tau_crit over direction (ten freedoms); that leaves {} mN of them \
         (normal, x, y). Before and after it gets what the diagnosis's own refit changed of both.",
        confirmation(fe),
        fe.runs.join(", "),
        fe.calibration_runs.join(", "),
        fixed(fe.stiffness, 3),
        fixed(fe.strength, 3),
        fe.calibration_rms_n.map(|v| fixed(1000.0 * v, 1)).join(", ")
    )
}

/// Above the first residual map.
pub fn map_title(claimed: bool) -> &'static str {
    if claimed {
        "Where simulation and measurement disagree without the effect"
    } else {
        "Where simulation and measurement disagree"
    }
}

/// Under a residual map.
pub fn map_caption(claimed: bool) -> String {
    let named = if claimed {
        " The first columns, in bold, drive the named effect. The finger is the one refitted with it: a refit without it would spread the gap \
         over other columns."
    } else {
        ""
    };
    format!(
        "Mean relative residual over runs in parts of each column, one row a column, at most six parts from low to high; left normal force, \
         then friction in full slip, along and across the motion. Red: more force measured than predicted. A dot marks parts whose mean is more than 3.5 \
         standard errors over runs from zero.{named}"
    )
}

/// Under the force traces.
pub fn traces_caption() -> &'static str {
    "The measured runs that the refitted baseline misses most, over the noise floor. As calibrated: nothing is fitted to the \
     measured runs. Readings that were left out (lift-off, spikes, a sensor's rail) are not shown."
}

/// Under a plot over a driver.
pub fn driver_caption(plot: &DriverPlot) -> String {
    let points = if plot.run_sd > 0.0 {
        "Each point is a run, its bar the scatter between runs that the calibration explains."
    } else {
        "Each point is a row in contact."
    };
    format!(
        "Measured {} less the model without {}, relative to it. {points} Below: what is left with it in the model.",
        plot.channel,
        plain(&plot.law)
    )
}

/// Under the bars.
pub fn bars_caption(report: &Diagnosis) -> String {
    let untestable: Vec<String> =
        report.tests.iter().filter(|t| !t.testable).map(|t| format!("{} ({})", plain(&t.law), t.reason)).collect();
    let rest = if untestable.is_empty() { String::new() } else { format!(" Not testable: {}.", untestable.join("; ")) };
    format!("Gain in 2 log likelihood, logarithmic; filled where the law passes the tests as the first one.{rest}")
}

/// Above the gap.
pub fn gap_title(report: &Diagnosis) -> &'static str {
    if report.holdout.method == "file" {
        "The gap on runs that neither chose nor fitted: as calibrated, refitted, with the effect"
    } else {
        "The gap on runs left out of the fit in turn: as calibrated, refitted, with the effect"
    }
}

/// Under the gap.
pub fn gap_caption(report: &Diagnosis) -> String {
    let g = &report.holdout;
    let refused = g.refused_after_n.map_or_else(String::new, |r| {
        format!(
            " The correction would have left {} N (normal, x, y), no closer than before: it is not made, and no \
             corrected model is written.",
            r.map(|v| fixed(v, 4)).join(", ")
        )
    });
    let of_elements = report.fe_confirmation.as_ref().map_or_else(String::new, |fe| {
        format!(" The finite elements' bars are of {} strokes of the {} set only.", fe.runs.len(), fe.set)
    });
    format!(
        "Root mean square residual of {} runs ({}). The floor is what row noise and the scatter between calibration \
         runs leave of a perfect model; the quotient itself scatters by some ten per cent.{of_elements}{refused}",
        g.runs, g.method
    )
}
