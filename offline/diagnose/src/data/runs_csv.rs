//! Measured runs from CSV, streamed: one run in memory at a time, long runs and long files thinned.
//!
//! Takes files compressed by gzip, a byte-order mark, CRLF, semicolons, tabs and decimal commas, a row of units, any column
//! order and unknown columns (noted). Rows of a run are contiguous and in time order.

use std::cell::Cell;
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use sha2::{Digest, Sha256};

use fingerpad_formats::{Error, significant};

use crate::data::clock::{equal_stamps, note};
use crate::data::column_map::ColumnMap;
use crate::data::content::{Content, ContentOf};
use crate::data::csv_text::{CsvRows, like, missing_column, short};
use crate::data::runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
use crate::data::thinning::{RunSample, Sample, rows_to_keep};
use crate::error::DiagnoseError;
use crate::laws::run_columns::{OPTIONAL, REQUIRED};
use crate::laws::{Column, OWN};
use crate::schema::Caution;

/// Most rows of a run that are held; a longer one is thinned while it is read.
const HELD_ROWS: usize = 4096;
/// Most rows of a run that are kept.
pub const KEPT_ROWS: usize = 240;
/// Most rows of a file that are kept; beyond it runs are left out at random, in the proportions of their kinds.
const FILE_ROWS: usize = 40_000;
/// Fewest runs of a file that are kept, whatever their rows.
const FEWEST_RUNS: usize = 64;

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
        let before = assembler.index;
        let mut go_on = || progress((number as f64 + bytes.get() as f64 / length as f64) / files.len() as f64);
        let read = read_text(file, map, &mut source, &mut assembler, &mut go_on)?;
        std::io::copy(&mut source, &mut std::io::sink()).map_err(failed)?;
        parts.push(FilePart {
            path: path.clone(),
            rows_read: read.rows,
            runs_read: assembler.index - before,
            sha256: source.hash.finalize().iter().map(|b| format!("{b:02x}")).collect(),
        });
        notes.extend(read.notes.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
        cautions.extend(read.cautions);
    }
    let names: Vec<String> = files.iter().map(|file| file.path.display().to_string()).collect();
    let path = PathBuf::from(names.join(" + "));
    cautions.extend(assembler.report(&path).into_iter().map(|text| caution("thinned", text)));
    notes.extend(map.told());
    notes.extend(note(assembler.equal_stamps));
    let mut set = RunSet {
        path,
        runs: assembler.runs.into_iter().map(|r| r.1).collect(),
        left_out: assembler.left_out,
        recorded: assembler.recorded.unwrap_or_default(),
        notes,
        cautions,
        rows_read: parts.iter().map(|part| part.rows_read).sum(),
        runs_read: assembler.index,
        sha256: parts[0].sha256.clone(),
    };
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

