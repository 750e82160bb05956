//! Reader of traces of forces alone: a finger moved freely on a force plate.
//!
//! Main types: [`Trace`], [`TraceRow`].

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use fingerpad_formats::{Error, significant};

use crate::data::column_map::ColumnMap;
use crate::data::csv_text::{CsvRows, missing_column};
use crate::data::rotation::Rotation;

/// One row of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceRow {
    /// Clock, s.
    pub t_s: f64,
    /// Readings: normal, x, y, N.
    pub force_n: [f64; 3],
}

/// Columns of a trace.
const WANTED: [&str; 4] = ["t_s", "normal_force_n", "friction_x_n", "friction_y_n"];

/// A trace of forces.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Its rows.
    pub rows: Vec<TraceRow>,
    /// How the file was read, where that is not as this program writes files.
    pub notes: Vec<String>,
}

/// Reads a trace, plain or compressed by gzip.
///
/// # Errors
/// [`Error`] with file, line and column.
pub fn read(path: &Path, map: &ColumnMap) -> Result<Trace, Error> {
    let problem = |line: usize, column: &str, value: f64, problem: &str| Error::Value {
        path: path.to_path_buf(),
        line,
        column: column.to_owned(),
        value: significant(value, DIGITS),
        problem: problem.to_owned(),
    };
    let names = WANTED.map(|column| map.name(column).to_owned());
    let file = File::open(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    let ours = |name: &str| names.iter().any(|n| n == name);
    let mut cells = CsvRows::open(path, BufReader::new(file), ours)?;
    cells.refuse_duplicates(ours)?;
    let mut at = [("", 0); 4];
    for (slot, column) in at.iter_mut().zip(WANTED) {
        let place = cells.header().iter().position(|h| h == map.name(column));
        *slot = (column, place.ok_or_else(|| missing_column(&cells, map, column, ours))?);
    }
    let (mut rows, mut lines): (Vec<TraceRow>, Vec<usize>) = (Vec::new(), Vec::new());
    while let Some(line) = cells.next(map, &at)? {
        let mut v = [0.0; 4];
        for (value, (column, place)) in v.iter_mut().zip(at) {
            *value = cells.number(map, column, place)?;
        }
        if rows.last().is_some_and(|last| !(v[0] >= last.t_s)) {
            return Err(problem(line, &names[0], v[0], "is before the row above: time must not fall"));
        }
        lines.push(line);
        let force_n = [v[1], v[2], v[3]];
        let force_n = map.rotation().map_or(force_n, |rotation| rotation.apply(force_n));
        rows.push(TraceRow { t_s: v[0], force_n });
    }
    if rows.len() < 3 {
        return Err(Error::TooFewRows { path: path.to_path_buf(), line: rows.len() + 1, found: rows.len(), needed: 3 });
    }
    let normal = if map.rotation().is_some() { format!("{} (after the rotation)", names[1]) } else { names[1].clone() };
    if let Some((line, value)) = falls(&rows, &lines) {
        let hint = "is below the rows with which the trace begins, and friction grows as the normal force falls: it is to be \
                    positive where the finger presses; turn it round with --map normal=-COLUMN";
        return Err(problem(line, &normal, value, hint));
    }
    if let Some((line, value)) = pulls(&rows, &lines) {
        let hint = "is the largest normal force in size, and negative: it is to be positive where the finger presses; turn it \
                    round with --map normal=-COLUMN";
        return Err(problem(line, &normal, value, hint));
    }
    let notes = cells.notes().into_iter().chain(map.rotation().map(Rotation::note)).collect();
    Ok(Trace { rows, notes })
}

/// Digits of values in a message.
const DIGITS: usize = 12;

/// Line and value of the largest fall below the rows with which a trace begins, where these are the highest readings of
/// all and friction grows as the reading falls: then the finger presses downwards, whatever the tare.
fn falls(rows: &[TraceRow], lines: &[usize]) -> Option<(usize, f64)> {
    let first = rows.len().min(3);
    let start: [f64; 3] =
        std::array::from_fn(|k| rows[..first].iter().map(|r| r.force_n[k]).sum::<f64>() / first as f64);
    let mut readings: Vec<f64> = rows.iter().map(|r| r.force_n[0]).collect();
    readings.sort_by(f64::total_cmp);
    let below = readings.partition_point(|f| *f < start[0] - 0.1);
    if below * 20 < rows.len() * 19 / 2 || readings[readings.len() * 19 / 20] > start[0] + 0.1 {
        return None;
    }
    let pair = |r: &TraceRow| (start[0] - r.force_n[0], (r.force_n[1] - start[1]).hypot(r.force_n[2] - start[2]));
    let n = rows.len() as f64;
    let mean = rows.iter().map(pair).fold((0.0, 0.0), |a, b| (a.0 + b.0 / n, a.1 + b.1 / n));
    let (mut both, mut own) = (0.0, [0.0; 2]);
    for (load, friction) in rows.iter().map(pair) {
        both += (load - mean.0) * (friction - mean.1);
        own = [own[0] + (load - mean.0).powi(2), own[1] + (friction - mean.1).powi(2)];
    }
    let lowest = (0..rows.len()).min_by(|a, b| rows[*a].force_n[0].total_cmp(&rows[*b].force_n[0]))?;
    (both > 0.3 * (own[0] * own[1]).sqrt()).then(|| (lines[lowest], rows[lowest].force_n[0]))
}

/// Line and value of the largest pull, where the normal force of a trace reaches farther below zero than above it: a
/// finger on a plate presses. A twentieth of the rows at either end is left out.
fn pulls(rows: &[TraceRow], lines: &[usize]) -> Option<(usize, f64)> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| rows[*a].force_n[0].total_cmp(&rows[*b].force_n[0]));
    let at = |place: usize| rows[order[place]].force_n[0];
    let end = rows.len() / 20;
    (at(end) < 0.0 && -at(end) > 2.0 * at(rows.len() - 1 - end)).then(|| (lines[order[0]], at(0)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::test_file;

    const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/human_texture_exploration/");

    #[test]
    fn a_normal_force_of_the_wrong_sign_is_refused_with_a_hint() {
        for name in ["July3_1_force_data_1", "July3_2_force_data_1", "July3_2_force_data_2", "July5_1_force_data_2"] {
            let path = format!("{FOLDER}{name}.csv");
            let read = |map| read(Path::new(&path), &ColumnMap::parse(Some(map), None).unwrap());
            assert!(read("normal=-Fz,x=Fx,y=Fy,t=Timestamp").is_ok(), "{name}");
            let message = read("normal=Fz,x=Fx,y=Fy,t=Timestamp").unwrap_err().to_string();
            for word in [name, "Fz", "turn it round", "--map normal=-"] {
                assert!(message.contains(word), "{message}");
            }
        }
    }

    #[test]
    fn a_compressed_trace_gives_the_rows_of_the_plain_one() {
        let path = format!("{FOLDER}July3_1_force_data_1.csv");
        let map = &ColumnMap::parse(Some("normal=-Fz,x=Fx,y=Fy,t=Timestamp"), None).unwrap();
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(&std::fs::read(&path).unwrap()).unwrap();
        let packed = test_file(".csv.gz", &encoder.finish().unwrap());
        assert_eq!(read(&packed, map).unwrap(), read(Path::new(&path), map).unwrap());
    }
}
