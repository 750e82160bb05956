//! Measured runs from CSV, streamed: one run in memory at a time, long runs and long files thinned.
//!
//! Takes files compressed by gzip, a byte-order mark, CRLF, any column order and unknown columns (noted). Rows of a run are contiguous and in
//! time order.

use std::cell::Cell;
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use flate2::read::MultiGzDecoder;
use sha2::{Digest, Sha256};

use fingerpad_formats::Error;

use crate::data::clock::{equal_stamps, note};
use crate::data::column_map::ColumnMap;
use crate::data::runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
use crate::error::DiagnoseError;
use crate::laws::run_columns::{OPTIONAL, REQUIRED};
use crate::laws::{Column, OWN};

/// Most rows of a run that are held; a longer one is thinned while it is read.
const HELD_ROWS: usize = 4096;
/// Most rows of a run that are kept.
const KEPT_ROWS: usize = 240;
/// Most rows of a file that are kept; beyond it every second run is left out, again and again.
const FILE_ROWS: usize = 40_000;

/// First bytes of a file compressed by gzip (RFC 1952).
pub(super) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Why measured runs could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is not what it should be.
    #[error(transparent)]
    Csv(#[from] Error),
    /// The rows make no run.
    #[error(transparent)]
    Run(#[from] DiagnoseError),
    /// The reader was told to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Reads a file of measured runs, plain or compressed by gzip. `progress` gets the share of bytes read and says whether to
/// go on.
///
/// Errors: [`ReadError`] with file, line and column.
pub fn read(path: &Path, progress: &mut dyn FnMut(f64) -> bool) -> Result<RunSet, ReadError> {
    read_mapped(path, &ColumnMap::default(), progress)
}

/// The same from a file whose columns have other names and units.
///
/// Errors: [`ReadError`] with file, line and column.
pub fn read_mapped(path: &Path, map: &ColumnMap, progress: &mut dyn FnMut(f64) -> bool) -> Result<RunSet, ReadError> {
    let failed = |source| Error::File { path: path.to_path_buf(), source };
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_or(0, |m| m.len()).max(1);
    let mut file = BufReader::new(file);
    let compressed = file.fill_buf().map_err(failed)?.starts_with(&GZIP_MAGIC);
    let bytes = Rc::new(Cell::new(0));
    let mut source = HashingReader { inner: file, hash: Sha256::new(), bytes: Rc::clone(&bytes) };
    let mut share_read = || progress(bytes.get() as f64 / length as f64);
    let mut set = if compressed {
        read_text(path, map, MultiGzDecoder::new(&mut source), &mut share_read)?
    } else {
        read_text(path, map, &mut source, &mut share_read)?
    };
    std::io::copy(&mut source, &mut std::io::sink()).map_err(failed)?;
    set.sha256 = source.hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    Ok(set)
}

/// Reads the runs of a text; `go_on` is asked now and then.
fn read_text(
    path: &Path,
    map: &ColumnMap,
    text: impl Read,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<RunSet, ReadError> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text);
    let columns = ColumnPlaces::of(path, map, reader.headers().map_err(|e| csv_error(path, &e))?)?;
    let mut assembler = RunAssembler::new(path);
    let mut record = csv::StringRecord::new();
    let mut rows_read = 0usize;
    while reader.read_record(&mut record).map_err(|e| csv_error(path, &e))? {
        let line = record.position().map_or(0, |p| p.line() as usize);
        if record.iter().all(str::is_empty) {
            continue;
        }
        rows_read += 1;
        if rows_read.is_multiple_of(8192) && !go_on() {
            return Err(ReadError::Interrupted);
        }
        let (labels, row) = columns.row(path, line, &record)?;
        assembler.push(labels, row)?;
    }
    assembler.finish()?;
    if assembler.runs.is_empty() {
        return Err(Error::TooFewRows { path: path.to_path_buf(), line: 1, found: 0, needed: 1 }.into());
    }
    let mut notes = columns.notes;
    notes.extend(map.told());
    notes.extend(note(assembler.equal_stamps));
    if assembler.thinned > 0 {
        notes.push(format!("{} runs are longer than {KEPT_ROWS} rows and were thinned to that", assembler.thinned));
    }
    if assembler.stride > 1 {
        notes.push(format!("every {}th of {} runs is used", assembler.stride, assembler.index));
    }
    let mut set = RunSet {
        path: path.to_path_buf(),
        runs: assembler.runs.into_iter().map(|r| r.1).collect(),
        recorded: assembler.recorded.unwrap_or_default(),
        notes,
        rows_read,
        runs_read: assembler.index,
        sha256: String::new(),
    };
    set.recognise(&map.own_columns());
    Ok(set)
}

/// A reader that hashes and counts the bytes that pass.
struct HashingReader<R> {
    inner: R,
    hash: Sha256,
    bytes: Rc<Cell<u64>>,
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.hash.update(&buffer[..n]);
        self.bytes.set(self.bytes.get() + n as u64);
        Ok(n)
    }
}