fn caution(kind: &str, text: String) -> Caution {
    Caution { kind: kind.to_owned(), role: String::new(), column: String::new(), text }
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
    let mut rows = CsvRows::open(path, source)?;
    let mut columns = ColumnPlaces::of(path, map, &rows)?;
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
    let mut cautions: Vec<Caution> =
        rows.notes().into_iter().map(|n| caution("reading", format!("{}: {n}.", path.display()))).collect();
    cautions.append(&mut columns.cautions);
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

/// Where each known column stands.
struct ColumnPlaces {
    required: [usize; REQUIRED.len()],
    optional: [Option<usize>; OPTIONAL.len()],
    /// Columns of the user's own.
    own: Vec<Option<usize>>,
    notes: Vec<String>,
    cautions: Vec<Caution>,
    map: ColumnMap,
}

impl ColumnPlaces {
    fn of(path: &Path, map: &ColumnMap, rows: &CsvRows<'_>) -> Result<Self, Error> {
        let own = || map.own().iter().map(|c| c.name.as_str());
        let ours =
            |name: &str| REQUIRED.into_iter().chain(OPTIONAL).chain(own()).any(|column| map.name(column) == name);
        rows.refuse_duplicates(ours)?;
        let names = rows.header();
        let find = |name: &str| names.iter().position(|n| n == map.name(name));
        let mut required = [0; REQUIRED.len()];
        for (slot, name) in required.iter_mut().zip(REQUIRED) {
            *slot = find(name).ok_or_else(|| missing_column(path, map, name, names, ours))?;
        }
        let mut cautions = Vec::new();
        for name in OPTIONAL.iter().filter(|name| find(name).is_none()) {
            let Some((other, by_case)) = like(name, names, ours) else { continue };
            let key = short(name);
            let (difference, unit) = match by_case {
                true => ("differs in upper and lower case", String::new()),
                false => ("has another unit", format!(" --unit {key}=UNIT")),
            };
            cautions.push(Caution {
                kind: "ignored_column".into(),
                role: String::new(),
                column: (*name).to_owned(),
                text: format!(
                    "{}: column `{other}` is not read: it looks like `{name}` and {difference} (--map {key}={other}{unit} reads it).",
                    path.display()
                ),
            });
        }
        let is_told = |name: &str| cautions.iter().any(|c: &Caution| c.text.contains(&format!("`{name}` is not read")));
        let unknown = names.iter().filter(|name| !ours(name) && !is_told(name));
        let mut notes: Vec<String> = unknown.map(|name| format!("column `{name}` is unknown and ignored")).collect();
        notes.sort();
        let own = own().map(find).collect();
        Ok(Self { required, optional: OPTIONAL.map(find), own, notes, cautions, map: map.clone() })
    }

    /// Columns of numbers and their places.
    fn numbers(&self) -> Vec<(String, usize)> {
        let required = REQUIRED.into_iter().zip(self.required).skip(1);
        let optional = OPTIONAL.into_iter().zip(self.optional).take(LABELS).filter_map(|(name, at)| Some((name, at?)));
        let own = self.map.own().iter().zip(&self.own).filter_map(|(column, at)| Some((column.name.as_str(), (*at)?)));
        required.chain(optional).chain(own).map(|(name, at)| (name.to_owned(), at)).collect()
    }

    /// Labels and numbers of the present row.
    fn row(&self, line: usize, cells: &mut CsvRows<'_>) -> Result<(Labels, RawRow), Error> {
        let text = |k: usize| self.optional[k].map_or_else(String::new, |i| cells.text(i).to_owned());
        let run = cells.text(self.required[0]).to_owned();
        if run.is_empty() {
            return Err(cells.refuse("run_id", self.required[0], "is blank"));
        }
        let labels = Labels { run, condition: text(LABELS), block: text(LABELS + 1), subject: text(LABELS + 2) };
        let mut own = [f64::NAN; OWN];
        for ((to, column), place) in own.iter_mut().zip(self.map.own()).zip(&self.own) {
            let Some(place) = *place else { continue };
            if cells.text(place).is_empty() {
                return Err(cells.refuse(&column.name, place, "is blank; a law reads this column in every row"));
            }
            let value = cells.number(&self.map, &column.name, place)?;
            let [low, high] = column.range;
            if !(value >= low && value <= high) {
                let problem =
                    format!("is outside {low} to {high} {}, the range in the file of laws: another unit?", column.unit);
                return Err(cells.refuse(&column.name, place, problem));
            }
            *to = value;
        }
        let mut need = |k: usize| -> Result<f64, Error> {
            let (column, place) = (REQUIRED[k], self.required[k]);
            if cells.text(place).is_empty() {
                return Err(cells.refuse(column, place, "is blank; this column needs a value in every row"));
            }
            cells.number(&self.map, column, place)
        };
        let [t_s, depth_mm] = [need(1)?, need(2)?];
        let slide_mm = [need(3)?, need(4)?];
        let force_n = [need(5)?, need(6)?, need(7)?];
        let mut may = |k: usize| -> Result<f64, Error> {
            match self.optional[k] {
                Some(place) if !cells.text(place).is_empty() => cells.number(&self.map, OPTIONAL[k], place),
                _ => Ok(f64::NAN),
            }
        };
        let row = RawRow {
            line,
            t_s,
            depth_mm,
            slide_mm,
            force_n,
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

/// Place among the optional columns of the first one that holds text.
const LABELS: usize = 8;

/// Turns rows into runs.
struct RunAssembler {
    /// The present file, and the time span of those before it.
    path: PathBuf,
    span_s: Option<[f64; 2]>,
    earlier_s: Vec<(PathBuf, [f64; 2])>,
    /// Names of the runs in the files before the present one.
    earlier_runs: HashSet<String>,
    labels: Labels,
    rows: Vec<RawRow>,
    content: ContentOf,
    /// Rows of the present run, and turns of it that were left out.
    count: usize,
    lost_turns: usize,
    seen: HashSet<String>,
    contents: HashSet<u64>,
    /// Runs that are kept, each with its number of the sample.
    runs: Vec<(f64, Run)>,
    left_out: Vec<(String, usize, Content)>,
    index: usize,
    sample: RunSample,
    share: f64,
    kept_rows: usize,
    thinned: usize,
    runs_without_turns: usize,
    copies: usize,
    equal_stamps: usize,
    recorded: Option<Vec<Column>>,
}

impl RunAssembler {
    fn new() -> Self {
        Self {
            path: PathBuf::new(),
            span_s: None,
            earlier_s: Vec::new(),
            earlier_runs: HashSet::new(),
            labels: Labels::default(),
            rows: Vec::new(),
            content: ContentOf::default(),
            count: 0,
            lost_turns: 0,
            seen: HashSet::new(),
            contents: HashSet::new(),
            runs: Vec::new(),
            left_out: Vec::new(),
            index: 0,
            sample: RunSample::default(),
            share: 1.0,
            kept_rows: 0,
            thinned: 0,
            runs_without_turns: 0,
            copies: 0,
            equal_stamps: 0,
            recorded: None,
        }
    }

    fn start_file(&mut self, path: &Path) {
        self.path = path.to_path_buf();
        self.span_s = None;
        self.earlier_runs.extend(self.seen.drain());
    }

    /// Ends the present file.
    ///
    /// # Errors
    /// [`ReadError::Run`] where its clock overlaps that of an earlier file: laws of the clock would compare wrong times.
    fn finish_file(&mut self) -> Result<(), ReadError> {
        self.finish()?;
        let Some(span_s) = self.span_s else { return Ok(()) };
        let overlapping = self.earlier_s.iter().find(|(_, other)| span_s[0] <= other[1] && other[0] <= span_s[1]);
        if let Some((other, other_s)) = overlapping {
            let [from, to, other_from, other_to] =
                [span_s[0], span_s[1], other_s[0], other_s[1]].map(|t| significant(t, CLOCK_DIGITS));
            return Err(DiagnoseError::Unusable {
                path: self.path.clone(),
                problem: format!(
                    "column t_s: {from} to {to} s overlaps {other_from} to {other_to} s of {}, and both are to be on one clock; where \
                     the clock was started again, give the time of the file's first row on the clock of the session with \
                     --append-start-s",
                    other.display()
                ),
            }
            .into());
        }
        self.earlier_s.push((self.path.clone(), span_s));
        Ok(())
    }

    fn push(&mut self, labels: Labels, row: RawRow) -> Result<(), ReadError> {
        let [from, to] = self.span_s.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
        self.span_s = Some([from.min(row.t_s), to.max(row.t_s)]);
        if self.rows.is_empty() || labels.run != self.labels.run {
            self.finish()?;
            if self.earlier_runs.contains(&labels.run) {
                return Err(Error::Value {
                    path: self.path.clone(),
                    line: row.line,
                    column: "run_id".into(),
                    value: labels.run,
                    problem: "is the name of a run in an earlier file too; give the appended run another name".into(),
                }
                .into());
            }
            if !self.seen.insert(labels.run.clone()) {
                return Err(Error::Value {
                    path: self.path.clone(),
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
                value: significant(row.t_s, CLOCK_DIGITS),
                problem: format!(
                    "is before {}: time must not fall within run `{}`",
                    significant(last.t_s, CLOCK_DIGITS),
                    self.labels.run
                ),
            }
            .into());
        }
        self.content.push(&row);
        self.rows.push(row);
        self.count += 1;
        if self.rows.len() > HELD_ROWS {
            let samples: Vec<Sample> = self.rows.iter().map(sample_of).collect();
            let (keep, lost) = rows_to_keep(&samples, HELD_ROWS / 2, self.count as u64);
            self.lost_turns += lost;
            // The latest row stays the last one, so that the clock is still checked against it.
            self.rows = keep.iter().map(|i| self.rows[*i]).collect();
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ReadError> {
        let rows = std::mem::take(&mut self.rows);
        let content = std::mem::take(&mut self.content).finish();
        let (count, mut lost) = (std::mem::take(&mut self.count), std::mem::take(&mut self.lost_turns));
        if rows.is_empty() {
            return Ok(());
        }
        self.equal_stamps += equal_stamps(&rows);
        let here = recorded(rows.iter());
        self.recorded = Some(match self.recorded.take() {
            None => here,
            Some(all) => all.into_iter().filter(|c| here.contains(c)).collect(),
        });
        self.index += 1;
        let mut run = run_of(&self.path, std::mem::take(&mut self.labels), &rows)?;
        run.content = content;
        if !self.contents.insert(run.content.whole) {
            self.copies += 1;
            return Ok(());
        }
        if run.rows.len() > KEPT_ROWS {
            lost += run.thin(KEPT_ROWS);
        }
        self.thinned += usize::from(count > run.rows.len());
        self.runs_without_turns += usize::from(lost > 0);
        let number = self.sample.number(&run);
        if number < self.share {
            self.kept_rows += run.rows.len();
            self.runs.push((number, run));
        } else {
            self.left_out.push((run.labels.run, run.line, run.content));
        }
        while self.kept_rows > FILE_ROWS && self.runs.len() > FEWEST_RUNS {
            self.share *= 0.5;
            let (kept, out): (Vec<_>, Vec<_>) =
                std::mem::take(&mut self.runs).into_iter().partition(|(number, _)| *number < self.share);
            self.runs = kept;
            self.left_out.extend(out.into_iter().map(|(_, run)| (run.labels.run, run.line, run.content)));
            self.kept_rows = self.runs.iter().map(|(_, run)| run.rows.len()).sum();
        }
        Ok(())
    }

    /// What was left out, one sentence each.
    fn report(&self, path: &Path) -> Vec<String> {
        let file = path.display();
        let mut out = Vec::new();
        if self.copies > 0 {
            out.push(format!(
                "{file}: {} of {} runs repeat another run of the file row by row; each of these is used once.",
                self.copies, self.index
            ));
        }
        if self.share < 1.0 {
            out.push(format!(
                "{file}: {} of {} runs are used, a random sample in the proportions of their conditions: at most {FILE_ROWS} \
                 rows of a file are held.",
                self.runs.len(),
                self.index - self.copies
            ));
        }
        if self.thinned > 0 {
            out.push(format!(
                "{file}: {} of {} runs are longer than {KEPT_ROWS} rows; {KEPT_ROWS} of each are used: touches, turns, and \
                 rows at random in equal parts of time, motion and change of force.",
                self.thinned, self.index
            ));
        }
        if self.runs_without_turns > 0 {
            out.push(format!(
                "{file}: {} runs have more turns than half of {KEPT_ROWS}, and not all of them are kept: split these runs.",
                self.runs_without_turns
            ));
        }
        out
    }
}

/// Digits of a clock in a message.
const CLOCK_DIGITS: usize = 12;

fn sample_of(row: &RawRow) -> Sample {
    Sample { t_s: row.t_s, depth_mm: row.depth_mm, slide_mm: row.slide_mm, force_n: row.force_n }
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

    const HEADER: &str = "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n\n";

    fn read_as_file(name: &str, text: &str) -> RunSet {
        let path = std::env::temp_dir().join(format!("{name}-{}.csv", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let set = read(&path, &mut |_| true);
        std::fs::remove_file(&path).unwrap();
        set.unwrap()
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
        let set = read_as_file("periodic", &text);
        assert!(set.rows() <= FILE_ROWS && set.runs_read == 6_400 && set.contents().count() == 6_400);
        let mut kept = [0; 16];
        set.runs.iter().for_each(|run| kept[((run.depth_mm() - 0.4) / 0.1).round() as usize] += 1);
        assert!(kept.iter().all(|k| (92..=108).contains(k)), "{kept:?}");
        let told = format!("{} of 6400 runs are used, a random sample", set.runs.len());
        assert!(set.cautions.iter().any(|c| c.kind == "thinned" && c.text.contains(&told)), "{:?}", set.cautions);
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
        let set = read_as_file("long", &text);
        let run = &set.runs[0];
        assert!(run.rows.len() <= KEPT_ROWS && run.rows.len() > 150, "{}", run.rows.len());
        let way: f64 = run.slide_mm.windows(2).map(|w| (w[1][0] - w[0][0]).abs()).sum();
        assert!((way / 60.0 - 1.0).abs() < 1e-3, "{way}");
        let touch = run.rows.iter().position(|r| r.depth_mm > 0.0).unwrap();
        assert!(run.rows[touch].depth_mm < 1e-3 && run.rows[touch - 1].depth_mm > -1e-3);
        let told = format!("1 of 1 runs are longer than {KEPT_ROWS} rows");
        assert!(set.cautions.iter().any(|c| c.text.contains(&told)), "{:?}", set.cautions);
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
