//! The report of an identification: page, numbers, figures.
//!
//! Main functions: [`render`] for one table, [`render_population`] for several. Computes no physics: it reads and draws
//! the results. May use: identify.

mod law_figures;
mod page;
mod table_figures;

use super::numbers::fixed;
use super::traces::Charts;
use super::{Picture, Rendered, ReportError};
use fingerpad_identify::{Outcome, population::Population};

/// Makes page, numbers and figures of one identification.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render(outcome: &Outcome) -> Result<Rendered, ReportError> {
    let charts = table_figures::table_fit(outcome);
    let mut figures = vec![Picture::wide_and_narrow(
        "table_fit",
        "The table against the model, before and after",
        "The model's values belong to the steady slide. Where the finger was calibrated, its depth offset is added to \
         the table's depth before the model is run.",
        |narrow| Charts { charts: &charts, columns: if narrow { 1 } else { 3 } },
    )];
    if let Some(law) = &outcome.law {
        if law.map.is_some() {
            let caption = format!(
                "The region where the sum of squares is below its {:.0} % bound. Strength and exponent are fitted; lambda is \
                 derived from them.",
                100.0 * law.confidence
            );
            let title = "Strength and exponent by the table";
            figures.push(Picture::new("region", title, caption, &law_figures::Region { law }));
        }
        if let (Some(surface), false) = (&outcome.surface, outcome.simplex.is_empty()) {
            let (runs, refined) = (&outcome.simplex[..], outcome.refined.as_ref());
            figures.push(Picture::new(
                "simplex",
                "The downhill simplex on its error surface",
                "Best vertex after every iteration; every vertex was run by finite elements. Open: start, filled: stop. The \
                 dashed line goes on from the best end in ln strength and beta with finer tolerances. \
                 The surface is a surrogate's that agrees with finite elements at the cross; far from it, it only shows \
                 the valley.",
                &law_figures::SimplexPaths { surface, runs, refined, law },
            ));
        }
    }
    if !outcome.left_out.is_empty() {
        figures.push(Picture::new(
            "left_out",
            "One depth left out and predicted",
            "Law and power laws are fitted to the other depths; the finger stays calibrated on all normal forces and areas.",
            &Charts { charts: &[table_figures::left_out_errors(outcome)], columns: 1 },
        ));
    }
    if outcome.curve.is_some() {
        figures.push(Picture::new(
            "curve",
            "Friction coefficient against normal force",
            "Squares are finite elements in steady slide. Dots continue the curve by its last power; nothing was computed there.",
            &table_figures::CurveFigure { outcome },
        ));
    }
    if let Some(last) = outcome.sensitivities.last() {
        let caption = format!(
            "Steady slide at depth {} mm, one input changed at a time by about its uncertainty for a subject.",
            fixed(last.depth_mm, 2)
        );
        let figure = table_figures::Tornado { outcome };
        figures.push(Picture::new("tornado", "Sensitivity of the result", caption, &figure));
    }
    let json = serde_json::to_string_pretty(outcome)? + "\n";
    Ok(Rendered { html: page::page(outcome, &figures), json, figures })
}

/// Makes page, numbers and figures of a population.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render_population(population: &Population) -> Result<Rendered, ReportError> {
    let figures: Vec<_> = (population.subjects.iter().any(|s| s.law_searched))
        .then(|| {
            Picture::new(
                "population",
                "Strength and exponent of the subjects",
                "Bars are the standard errors of each fit; a fit without them has none.",
                &table_figures::Subjects { population },
            )
        })
        .into_iter()
        .collect();
    let json = serde_json::to_string_pretty(population)? + "\n";
    Ok(Rendered { html: page::population(population, &figures), json, figures })
}