fn csv_error(path: &Path, error: &csv::Error) -> Error {
    let line = error.position().map_or(1, |p| p.line() as usize);
    match error.kind() {
        csv::ErrorKind::Utf8 { .. } => Error::NotText { path: path.to_path_buf(), line },
        _ => Error::File { path: path.to_path_buf(), source: std::io::Error::other(error.to_string()) },
    }
}

/// Where each known column stands.
struct ColumnPlaces {
    required: [usize; REQUIRED.len()],
    optional: [Option<usize>; OPTIONAL.len()],
    /// Columns of the user's own.
    own: Vec<Option<usize>>,
    count: usize,
    notes: Vec<String>,
    map: ColumnMap,
}

impl ColumnPlaces {
    fn of(path: &Path, map: &ColumnMap, header: &csv::StringRecord) -> Result<Self, Error> {
        let own = || map.own().iter().map(|c| c.name.as_str());
        let ours =
            |name: &&str| REQUIRED.into_iter().chain(OPTIONAL).chain(own()).any(|column| map.name(column) == *name);
        let names: Vec<&str> =
            header.iter().map(|n| n.trim_start_matches('\u{feff}').trim().trim_matches('"')).collect();
        let problem =
            |column: &str| Error::MissingColumn { path: path.to_path_buf(), line: 1, column: column.to_owned() };
        if names.len() == 1 && names[0].contains([';', '\t']) {
            return Err(problem("`run_id`: cells are to be separated by commas, with a decimal point"));
        }
        for (i, name) in names.iter().enumerate() {
            if names[..i].contains(name) && ours(name) {
                return Err(Error::Conflict {
                    path: path.to_path_buf(),
                    line: 1,
                    column: (*name).to_owned(),
                    other: (*name).to_owned(),
                });
            }
        }
        let find = |name: &str| names.iter().position(|n| *n == map.name(name));
        let mut required = [0; REQUIRED.len()];
        for (slot, name) in required.iter_mut().zip(REQUIRED) {
            *slot = find(name).ok_or_else(|| match stem_match(name, &names) {
                Some(other) => problem(&format!(
                    "`{name}`; there is `{other}`, another unit: convert it, or --map {name}={other} --unit {name}=UNIT"
                )),
                None => problem(&format!("`{}` (--map {name}=COLUMN says where it is)", map.name(name))),
            })?;
        }
        let mut notes = Vec::new();
        for name in &names {
            if !ours(name) {
                notes.push(format!("column `{name}` is unknown and ignored"));
            }
        }
        for name in OPTIONAL {
            if find(name).is_none()
                && let Some(other) = stem_match(name, &names)
            {
                notes.push(format!("column `{other}` looks like `{name}` in another unit and is ignored"));
            }
        }
        notes.sort();
        let own = own().map(find).collect();
        Ok(Self { required, optional: OPTIONAL.map(find), own, count: names.len(), notes, map: map.clone() })
    }

