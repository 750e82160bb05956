//! A table of measured friction at given depths, in the manner of Table 1 of Yoshida et al. 2011.

use std::path::Path;

use super::Error;
use super::columns::Columns;

/// One depth of a measured table.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Row {
    /// Travel of the plane from first touch, mm, > 0.
    pub depth_mm: f64,
    /// Normal force, N, > 0.
    pub normal_force_n: f64,
    /// Kinetic friction force over normal force, >= 0.
    pub friction_coefficient: f64,
    /// Contact area, mm², > 0; `None` if the table has no such column.
    pub contact_area_mm2: Option<f64>,
}

/// Reads a table: `depth_mm,normal_force_n,friction_coefficient` and, optionally, `contact_area_mm2`.
///
/// Rows keep the order of the file; a depth may occur more than once (repeats).
pub fn read(file: &Path) -> Result<Vec<Row>, Error> {
    let known = ["depth_mm", "normal_force_n", "friction_coefficient", "contact_area_mm2"];
    let table = Columns::read(file, &known)?;
    let [depth, force, friction] = [table.need(known[0])?, table.need(known[1])?, table.need(known[2])?];
    let area = table.find(known[3]);
    table.need_rows(1)?;
    let positive = |row, column| {
        let value = table.number(row, column)?;
        if value > 0.0 { Ok(value) } else { Err(table.refuse(row, column, "must be greater than 0")) }
    };
    table
        .rows
        .iter()
        .map(|row| {
            let friction_coefficient = table.number(row, friction)?;
            if friction_coefficient < 0.0 {
                return Err(table.refuse(row, friction, "is negative"));
            }
            Ok(Row {
                depth_mm: positive(row, depth)?,
                normal_force_n: positive(row, force)?,
                friction_coefficient,
                contact_area_mm2: area.map(|column| positive(row, column)).transpose()?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_1_of_the_paper() {
        let rows = read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../data/yoshida2011.csv"))).unwrap();
        assert_eq!(rows.len(), 4);
        let last =
            Row { depth_mm: 1.5, normal_force_n: 0.454, friction_coefficient: 1.42, contact_area_mm2: Some(97.7) };
        assert_eq!(rows[3], last);
    }

    #[test]
    fn the_area_may_be_missing_but_not_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("t.csv");
        let read_text = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read(&file)
        };
        let rows = read_text("friction_coefficient,depth_mm,normal_force_n\n2,1,0.2\n").unwrap();
        assert_eq!(rows[0].contact_area_mm2, None);
        let head = "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n";
        for (text, expected) in [
            (format!("{head}1,0.2,2,0\n"), "t.csv:2: column `contact_area_mm2`: `0` must be greater than 0"),
            (format!("{head}1,0,2,5\n"), "t.csv:2: column `normal_force_n`: `0` must be greater than 0"),
            (format!("{head}1,0.1,-2,5\n"), "t.csv:2: column `friction_coefficient`: `-2` is negative"),
            (format!("{head}1,0.1,2,\n"), "t.csv:2: column `contact_area_mm2`: `` is missing: the cell is empty"),
            (head.to_owned(), "t.csv:1: the file ends after 0 row(s) of values; at least 1 needed"),
            (
                "depth_mm,normal_force_n,friction_coefficient,area_cm2\n".to_owned(),
                "t.csv:1: unknown column `area_cm2`; did you mean `contact_area_mm2`, in mm²?",
            ),
        ] {
            let message = read_text(&text).unwrap_err().to_string();
            assert!(message.ends_with(expected), "{message}");
        }
    }
}
