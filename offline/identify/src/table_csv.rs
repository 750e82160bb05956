//! A table of measured friction at given depths, in the manner of Table 1 of Yoshida et al. 2011.

use std::path::Path;

use fingerpad_fe::Rounded;
use fingerpad_formats::{ColumnNames, Columns, Error, Row as CsvRow};

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

/// A measured value with its standard deviation, if that was measured too.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cell {
    /// Value, in the column's unit.
    pub value: f64,
    /// Standard deviation of the value, in the same unit.
    pub sd: Option<f64>,
}

/// One depth of a table with optional columns and cells.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PartialRow {
    /// Travel of the plane from first touch, mm, > 0; its standard deviation if the table has it.
    pub depth_mm: Cell,
    /// Normal force, N, > 0.
    pub normal_force_n: Option<Cell>,
    /// Contact area, mm², > 0.
    pub contact_area_mm2: Option<Cell>,
    /// Kinetic friction force over normal force, > 0.
    pub friction_coefficient: Option<Cell>,
}

/// Columns of a table, each followed by that of its standard deviation.
pub const KNOWN: [&str; 8] = [
    "depth_mm",
    "depth_mm_sd",
    "normal_force_n",
    "normal_force_n_sd",
    "friction_coefficient",
    "friction_coefficient_sd",
    "contact_area_mm2",
    "contact_area_mm2_sd",
];
const DEPTH: usize = 0;
const FORCE: usize = 2;
const FRICTION: usize = 4;
const AREA: usize = 6;

/// Deepest indentation of a fingertip without reaching its bone, mm.
const DEEPEST_MM: f64 = 10.0;
/// Normal force over depth squared that no fingertip exceeds, N/mm² (measured ones are below 2 up to 3 mm).
const STIFFEST_N_PER_MM2: f64 = 6.0;
/// Mean contact pressures between which every fingertip's lie, MPa.
const PRESSURES_MPA: [f64; 2] = [1e-4, 0.15];
/// Largest friction coefficient.
const MOST_FRICTION: f64 = 20.0;

/// Reads a table: `depth_mm,normal_force_n,friction_coefficient` and, optionally, `contact_area_mm2`.
///
/// Rows keep the order of the file; a depth may occur more than once (repeats). Values that no fingertip has are
/// refused with the mistake that they hint at: swapped columns, forces in grams. Standard deviations are read over.
///
/// * `stiffness`: of the configured tissue over that of the human finger, which the limits follow
pub fn read(file: &Path, stiffness: f64) -> Result<Vec<Row>, Error> {
    rows(&Columns::read(file, &KNOWN)?, stiffness)
}

/// Reads a table of a human finger from text; `name` is for the messages.
pub fn parse(name: &Path, text: &str) -> Result<Vec<Row>, Error> {
    rows(&Columns::parse(name, text, &KNOWN)?, 1.0)
}

/// Reads a table that needs depth and one other quantity; each may have a column `..._sd`, and cells may be empty.
///
/// * `names`: column names of the file, and their units
/// * `stiffness`: as of [`read`]
///
/// # Errors
/// [`Error`] with file, line, column and value; values that are impossible for a fingertip are refused as by [`read`].
pub fn read_partial(file: &Path, names: &ColumnNames, stiffness: f64) -> Result<Vec<PartialRow>, Error> {
    partial_rows(&Columns::read_as(file, &KNOWN, names)?, stiffness)
}

/// Format of a table, if it differs from that of this program's files: separators, decimals, a row of units.
pub fn notes(file: &Path, names: &ColumnNames) -> Vec<String> {
    Columns::read_as(file, &KNOWN, names).map_or_else(|_| Vec::new(), |table| table.notes)
}

