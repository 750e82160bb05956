//! What a file holds, as far as it is understood without a diagnosis: columns, units, rates, strokes, loads, and what it can be used for.
//!
//! Main type: [`Survey`]; main function: [`survey`].

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use fingerpad_formats::unit::find;
use fingerpad_formats::{Error, significant};
use serde::Serialize;

use crate::data::column_map::ColumnMap;
use crate::data::csv_text::{CsvRows, short};
use crate::data::median::median;
use crate::data::runs::RunSet;
use crate::data::runs_csv;
use crate::laws::run_columns::{self, REQUIRED, RunColumn, run_columns};
use crate::laws::{Column, LAWS};
use crate::selection::scan::why_untestable;

/// A column of a file.
#[derive(Clone, Debug, Serialize)]
pub struct SurveyedColumn {
    /// Its name in the file.
    pub name: String,
    /// The program's name for it; none for a column that is not read.
    pub is: Option<String>,
    /// Whether it was recognised by a usual name and needs the proposed `--map`.
    pub guessed: bool,
    /// The unit in which it was read, and its least and largest value in the program's unit; none for text.
    pub range: Option<([f64; 2], String)>,
    /// Number of different texts of a column of text.
    pub texts: usize,
}

/// Something that a file can be used for.
#[derive(Clone, Debug, Serialize)]
pub struct Analysis {
    /// The command.
    pub command: String,
    /// Columns that it lacks; empty where it is possible.
    pub lacks: Vec<String>,
}

/// A range of values of the strokes.
#[derive(Clone, Debug, Serialize)]
pub struct StrokeRange {
    /// What it is of.
    pub of: String,
    /// Unit.
    pub unit: String,
    /// Least, middle and largest value.
    pub range: [f64; 3],
}

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
pub struct Survey {
    /// The file.
    pub file: String,
    /// Its rows.
    pub rows: usize,
    /// Its columns.
    pub columns: Vec<SurveyedColumn>,
    /// How it was read, where that is not as this program writes files.
    pub notes: Vec<String>,
    /// The `--map` and `--unit` with which it was read; empty where none is needed.
    pub map: String,
    /// See `map`.
    pub unit: String,
    /// Middle time between rows, s; none without a clock.
    pub row_every_s: Option<f64>,
    /// Runs or strokes.
    pub strokes: usize,
    /// Their loads, speeds, depths and so on.
    pub ranges: Vec<StrokeRange>,
    /// What the file can be used for.
    pub analyses: Vec<Analysis>,
    /// Laws that these runs cannot test, and why; only where they are runs.
    pub untestable: Vec<(String, String)>,
}

/// A column's name in lower case without its unit, and that unit.
fn split_unit(name: &str) -> (String, Option<&str>) {
    let cut = name.find(['[', '(']);
    let unit = cut.map(|at| name[at..].trim_matches(['[', ']', '(', ')', ' ']));
    let bare = cut.map_or(name, |at| &name[..at]).trim().to_lowercase().replace([' ', '-'], "_");
    (bare, unit)
}

/// Which column of the file is which of ours: by its exact name or that of `--map`, or else by a usual name.
fn recognised<'h>(header: &'h [String], map: &ColumnMap) -> Vec<(&'static str, usize, bool, Option<&'h str>)> {
    let mut out = Vec::new();
    for known in run_columns() {
        if let Some(place) = header.iter().position(|name| name == map.name(known.name)) {
            out.push((known.name, place, false, None));
        }
    }
    for RunColumn { name: column, usual, .. } in run_columns() {
        let taken = |place: usize| out.iter().any(|(_, other, ..)| *other == place);
        let found = usual.iter().find_map(|usual| header.iter().position(|name| split_unit(name).0 == *usual));
        if let Some(place) = found.filter(|place| !taken(*place))
            && !out.iter().any(|(other, ..)| *other == *column)
        {
            out.push((column, place, true, split_unit(&header[place]).1));
        }
    }
    out
}

