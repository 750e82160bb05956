//! Columns of the user's own in measured runs: which sets must have them, and what stands for them in the calibration.
//!
//! Main functions: [`require`], [`at_reference`].

use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::{Column, LawsFile};

/// Refuses a set that lacks a column which a law of the file reads.
///
/// Errors: [`DiagnoseError::Unusable`] with the column, the law and its file.
pub fn require(set: &RunSet, laws: &LawsFile) -> Result<(), DiagnoseError> {
    for law in &laws.laws {
        for driver in law.drivers.iter().filter(|d| matches!(d.column, Column::Own { .. })) {
            if !set.recorded.contains(&driver.column) {
                return Err(DiagnoseError::Unusable {
                    path: set.path.clone(),
                    problem: format!(
                        "line 1: column `{}` is missing; law `{}` of {} reads it (--map {}=COLUMN says where it is)",
                        driver.name,
                        law.law.name,
                        laws.path.display(),
                        driver.name
                    ),
                });
            }
        }
    }
    Ok(())
}

/// The calibration with the reference value in every column of the user's own that it lacks.
pub fn at_reference(set: &RunSet, laws: &LawsFile) -> RunSet {
    let mut out = set.clone();
    let own = laws.own_columns();
    for (place, column) in laws.columns.iter().enumerate() {
        if out.recorded.contains(&own[place]) {
            continue;
        }
        out.runs.iter_mut().flat_map(|r| &mut r.rows).for_each(|row| row.own[place] = column.reference);
        out.notes.push(format!("column `{}` is not there; its reference {} is taken", column.name, column.reference));
    }
    out.recognise(&own);
    out
}

/// Share of a range by which it is widened: clocks and paths of the core differ from those of a file in rounding.
const WIDER: f64 = 0.02;

/// The laws with the ranges of their drivers in some sets, where the file of laws declares none.
pub fn with_ranges_of(laws: &LawsFile, sets: &[&RunSet]) -> LawsFile {
    let mut out = laws.clone();
    for law in &mut out.laws {
        for driver in law.drivers.iter_mut().filter(|d| !d.is_declared) {
            let rows = sets.iter().flat_map(|s| &s.runs).flat_map(|r| &r.rows).filter(|row| row.depth_mm > 0.0);
            let values = rows.filter_map(|row| fingerpad::effects::tables::driver(driver.number, row));
            let (low, high) = values
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
            if !(low <= high) {
                continue;
            }
            // The formula was checked within its range alone.
            let [least, most] = driver.range;
            let more = WIDER * (high - low).max(1e-3 * (most - least));
            let range = [(low - more).clamp(least, most), (high + more).clamp(least, most)];
            if range[1] > range[0] {
                driver.range = range;
            }
        }
    }
    out
}
