//! The first sheet of an Excel workbook as text with tabs between its cells.
//!
//! Main function: [`first_sheet`].

use std::io::Cursor;

use calamine::{Data, Reader, Xlsx};

/// Seconds of a day: Excel counts times in days.
const DAY_S: f64 = 86_400.0;

/// Text of the first sheet, a line for each of its rows, and how the file was read.
///
/// # Errors
/// What is wrong with the workbook and what to do, as a sentence.
pub fn first_sheet(bytes: Vec<u8>) -> Result<(String, String), String> {
    let advice = "save the sheet as CSV (UTF-8)";
    let unreadable =
        |problem: &dyn std::fmt::Display| format!("no Excel workbook that can be read ({problem}): {advice}");
    let mut book = Xlsx::new(Cursor::new(bytes)).map_err(|error| unreadable(&error))?;
    let names = book.sheet_names();
    let name = names.first().ok_or_else(|| unreadable(&"it has no sheet"))?;
    let sheet = book.worksheet_range(name).map_err(|error| unreadable(&error))?;
    let Some((above, _)) = sheet.start() else { return Err(format!("the first sheet, `{name}`, is empty: {advice}")) };
    // Empty rows above the first one are no part of the range; with them lines have the numbers of rows.
    let mut text = "\n".repeat(above as usize);
    let mut dated = false;
    for row in sheet.rows() {
        let cells: Vec<String> = row.iter().map(|cell| cell_text(cell, &mut dated)).collect();
        text += &cells.join("\t");
        text.push('\n');
    }
    let others = match names.len() - 1 {
        0 => String::new(),
        1 => "; the other sheet is not read".into(),
        more => format!("; the {more} other sheets are not read"),
    };
    let times = if dated { "; times of day and dates in s" } else { "" };
    Ok((text, format!("the sheet `{name}` of a workbook{others}{times}")))
}

fn cell_text(cell: &Data, dated: &mut bool) -> String {
    match cell {
        Data::DateTime(time) => {
            *dated = true;
            (time.as_f64() * DAY_S).to_string()
        }
        Data::String(text) => text.replace(['\t', '\n', '\r', '"'], " "),
        other => other.to_string(),
    }
}
