//! A path of the plane from CSV: `t_s,depth_mm,slide_x_mm,slide_y_mm`, or forces in place of travels.

use std::path::Path as FilePath;

use crate::load_path::{Drive, Path, Turn, Turns, Waypoint};
use fingerpad_formats::Columns;
use fingerpad_formats::Error;

/// Columns by axis: driven by travel, driven by force.
const AXES: [(&str, &str); 3] =
    [("depth_mm", "normal_force_n"), ("slide_x_mm", "friction_x_n"), ("slide_y_mm", "friction_y_n")];

/// Columns of turns, which may be absent: driven by angle, driven by moment.
const TURNS: [(&str, &str); 3] =
    [("spin_deg", "spin_moment_n_mm"), ("pitch_deg", "moment_y_n_mm"), ("roll_deg", "moment_x_n_mm")];

/// Reads a path.
///
/// `normal_force_n` in place of `depth_mm`, `friction_x_n` and `friction_y_n` in place of the slides, drive that axis
/// by force. Time must increase strictly from row to row, normal forces must not be negative, all numbers are finite,
/// and there are at least two rows; any other file gives an error with its line. `spin_deg`, `pitch_deg` and
/// `roll_deg`, or the moments in their place, may be absent: the finger then keeps its neutral pose.
pub fn read(file: &FilePath) -> Result<Path, Error> {
    read_with(file, &[]).map(|(path, _)| path)
}

/// A column of the reader's choice beside a path.
#[derive(Clone, Copy, Debug)]
pub struct More<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its unit, for errors.
    pub unit: &'a str,
    /// Least and largest accepted value.
    pub range: [f64; 2],
}

/// The same with further columns, which may be absent: for each its values, one a waypoint.
///
/// # Errors
/// Those of [`read`], and a value that is outside its range.
pub fn read_with(file: &FilePath, more: &[More<'_>]) -> Result<(Path, Vec<Option<Vec<f64>>>), Error> {
    let known: Vec<&str> = std::iter::once("t_s")
        .chain(AXES.iter().chain(&TURNS).flat_map(|(a, b)| [*a, *b]))
        .chain(more.iter().map(|m| m.name))
        .collect();
    let table = Columns::read(file, &known)?;
    let path = path_of(&table)?;
    let further = more.iter().map(|m| further(&table, m)).collect::<Result<_, _>>()?;
    Ok((path, further))
}

/// A further column, if the file has it.
fn further(table: &Columns, more: &More<'_>) -> Result<Option<Vec<f64>>, Error> {
    let Some(column) = table.find(more.name) else { return Ok(None) };
    let [low, high] = more.range;
    let value = |row| -> Result<f64, Error> {
        let value = table.number(row, column)?;
        if value >= low && value <= high {
            return Ok(value);
        }
        let problem = format!("is outside {low} to {high} {}", more.unit);
        Err(table.refuse(row, column, problem.trim_end()))
    };
    table.rows.iter().map(value).collect::<Result<_, _>>().map(Some)
}

fn path_of(table: &Columns) -> Result<Path, Error> {
    let t = table.need("t_s")?;
    let mut drives = [Drive::Displacement; 3];
    let mut columns = [0; 3];
    for (axis, (travel, force)) in AXES.into_iter().enumerate() {
        let (column, by_force) = table.either(travel, force)?;
        columns[axis] = column;
        if by_force {
            drives[axis] = Drive::Force;
        }
    }
    table.need_rows(2)?;
    let mut waypoints: Vec<Waypoint> = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        let [normal, x, y] = [0, 1, 2].map(|axis| table.number(row, columns[axis]));
        let waypoint = Waypoint { t_s: table.number(row, t)?, normal: normal?, x: x?, y: y? };
        if let Some(before) = waypoints.last().filter(|before| waypoint.t_s <= before.t_s) {
            let problem = format!("is not after {} of the row before; time must increase", before.t_s);
            return Err(table.refuse(row, t, problem));
        }
        if drives[0] == Drive::Force && waypoint.normal < 0.0 {
            return Err(table.refuse(row, columns[0], "is negative: the plane can press the finger, not pull it"));
        }
        waypoints.push(waypoint);
    }
    let [spin, pitch, roll] = TURNS.map(|(angle, moment)| turn(table, angle, moment));
    Ok(Path { drives, waypoints, turns: Turns { spin: spin?, pitch: pitch?, roll: roll? } })
}

