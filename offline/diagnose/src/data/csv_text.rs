//! Rows of a CSV file, plain or compressed by gzip, or of a workbook's first sheet, in any dialect that is clear: separators, decimals, a row
//! of units, UTF-16, lines of a logger above the header.
//!
//! Main type: [`CsvRows`]; main function: [`missing_column`].

use std::io::{Chain, Cursor, Read};
use std::path::Path;

use fingerpad_formats::Error;
use fingerpad_formats::dialect::{Decimals, SEPARATORS, separator, split};
use fingerpad_formats::unit::{UnitCell, check_units_row, is_units_row};
use flate2::read::MultiGzDecoder;

use crate::data::column_map::ColumnMap;
use crate::data::workbook::first_sheet;
use crate::laws::run_columns::run_columns;

/// First bytes of a file compressed by gzip (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// First bytes of a ZIP file, as workbooks are.
const ZIP_MAGIC: [u8; 2] = *b"PK";
/// Bytes of text by which a file's separator is found.
const HEAD_BYTES: u64 = 1 << 16;

/// The rows of a file, one after the other.
pub struct CsvRows<'a> {
    path: &'a Path,
    reader: csv::Reader<Chain<Cursor<Vec<u8>>, Box<dyn Read + 'a>>>,
    compressed: bool,
    is_workbook: bool,
    record: csv::StringRecord,
    header: Vec<String>,
    decimals: Decimals,
    units_row: Option<usize>,
    /// Lines above the header, and why the file is not plain UTF-8.
    above: usize,
    encoding: Option<String>,
    /// Columns up to the last one that is read, and cells of the first row.
    needed: usize,
    cells: Option<usize>,
}

/// The text of bytes in UTF-16 with a byte-order mark, and what it is called.
fn of_utf16(bytes: &[u8]) -> Option<(String, &'static str)> {
    let (name, unit): (_, fn([u8; 2]) -> u16) = match bytes {
        [0xff, 0xfe, ..] => ("UTF-16, little-endian", u16::from_le_bytes),
        [0xfe, 0xff, ..] => ("UTF-16, big-endian", u16::from_be_bytes),
        _ => return None,
    };
    let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
    Some((String::from_utf16_lossy(&units), name))
}

/// A cell without byte-order mark, blanks and quotes.
fn bare(cell: &str) -> &str {
    cell.trim_start_matches('\u{feff}').trim().trim_matches('"')
}

/// Whether all cells of a line, of two and more, are numbers; empty ones at its end do not count.
fn is_row(cells: &[&str]) -> bool {
    let number = |cell: &&str| bare(cell).replace(',', ".").parse::<f64>().is_ok();
    let filled = cells.iter().rposition(|cell| !bare(cell).is_empty()).map_or(0, |last| last + 1);
    filled > 1 && cells[..filled].iter().all(number)
}

/// Number and first byte of the line of the header: the first line that has two of our columns, or else that above the rows of numbers
/// with as many cells. `Err` with a row's number and text where nothing stands above it.
fn header_of(head: &str, ours: impl Fn(&str) -> bool) -> Result<(usize, usize), (usize, &str)> {
    let mut byte = 0;
    let lines: Vec<(usize, &str)> = head
        .split_inclusive('\n')
        .map(|line| {
            let start = byte;
            byte += line.len();
            (start, line.trim_end())
        })
        .collect();
    let known = |line: &str| {
        let count = |c: char| split(line, c).iter().filter(|cell| ours(bare(cell))).count();
        SEPARATORS.iter().any(|(c, _)| count(*c) > 1)
    };
    if let Some(number) = lines.iter().position(|(_, line)| known(line)) {
        return Ok((number, lines[number].0));
    }
    // A decimal comma separates cells as well as a comma does, so that commas come last.
    let separators = [';', '\t', ','];
    let row = lines
        .iter()
        .enumerate()
        .find_map(|(number, (_, line))| separators.into_iter().find(|c| is_row(&split(line, *c))).map(|c| (number, c)));
    let Some((row, separator)) = row else { return Ok((0, 0)) };
    let cells = |line: &str| split(line, separator).len();
    let names = |(_, line): &&(usize, &str)| cells(line) == cells(lines[row].1);
    match lines[..row].iter().rev().take_while(names).count() {
        0 if lines[..row].iter().all(|(_, line)| line.is_empty()) => Err((row, lines[row].1)),
        0 => Ok((0, 0)),
        above => Ok((row - above, lines[row - above].0)),
    }
}