    fn row(&self, path: &Path, line: usize, record: &csv::StringRecord) -> Result<(Labels, RawRow), Error> {
        if record.len() != self.count {
            return Err(Error::CellCount { path: path.to_path_buf(), line, found: record.len(), expected: self.count });
        }
        let refuse = |column: &str, value: &str, problem: &str| Error::Value {
            path: path.to_path_buf(),
            line,
            column: column.to_owned(),
            value: value.to_owned(),
            problem: problem.to_owned(),
        };
        let number = |column: &str, cell: &str| -> Result<f64, Error> {
            let value: f64 = cell.parse().map_err(|_| refuse(column, cell, "is not a number"))?;
            let value = self.map.value(column, value);
            if value.is_finite() { Ok(value) } else { Err(refuse(column, cell, "is not a finite number")) }
        };
        let need = |k: usize| -> Result<f64, Error> {
            let cell = &record[self.required[k]];
            if cell.is_empty() {
                Err(refuse(REQUIRED[k], cell, "is blank; this column needs a value in every row"))
            } else {
                number(REQUIRED[k], cell)
            }
        };
        let may = |k: usize| -> Result<f64, Error> {
            match self.optional[k].map(|i| &record[i]) {
                None | Some("") => Ok(f64::NAN),
                Some(cell) => number(OPTIONAL[k], cell),
            }
        };
        let mut own = [f64::NAN; OWN];
        for ((to, column), place) in own.iter_mut().zip(self.map.own()).zip(&self.own) {
            let Some(cell) = place.map(|i| &record[i]) else { continue };
            if cell.is_empty() {
                return Err(refuse(&column.name, cell, "is blank; a law reads this column in every row"));
            }
            let value = number(&column.name, cell)?;
            let [low, high] = column.range;
            if !(value >= low && value <= high) {
                let problem =
                    format!("is outside {low} to {high} {}, the range in the file of laws: another unit?", column.unit);
                return Err(refuse(&column.name, cell, &problem));
            }
            *to = value;
        }
        let text = |k: usize| self.optional[k].map_or_else(String::new, |i| record[i].to_owned());
        let run = record[self.required[0]].to_owned();
        if run.is_empty() {
            return Err(refuse("run_id", "", "is blank"));
        }
        let labels = Labels { run, condition: text(8), block: text(9), subject: text(10) };
        let row = RawRow {
            line,
            t_s: need(1)?,
            depth_mm: need(2)?,
            slide_mm: [need(3)?, need(4)?],
            force_n: [need(5)?, need(6)?, need(7)?],
            contact_time_s: may(0)?,
            speed_mm_s: may(1)?,
            direction_deg: may(2)?,
            dwell_s: may(3)?,
            occlusion_time_s: may(4)?,
            hydration_au: may(5)?,
            temperature_c: may(6)?,
            finger_width_mm: may(7)?,
            own,
        };
        Ok((labels, row))
    }
}

/// A column of the header that is `name` with another ending after the last underscore.
fn stem_match<'a>(name: &str, names: &[&'a str]) -> Option<&'a str> {
    let stem = |n: &str| n.rsplit_once('_').map_or(n.to_lowercase(), |(s, _)| s.to_lowercase());
    names
        .iter()
        .copied()
        .find(|n| *n != name && !REQUIRED.contains(n) && !OPTIONAL.contains(n) && stem(n) == stem(name))
}

/// Turns rows into runs.
struct RunAssembler<'a> {
    path: &'a Path,
    labels: Labels,
    rows: Vec<RawRow>,
    row_stride: usize,
    row_index: usize,
    seen: HashSet<String>,
    runs: Vec<(usize, Run)>,
    index: usize,
    stride: usize,
    kept_rows: usize,
    thinned: usize,
    equal_stamps: usize,
    recorded: Option<Vec<Column>>,
}

