//! A CSV file of numbers as named columns; errors name line and column.
//!
//! Accepts the output of spreadsheets: byte order mark, CRLF, blank lines, spaces and quotes around cells (a separator
//! inside quotes separates nothing), any column order; commas, semicolons or tabs between the cells, with the latter
//! two decimal commas too; a row of units below the header. Does not accept thousands separators, comments or missing
//! cells.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::dialect::{Decimals, separator, split};
use crate::unit::{UnitCell, check_units_row, is_units_row, units_of};

use super::{ColumnNames, Error};

/// One row of cells with its line number.
pub struct Row {
    /// Line of the file, counted from 1.
    pub line: usize,
    /// Cells as text, in the order of the header.
    pub cells: Vec<String>,
}

/// Header and rows of a file, cells as text.
pub struct Columns {
    path: PathBuf,
    header_line: usize,
    names: Vec<String>,
    /// Factor of each column's values.
    factors: Vec<f64>,
    decimals: Decimals,
    /// Rows of values, blank lines and a row of units left out; numbers have decimal points.
    pub rows: Vec<Row>,
    /// Format of the file, if it differs from that of this program's files.
    pub notes: Vec<String>,
}

impl Columns {
    /// Line of the header.
    pub fn header_line(&self) -> usize {
        self.header_line
    }

    /// Reads the file and checks that its columns are among `known` and unique, and that each row has as many cells.
    pub fn read(path: &Path, known: &[&str]) -> Result<Self, Error> {
        Self::parse_as(path, &text(path)?, known, &ColumnNames::default(), false)
    }

    /// Reads a file whose columns have names and units of their own. If any has, other columns are ignored.
    pub fn read_as(path: &Path, known: &[&str], as_named: &ColumnNames) -> Result<Self, Error> {
        Self::parse_as(path, &text(path)?, known, as_named, true)
    }

    /// The same from text; `path` is for the messages.
    pub fn parse(path: &Path, text: &str, known: &[&str]) -> Result<Self, Error> {
        Self::parse_as(path, text, known, &ColumnNames::default(), false)
    }

