//! Rows of measured runs, in the order of their files, become runs: one run in memory at a time, long runs and long files
//! thinned. Files of one session join one another.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use fingerpad_formats::{Error, significant};

use crate::data::clock::{equal_stamps, note};
use crate::data::content::{Content, ContentOf, near_copies};
use crate::data::runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
use crate::data::runs_csv::ReadError;
use crate::data::thinning::{RunSample, Sample, rows_to_keep};
use crate::error::DiagnoseError;
use crate::laws::Column;
use crate::schema::Caution;

/// Most rows of a run that are held; a longer one is thinned while it is read.
const HELD_ROWS: usize = 4096;
/// Most rows of a run that are kept.
pub const KEPT_ROWS: usize = 240;
/// Most rows of a file that are kept; beyond it runs are left out at random, in the proportions of their kinds.
pub const FILE_ROWS: usize = 40_000;
/// Fewest runs of a file that are kept, whatever their rows.
const FEWEST_RUNS: usize = 64;

/// Turns rows into runs.
pub struct RunAssembler {
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
    /// Runs that are kept before near copies go, and those.
    kept: usize,
    near_copies: Vec<String>,
    equal_stamps: usize,
    recorded: Option<Vec<Column>>,
}

impl RunAssembler {
    /// Without a row.
    pub fn new() -> Self {
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
            kept: 0,
            near_copies: Vec::new(),
            equal_stamps: 0,
            recorded: None,
        }
    }

    /// Number of runs so far.
    pub fn runs_read(&self) -> usize {
        self.index
    }

    /// Starts a file, whose runs have other names than those of the files before it.
    pub fn start_file(&mut self, path: &Path) {
        self.path = path.to_path_buf();
        self.span_s = None;
        self.earlier_runs.extend(self.seen.drain());
    }

    /// Ends the present file.
    ///
    /// # Errors
    /// [`ReadError::Run`] where its clock overlaps that of an earlier file: laws of the clock would compare wrong times.
    pub fn finish_file(&mut self) -> Result<(), ReadError> {
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

    /// Takes the next row of the present file.
    ///
    /// # Errors
    /// [`ReadError::Csv`] with the line of a row that is earlier than the row before it, or whose run has the name of an
    /// earlier one; [`ReadError::Run`] where the rows of the run before it make no run.
    pub fn push(&mut self, labels: Labels, row: RawRow) -> Result<(), ReadError> {
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

    /// The runs of all files, and what was done to them. The number of rows and the hash are those of the files.
    pub fn into_set(mut self, path: PathBuf) -> RunSet {
        let mut runs: Vec<Run> = std::mem::take(&mut self.runs).into_iter().map(|(_, run)| run).collect();
        self.kept = runs.len();
        for (place, _) in near_copies(&runs).into_iter().enumerate().filter(|(_, copy)| *copy).rev().collect::<Vec<_>>()
        {
            let copy = runs.remove(place);
            self.near_copies.insert(0, copy.labels.run.clone());
            self.left_out.push((copy.labels.run, copy.line, copy.content));
        }
        let thinned = self.report(&path).into_iter();
        RunSet {
            cautions: thinned.map(|text| caution("thinned", text)).collect(),
            factors: Vec::new(),
            notes: note(self.equal_stamps).into_iter().collect(),
            runs,
            left_out: self.left_out,
            recorded: self.recorded.unwrap_or_default(),
            rows_read: 0,
            runs_read: self.index,
            sha256: String::new(),
            path,
        }
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
        if !self.near_copies.is_empty() {
            out.push(format!(
                "{file}: {} of {} runs have the motion of another run and its forces within less than the sensor's noise ({}): copies, each of \
                 which is left out.",
                self.near_copies.len(),
                self.index,
                first_names(&self.near_copies)
            ));
        }
        if self.share < 1.0 {
            out.push(format!(
                "{file}: {} of {} runs are used, a random sample in the proportions of their conditions: at most {FILE_ROWS} \
                 rows of a file are held.",
                self.kept,
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

/// The first of some names.
fn first_names(names: &[String]) -> String {
    const NAMED: usize = 4;
    let more = names.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    names[..names.len().min(NAMED)].join(", ") + &more
}

/// A remark of the reader on a file.
pub fn caution(kind: &str, text: String) -> Caution {
    Caution { kind: kind.to_owned(), role: String::new(), column: String::new(), text }
}

/// Digits of a clock in a message.
const CLOCK_DIGITS: usize = 12;

fn sample_of(row: &RawRow) -> Sample {
    Sample { t_s: row.t_s, depth_mm: row.depth_mm, slide_mm: row.slide_mm, force_n: row.force_n }
}
