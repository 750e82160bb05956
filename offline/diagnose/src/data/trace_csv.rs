//! Reader of traces of forces alone: a finger moved freely on a force plate.
//!
//! Main type: [`TraceRow`].

use std::io::Read;
use std::path::Path;

use fingerpad_formats::Error;
use flate2::read::MultiGzDecoder;

use crate::data::runs_csv::GZIP_MAGIC;

/// One row of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceRow {
    /// Clock, s.
    pub t_s: f64,
    /// Readings: normal, x, y, N.
    pub force_n: [f64; 3],
}

/// Keys of a map, and the columns that they stand for without one.
const WANTED: [(&str, &str); 4] =
    [("t", "t_s"), ("normal", "normal_force_n"), ("x", "friction_x_n"), ("y", "friction_y_n")];

/// Reads a trace, plain or compressed by gzip. `map` is like `normal=-Fz,x=Fx,y=Fy,t=Timestamp`; a minus sign turns a column round.
pub fn read(path: &Path, map: Option<&str>) -> Result<Vec<TraceRow>, Error> {
    let problem = |line: usize, column: &str, value: &str, problem: &str| Error::Value {
        path: path.to_path_buf(),
        line,
        column: column.to_owned(),
        value: value.to_owned(),
        problem: problem.to_owned(),
    };
    let mut names = WANTED.map(|(_, column)| (column.to_owned(), 1.0));
    for pair in map.unwrap_or("").split(',').filter(|p| !p.is_empty()) {
        let (key, column) = pair.split_once('=').ok_or_else(|| problem(1, "--map", pair, "is not KEY=COLUMN"))?;
        let slot = WANTED.iter().position(|(k, c)| *k == key.trim() || *c == key.trim());
        let slot = slot.ok_or_else(|| problem(1, "--map", key, "is not one of t, normal, x, y"))?;
        let column = column.trim();
        names[slot] = match column.strip_prefix('-') {
            Some(turned) => (turned.to_owned(), -1.0),
            None => (column.to_owned(), 1.0),
        };
    }
    let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    let bytes = if bytes.starts_with(&GZIP_MAGIC) {
        let mut text = Vec::new();
        MultiGzDecoder::new(&bytes[..])
            .read_to_end(&mut text)
            .map_err(|source| Error::File { path: path.to_path_buf(), source })?;
        text
    } else {
        bytes
    };
    let text = String::from_utf8(bytes).map_err(|_| Error::NotText { path: path.to_path_buf(), line: 1 })?;
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let fail = |e: csv::Error| Error::File { path: path.to_path_buf(), source: std::io::Error::other(e.to_string()) };
    let header = reader.headers().map_err(fail)?.clone();
    let mut at = [0; 4];
    for (slot, (name, _)) in at.iter_mut().zip(&names) {
        *slot = header.iter().position(|h| h == name).ok_or_else(|| Error::MissingColumn {
            path: path.to_path_buf(),
            line: 1,
            column: format!("`{name}` (use --map to say where it is)"),
        })?;
    }
    let (mut rows, mut lines): (Vec<TraceRow>, Vec<usize>) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(fail)?;
        let line = record.position().map_or(0, |p| p.line() as usize);
        let mut v = [0.0; 4];
        for k in 0..4 {
            let cell = record.get(at[k]).unwrap_or("");
            let value: f64 = cell.parse().map_err(|_| problem(line, &names[k].0, cell, "is not a number"))?;
            if !value.is_finite() {
                return Err(problem(line, &names[k].0, cell, "is not a finite number"));
            }
            v[k] = names[k].1 * value;
        }
        if rows.last().is_some_and(|last| !(v[0] > last.t_s)) {
            return Err(problem(line, &names[0].0, &v[0].to_string(), "is not after the row before"));
        }
        lines.push(line);
        rows.push(TraceRow { t_s: v[0], force_n: [v[1], v[2], v[3]] });
    }
    if rows.len() < 3 {
        return Err(Error::TooFewRows { path: path.to_path_buf(), line: rows.len() + 1, found: rows.len(), needed: 3 });
    }
    if let Some((line, value)) = pulls(&rows, &lines) {
        let hint = "is the largest normal force in size, and negative: it is to be positive where the finger presses; turn it \
                    round with --map normal=-COLUMN";
        return Err(problem(line, &names[1].0, &(names[1].1 * value).to_string(), hint));
    }
    Ok(rows)
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

    const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/human_texture_exploration/");

    #[test]
    fn a_normal_force_of_the_wrong_sign_is_refused_with_a_hint() {
        for name in ["July3_1_force_data_1", "July3_2_force_data_1", "July3_2_force_data_2", "July5_1_force_data_2"] {
            let path = format!("{FOLDER}{name}.csv");
            let read = |map| read(Path::new(&path), Some(map));
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
        let map = Some("normal=-Fz,x=Fx,y=Fy,t=Timestamp");
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(&std::fs::read(&path).unwrap()).unwrap();
        let packed = std::env::temp_dir().join(format!("trace-{}.csv.gz", std::process::id()));
        std::fs::write(&packed, encoder.finish().unwrap()).unwrap();
        let rows = read(&packed, map).unwrap();
        std::fs::remove_file(&packed).unwrap();
        assert_eq!(rows, read(Path::new(&path), map).unwrap());
    }
}
