//! Columns of the user's own in measured runs: which sets must have them, and what stands for them in the calibration.
//!
//! Main functions: [`require`], [`at_reference`].

use fingerpad_formats::significant;

use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::{Column, LawsFile};

/// Refuses a set that lacks a column which a law of the file reads.
///
/// # Errors
/// [`DiagnoseError::Unusable`] with the column, the law and its file.
pub fn require(set: &RunSet, laws: &LawsFile) -> Result<(), DiagnoseError> {
    for law in &laws.laws {
        for driver in law.drivers.iter().filter(|d| matches!(d.column, Column::Own { .. })) {
            if !set.recorded.contains(&driver.column) {
                let is_computed = laws.columns.iter().any(|c| c.name == driver.name && c.derived.is_some());
                let why = if is_computed {
                    "it is computed, and what it is computed from is missing".to_owned()
                } else {
                    format!("--map {}=COLUMN says where it is", driver.name)
                };
                return Err(DiagnoseError::Unusable {
                    path: set.path.clone(),
                    problem: format!(
                        "line 1: column `{}` is missing; law `{}` of {} reads it ({why})",
                        driver.name,
                        law.law.name,
                        laws.path.display()
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
        out.notes.push(format!(
            "column `{}` is not there; its reference {} is taken",
            column.name,
            significant(column.reference, 6)
        ));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::column_map::ColumnMap;
    use crate::data::runs_csv;
    use crate::test_file;

    fn laws() -> LawsFile {
        let text = "[[column]]\nname = \"voltage_v\"\nunit = \"V\"\nrange = [0, 200]\nreference = 5\n\n[[law]]\nname = \"mine\"\n\
                    acts_on = \"strength\"\nformula = \"gain * voltage_v / 100\"\n\
                    parameter = [{ name = \"gain\", unit = \"\", range = [0, 1], typical = 0.1 }]\n";
        LawsFile::parse("mine.toml".as_ref(), text).unwrap()
    }

    /// A run of two rows whose own column is called `U` and holds these cells.
    fn read(cells: [&str; 2]) -> Result<RunSet, String> {
        let head = "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,U";
        let text = format!("{head}\na,0,0.1,0,0,0,0,0,{}\na,1,0.2,0,0,0,0,0,{}\n", cells[0], cells[1]);
        let map = ColumnMap::parse_with(laws().columns, Some("voltage_v=U"), None, "").unwrap();
        runs_csv::read_mapped(&test_file(".csv", text.as_bytes()), &map, &mut |_| true).map_err(|e| e.to_string())
    }

    #[test]
    fn own_columns_are_read_under_their_name_and_refused_with_line_and_value() {
        let set = read(["10", "120.5"]).unwrap();
        assert_eq!(set.runs[0].rows.iter().map(|r| r.own[0]).collect::<Vec<_>>(), [10.0, 120.5]);
        assert!(require(&set, &laws()).is_ok());
        for (cells, words) in [
            (["10", ""], [":3", "voltage_v", "blank"]),
            (["10", "x"], [":3", "voltage_v", "`x`"]),
            (["12000", "10"], [":2", "12000", "0 to 200 V"]),
            (["nan", "10"], [":2", "nan", "finite"]),
        ] {
            let message = read(cells).unwrap_err();
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
        assert!(
            ColumnMap::parse_with(laws().columns, None, Some("voltage_v=kV"), "").unwrap_err().contains("voltage_v")
        );
    }

    #[test]
    fn a_set_without_the_column_is_refused_but_for_the_calibration() {
        let mut set = read(["10", "20"]).unwrap();
        set.recorded.clear();
        set.runs[0].rows.iter_mut().for_each(|row| row.own[0] = f64::NAN);
        let message = require(&set, &laws()).unwrap_err().to_string();
        assert!(message.contains("`voltage_v` is missing") && message.contains("`mine` of mine.toml"), "{message}");
        let filled = at_reference(&set, &laws());
        assert!(filled.runs[0].rows.iter().all(|row| row.own[0] == 5.0) && require(&filled, &laws()).is_ok());
    }
}
