//! Measured runs from CSV, streamed: one run in memory at a time, long runs and long files thinned.
//!
//! Takes files compressed by gzip, a byte-order mark, CRLF, semicolons, tabs and decimal commas, a row of units, any column
//! order and unknown columns (noted). Rows of a run are contiguous and in time order.

use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use sha2::{Digest, Sha256};

use fingerpad_formats::Error;

use crate::data::column_map::ColumnMap;
use crate::data::column_places::{ColumnPlaces, is_read};
use crate::data::csv_text::CsvRows;
use crate::data::derived_columns::compute_derived;
pub use crate::data::run_assembler::KEPT_ROWS;
use crate::data::run_assembler::{RunAssembler, caution};
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::schema::Caution;

/// Why measured runs could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is not what it should be.
    #[error(transparent)]
    Csv(#[from] Error),
    /// The rows make no run.
    #[error(transparent)]
    Run(#[from] DiagnoseError),
    /// The caller stopped the reader.
    #[error("interrupted")]
    Interrupted,
}

/// Reads a file of measured runs, plain or compressed by gzip. `progress` gets the share of bytes read and says whether to
/// go on.
///
/// # Errors
/// [`ReadError`] with file, line and column.
pub fn read(path: &Path, progress: &mut dyn FnMut(f64) -> bool) -> Result<RunSet, ReadError> {
    read_mapped(path, &ColumnMap::default(), progress)
}

/// The same from a file whose columns have other names and units.
///
/// # Errors
/// [`ReadError`] with file, line and column.
pub fn read_mapped(path: &Path, map: &ColumnMap, progress: &mut dyn FnMut(f64) -> bool) -> Result<RunSet, ReadError> {
    Ok(read_union(&[SessionFile::first(path)], map, progress)?.0)
}

/// A file of a session, whose runs join those of the files before it.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionFile {
    /// The file.
    pub path: PathBuf,
    /// Time of its first row on the clock of the session, s; `None` where its clock is that of the session.
    pub start_s: Option<f64>,
}

impl SessionFile {
    /// The file with which a session starts.
    pub fn first(path: &Path) -> Self {
        Self { path: path.to_path_buf(), start_s: None }
    }
}

/// What was read of one of several files.
#[derive(Clone, Debug, PartialEq)]
pub struct FilePart {
    /// The file.
    pub path: PathBuf,
    /// Rows in it.
    pub rows_read: usize,
    /// Runs in it.
    pub runs_read: usize,
    /// Its SHA-256.
    pub sha256: String,
}