/// Reads a file as far as it can be understood.
///
/// * `map`, `unit`: texts of `--map` and `--unit`
///
/// # Errors
/// [`Error`] with file, line and column for cells that are no numbers and for files that are no text.
pub fn survey(path: &Path, map: Option<&str>, unit: Option<&str>) -> Result<Survey, SurveyError> {
    let given = ColumnMap::parse(map, unit).map_err(SurveyError::Options)?;
    let failed = |source| Error::File { path: path.to_path_buf(), source };
    let open = || File::open(path).map(BufReader::new).map_err(failed);
    let ours = |name: &str| {
        let bare = split_unit(name).0;
        run_columns().iter().any(|known| given.name(known.name) == name || known.usual.contains(&bare.as_str()))
    };
    let mut cells = CsvRows::open(path, open()?, ours)?;
    let header = cells.header().to_vec();
    let known = recognised(&header, &given);
    let (mut maps, mut units): (Vec<String>, Vec<String>) = (texts(map), texts(unit));
    for (column, place, guessed, found) in &known {
        if *guessed {
            maps.push(format!("{}={}", short(column), header[*place]));
        }
        let ours = given.unit(column);
        if let Some(other) = found.and_then(|name| find(column, name).ok()).filter(|u| *guessed && u.name != ours) {
            units.push(format!("{}={}", short(column), other.name));
        }
    }
    let (maps, units) = (maps.join(","), units.join(","));
    let used = ColumnMap::parse(Some(&maps), Some(&units)).map_err(SurveyError::Options)?;
    let is_text = |column: &str| run_columns().iter().any(|known| known.is_text && known.name == column);
    let numbers: Vec<(&str, usize)> =
        known.iter().filter(|k| !is_text(k.0)).map(|(column, place, ..)| (*column, *place)).collect();
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); numbers.len()];
    let mut names: Vec<std::collections::BTreeSet<String>> = vec![Default::default(); header.len()];
    let mut rows = 0;
    while cells.next(&used, &numbers)?.is_some() {
        rows += 1;
        for ((column, place), values) in numbers.iter().zip(&mut values) {
            let blank = cells.text(*place).is_empty();
            values.push(if blank { f64::NAN } else { cells.number(&used, column, *place)? });
        }
        for place in known.iter().filter(|k| is_text(k.0)).map(|k| k.1) {
            names[place].insert(cells.text(place).to_owned());
        }
    }
    let of = |column: &str| numbers.iter().position(|(c, _)| *c == column).map(|k| &values[k]);
    let columns = header.iter().enumerate().map(|(place, name)| {
        let is = known.iter().find(|k| k.1 == place);
        SurveyedColumn {
            name: name.clone(),
            is: is.map(|k| k.0.to_owned()),
            guessed: is.is_some_and(|k| k.2),
            range: is.and_then(|k| Some((ends(of(k.0)?)?, used.unit(k.0).to_owned()))),
            texts: names[place].len(),
        }
    });
    let has = |column: &&str| known.iter().any(|k| *k.0 == **column);
    let lacks = |needed: &[&str]| needed.iter().filter(|c| !has(c)).map(|c| (*c).to_owned()).collect::<Vec<_>>();
    let analysis = |command: &str, needed: &[&str]| Analysis { command: command.into(), lacks: lacks(needed) };
    let analyses = vec![
        analysis("fingerpad diagnose runs --calibration ... --measured ...", &REQUIRED),
        analysis("fingerpad diagnose trace ...", &["t_s", "normal_force_n", "friction_x_n", "friction_y_n"]),
    ];
    let mut out = Survey {
        file: path.display().to_string(),
        rows,
        columns: columns.collect(),
        notes: cells.notes(),
        map: maps,
        unit: units,
        row_every_s: of("t_s").and_then(|t| middle_step(t)),
        strokes: 0,
        ranges: Vec::new(),
        analyses,
        untestable: Vec::new(),
    };
    if out.analyses[0].lacks.is_empty() {
        let set = runs_csv::read_mapped(path, &used, &mut |_| true).map_err(SurveyError::Runs)?;
        out.strokes = set.runs_read;
        out.ranges = of_runs(&set);
        out.untestable =
            LAWS.iter().filter_map(|law| Some((law.name.to_owned(), why_untestable(law, &set)?))).collect();
    } else {
        of_rows(&mut out, |name| of(name).map(Vec::as_slice));
    }
    Ok(out)
}

/// Why a file could not be looked at.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// The file is not what it should be.
    #[error(transparent)]
    Csv(#[from] Error),
    /// Its rows make no runs.
    #[error(transparent)]
    Runs(runs_csv::ReadError),
    /// `--map` or `--unit` cannot be used.
    #[error("{0}")]
    Options(String),
}

fn texts(pairs: Option<&str>) -> Vec<String> {
    pairs.into_iter().filter(|text| !text.trim().is_empty()).map(str::to_owned).collect()
}

/// Least and largest finite value.
fn ends(values: &[f64]) -> Option<[f64; 2]> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    finite().next().map(|_| [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)])
}

/// Middle step of a clock, s.
fn middle_step(t_s: &[f64]) -> Option<f64> {
    median(t_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0))
}

/// Least, middle and largest of some values; `None` without any.
fn range(of: &str, unit: &str, values: impl Iterator<Item = f64>) -> Option<StrokeRange> {
    let values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let [low, high] = ends(&values)?;
    Some(StrokeRange { of: of.into(), unit: unit.into(), range: [low, median(values)?, high] })
}

