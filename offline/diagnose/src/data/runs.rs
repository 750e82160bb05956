//! Measured runs: rows in time order with everything that the laws may read.
//!
//! Main types: [`RunSet`], [`Run`], [`RawRow`].

use std::path::{Path, PathBuf};

use fingerpad_formats::significant;

use crate::data::clock::{clock_step_s, equal_stamps, note, spread_equal_stamps};
use crate::data::content::Content;
use crate::data::median::median;
use crate::data::thinning::{Sample, rows_to_keep};
use crate::data::turns::with_turns;
use crate::error::DiagnoseError;
use crate::laws::run_columns;
use crate::laws::{Column, OWN, Row};
use crate::schema::Caution;

/// One row of a file; a missing value is NaN.
#[derive(Clone, Copy, Debug)]
pub struct RawRow {
    /// Line of the file.
    pub line: usize,
    /// Clock, s.
    pub t_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Displacement of the plate, mm.
    pub slide_mm: [f64; 2],
    /// Readings: normal, x, y, N.
    pub force_n: [f64; 3],
    /// Time since touch, s.
    pub contact_time_s: f64,
    /// Nominal speed, mm/s.
    pub speed_mm_s: f64,
    /// Direction, degrees.
    pub direction_deg: f64,
    /// Hold before sliding, s.
    pub dwell_s: f64,
    /// Contact time since the last rest, s.
    pub occlusion_time_s: f64,
    /// Corneometer reading.
    pub hydration_au: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Width of the finger, mm.
    pub finger_width_mm: f64,
    /// Columns of the user's own.
    pub own: [f64; OWN],
}

impl RawRow {
    /// A row of the motion and the readings alone: all other columns are missing.
    pub fn bare(line: usize, t_s: f64, depth_mm: f64, slide_mm: [f64; 2], force_n: [f64; 3]) -> Self {
        Self {
            line,
            t_s,
            depth_mm,
            slide_mm,
            force_n,
            contact_time_s: f64::NAN,
            speed_mm_s: f64::NAN,
            direction_deg: f64::NAN,
            dwell_s: f64::NAN,
            occlusion_time_s: f64::NAN,
            hydration_au: f64::NAN,
            temperature_c: f64::NAN,
            finger_width_mm: f64::NAN,
            own: [f64::NAN; OWN],
        }
    }
}

/// Names that group runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// The run.
    pub run: String,
    /// Repeats share it.
    pub condition: String,
    /// Rest lies between blocks.
    pub block: String,
    /// Whose finger.
    pub subject: String,
}

/// One approach and stroke.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its names.
    pub labels: Labels,
    /// Line of its first row.
    pub line: usize,
    /// State of contact and skin in each row, as the laws read it.
    pub rows: Vec<Row>,
    /// Displacement of the plate in each row, mm.
    pub slide_mm: Vec<[f64; 2]>,
    /// Readings: normal, x, y, N; NaN where one is left out.
    pub force_n: Vec<[f64; 3]>,
    /// Time constant of the sensor's low-pass, s; 0 without one.
    pub time_constant_s: f64,
    /// Hashes of the file's rows.
    pub content: Content,
}

impl Run {
    /// The plate's path in one row, mm.
    pub fn increment(&self, row: usize) -> [f64; 2] {
        if row == 0 {
            return self.slide_mm[0];
        }
        let (a, b) = (self.slide_mm[row - 1], self.slide_mm[row]);
        [b[0] - a[0], b[1] - a[1]]
    }

    /// Keeps at most so many rows; returns the number of turns that had to go.
    pub fn thin(&mut self, most: usize) -> usize {
        let sample = |i: usize| Sample {
            t_s: self.rows[i].t_s,
            depth_mm: self.rows[i].depth_mm,
            slide_mm: self.slide_mm[i],
            force_n: self.force_n[i],
        };
        let samples: Vec<Sample> = (0..self.rows.len()).map(sample).collect();
        let (keep, lost) = rows_to_keep(&samples, most, self.content.whole);
        self.rows = keep.iter().map(|i| self.rows[*i]).collect();
        self.slide_mm = keep.iter().map(|i| self.slide_mm[*i]).collect();
        self.force_n = keep.iter().map(|i| self.force_n[*i]).collect();
        lost
    }