impl<'a> RunAssembler<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            labels: Labels::default(),
            rows: Vec::new(),
            row_stride: 1,
            row_index: 0,
            seen: HashSet::new(),
            runs: Vec::new(),
            index: 0,
            stride: 1,
            kept_rows: 0,
            thinned: 0,
            equal_stamps: 0,
            recorded: None,
        }
    }

    fn push(&mut self, labels: Labels, row: RawRow) -> Result<(), ReadError> {
        if self.rows.is_empty() || labels.run != self.labels.run {
            self.finish()?;
            if !self.seen.insert(labels.run.clone()) {
                return Err(Error::Value {
                    path: self.path.to_path_buf(),
                    line: row.line,
                    column: "run_id".into(),
                    value: labels.run,
                    problem: "comes again after another run; the rows of a run must be contiguous".into(),
                }
                .into());
            }
            self.labels = labels;
        }
        let last = self.rows.last();
        if let Some(last) = last
            && !(row.t_s >= last.t_s)
        {
            return Err(Error::Value {
                path: self.path.to_path_buf(),
                line: row.line,
                column: "t_s".into(),
                value: row.t_s.to_string(),
                problem: format!("is before {}: time must not fall within run `{}`", last.t_s, self.labels.run),
            }
            .into());
        }
        if self.row_index.is_multiple_of(self.row_stride) {
            self.rows.push(row);
        }
        self.row_index += 1;
        if self.rows.len() > HELD_ROWS {
            let mut i = 0;
            self.rows.retain(|_| {
                i += 1;
                i % 2 == 1
            });
            self.row_stride *= 2;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ReadError> {
        let rows = std::mem::take(&mut self.rows);
        (self.row_index, self.row_stride) = (0, 1);
        if rows.is_empty() {
            return Ok(());
        }
        self.equal_stamps += equal_stamps(&rows);
        let here = recorded(rows.iter());
        self.recorded = Some(match self.recorded.take() {
            None => here,
            Some(all) => all.into_iter().filter(|c| here.contains(c)).collect(),
        });
        let mut run = run_of(self.path, std::mem::take(&mut self.labels), &rows)?;
        let stride = run.rows.len().div_ceil(KEPT_ROWS);
        if stride > 1 {
            self.thinned += 1;
            run.thin(stride);
        }
        if self.index.is_multiple_of(self.stride) {
            self.kept_rows += run.rows.len();
            self.runs.push((self.index, run));
        }
        self.index += 1;
        while self.kept_rows > FILE_ROWS && self.runs.len() > 64 {
            self.stride *= 2;
            let stride = self.stride;
            self.runs.retain(|(i, _)| i.is_multiple_of(stride));
            self.kept_rows = self.runs.iter().map(|(_, r)| r.rows.len()).sum();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::laws::run_columns::template;

    #[test]
    fn the_template_has_every_column_and_can_be_read() {
        let path = std::env::temp_dir().join(format!("template-{}.csv", std::process::id()));
        let template = template();
        std::fs::write(&path, &template).unwrap();
        let set = read(&path, &mut |_| true).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!((set.rows_read, set.runs_read, set.notes.len(), set.recorded.len()), (2, 1, 0, 5));
        for column in REQUIRED.iter().chain(&OPTIONAL) {
            assert!(template.lines().next().unwrap().split(',').any(|c| c == *column), "{column}");
        }
    }

    #[test]
    fn a_compressed_file_gives_the_runs_of_the_plain_one() {
        let mut text =
            "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n\n".to_owned();
        for run in 0..3 {
            for row in 0..5 {
                text += &format!("r{run},{row},{},0,0,0.{row},0,0\n", 0.2 * f64::from(row));
            }
        }
        let name = std::process::id();
        let (plain, packed) = (
            std::env::temp_dir().join(format!("runs-{name}.csv")),
            std::env::temp_dir().join(format!("runs-{name}.csv.gz")),
        );
        std::fs::write(&plain, &text).unwrap();
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        std::fs::write(&packed, encoder.finish().unwrap()).unwrap();
        let [a, b] = [&plain, &packed].map(|p| read(p, &mut |_| true).unwrap());
        let [_, _] = [&plain, &packed].map(|p| std::fs::remove_file(p).unwrap());
        assert_eq!(a.rows_read, 15);
        assert_eq!((a.rows_read, a.runs_read), (b.rows_read, b.runs_read));
        for (a, b) in a.runs.iter().zip(&b.runs) {
            assert_eq!((&a.force_n, &a.slide_mm), (&b.force_n, &b.slide_mm));
        }
        assert_ne!(a.sha256, b.sha256);
    }
}