/// The runs of several files as one set: that of one file with the rows of all of them, in this order.
///
/// # Errors
/// [`ReadError`] with file, line and column; also for a `run_id` that two files have, and for files whose clocks overlap.
pub fn read_union(
    files: &[SessionFile],
    map: &ColumnMap,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<(RunSet, Vec<FilePart>), ReadError> {
    let mut assembler = RunAssembler::new();
    let (mut notes, mut cautions, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for (number, file) in files.iter().enumerate() {
        let path = &file.path;
        let failed = |source| Error::File { path: path.clone(), source };
        let opened = File::open(path).map_err(failed)?;
        let length = opened.metadata().map_or(0, |m| m.len()).max(1);
        let bytes = Rc::new(Cell::new(0));
        let mut source = HashingReader { inner: BufReader::new(opened), hash: Sha256::new(), bytes: Rc::clone(&bytes) };
        let before = assembler.runs_read();
        let mut go_on = || progress((number as f64 + bytes.get() as f64 / length as f64) / files.len() as f64);
        let read = read_text(file, map, &mut source, &mut assembler, &mut go_on)?;
        std::io::copy(&mut source, &mut std::io::sink()).map_err(failed)?;
        parts.push(FilePart {
            path: path.clone(),
            rows_read: read.rows,
            runs_read: assembler.runs_read() - before,
            sha256: source.hash.finalize().iter().map(|b| format!("{b:02x}")).collect(),
        });
        notes.extend(read.notes.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
        cautions.extend(read.cautions);
    }
    let names: Vec<String> = files.iter().map(|file| file.path.display().to_string()).collect();
    let mut set = assembler.into_set(PathBuf::from(names.join(" + ")));
    set.notes.splice(0..0, notes.into_iter().chain(map.used()));
    set.cautions.splice(0..0, cautions);
    set.factors = map.factors();
    set.rows_read = parts.iter().map(|part| part.rows_read).sum();
    set.sha256.clone_from(&parts[0].sha256);
    compute_derived(&mut set, map.own())?;
    set.recognise(&map.own_columns());
    if let Some(rotation) = map.rotation() {
        rotation.turn(&mut set, ["normal_force_n", "friction_x_n", "friction_y_n"].map(|column| map.name(column)))?;
    }
    Ok((set, parts))
}

/// What one file says beside its runs.
struct FileRead {
    rows: usize,
    notes: Vec<String>,
    cautions: Vec<Caution>,
}

/// Reads the runs of a file's bytes into the assembler; `go_on` is called now and then.
fn read_text(
    file: &SessionFile,
    map: &ColumnMap,
    source: impl Read,
    assembler: &mut RunAssembler,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<FileRead, ReadError> {
    let path = &file.path;
    let mut rows = CsvRows::open(path, source, |name| is_read(map, name))?;
    let columns = ColumnPlaces::of(path, map, &rows)?;
    let numbers = columns.numbers();
    let numbers: Vec<(&str, usize)> = numbers.iter().map(|(name, place)| (name.as_str(), *place)).collect();
    assembler.start_file(path);
    let mut rows_read = 0usize;
    let mut shift_s = 0.0;
    while let Some(line) = rows.next(map, &numbers)? {
        rows_read += 1;
        if rows_read.is_multiple_of(8192) && !go_on() {
            return Err(ReadError::Interrupted);
        }
        let (labels, mut row) = columns.row(line, &mut rows)?;
        if rows_read == 1 {
            shift_s = file.start_s.map_or(0.0, |start_s| start_s - row.t_s);
        }
        row.t_s += shift_s;
        assembler.push(labels, row)?;
    }
    assembler.finish_file()?;
    if rows_read == 0 {
        return Err(Error::TooFewRows { path: path.clone(), line: 1, found: 0, needed: 1 }.into());
    }
    let reading = rows.notes().into_iter().map(|n| caution("reading", format!("{}: {n}.", path.display())));
    let cautions = reading.chain(columns.cautions).collect();
    Ok(FileRead { rows: rows_read, notes: columns.notes, cautions })
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

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::data::run_assembler::FILE_ROWS;
    use crate::laws::run_columns::{OPTIONAL, REQUIRED, template};
    use crate::test_file;

    #[test]
    fn the_template_has_every_column_and_can_be_read() {
        let template = template();
        let set = read_as_file(&template);
        assert_eq!((set.rows_read, set.runs_read, set.notes.len(), set.recorded.len()), (2, 1, 0, 5));
        for column in REQUIRED.iter().chain(&OPTIONAL) {
            assert!(template.lines().next().unwrap().split(',').any(|c| c == *column), "{column}");
        }
    }

    const HEADER: &str = "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n\n";

    fn read_as_file(text: &str) -> RunSet {
        read(&test_file(".csv", text.as_bytes()), &mut |_| true).unwrap()
    }

    /// 6400 runs of 20 rows, four times what is held, of a protocol that repeats 16 depths: a stride of 4 would use four.
    #[test]
    fn runs_of_a_periodic_protocol_are_thinned_in_their_proportions() {
        let mut text = HEADER.to_owned();
        for run in 0..6_400 {
            let depth = 0.4 + 0.1 * f64::from(run % 16);
            for row in 0..20 {
                let force = depth + 1e-6 * f64::from(7 * run + row);
                text += &format!("r{run},{row},{depth},{},0,{force},0.1,0\n", 0.1 * f64::from(row));
            }
        }
        let set = read_as_file(&text);
        assert!(set.rows() <= FILE_ROWS && set.runs_read == 6_400 && set.contents().count() == 6_400);
        let mut kept = [0; 16];
        set.runs.iter().for_each(|run| kept[((run.depth_mm() - 0.4) / 0.1).round() as usize] += 1);
        assert!(kept.iter().all(|k| (92..=108).contains(k)), "{kept:?}");
        let text = format!("{} of 6400 runs are used, a random sample", set.runs.len());
        assert!(set.cautions.iter().any(|c| c.kind == "thinned" && c.text.contains(&text)), "{:?}", set.cautions);
    }

    /// A plate that goes back and forth 20 times in 30 000 rows: all turns stay, and the way between them.
    #[test]
    fn a_long_run_keeps_its_turns_and_touches() {
        let mut text = HEADER.to_owned();
        for i in 0..30_000 {
            let share = f64::from(i) / 29_999.0;
            let depth = (20.0 * share - 0.5).min(19.5 - 20.0 * share).min(1.0);
            let phase = 20.0 * ((share - 0.1) / 0.8).clamp(0.0, 1.0);
            let slide = 1.0 - (phase.rem_euclid(2.0) - 1.0).abs();
            text += &format!("a,{},{depth},{},0,{},{slide},0\n", 60.0 * share, 3.0 * slide, depth.max(0.0));
        }
        let set = read_as_file(&text);
        let run = &set.runs[0];
        assert!(run.rows.len() <= KEPT_ROWS && run.rows.len() > 150, "{}", run.rows.len());
        let way: f64 = run.slide_mm.windows(2).map(|w| (w[1][0] - w[0][0]).abs()).sum();
        assert!((way / 60.0 - 1.0).abs() < 1e-3, "{way}");
        let touch = run.rows.iter().position(|r| r.depth_mm > 0.0).unwrap();
        assert!(run.rows[touch].depth_mm < 1e-3 && run.rows[touch - 1].depth_mm > -1e-3);
        let text = format!("1 of 1 runs are longer than {KEPT_ROWS} rows");
        assert!(set.cautions.iter().any(|c| c.text.contains(&text)), "{:?}", set.cautions);
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
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        let packed = test_file(".csv.gz", &encoder.finish().unwrap());
        let (a, b) = (read_as_file(&text), read(&packed, &mut |_| true).unwrap());
        assert_eq!(a.rows_read, 15);
        assert_eq!((a.rows_read, a.runs_read), (b.rows_read, b.runs_read));
        for (a, b) in a.runs.iter().zip(&b.runs) {
            assert_eq!((&a.force_n, &a.slide_mm), (&b.force_n, &b.slide_mm));
        }
        assert_ne!(a.sha256, b.sha256);
    }
}