/// What the runs of a set are like.
fn of_runs(set: &RunSet) -> Vec<StrokeRange> {
    let of = |column: Column| set.runs.iter().map(move |run| run.value(column));
    let load = set.runs.iter().map(|run| run.force_n.iter().map(|f| f[0]).fold(f64::NAN, f64::max));
    let ratio = set.runs.iter().filter_map(|run| {
        let last = run.rows.iter().rposition(|row| row.turn_mm > 1.0)?;
        let [n, x, y] = run.force_n[last];
        (n > 0.01).then(|| x.hypot(y) / n)
    });
    let air = set.runs.iter().map(|run| run.rows.iter().filter(|row| !(row.depth_mm > 0.0)).count() as f64);
    let columns =
        run_columns::law_columns().filter(|(column, _)| !matches!(column, Column::Time | Column::ContactTime));
    let columns = columns.map(|(column, known)| {
        range(known.words, known.unit, of(column).filter(|v| column != Column::Speed || *v > 0.0))
    });
    let forces = [
        range("largest load", "N", load),
        range("friction over load at the end", "", ratio),
        range("rows in the air", "", air),
    ];
    columns.chain(forces).flatten().collect()
}

/// Share of the range of the position that a stroke covers at least.
const STROKE: f64 = 0.2;

/// Strokes, loads and friction of a file that is no set of runs: by its position, where it has one.
fn of_rows<'v>(out: &mut Survey, column: impl Fn(&str) -> Option<&'v [f64]>) {
    let load = column("normal_force_n");
    if let (Some(t_s), Some(x)) = (column("t_s"), column("slide_x_mm")) {
        let strokes = passes(t_s, x);
        out.strokes = strokes.len();
        out.ranges.extend(range("length of a stroke", "mm", strokes.iter().map(|s| s.1)));
        out.ranges.extend(range("speed of a stroke", "mm/s", strokes.iter().map(|s| s.1 / s.2)));
        if let Some(load) = load {
            let mean = |rows: &std::ops::Range<usize>| load[rows.clone()].iter().sum::<f64>() / rows.len() as f64;
            out.ranges.extend(range("load of a stroke", "N", strokes.iter().map(|s| mean(&s.0))));
        }
    } else if let Some(load) = load {
        out.ranges.extend(range("load", "N", load.iter().copied()));
    }
    if let (Some(load), Some(x)) = (load, column("friction_x_n")) {
        let y = column("friction_y_n");
        let middle = median(load.iter().copied()).unwrap_or(0.0);
        let pressed = (0..load.len()).filter(|i| load[*i] > 0.5 * middle && load[*i] > 0.01);
        let ratio = pressed.map(|i| x[i].hypot(y.map_or(0.0, |y| y[i])) / load[i]);
        out.ranges.extend(range("friction over load under half the usual load and more", "", ratio));
    }
}

/// Rows, length in mm and duration in s of the parts in which a position goes one way.
fn passes(t_s: &[f64], x: &[f64]) -> Vec<(std::ops::Range<usize>, f64, f64)> {
    let Some([low, high]) = ends(x) else { return Vec::new() };
    let least = STROKE * (high - low);
    let mut out = Vec::new();
    // A turn counts once the position has come back by a part of a stroke.
    let (mut start, mut extreme, mut way) = (0, 0, 0.0f64);
    let mut close = |start: usize, end: usize| {
        let length = (x[end] - x[start]).abs();
        // Rows at rest at either end are no part of a stroke.
        let moved = |i: usize, to: usize| (x[i] - x[to]).abs() > 0.02 * length;
        let first = (start..end).find(|i| moved(*i, start)).unwrap_or(start);
        let last = (start..=end).rev().find(|i| moved(*i, end)).unwrap_or(end);
        if length > least && length > 0.0 && last > first {
            out.push((first..last + 1, (x[last] - x[first]).abs(), t_s[last] - t_s[first]));
        }
    };
    for i in 1..x.len() {
        let ahead = x[i] - x[extreme];
        if way == 0.0 || ahead * way > 0.0 {
            (extreme, way) =
                (i, if way == 0.0 { (x[i] - x[start]).signum() * f64::from(u8::from(x[i] != x[start])) } else { way });
        } else if ahead.abs() > 0.5 * least && least > 0.0 {
            close(start, extreme);
            (start, extreme, way) = (extreme, i, ahead.signum());
        }
    }
    close(start, extreme);
    out.retain(|pass| pass.2 > 0.0);
    out
}

