//! The report of an identification: page, numbers, figures.
//!
//! Main functions: [`render`] for one table, [`render_population`] for several. Computes no physics: it reads and draws
//! the results. May use: identify.

mod law_figures;
mod page;
pub(crate) mod plot;
mod table_figures;

use super::canvas::{self, Figure};
use super::html::Picture;
use super::{Rendered, ReportError};
use fingerpad_identify::{Outcome, population::Population};

/// Pictures so far.
#[derive(Default)]
struct Gallery {
    pictures: Vec<Picture>,
    files: Vec<(String, Vec<u8>)>,
}

impl Gallery {
    fn add<F: Figure>(&mut self, name: &str, title: &str, caption: &str, figure: &F) -> Result<(), ReportError> {
        let png = canvas::png(figure)?;
        self.files.push((format!("{name}.png"), png.clone()));
        self.pictures.push(Picture {
            name: name.to_owned(),
            title: title.to_owned(),
            caption: caption.to_owned(),
            png,
            svg: Some(canvas::svg(figure)?),
        });
        Ok(())
    }
}

/// Makes page, numbers and figures of one identification.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn render(outcome: &Outcome) -> Result<Rendered, ReportError> {
    let mut gallery = Gallery::default();
    gallery.add(
        "table_fit",
        "The table against the model, before and after",
        "The model's values belong to the steady slide. Where the finger was calibrated, its depth offset is added to \
         the table's depth before the model is run.",
        &table_figures::TableFit { outcome },
    )?;
    if let Some(law) = &outcome.law {
        if law.map.is_some() {
            let caption = format!(
                "The region where the sum of squares is below its {:.0} % bound. Strength and exponent are fitted; lambda is \
                 derived from them.",
                100.0 * law.confidence
            );
            gallery.add("region", "Strength and exponent by the table", &caption, &law_figures::Region { law })?;
        }
        if let (Some(surface), false) = (&outcome.surface, outcome.simplex.is_empty()) {
            gallery.add(
                "simplex",
                "The downhill simplex on its error surface",
                "Best vertex after every iteration; every vertex was run by finite elements. Open: start, filled: stop. The \
                 dashed line goes on from the best end in ln strength and beta with finer tolerances. \
                 The surface is a surrogate's that agrees with finite elements at the cross; far from it, it only shows \
                 the valley.",
                &law_figures::SimplexPaths {
                    surface,
                    runs: &outcome.simplex,
                    refined: outcome.refined.as_ref(),
                    law,
                },
            )?;
        }
    }
    if !outcome.left_out.is_empty() {
        gallery.add(
            "left_out",
            "One depth left out and predicted",
            "Law and power laws are fitted to the other depths; the finger stays calibrated on all normal forces and areas.",
            &table_figures::LeftOutErrors { outcome },
        )?;
    }
    if outcome.curve.is_some() {
        gallery.add(
            "curve",
            "Friction coefficient against normal force",
            "Squares are finite elements in steady slide. Dots continue the curve by its last power; nothing was computed there.",
            &table_figures::CurveFigure { outcome },
        )?;
    }
    if let Some(last) = outcome.sensitivities.last() {
        let caption = format!(
            "Steady slide at depth {} mm, one input changed at a time by about its uncertainty for a subject.",
            last.depth_mm
        );
        gallery.add("tornado", "Sensitivity of the result", &caption, &table_figures::Tornado { outcome })?;
    }
    let json = serde_json::to_string_pretty(outcome)? + "\n";
    Ok(Rendered { html: page::page(outcome, &gallery.pictures), json, figures: gallery.files })
}

/// Makes page, numbers and figures of a population.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn render_population(population: &Population) -> Result<Rendered, ReportError> {
    let mut gallery = Gallery::default();
    if population.subjects.iter().any(|s| s.law_searched) {
        gallery.add(
            "population",
            "Strength and exponent of the subjects",
            "Bars are the standard errors of each fit; a fit without them has none.",
            &table_figures::Subjects { population },
        )?;
    }
    let json = serde_json::to_string_pretty(population)? + "\n";
    Ok(Rendered { html: page::population(population, &gallery.pictures), json, figures: gallery.files })
}
