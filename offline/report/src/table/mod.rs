//! A diagnosis of a table becomes a page, its numbers and its figures.
//!
//! Main function: [`render`]. Computes only differences of its inputs. May use: identify, diagnose.

mod figures;
mod page;

use super::{Rendered, ReportError, canvas, html::Picture};
use fingerpad_identify::table_diagnosis::Finding;

/// Makes page, numbers and figures.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn render(finding: &Finding) -> Result<Rendered, ReportError> {
    let json = serde_json::to_string_pretty(&finding.report)? + "\n";
    let section = &finding.report.table;
    let mut files = Vec::new();
    let mut picture = |name: &str, title: &str, caption: String, png: Vec<u8>, svg: String| {
        files.push((format!("{name}.png"), png.clone()));
        Picture { name: name.into(), title: title.into(), caption, png, svg: Some(svg) }
    };
    let table = figures::Cells { section };
    let candidates = figures::Candidates { section };
    let pictures = [
        picture(
            "table",
            "The table and the finite elements",
            "Circles: as measured, the bar its error; triangles: published constants, finger as given; diamonds: published \
             constants, finger calibrated; squares: what the corrected model reads."
                .into(),
            canvas::png(&table)?,
            canvas::svg(&table)?,
        ),
        picture(
            "candidates",
            "Remaining gap with each candidate",
            "Each beside the finger's constants (stiffness, touch point, strength). The long bar is the remaining gap, the \
             line at its end the error at depths that were left out and predicted; darker candidates cannot be distinguished from the \
             best one. Below: the best pairs."
                .into(),
            canvas::png(&candidates)?,
            canvas::svg(&candidates)?,
        ),
    ];
    let html = page::page(finding, &pictures);
    Ok(Rendered { html, json, figures: files })
}