fn rows(table: &Columns, stiffness: f64) -> Result<Vec<Row>, Error> {
    let [depth, force, friction] = [table.need(KNOWN[DEPTH])?, table.need(KNOWN[FORCE])?, table.need(KNOWN[FRICTION])?];
    let area = table.find(KNOWN[AREA]);
    table.need_rows(1)?;
    let mut rows = Vec::new();
    for row in &table.rows {
        let read = Row {
            depth_mm: positive(table, row, depth)?,
            normal_force_n: positive(table, row, force)?,
            friction_coefficient: not_negative(table, row, friction)?,
            contact_area_mm2: area.map(|column| positive(table, row, column)).transpose()?,
        };
        let partial = PartialRow {
            depth_mm: Cell { value: read.depth_mm, sd: None },
            normal_force_n: Some(Cell { value: read.normal_force_n, sd: None }),
            friction_coefficient: Some(Cell { value: read.friction_coefficient, sd: None }),
            contact_area_mm2: read.contact_area_mm2.map(|value| Cell { value, sd: None }),
        };
        check(table, row, &partial, stiffness)?;
        rows.push(read);
    }
    let forces: Vec<_> = rows.iter().map(|r| Some((r.depth_mm, r.normal_force_n))).collect();
    rising(table, &forces, force)?;
    Ok(rows)
}

fn partial_rows(table: &Columns, stiffness: f64) -> Result<Vec<PartialRow>, Error> {
    let depth = table.need(KNOWN[DEPTH])?;
    let columns = [FORCE, AREA, FRICTION].map(|k| table.find(KNOWN[k]));
    if columns.iter().all(Option::is_none) {
        // One of them is needed; the message names the first.
        table.need(KNOWN[FORCE])?;
    }
    table.need_rows(1)?;
    let mut rows = Vec::new();
    for row in &table.rows {
        let cell = |k: usize| -> Result<Option<Cell>, Error> {
            let Some(column) = table.find(KNOWN[k]).filter(|&c| !row.cells[c].is_empty()) else { return Ok(None) };
            let value = positive(table, row, column)?;
            let sd = table.find(KNOWN[k + 1]).filter(|&c| !row.cells[c].is_empty());
            Ok(Some(Cell { value, sd: sd.map(|c| positive(table, row, c)).transpose()? }))
        };
        let empty = || table.refuse(row, depth, "is missing: the cell is empty");
        let read = PartialRow {
            depth_mm: cell(DEPTH)?.ok_or_else(empty)?,
            normal_force_n: cell(FORCE)?,
            contact_area_mm2: cell(AREA)?,
            friction_coefficient: cell(FRICTION)?,
        };
        if read.normal_force_n.is_none() && read.contact_area_mm2.is_none() && read.friction_coefficient.is_none() {
            return Err(table.refuse(row, depth, "has nothing measured beside it"));
        }
        check(table, row, &read, stiffness)?;
        rows.push(read);
    }
    if let Some(force) = columns[0] {
        let forces: Vec<_> = rows.iter().map(|r| r.normal_force_n.map(|n| (r.depth_mm.value, n.value))).collect();
        rising(table, &forces, force)?;
    }
    Ok(rows)
}

fn positive(table: &Columns, row: &CsvRow, column: usize) -> Result<f64, Error> {
    let value = table.number(row, column)?;
    if value > 0.0 { Ok(value) } else { Err(table.refuse(row, column, "must be greater than 0")) }
}

fn not_negative(table: &Columns, row: &CsvRow, column: usize) -> Result<f64, Error> {
    let value = table.number(row, column)?;
    if value < 0.0 { Err(table.refuse(row, column, "is negative")) } else { Ok(value) }
}

/// Refuses values that no fingertip of this stiffness has.
fn check(table: &Columns, row: &CsvRow, read: &PartialRow, stiffness: f64) -> Result<(), Error> {
    let column = |k: usize| table.find(KNOWN[k]).expect("the value was read from there");
    let depth_mm = read.depth_mm.value;
    if depth_mm > DEEPEST_MM {
        let problem = format!("is no indentation of a fingertip (at most {DEEPEST_MM} mm): are columns swapped?");
        return Err(table.refuse(row, column(DEPTH), problem));
    }
    if read.friction_coefficient.is_some_and(|c| c.value > MOST_FRICTION) {
        let problem = format!("is no friction coefficient (at most {MOST_FRICTION}): are columns swapped?");
        return Err(table.refuse(row, column(FRICTION), problem));
    }
    let Some(force_n) = read.normal_force_n.map(|n| n.value) else { return Ok(()) };
    let most = STIFFEST_N_PER_MM2 * stiffness.max(1.0) * depth_mm * depth_mm;
    if force_n > most {
        let problem = format!(
            "is more than a fingertip supports at {} mm (at most {most:.2} N): is the force in grams \
             (1 g = 0.00981 N), or are columns swapped?",
            Rounded(depth_mm)
        );
        return Err(table.refuse(row, column(FORCE), problem));
    }
    let Some(area) = read.contact_area_mm2 else { return Ok(()) };
    let pressure = force_n / area.value;
    let [least, most] = [PRESSURES_MPA[0] * stiffness.min(1.0), PRESSURES_MPA[1] * stiffness.max(1.0)];
    if !(least..=most).contains(&pressure) {
        let problem = format!(
            "mm² under {} N is a mean pressure of {:.3} kPa, which no fingertip has ({} to {} kPa): are \
             columns swapped, or units other than mm² and N?",
            Rounded(force_n),
            1e3 * pressure,
            Rounded(1e3 * least),
            Rounded(1e3 * most)
        );
        return Err(table.refuse(row, column(AREA), problem));
    }
    Ok(())
}