/// A turn, if the file has a column of it.
fn turn(table: &Columns, angle: &str, moment: &str) -> Result<Option<Turn>, Error> {
    if table.find(angle).is_none() && table.find(moment).is_none() {
        return Ok(None);
    }
    let (column, by_moment) = table.either(angle, moment)?;
    let values = table.rows.iter().map(|row| table.number(row, column)).collect::<Result<_, _>>()?;
    Ok(Some(Turn { drive: if by_moment { Drive::Force } else { Drive::Displacement }, values }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Path, String> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("p.csv");
        std::fs::write(&file, text).unwrap();
        read(&file).map_err(|e| e.to_string().rsplit_once("p.csv").unwrap().1.to_owned())
    }

    #[test]
    fn a_spreadsheet_file_in_any_column_order() {
        let path = read_text(
            "\u{feff}slide_x_mm, t_s ,\"normal_force_n\",friction_y_n\r\n\r\n 0,0,0,0\r\n1.5 ,2e-1, .3,-0.1\r\n\r\n",
        )
        .unwrap();
        assert_eq!(path.drives, [Drive::Force, Drive::Displacement, Drive::Force]);
        assert_eq!(path.waypoints[1], Waypoint { t_s: 0.2, normal: 0.3, x: 1.5, y: -0.1 });
        assert_eq!(path.waypoints.len(), 2);
    }

    #[test]
    fn further_columns_come_with_the_path_and_are_held_to_their_range() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("p.csv");
        let more = [("voltage_v", "V", 200.0), ("film_um", "um", 50.0)];
        let more = more.map(|(name, unit, high)| More { name, unit, range: [0.0, high] });
        let read_text = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read_with(&file, &more).map_err(|e| e.to_string().rsplit_once("p.csv").unwrap().1.to_owned())
        };
        let head = "t_s,depth_mm,voltage_v,slide_x_mm,slide_y_mm\n";
        let (path, further) = read_text(&format!("{head}0,0,0,0,0\n1,1,120.5,0,0\n")).unwrap();
        assert_eq!((path.waypoints.len(), further), (2, vec![Some(vec![0.0, 120.5]), None]));
        let message = read_text(&format!("{head}0,0,0,0,0\n1,1,300,0,0\n")).unwrap_err();
        assert_eq!(message, ":3: column `voltage_v`: `300` is outside 0 to 200 V");
        let message = read_text(&format!("{head}0,0,0,0,0\n1,1,,0,0\n")).unwrap_err();
        assert!(message.starts_with(":3: column `voltage_v`: `` is missing"), "{message}");
    }

    #[test]
    fn every_mistake_is_named_with_its_place() {
        let head = "t_s,depth_mm,slide_x_mm,slide_y_mm\n";
        let cases = [
            ("", ": the file is empty"),
            ("\n \r\n", ": the file is empty"),
            ("t_s,depth_m,slide_x_mm,slide_y_mm\n", ":1: unknown column `depth_m`; did you mean `depth_mm`, in mm?"),
            ("t_s,depth_um,slide_x_mm,slide_y_mm\n", ":1: unknown column `depth_um`; did you mean `depth_mm`, in mm?"),
            (
                "t_s,force_g,slide_x_mm,slide_y_mm\n",
                ":1: unknown column `force_g`; did you mean `normal_force_n`, in newtons?",
            ),
            ("\ntime_ms,depth_mm\n", ":2: unknown column `time_ms`; did you mean `t_s`, in seconds?"),
            ("t_s,Depth (mm)\n", ":1: unknown column `Depth (mm)`; did you mean `depth_mm`?"),
            ("t_s;depth_mm\n", ":1: no column `slide_x_mm` or `friction_x_n`"),
            ("0,1,2,3\n", ":1: unknown column `0`; the first line must name the columns"),
            ("t_s,bogus\n", ":1: unknown column `bogus`; columns are t_s, depth_mm"),
            ("t_s,depth_mm,slide_x_mm\n", ":1: no column `slide_y_mm` or `friction_y_n`"),
            ("depth_mm,slide_x_mm,slide_y_mm\n", ":1: no column `t_s`"),
            ("t_s,t_s,depth_mm\n", ":1: column `t_s` occurs twice in the header"),
            (
                "t_s,normal_force_n,depth_mm,slide_x_mm,slide_y_mm\n",
                ":1: column `depth_mm` cannot be used together with `normal_force_n`",
            ),
            (head, ":1: the file ends after 0 row(s) of values; at least 2 needed"),
            (&format!("{head}0,0,0,0\n\n"), ":2: the file ends after 1 row(s)"),
            (&format!("{head}0,0,0,0\n1,NaN,0,0\n"), ":3: column `depth_mm`: `NaN` is not finite"),
            (&format!("{head}0,0,0,0\n\n1,0,inf,0\n"), ":4: column `slide_x_mm`: `inf` is not finite"),
            (&format!("{head}0,0,0,1e999\n1,0,0,0\n"), ":2: column `slide_y_mm`: `1e999` is not finite"),
            (&format!("{head}0,0,0,0\n1,1 mm,0,0\n"), ":3: column `depth_mm`: `1 mm` is not a number"),
            (&format!("{head}0,0,0,0\n1,,0,0\n"), ":3: column `depth_mm`: `` is missing"),
            (&format!("{head}0,0,0,0\n1,0,0\n"), ":3: 3 cells, but the header has 4"),
            (&format!("{head}0,0,0,0\n1,0,0,0,0\n"), ":3: 5 cells, but the header has 4"),
            (&format!("{head}0,0,0,0\n1,0,0,0\n1,1,0,0\n"), ":4: column `t_s`: `1` is not after 1 of the row before"),
            (
                "t_s,normal_force_n,slide_x_mm,slide_y_mm\n0,0,0,0\n1,-0.2,0,0\n",
                ":3: column `normal_force_n`: `-0.2` is negative",
            ),
        ];
        for (text, expected) in cases {
            let message = read_text(text).expect_err(text);
            assert!(message.starts_with(expected), "{text:?}\n  gave {message}\n  not  {expected}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_and_missing_files() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("p.csv");
        std::fs::write(&file, b"t_s\n\xff\xfe").unwrap();
        assert!(read(&file).unwrap_err().to_string().ends_with("p.csv:2: not a text file in UTF-8"));
        let error = read(&dir.path().join("none.csv")).unwrap_err().to_string();
        assert!(error.contains("none.csv: "), "{error}");
    }
}