    /// * `has_options`: whether the user can set names and units of columns by options
    fn parse_as(
        path: &Path,
        text: &str,
        known: &[&str],
        as_named: &ColumnNames,
        has_options: bool,
    ) -> Result<Self, Error> {
        let path = path.to_path_buf();
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let first = 1 + text.lines().take_while(|line| line.trim().is_empty()).count();
        let separator = separator(text).map_err(|problem| Error::Line { path: path.clone(), line: first, problem })?;
        let mut lines = text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(i, line)| (i + 1, split(line, separator).into_iter().map(cell).collect::<Vec<_>>()));
        let Some((header_line, names)) = lines.next() else {
            return Err(Error::Empty { path, expected: known.join(",") });
        };
        for (column, given) in as_named.given() {
            if !names.iter().any(|name| name == given) {
                let column = format!("`{given}`, which is `{column}`");
                return Err(Error::MissingColumn { path, line: header_line, column });
            }
        }
        // A column that is none of the format's keeps its name, which is never looked up.
        let names: Vec<String> = names
            .into_iter()
            .map(|name| as_named.of_file(&name).map_or_else(|| format!("({name})"), str::to_owned))
            .collect();
        for (i, name) in names.iter().enumerate() {
            if !known.contains(&name.as_str()) {
                if as_named.renames() {
                    continue;
                }
                let hint = hint(name, known);
                return Err(Error::UnknownColumn { path, line: header_line, column: name.clone(), hint });
            }
            if let Some(before) = names[..i].iter().position(|other| other == name) {
                let places = [before + 1, i + 1];
                return Err(Error::Duplicate { path, line: header_line, column: name.clone(), places });
            }
        }
        let mut rows = Vec::new();
        for (line, cells) in lines {
            if cells.len() != names.len() {
                let (found, expected) = (cells.len(), names.len());
                return Err(Error::CellCount { path, line, found, expected, separator });
            }
            rows.push(Row { line, cells });
        }
        let factors = names.iter().map(|name| as_named.factor(name)).collect();
        let decimals = Decimals::new(separator);
        let mut columns = Self { path, header_line, names, factors, decimals, rows, notes: Vec::new() };
        columns.take_units_row(known, as_named, has_options)?;
        columns.point_decimals(known)?;
        columns.notes.extend(columns.decimals.note());
        Ok(columns)
    }

    /// Removes the first row if it names the columns' units.
    fn take_units_row(&mut self, known: &[&str], as_named: &ColumnNames, has_options: bool) -> Result<(), Error> {
        let Some(row) = self.rows.first() else { return Ok(()) };
        let places: Vec<usize> = (0..self.names.len()).filter(|i| known.contains(&self.names[*i].as_str())).collect();
        let cell = |&i: &usize| {
            let column = self.names[i].as_str();
            let ours = units_of(column).next();
            UnitCell {
                column,
                key: if has_options { column } else { "" },
                unit: as_named.unit(column).or(ours).map_or("", |unit| unit.name),
                text: &row.cells[i],
            }
        };
        let cells: Vec<UnitCell<'_>> = places.iter().map(cell).collect();
        if !is_units_row(&cells) {
            return Ok(());
        }
        check_units_row(&cells).map_err(|(k, problem)| self.refuse(row, places[k], problem))?;
        self.notes.push(format!("line {}: a row of units, which are those of the columns' names", row.line));
        self.rows.remove(0);
        Ok(())
    }

    /// Writes the decimals of all known columns with points.
    fn point_decimals(&mut self, known: &[&str]) -> Result<(), Error> {
        for k in 0..self.rows.len() {
            for column in 0..self.names.len() {
                if !known.contains(&self.names[column].as_str()) {
                    continue;
                }
                let row = &self.rows[k];
                let plain = self.decimals.plain(row.line, &row.cells[column]).map(Cow::into_owned);
                self.rows[k].cells[column] = plain.map_err(|problem| self.refuse(&self.rows[k], column, problem))?;
            }
        }
        let path = &self.path;
        self.decimals.finish().map_err(|(line, problem)| Error::Line { path: path.clone(), line, problem })
    }

    /// Index of the column, if the file has it.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Index of the column.
    pub fn need(&self, name: &str) -> Result<usize, Error> {
        self.find(name).ok_or_else(|| self.missing(&format!("`{name}`")))
    }

    /// Index of whichever of two columns the file has, and whether it is the second; both or none is an error.
    pub fn either(&self, first: &str, second: &str) -> Result<(usize, bool), Error> {
        match (self.find(first), self.find(second)) {
            (Some(i), None) => Ok((i, false)),
            (None, Some(i)) => Ok((i, true)),
            (None, None) => Err(self.missing(&format!("`{first}` or `{second}`"))),
            (Some(i), Some(j)) => Err(Error::Conflict {
                path: self.path.clone(),
                line: self.header_line,
                column: self.names[i.max(j)].clone(),
                other: self.names[i.min(j)].clone(),
            }),
        }
    }

    fn missing(&self, name: &str) -> Error {
        Error::MissingColumn { path: self.path.clone(), line: self.header_line, column: name.to_owned() }
    }

    /// The finite number in a cell.
    pub fn number(&self, row: &Row, column: usize) -> Result<f64, Error> {
        let text = &row.cells[column];
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value * self.factors[column]),
            Ok(_) => Err(self.refuse(row, column, "is not finite")),
            Err(_) if text.is_empty() => Err(self.refuse(row, column, "is missing: the cell is empty")),
            Err(_) => Err(self.refuse(row, column, self.decimals.not_a_number(text))),
        }
    }

    /// The error for a cell that cannot be.
    pub fn refuse(&self, row: &Row, column: usize, problem: impl Into<String>) -> Error {
        Error::Value {
            path: self.path.clone(),
            line: row.line,
            column: self.names[column].clone(),
            value: row.cells[column].clone(),
            problem: problem.into(),
        }
    }

    /// Errors when there are fewer than `needed` rows.
    pub fn need_rows(&self, needed: usize) -> Result<(), Error> {
        if self.rows.len() >= needed {
            return Ok(());
        }
        let line = self.rows.last().map_or(self.header_line, |row| row.line);
        Err(Error::TooFewRows { path: self.path.clone(), line, found: self.rows.len(), needed })
    }
}

/// The text of a file.
fn text(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    String::from_utf8(bytes).map_err(|e| Error::NotText {
        path: path.to_path_buf(),
        line: 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count(),
    })
}

fn cell(text: &str) -> String {
    let text = text.trim();
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text).trim().to_owned()
}