/// The message for a file without a header, with its first row.
fn no_header(row: &str) -> String {
    const SHOWN: usize = 60;
    let shown: String = row.chars().take(SHOWN).collect();
    let more = if shown.len() < row.len() { "…" } else { "" };
    format!(
        "no header: the first row is `{shown}{more}`; write a line with the names of its columns above it, as Time,Fx,Fy,Fz in the \
         order of the cells; --map t=Time,x=Fx,y=Fy,normal=Fz says which is which"
    )
}

impl<'a> CsvRows<'a> {
    /// Reads the header.
    ///
    /// * `source`: the file's bytes
    /// * `ours`: whether a column of this name is read
    ///
    /// # Errors
    /// [`Error`] with file and line.
    pub fn open(path: &'a Path, mut source: impl Read + 'a, ours: impl Fn(&str) -> bool) -> Result<Self, Error> {
        let failed = |source| Error::File { path: path.to_path_buf(), source };
        let mut magic = Vec::new();
        source.by_ref().take(GZIP_MAGIC.len() as u64).read_to_end(&mut magic).map_err(failed)?;
        let line_error = |line, problem| Error::Line { path: path.to_path_buf(), line, problem };
        let compressed = magic == GZIP_MAGIC;
        let is_workbook = magic == ZIP_MAGIC;
        let mut encoding = None;
        let mut bytes = Cursor::new(magic).chain(source);
        let mut sheet = Vec::new();
        if is_workbook {
            bytes.read_to_end(&mut sheet).map_err(failed)?;
            let (text, name) = first_sheet(sheet).map_err(|problem| line_error(1, problem))?;
            (sheet, encoding) = (text.into_bytes(), Some(name));
        }
        let bytes = Cursor::new(sheet).chain(bytes);
        let mut text: Box<dyn Read + 'a> =
            if compressed { Box::new(MultiGzDecoder::new(bytes)) } else { Box::new(bytes) };
        let mut head = Vec::new();
        if let Err(error) = text.by_ref().take(HEAD_BYTES).read_to_end(&mut head) {
            let lines = head.iter().filter(|b| **b == b'\n').count();
            return Err(read_error(path, compressed, lines, error));
        }
        if of_utf16(&head).is_some() {
            text.read_to_end(&mut head).map_err(|error| read_error(path, compressed, 1, error))?;
            if let Some((decoded, name)) = of_utf16(&head) {
                (head, encoding) = (decoded.into_bytes(), Some(name.to_owned()));
            }
        }
        let lines = String::from_utf8_lossy(&head);
        let found = header_of(&lines, &ours);
        let (above, start) = found.map_err(|(row, text)| line_error(row + 1, no_header(text)))?;
        let separator = separator(&lines[start..]).map_err(|problem| line_error(above + 1, problem))?;
        // Bytes that are no UTF-8 are longer in `lines`: the header starts after as many line ends.
        let line_ends = head.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(i, _)| i + 1);
        let start = std::iter::once(0).chain(line_ends).nth(above).unwrap_or(0);
        head.drain(..start);
        // A line ends at its line feed, a carriage return before it is a blank: where the return ends it, the next one has its number.
        let end = if head.contains(&b'\n') { csv::Terminator::Any(b'\n') } else { csv::Terminator::CRLF };
        let mut reader = csv::ReaderBuilder::new()
            .terminator(end)
            .flexible(true)
            .trim(csv::Trim::All)
            .delimiter(separator as u8)
            .from_reader(Cursor::new(head).chain(text));
        let mut header: Vec<String> = match reader.headers() {
            Ok(header) => header.iter().map(|name| bare(name).to_owned()).collect(),
            Err(error) => return Err(csv_error(path, compressed, above, above + 1, error)),
        };
        header.truncate(header.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1));
        let needed = header.iter().rposition(|name| ours(name)).map_or(0, |last| last + 1);
        let (record, decimals) = (csv::StringRecord::new(), Decimals::new(separator));
        let (units_row, cells) = (None, None);
        Ok(Self {
            path,
            reader,
            compressed,
            is_workbook,
            record,
            header,
            decimals,
            units_row,
            above,
            encoding,
            needed,
            cells,
        })
    }

    /// Line of the header.
    pub fn header_line(&self) -> usize {
        self.above + 1
    }

    /// Whether the present row has as many cells as the first one, and that one as many as the header; empty cells at the end, and
    /// columns there that are not read, do not count.
    fn is_complete(&mut self) -> bool {
        let filled = (0..self.record.len()).rev().find(|i| !self.record[*i].is_empty()).map_or(0, |last| last + 1);
        let found = self.record.len();
        let expected = *self.cells.get_or_insert(found.clamp(self.needed, self.header.len().max(self.needed)));
        filled <= expected && found >= expected
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
                return Err(Error::Duplicate {
                    path: self.path.to_path_buf(),
                    line: self.header_line(),
                    column: name.clone(),
                    places,
                });
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
            let before = self.above + self.reader.position().line() as usize;
            let read = self.reader.read_record(&mut self.record);
            if !read.map_err(|e| csv_error(self.path, self.compressed, self.above, before, e))? {
                let end = self.decimals.finish();
                end.map_err(|(line, problem)| Error::Line { path: self.path.to_path_buf(), line, problem })?;
                return Ok(None);
            }
            if self.record.iter().all(str::is_empty) {
                continue;
            }
            let line = self.line();
            if !self.is_complete() {
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
        self.record.position().map_or(0, |p| self.above + p.line() as usize)
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
        let encoding = self.encoding.as_ref().map(|name| format!("read as {name}"));
        let above = (self.above > 0).then(|| {
            let (line, lines) = (self.header_line(), if self.above == 1 { "line" } else { "lines" });
            format!("line {line}: the header; the {lines} above it ({}) are not read", self.above)
        });
        // A workbook has no separators; the tabs are the program's.
        let dialect = self.decimals.note().filter(|_| !self.is_workbook);
        [encoding, above, dialect, units].into_iter().flatten().collect()
    }
}

