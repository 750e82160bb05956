//! Rows of a CSV file, plain or compressed by gzip, in any dialect that is clear: separators, decimals, a row of units.
//!
//! Main type: [`CsvRows`]; main function: [`missing_column`].

use std::io::{Chain, Cursor, Read};
use std::path::Path;

use fingerpad_formats::Error;
use fingerpad_formats::dialect::{Decimals, separator};
use fingerpad_formats::unit::{UnitCell, check_units_row, is_units_row};
use flate2::read::MultiGzDecoder;

use crate::data::column_map::ColumnMap;
use crate::laws::run_columns::RUN_COLUMNS;

/// First bytes of a file compressed by gzip (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// Bytes of text by which a file's separator is found.
const HEAD_BYTES: u64 = 1 << 16;

/// The rows of a file, one after the other.
pub struct CsvRows<'a> {
    path: &'a Path,
    reader: csv::Reader<Chain<Cursor<Vec<u8>>, Box<dyn Read + 'a>>>,
    compressed: bool,
    record: csv::StringRecord,
    header: Vec<String>,
    decimals: Decimals,
    units_row: Option<usize>,
}

impl<'a> CsvRows<'a> {
    /// Reads the header.
    ///
    /// * `source`: the file's bytes
    ///
    /// # Errors
    /// [`Error`] with file and line.
    pub fn open(path: &'a Path, mut source: impl Read + 'a) -> Result<Self, Error> {
        let failed = |source| Error::File { path: path.to_path_buf(), source };
        let mut magic = Vec::new();
        source.by_ref().take(GZIP_MAGIC.len() as u64).read_to_end(&mut magic).map_err(failed)?;
        let compressed = magic == GZIP_MAGIC;
        let bytes = Cursor::new(magic).chain(source);
        let mut text: Box<dyn Read + 'a> =
            if compressed { Box::new(MultiGzDecoder::new(bytes)) } else { Box::new(bytes) };
        let mut head = Vec::new();
        if let Err(error) = text.by_ref().take(HEAD_BYTES).read_to_end(&mut head) {
            let lines = head.iter().filter(|b| **b == b'\n').count();
            return Err(read_error(path, compressed, lines, error));
        }
        let line_error = |line, problem| Error::Line { path: path.to_path_buf(), line, problem };
        let separator = separator(&String::from_utf8_lossy(&head)).map_err(|problem| line_error(1, problem))?;
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::All)
            .delimiter(separator as u8)
            .from_reader(Cursor::new(head).chain(text));
        let bare = |name: &str| name.trim_start_matches('\u{feff}').trim().trim_matches('"').to_owned();
        let header = match reader.headers() {
            Ok(header) => header.iter().map(bare).collect(),
            Err(error) => return Err(csv_error(path, compressed, 1, error)),
        };
        let (record, decimals) = (csv::StringRecord::new(), Decimals::new(separator));
        Ok(Self { path, reader, compressed, record, header, decimals, units_row: None })
    }

    /// Names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Refuses a header that has one of these names twice.
    pub fn refuse_duplicates(&self, ours: impl Fn(&str) -> bool) -> Result<(), Error> {
        for (i, name) in self.header.iter().enumerate().filter(|(_, name)| ours(name)) {
            if let Some(before) = self.header[..i].iter().position(|other| other == name) {
                let places = [before + 1, i + 1];
                return Err(Error::Duplicate { path: self.path.to_path_buf(), line: 1, column: name.clone(), places });
            }
        }
        Ok(())
    }

    /// Goes to the next row that is not blank and returns its line; `None` at the end of the file.
    ///
    /// * `numbers`: columns that hold numbers: the program's name and place in the header; a first row that names their
    ///   units is passed over
    pub fn next(&mut self, map: &ColumnMap, numbers: &[(&str, usize)]) -> Result<Option<usize>, Error> {
        let first = self.record.position().is_none();
        loop {
            let before = self.reader.position().line() as usize;
            let read = self.reader.read_record(&mut self.record);
            if !read.map_err(|e| csv_error(self.path, self.compressed, before, e))? {
                let end = self.decimals.finish();
                end.map_err(|(line, problem)| Error::Line { path: self.path.to_path_buf(), line, problem })?;
                return Ok(None);
            }
            if self.record.iter().all(str::is_empty) {
                continue;
            }
            let line = self.line();
            if self.record.len() != self.header.len() {
                return Err(Error::CellCount {
                    path: self.path.to_path_buf(),
                    line,
                    found: self.record.len(),
                    expected: self.header.len(),
                    separator: self.decimals.separator(),
                });
            }
            if first && self.units_row.is_none() && self.names_units(map, numbers)? {
                self.units_row = Some(line);
                continue;
            }
            return Ok(Some(line));
        }
    }

    /// Whether the present row names the units of these columns.
    fn names_units<'c>(&'c self, map: &'c ColumnMap, numbers: &[(&'c str, usize)]) -> Result<bool, Error> {
        let cell = |(column, place): &(&'c str, usize)| UnitCell {
            column,
            key: short(column),
            unit: map.unit(column),
            text: &self.record[*place],
        };
        let cells: Vec<UnitCell<'_>> = numbers.iter().map(cell).collect();
        if !is_units_row(&cells) {
            return Ok(false);
        }
        check_units_row(&cells).map_err(|(k, problem)| self.refuse(numbers[k].0, numbers[k].1, problem))?;
        Ok(true)
    }

    fn line(&self) -> usize {
        self.record.position().map_or(0, |p| p.line() as usize)
    }

    /// Text of a cell of the present row.
    pub fn text(&self, place: usize) -> &str {
        &self.record[place]
    }

    /// The number in a cell of the present row, in the program's unit and sign.
    ///
    /// # Errors
    /// [`Error::Value`] for text and for what is not finite.
    pub fn number(&mut self, map: &ColumnMap, column: &str, place: usize) -> Result<f64, Error> {
        let line = self.line();
        let plain = match self.decimals.plain(line, &self.record[place]) {
            Ok(plain) => plain,
            Err(problem) => return Err(self.refuse(column, place, problem)),
        };
        match plain.parse::<f64>().map(|value| map.value(column, value)) {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(self.refuse(column, place, "is not a finite number")),
            Err(_) => Err(self.refuse(column, place, self.decimals.not_a_number(&self.record[place]))),
        }
    }

    /// The error for a cell of the present row.
    pub fn refuse(&self, column: &str, place: usize, problem: impl Into<String>) -> Error {
        Error::Value {
            path: self.path.to_path_buf(),
            line: self.line(),
            column: column.to_owned(),
            value: self.record[place].to_owned(),
            problem: problem.into(),
        }
    }

    /// How the file was read, where that is not as this program writes files.
    pub fn notes(&self) -> Vec<String> {
        let units = self.units_row.map(|line| format!("line {line}: a row of units, which are those of the columns"));
        self.decimals.note().into_iter().chain(units).collect()
    }
}