/// The probable intention of an unknown column.
fn hint(name: &str, known: &[&str]) -> String {
    let all = || format!("columns are {}", known.join(", "));
    if name.parse::<f64>().is_ok() {
        return format!("the first line must name the columns; {}", all());
    }
    let lower = name.to_lowercase().replace([' ', '-', '(', '[', '/'], "_").replace([')', ']'], "").replace("__", "_");
    if let Some(same) = known.iter().find(|k| **k == lower) {
        return format!("did you mean `{same}`?");
    }
    let unit_of = |k: &str| k.rsplit_once('_').map(|(_, unit)| unit.to_owned()).unwrap_or_default();
    let stems = ["t", "depth", "slide_x", "slide_y", "normal_force", "friction_x", "friction_y", "contact_area"];
    let aliases = [
        ("time", "t"),
        ("force", "normal_force"),
        ("normal", "normal_force"),
        ("load", "normal_force"),
        ("force_z", "normal_force"),
        ("fz", "normal_force"),
        ("force_x", "friction_x"),
        ("force_y", "friction_y"),
        ("fx", "friction_x"),
        ("fy", "friction_y"),
        ("x", "slide_x"),
        ("y", "slide_y"),
        ("slide", "slide_x"),
        ("area", "contact_area"),
        ("indentation", "depth"),
        ("mu", "friction_coefficient"),
        ("friction", "friction_coefficient"),
    ];
    let stem_is = |s: &str| lower == s || lower.rsplit_once('_').is_some_and(|(stem, _)| stem == s);
    let alias = aliases.iter().filter(|(a, _)| stem_is(a)).map(|(_, stem)| *stem);
    for stem in stems.iter().copied().filter(|s| stem_is(s)).chain(alias) {
        let fits = |k: &&&str| {
            **k == stem || k.strip_prefix(stem).is_some_and(|unit| unit.starts_with('_') && !unit[1..].contains('_'))
        };
        if let Some(meant) = known.iter().find(fits) {
            return match unit_of(meant).as_str() {
                "mm" => format!("did you mean `{meant}`, in mm?"),
                "mm2" => format!("did you mean `{meant}`, in mm²?"),
                "n" => format!("did you mean `{meant}`, in newtons?"),
                "s" => format!("did you mean `{meant}`, in seconds?"),
                _ => format!("did you mean `{meant}`?"),
            };
        }
    }
    all()
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [&str; 3] = ["t_s", "depth_mm", "normal_force_n"];

    fn parse(text: &str) -> Result<Columns, String> {
        Columns::parse(Path::new("runs.csv"), text, &KNOWN).map_err(|e| e.to_string())
    }

    fn numbers(columns: &Columns) -> Result<Vec<f64>, Error> {
        columns.rows.iter().flat_map(|row| (0..3).map(|k| columns.number(row, k))).collect()
    }

    #[test]
    fn every_unambiguous_dialect_gives_the_same_numbers() {
        let plain = "t_s,depth_mm,normal_force_n\n0,0.25,-0.5\n1,0.5,1e-3\n";
        let wanted = parse(plain).unwrap();
        assert!(wanted.notes.is_empty());
        for (text, note) in [
            (plain.replace(',', ";").replace('.', ","), "read as semicolon-separated with decimal commas"),
            (plain.replace(',', ";"), "read as semicolon-separated"),
            (plain.replace(',', "\t").replace('.', ","), "read as tab-separated with decimal commas"),
            (
                plain.replace("_n\n", "_n\n[s],[mm],N\n"),
                "line 2: a row of units, which are those of the columns' names",
            ),
        ] {
            let read = parse(&text).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(numbers(&read).unwrap(), numbers(&wanted).unwrap(), "{text}");
            assert_eq!(read.notes, [note]);
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_line() {
        for (text, wanted_text) in [
            ("t_s,depth_mm,normal_force_n\n0,0,25,0\n", &["runs.csv:2", "4 cells", "decimal comma"][..]),
            ("t_s,depth_mm,normal_force_n\n0,\"-0,2\",0\n", &["runs.csv:2", "depth_mm", "`-0,2`", "write -0.2"]),
            ("t_s;depth_mm;normal_force_n\n0;0,5;0\n1;0.5;0\n", &["runs.csv:3", "decimal point", "line 2", "`0,5`"]),
            ("t_s;depth_mm;normal_force_n\n0;1,500;0\n", &["runs.csv:2", "1.500 or 1500"]),
            ("t_s,depth_mm;normal_force_n\n0,0.5;0\n", &["runs.csv:1", "commas and semicolons"]),
            ("t_s,depth_mm,t_s\n0,0,0\n", &["runs.csv:1", "`t_s`", "twice", "cells 1 and 3"]),
            (
                "t_s,depth_mm,normal_force_n\ns,um,N\n0,0,0\n",
                &["runs.csv:2", "depth_mm", "`um`", "convert the column to mm"],
            ),
            (
                "t_s,depth_mm,normal_force_n\ns,furlong,N\n",
                &["runs.csv:2", "depth_mm", "`furlong`", "neither a number"],
            ),
            ("T_S,depth_mm,normal_force_n\n0,0,0\n", &["runs.csv:1", "`T_S`", "did you mean `t_s`"]),
        ] {
            let message = parse(text).and_then(|read| numbers(&read).map_err(|e| e.to_string())).unwrap_err();
            assert!(wanted_text.iter().all(|part| message.contains(part)), "{message}");
        }
        let names = ColumnNames::parse(None, Some("depth_mm=cm"), &KNOWN).unwrap();
        let text = "t_s,depth_mm,normal_force_n\ns,um,mN\n0,0,0\n";
        let read = Columns::parse_as(Path::new("runs.csv"), text, &KNOWN, &names, true);
        let message = read.map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("read in cm: add --unit depth_mm=um,normal_force_n=mN"), "{message}");
    }
}