    /// Largest depth, mm.
    pub fn depth_mm(&self) -> f64 {
        self.rows.iter().map(|r| r.depth_mm).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The run's value of a column: that of its last sliding row, or of its last row.
    pub fn value(&self, column: Column) -> f64 {
        let row = self.rows.iter().rev().find(|r| r.speed_mm_s > 0.0).or(self.rows.last()).copied().unwrap_or_default();
        if column == Column::Depth { self.depth_mm() } else { run_columns::value(column, &row) }
    }
}

/// The runs of a file.
#[derive(Clone, Debug)]
pub struct RunSet {
    /// The file.
    pub path: PathBuf,
    /// The runs.
    pub runs: Vec<Run>,
    /// Runs that the reader left out: name, line and content.
    pub left_out: Vec<(String, usize, Content)>,
    /// State columns that every row has.
    pub recorded: Vec<Column>,
    /// Columns that the reader converted, with the factor of their unit in the file.
    pub factors: Vec<(String, f64)>,
    /// Remarks of the reader.
    pub notes: Vec<String>,
    /// What the reader did, reported before the verdict; without a role.
    pub cautions: Vec<Caution>,
    /// Rows in the file.
    pub rows_read: usize,
    /// Runs in the file.
    pub runs_read: usize,
    /// SHA-256 of the file.
    pub sha256: String,
}

/// Slides shorter than this are no motion, mm.
const STILL_MM: f64 = 1e-6;

/// A run from its rows: derives contact time, speed, direction and paths where the file does not have them.
///
/// * `recorded`: state columns that the file has
///
/// Rows of one time stamp are spread over the clock's step. Errors: [`DiagnoseError::Unusable`] for time running backwards.
pub fn run_of(path: &Path, labels: Labels, raw: &[RawRow]) -> Result<Run, DiagnoseError> {
    for pair in raw.windows(2) {
        if !(pair[1].t_s >= pair[0].t_s) {
            return Err(DiagnoseError::Unusable {
                path: path.to_path_buf(),
                problem: format!(
                    "line {}, column t_s: {} after {}: time must not fall within run `{}`",
                    pair[1].line,
                    significant(pair[1].t_s, 12),
                    significant(pair[0].t_s, 12),
                    labels.run
                ),
            });
        }
    }
    let content = Content::of(raw);
    let clock_s = clock_step_s(raw);
    let raw = spread_equal_stamps(raw);
    let raw = &with_turns(&raw, clock_s)[..];
    let n = raw.len();
    let touch_s = touch_time(raw);
    let step = |i: usize| -> [f64; 2] {
        let from = if i == 0 { [0.0; 2] } else { raw[i - 1].slide_mm };
        if i == 0 && raw[0].depth_mm <= 0.0 {
            [0.0; 2]
        } else {
            [raw[i].slide_mm[0] - from[0], raw[i].slide_mm[1] - from[1]]
        }
    };
    let length = |s: [f64; 2]| s[0].hypot(s[1]);
    let nominal = nominal_speed(raw);
    let mut rows = Vec::with_capacity(n);
    let (mut path_mm, mut turn_mm, mut along) = (0.0, 0.0, [0.0; 2]);
    for (i, r) in raw.iter().enumerate() {
        let s = step(i);
        let moved = length(s);
        let sliding = moved > STILL_MM && r.depth_mm > 0.0;
        if sliding {
            let now = [s[0] / moved, s[1] / moved];
            if now[0] * along[0] + now[1] * along[1] < 0.0 {
                turn_mm = 0.0;
            }
            along = now;
            path_mm += moved;
            turn_mm += moved;
        } else if r.depth_mm <= 0.0 {
            (path_mm, turn_mm, along) = (0.0, 0.0, [0.0; 2]);
        }
        let speed_mm_s = match (sliding, r.speed_mm_s > 0.0) {
            (false, _) => 0.0,
            (true, true) => r.speed_mm_s,
            (true, false) => nominal,
        };
        let angle = 2.0 * along[1].atan2(along[0]);
        let double_angle = if along == [0.0; 2] { [0.0; 2] } else { [angle.cos(), angle.sin()] };
        rows.push(Row {
            t_s: r.t_s,
            depth_mm: r.depth_mm,
            contact_time_s: if r.contact_time_s.is_nan() { r.t_s - touch_s } else { r.contact_time_s },
            speed_mm_s,
            double_angle,
            along,
            path_mm,
            turn_mm,
            dwell_s: r.dwell_s,
            occlusion_s: r.occlusion_time_s,
            hydration_au: r.hydration_au,
            temperature_c: r.temperature_c,
            width_mm: r.finger_width_mm,
            own: r.own,
        });
    }
    fill_direction_before_motion(&mut rows);
    Ok(Run {
        line: raw[0].line,
        labels,
        rows,
        slide_mm: raw.iter().map(|r| r.slide_mm).collect(),
        force_n: raw.iter().map(|r| r.force_n).collect(),
        time_constant_s: 0.0,
        content,
    })
}

/// A finger that presses has no direction yet; the one to come is the direction that its friction will have.
fn fill_direction_before_motion(rows: &mut [Row]) {
    let first = rows.iter().find(|r| r.along != [0.0; 2]).map(|r| r.double_angle);
    if let Some(first) = first {
        for row in rows.iter_mut() {
            if row.along == [0.0; 2] {
                row.double_angle = first;
            } else {
                break;
            }
        }
    }
}

/// When depth passed zero, interpolated; without a row in the air, extrapolated from the first two, at most one row.
fn touch_time(raw: &[RawRow]) -> f64 {
    for pair in raw.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        if a.depth_mm <= 0.0 && b.depth_mm > 0.0 {
            return a.t_s + (b.t_s - a.t_s) * (-a.depth_mm) / (b.depth_mm - a.depth_mm);
        }
    }
    match raw {
        [a, b, ..] if a.depth_mm > 0.0 && b.depth_mm > a.depth_mm => {
            a.t_s - ((b.t_s - a.t_s) * a.depth_mm / (b.depth_mm - a.depth_mm)).min(b.t_s - a.t_s)
        }
        [a, ..] => a.t_s,
        [] => f64::NAN,
    }
}