/// Refuses forces that fall at every step down; `forces` are depth and force of each row that has one.
fn rising(table: &Columns, forces: &[Option<(f64, f64)>], column: usize) -> Result<(), Error> {
    let mut order: Vec<(usize, f64, f64)> =
        forces.iter().enumerate().filter_map(|(i, f)| f.map(|(depth, force)| (i, depth, force))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut steps = order.windows(2).filter(|w| w[1].1 > w[0].1).peekable();
    let Some(first) = steps.peek().map(|w| w[1].0) else { return Ok(()) };
    if steps.all(|w| w[1].2 < w[0].2) {
        let problem = "is less than at a smaller depth, and so on through the table: are columns swapped?";
        return Err(table.refuse(&table.rows[first], column, problem));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_1_of_the_paper() {
        let rows = read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/yoshida2011.csv")), 1.0).unwrap();
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
            read(&file, 1.0)
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

    #[test]
    fn spreadsheets_are_read_right_and_mistakes_are_named() {
        let read_text = |text: &str| parse(Path::new("t.csv"), text);
        let table_1 =
            [[0.75, 0.12, 2.46, 49.4], [1.0, 0.198, 2.0, 62.8], [1.25, 0.384, 1.53, 83.2], [1.5, 0.454, 1.42, 97.7]];
        let write = |columns: [usize; 4], scale: [f64; 4]| {
            let mut text = "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n".to_owned();
            for row in table_1 {
                let cells: Vec<String> = columns.iter().map(|&c| (row[c] * scale[c]).to_string()).collect();
                text += &(cells.join(",") + "\n");
            }
            text
        };
        let good = write([0, 1, 2, 3], [1.0; 4]);
        assert_eq!(read_text(&good).unwrap().len(), 4);
        let excel = format!("\u{feff}{}", good.replace('\n', "\r\n").replace("0.12,", "\"0.12\","));
        assert_eq!(read_text(&excel).unwrap(), read_text(&good).unwrap());
        // Every swap of two columns, and other units.
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let mut columns = [0, 1, 2, 3];
            columns.swap(a, b);
            match read_text(&write(columns, [1.0; 4])) {
                Err(error) => assert!(error.to_string().contains("swapped"), "{a} {b}: {error}"),
                // Depth and friction coefficient of this table are alike in size, and the force then falls.
                Ok(rows) => panic!("{a} and {b} swapped were read: {rows:?}"),
            }
        }
        let grams = read_text(&write([0, 1, 2, 3], [1.0, 1.0 / 0.00981, 1.0, 1.0])).unwrap_err().to_string();
        assert!(grams.starts_with("t.csv:2: column `normal_force_n`") && grams.contains("grams"), "{grams}");
        let head = "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n";
        for (row, expected) in [
            (
                "1,0.2,2,\"1,062.8\"",
                "t.csv:2: column `contact_area_mm2`: `1,062.8` has a thousands separator: write 1062.8",
            ),
            ("1,0.2,2,1 062", "`1 062` has a thousands separator: write 1062"),
            (
                "1,\"0,2\",2,62",
                "t.csv:2: column `normal_force_n`: `0,2` has a decimal comma, while commas separate the cells",
            ),
            ("1,0.2,2,1,062.8", "t.csv:2: 5 cells, but the header has 4"),
            ("1,0.2,two,62", "`two` is not a number"),
        ] {
            let message = read_text(&format!("{head}{row}\n")).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        let missing = read_text("depth_mm,friction_coefficient\n1,2\n").unwrap_err().to_string();
        assert_eq!(missing, "t.csv:1: no column `normal_force_n`");
    }
}
