//! A diagnosis of a table becomes a page, its numbers and its figures.
//!
//! Main function: [`render`]. Computes only differences of its inputs. May use: identify, diagnose.

mod figures;
mod page;

use super::traces::Charts;
use super::{Picture, Rendered, ReportError};
use fingerpad_identify::table_diagnosis::Finding;

/// Makes page, numbers and figures.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render(finding: &Finding) -> Result<Rendered, ReportError> {
    let json = serde_json::to_string_pretty(&finding.report)? + "\n";
    let section = &finding.report.table;
    let cells = figures::cells(section);
    let figures = vec![
        Picture::wide_and_narrow(
            "table",
            "The table and the finite elements",
            "Circles: as measured, the bar its error. Published constants: with the finger as given, and calibrated; the corrected model: what it \
             reads.",
            |narrow| Charts { charts: &cells, columns: if narrow { 1 } else { cells.len() } },
        ),
        Picture::wide_and_narrow(
            "candidates",
            "Remaining gap with each candidate",
            "Each beside the finger's constants (stiffness, touch point, strength). The long bar is the remaining gap, the \
             line at its end the error at depths that were left out and predicted; darker candidates cannot be distinguished from the \
             best one. Below: the best pairs.",
            |narrow| figures::Candidates { section, narrow },
        ),
    ];
    Ok(Rendered { html: page::page(finding, &figures), json, figures })
}