/// Median speed over the rows in which the plate moves, mm/s; 0 without any.
fn nominal_speed(raw: &[RawRow]) -> f64 {
    let speeds = raw
        .windows(2)
        .filter(|p| p[1].depth_mm > 0.0)
        .map(|p| {
            (p[1].slide_mm[0] - p[0].slide_mm[0]).hypot(p[1].slide_mm[1] - p[0].slide_mm[1]) / (p[1].t_s - p[0].t_s)
        })
        .filter(|v| *v > STILL_MM);
    median(speeds).unwrap_or(0.0)
}

impl RunSet {
    /// Number of rows that are kept.
    pub fn rows(&self) -> usize {
        self.runs.iter().map(|r| r.rows.len()).sum()
    }

    /// Name, line and content of every run of the file.
    pub fn contents(&self) -> impl Iterator<Item = (&str, usize, &Content)> {
        let kept = self.runs.iter().map(|r| (r.labels.run.as_str(), r.line, &r.content));
        kept.chain(self.left_out.iter().map(|(run, line, content)| (run.as_str(), *line, content)))
    }

    /// Whether a law may read the column.
    pub fn has(&self, column: Column) -> bool {
        match column {
            Column::Time | Column::Depth | Column::ContactTime | Column::Speed | Column::Direction | Column::Slide => {
                true
            }
            state => self.recorded.contains(&state),
        }
    }

    /// Factor of the unit in which a column stands in the file.
    pub fn factor(&self, column: &str) -> f64 {
        self.factors.iter().find(|(name, _)| name == column).map_or(1.0, |(_, factor)| *factor)
    }

    /// Takes note of the user's own columns that no row lacks.
    pub fn recognise(&mut self, own: &[Column]) {
        let place_of = |c: &Column| if let Column::Own { place, .. } = c { usize::from(*place) } else { OWN };
        for column in own {
            let known = |row: &Row| row.own.get(place_of(column)).is_some_and(|v| v.is_finite());
            if !self.recorded.contains(column) && self.runs.iter().flat_map(|r| &r.rows).all(known) {
                self.recorded.push(*column);
            }
        }
    }

    /// Some of the runs.
    pub fn subset(&self, pick: impl Fn(usize) -> bool) -> Self {
        Self {
            runs: self.runs.iter().enumerate().filter(|(i, _)| pick(*i)).map(|(_, r)| r.clone()).collect(),
            ..self.clone()
        }
    }

    /// Standard deviation of a column over runs.
    pub fn spread(&self, column: Column) -> f64 {
        let values: Vec<f64> = self.runs.iter().map(|r| r.value(column)).filter(|v| v.is_finite()).collect();
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
    }
}

impl RunSet {
    /// A set from rows in memory.
    ///
    /// # Errors
    /// Those of [`run_of`].
    pub fn from_rows(path: PathBuf, rows: Vec<(Labels, Vec<RawRow>)>) -> Result<Self, DiagnoseError> {
        let rows_read = rows.iter().map(|r| r.1.len()).sum();
        let runs_read = rows.len();
        let recorded = recorded(rows.iter().flat_map(|r| &r.1));
        let notes = note(rows.iter().map(|r| equal_stamps(&r.1)).sum()).into_iter().collect();
        let runs = rows.into_iter().map(|(labels, rows)| run_of(&path, labels, &rows)).collect::<Result<_, _>>()?;
        Ok(Self {
            path,
            runs,
            left_out: Vec::new(),
            recorded,
            factors: Vec::new(),
            notes,
            cautions: Vec::new(),
            rows_read,
            runs_read,
            sha256: String::new(),
        })
    }
}

/// The state columns that no row lacks.
pub fn recorded<'a>(rows: impl Iterator<Item = &'a RawRow>) -> Vec<Column> {
    let mut there = vec![true; run_columns::states().count()];
    for r in rows {
        // In the order of the list.
        let values = [r.dwell_s, r.occlusion_time_s, r.hydration_au, r.temperature_c, r.finger_width_mm];
        for (flag, v) in there.iter_mut().zip(values) {
            *flag &= v.is_finite();
        }
    }
    run_columns::states().zip(there).filter_map(|((column, _), there)| there.then_some(column)).collect()
}
