//! A CSV file of numbers as named columns, with errors that say where.
//!
//! Takes what spreadsheets write: byte order mark, CRLF, blank lines, spaces and quotes around cells (a comma inside
//! quotes separates nothing), any column order. Does not take semicolons, decimal commas, thousands separators,
//! comments or missing cells.

use std::path::{Path, PathBuf};

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
    /// Rows of values, blank lines left out.
    pub rows: Vec<Row>,
}

impl Columns {
    /// Reads the file and checks that its columns are among `known` and unique, and that each row has as many cells.
    pub fn read(path: &Path, known: &[&str]) -> Result<Self, Error> {
        Self::read_as(path, known, &ColumnNames::default())
    }

    /// Reads a file whose columns have names and units of their own. Where any has, other columns are left aside.
    pub fn read_as(path: &Path, known: &[&str], as_named: &ColumnNames) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
        let text = std::str::from_utf8(&bytes).map_err(|e| Error::NotText {
            path: path.to_path_buf(),
            line: 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count(),
        })?;
        Self::parse_as(path, text, known, as_named)
    }

    /// The same from text; `path` is for the messages.
    pub fn parse(path: &Path, text: &str, known: &[&str]) -> Result<Self, Error> {
        Self::parse_as(path, text, known, &ColumnNames::default())
    }

    fn parse_as(path: &Path, text: &str, known: &[&str], as_named: &ColumnNames) -> Result<Self, Error> {
        let path = path.to_path_buf();
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(i, line)| (i + 1, split(line).into_iter().map(cell).collect::<Vec<_>>()));
        let Some((header_line, names)) = lines.next() else {
            return Err(Error::Empty { path, expected: known.join(",") });
        };
        for (column, given) in as_named.given() {
            if !names.iter().any(|name| name == given) {
                let column = format!("`{given}`, which stands for `{column}`");
                return Err(Error::MissingColumn { path, line: header_line, column });
            }
        }
        // A column of the file that stands for none of the format keeps its name, which nobody asks for.
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
            if names[..i].contains(name) {
                let (column, other) = (name.clone(), name.clone());
                return Err(Error::Conflict { path, line: header_line, column, other });
            }
        }
        let mut rows = Vec::new();
        for (line, cells) in lines {
            if cells.len() != names.len() {
                return Err(Error::CellCount { path, line, found: cells.len(), expected: names.len() });
            }
            rows.push(Row { line, cells });
        }
        let factors = names.iter().map(|name| as_named.factor(name)).collect();
        Ok(Self { path, header_line, names, factors, rows })
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
            Err(_) => Err(self.refuse(row, column, not_a_number(text))),
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

/// Cells of a line: commas outside quotes separate.
fn split(line: &str) -> Vec<&str> {
    let (mut cells, mut start, mut quoted) = (Vec::new(), 0, false);
    for (i, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => {
                cells.push(&line[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    cells.push(&line[start..]);
    cells
}

/// Why a cell is not a number.
fn not_a_number(text: &str) -> String {
    let plain = |separators: &[char]| -> Option<String> {
        let joined = text.replace(separators, "");
        (joined.len() < text.len() && joined.parse::<f64>().is_ok_and(f64::is_finite)).then_some(joined)
    };
    let groups = |separator: char| {
        let whole = text.split('.').next().unwrap_or(text);
        whole.split(separator).skip(1).all(|group| group.len() == 3)
    };
    if text.contains(',') && !groups(',') {
        return "is not a number: the decimal point is `.`".into();
    }
    match plain(&[',', ' ', '\'', '_', '\u{a0}', '\u{202f}', '\u{2009}']) {
        Some(joined) => format!("has a thousands separator: write {joined}"),
        None => "is not a number".into(),
    }
}

fn cell(text: &str) -> String {
    let text = text.trim();
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text).trim().to_owned()
}

/// What an unknown column probably was meant to be.
fn hint(name: &str, known: &[&str]) -> String {
    let all = || format!("columns are {}", known.join(", "));
    if name.contains([';', '\t']) {
        return format!("columns are separated by commas; {}", all());
    }
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