impl Survey {
    /// The lines that the command prints.
    pub fn lines(&self) -> Vec<String> {
        let mut out = vec![format!("{}: {} rows", self.file, self.rows)];
        out.extend(self.notes.iter().map(|note| format!("  {note}")));
        for column in &self.columns {
            let what = match (&column.is, &column.range) {
                (Some(is), Some(([low, high], unit))) => {
                    format!("{is}, {} to {} {}", significant(*low, 4), significant(*high, 4), in_ours(is, unit))
                }
                (Some(is), None) => format!("{is}, {} different", column.texts),
                (None, _) => "not read".into(),
            };
            out.push(format!(
                "  column `{}`: {what}{}",
                column.name,
                if column.guessed { " (by its name)" } else { "" }
            ));
        }
        out.extend(
            self.row_every_s
                .map(|s| format!("  a row every {} s ({} a second)", significant(s, 3), significant(1.0 / s, 3))),
        );
        if self.strokes > 0 {
            out.push(format!(
                "  {} {}",
                self.strokes,
                if self.analyses[0].lacks.is_empty() { "runs" } else { "strokes, by the position" }
            ));
        }
        out.extend(self.ranges.iter().map(|r| {
            let [low, middle, high] = r.range.map(|v| significant(v, 3));
            let unit = if r.unit.is_empty() { String::new() } else { format!(" {}", r.unit) };
            format!("  {}: {low} to {high}{unit}, middle {middle}", r.of)
        }));
        if self.columns.iter().any(|c| c.guessed) {
            let unit = if self.unit.is_empty() { String::new() } else { format!(" --unit '{}'", self.unit) };
            out.push(format!("  read with --map '{}'{unit}", self.map));
        }
        for analysis in &self.analyses {
            out.push(match &analysis.lacks[..] {
                [] => format!("  possible: {}", analysis.command),
                lacks => format!("  not possible: {} (lacks {})", analysis.command, lacks.join(", ")),
            });
        }
        out.extend(
            self.untestable.iter().map(|(law, why)| format!("  {} cannot be tested: {why}", law.replace('_', " "))),
        );
        out
    }
}

/// The program's unit of a column that was read in `unit`.
fn in_ours(column: &str, unit: &str) -> String {
    let ours = fingerpad_formats::unit::units_of(column).next().map_or("", |u| u.name);
    if ours == unit { unit.to_owned() } else { format!("{ours} (from {unit})") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_file;

    fn of(text: &str, map: Option<&str>) -> Result<Survey, SurveyError> {
        survey(&test_file(".csv", text.as_bytes()), map, None)
    }

    /// Strokes of 5 mm at 2 mm/s to and fro, with a rest of a second at each end, under 1 N in mN and a friction of 0.4.
    fn tribometer() -> String {
        let mut out = "Zeit (s);Fn [mN];Ft [N];pos (mm);Notiz\n".to_owned();
        for k in 0..700 {
            let t = 0.02 * f64::from(k);
            let phase = t.rem_euclid(7.0);
            let x = match phase {
                p if p < 2.5 => 2.0 * p,
                p if p < 3.5 => 5.0,
                p if p < 6.0 => 5.0 - 2.0 * (p - 3.5),
                _ => 0.0,
            };
            let way = if phase < 3.5 { 1.0 } else { -1.0 };
            out += &format!("{t:.2};{:.1};{:.3};{x:.3};-\n", 1000.0, 0.4 * way).replace('.', ",");
        }
        out
    }

    #[test]
    fn a_tribometers_file_is_understood_by_its_names_and_units() {
        let found = of(&tribometer(), None).unwrap();
        assert_eq!(found.map, "t=Zeit (s),slide_x=pos (mm),normal=Fn [mN],x=Ft [N]");
        assert_eq!(found.unit, "normal=mN");
        assert_eq!((found.rows, found.strokes), (700, 4));
        let ranges = |of: &str| found.ranges.iter().find(|r| r.of == of).unwrap().range;
        assert!((ranges("speed of a stroke")[1] - 2.0).abs() < 0.05, "{:?}", found.ranges);
        assert!(
            (ranges("load of a stroke")[1] - 1.0).abs() < 1e-9 && (ranges("length of a stroke")[1] - 5.0).abs() < 0.3
        );
        assert!((found.row_every_s.unwrap() - 0.02).abs() < 1e-6);
        assert_eq!(found.analyses[0].lacks, ["run_id", "depth_mm", "slide_y_mm", "friction_y_n"]);
        assert_eq!(found.analyses[1].lacks, ["friction_y_n"]);
        let text = found.lines().join("\n");
        assert!(text.contains("column `Notiz`: not read") && text.contains("N (from mN)"), "{text}");
    }

    #[test]
    fn runs_are_counted_and_laws_without_a_column_listed() {
        let found = of(&crate::laws::run_columns::template(), None).unwrap();
        assert_eq!((found.strokes, found.map.as_str()), (1, ""));
        assert!(found.analyses.iter().all(|a| a.lacks.is_empty()));
        assert!(found.untestable.iter().any(|(law, _)| law == "temperature"), "{:?}", found.untestable);
        let message = of("t_s,normal_force_n\n0,1\n0.1,x\n", None).unwrap_err().to_string();
        assert!(message.contains(":3:") && message.contains("normal_force_n"), "{message}");
    }
}