/// The name of a column in `--map` and `--unit`.
pub fn short(column: &str) -> &str {
    RUN_COLUMNS.iter().find(|(name, _)| *name == column).map_or(column, |(_, short)| short)
}

/// A column of the header that has the name in other letters: `(it, whether only upper and lower case differ)`; the other
/// kind is a name whose last word, the unit, differs.
pub fn like<'h>(name: &str, header: &'h [String], ours: impl Fn(&str) -> bool) -> Option<(&'h str, bool)> {
    let stem = |n: &str| n.rsplit_once('_').map_or(n.to_lowercase(), |(s, _)| s.to_lowercase());
    let others = || header.iter().map(String::as_str).filter(|n| *n != name && !ours(n));
    let by_case = others().find(|n| n.eq_ignore_ascii_case(name)).map(|n| (n, true));
    by_case.or_else(|| others().find(|n| stem(n) == stem(name)).map(|n| (n, false)))
}

/// The error for a column that the header lacks; it names the option that helps.
pub fn missing_column(
    path: &Path,
    map: &ColumnMap,
    column: &str,
    header: &[String],
    ours: impl Fn(&str) -> bool,
) -> Error {
    let (name, key) = (map.name(column), short(column));
    let hint = match like(name, header, ours) {
        Some((other, true)) => {
            format!(
                "`{name}`; there is `{other}`, which differs in upper and lower case: rename it, or --map {key}={other}"
            )
        }
        Some((other, false)) => {
            format!("`{name}`; there is `{other}`, another unit: convert it, or --map {key}={other} --unit {key}=UNIT")
        }
        None => format!("`{name}` (--map {key}=COLUMN gives its name in the file)"),
    };
    Error::MissingColumn { path: path.to_path_buf(), line: 1, column: hint }
}

fn csv_error(path: &Path, compressed: bool, line: usize, error: csv::Error) -> Error {
    let at = error.position().map_or(line, |p| p.line() as usize);
    match error.into_kind() {
        csv::ErrorKind::Utf8 { .. } => Error::NotText { path: path.to_path_buf(), line: at },
        csv::ErrorKind::Io(error) => read_error(path, compressed, line, error),
        other => Error::Line { path: path.to_path_buf(), line: at, problem: format!("{other:?}") },
    }
}

/// The error of a file that ends or is damaged after a line.
fn read_error(path: &Path, compressed: bool, line: usize, source: std::io::Error) -> Error {
    let path = path.to_path_buf();
    if !compressed {
        return Error::File { path, source };
    }
    // A deflate stream that ends early is an error of another kind than a trailer that does.
    let truncated = source.kind() == std::io::ErrorKind::UnexpectedEof || source.to_string().contains("incomplete");
    let problem = if truncated {
        "the gzip file is truncated: its data end in the middle of the text; copy or download it again".to_owned()
    } else {
        format!("the gzip file is damaged after this line: {source}; copy or download it again")
    };
    Error::Line { path, line: line.max(1), problem }
}