/// The name of a column in `--map` and `--unit`.
pub fn short(column: &str) -> &str {
    run_columns().iter().find(|known| known.name == column).map_or(column, |known| known.short)
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
pub fn missing_column(rows: &CsvRows<'_>, map: &ColumnMap, column: &str, ours: impl Fn(&str) -> bool) -> Error {
    let header = rows.header();
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
    Error::MissingColumn { path: rows.path.to_path_buf(), line: rows.header_line(), column: hint }
}

fn csv_error(path: &Path, compressed: bool, above: usize, line: usize, error: csv::Error) -> Error {
    let at = error.position().map_or(line, |p| above + p.line() as usize);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::trace_csv::{self, Trace};
    use crate::test_file;

    const MAP: &str = "t=Time,x=Fx,y=Fy,normal=Fz";

    /// Forty rows with this header.
    fn plain() -> String {
        let row = |k: i32| {
            let t = f64::from(k) / 50.0;
            format!("{t:.3},{:.4},{:.4},{:.4},{k}\n", 0.3 * t.sin(), 0.3 * t.cos(), 1.0 + 0.2 * t)
        };
        "Time,Fx,Fy,Fz,Tz\n".to_owned() + &(0..40).map(row).collect::<String>()
    }

    fn read(bytes: &[u8], map: &str) -> Result<Trace, String> {
        trace_csv::read(&test_file(".csv", bytes), &ColumnMap::parse(Some(map), None).unwrap())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn lines_above_the_header_encodings_and_empty_columns_are_read_with_a_note() {
        let plain = plain();
        let wanted = read(plain.as_bytes(), MAP).unwrap();
        assert_eq!((wanted.rows.len(), wanted.notes.len()), (40, 0));
        let german = plain.replace(',', ";").replace('.', ",");
        let tabs = plain.replace(',', "\t");
        let lvm = format!(
            "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\t\nChannels\t4\t\t\t\t\nSamples\t40\t40\t40\t40\n\
             ***End_of_Header***\t\n{}",
            tabs.replacen("Tz\n", "Tz\tComment\n", 1).replace("Time", "X_Value")
        );
        let tribometer = format!("Test name;finger on glass\nDate;2024-01-01\n\n{german}");
        let trailing = plain.replace('\n', ",,\n");
        let ragged = plain.replacen("Tz\n", "Tz,,\n", 1);
        let utf16 = |text: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            format!("\u{feff}{text}").encode_utf16().flat_map(bytes).collect()
        };
        let workbook = include_bytes!("../../data/workbook.xlsx").to_vec();
        let sheet = "the sheet `Messung` of a workbook; the other sheet is not read";
        for (name, bytes, map, notes) in [
            ("workbook", workbook, MAP, vec![sheet, "line 4: the header"]),
            ("comments", format!("# ATI Nano17, rate\n# 50 Hz\n{plain}").into_bytes(), MAP, vec!["line 3: the header"]),
            (
                "sep",
                format!("sep=;\n{german}").into_bytes(),
                MAP,
                vec!["line 2: the header; the line above", "semicolon"],
            ),
            ("lvm", lvm.into_bytes(), "t=X_Value,x=Fx,y=Fy,normal=Fz", vec!["line 9: the header", "tab"]),
            ("tribometer", tribometer.into_bytes(), MAP, vec!["line 4: the header", "decimal commas"]),
            ("trailing", trailing.into_bytes(), MAP, vec![]),
            ("dos", plain.replace('\n', "\r\n").into_bytes(), MAP, vec![]),
            ("mac", plain.replace('\n', "\r").into_bytes(), MAP, vec![]),
            ("ragged", ragged.into_bytes(), MAP, vec![]),
            ("utf16le", utf16(&tabs, u16::to_le_bytes), MAP, vec!["little-endian", "tab"]),
            ("utf16be", utf16(&format!("x\n{plain}"), u16::to_be_bytes), MAP, vec!["big-endian", "line 2: the header"]),
        ] {
            let found = read(&bytes, map).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(found.rows, wanted.rows, "{name}");
            assert_eq!(found.notes.len(), notes.len(), "{name}: {:?}", found.notes);
            assert!(
                found.notes.iter().zip(&notes).all(|(found, said)| found.contains(said)),
                "{name}: {:?}",
                found.notes
            );
        }
    }

    #[test]
    fn lines_are_counted_from_the_first_one_of_the_file() {
        let refused = |name: &str, text: String, map: &str, words: &[&str]| {
            let message = read(text.as_bytes(), map).unwrap_err();
            assert!(words.iter().all(|word| message.contains(word)), "{name}: {message}");
        };
        let plain = plain();
        let rows = plain.split_once('\n').unwrap().1;
        refused("bad-cell", format!("# one\n# two\n{}", plain.replacen("0.020,", "0.0x0,", 1)), MAP, &[":5:", "0.0x0"]);
        refused("short", format!("# one\n{}", plain.replacen(",1.0040,1\n", "\n", 1)), MAP, &[":4:", "3 cells"]);
        let dos = |text: String| text.replace('\n', "\r\n");
        refused("dos", dos(plain.replacen("0.000,", "0.0x0,", 1)), MAP, &[":2:", "0.0x0"]);
        refused("dos-last", dos(plain.replacen("0.780,", "0.7x0,", 1)), MAP, &[":41:", "0.7x0"]);
        refused(
            "dos-short",
            dos(format!("# one\n{}", plain.replacen(",1.0040,1\n", "\n", 1))),
            MAP,
            &[":4:", "3 cells"],
        );
        refused("long", plain.replacen(",1\n", ",1,7\n", 1), MAP, &[":3:", "6 cells"]);
        // A header without our names stands above the rows of numbers, below lines of other kinds.
        refused("names", format!("a test\n\n{plain}"), "t=t,x=Fx", &[":3:", "no column `t`"]);
        refused("bare", rows.into(), MAP, &[":1:", "no header", "0.000,0.0000,0.3000", "--map t=Time"]);
        refused("german", rows.replace(',', ";").replace('.', ","), MAP, &[":1:", "no header", "0,000;0,0000"]);
        refused("workbook", "PK\u{3}\u{4}xl".into(), MAP, &[":1:", "no Excel workbook", "save the sheet as CSV"]);
    }
}
