//! The known columns of a file of measured runs: where each of them stands, and the rows that they hold.

use std::path::Path;

use fingerpad_formats::Error;

use crate::data::column_map::ColumnMap;
use crate::data::csv_text::{CsvRows, like, missing_column, short};
use crate::data::runs::{Labels, RawRow};
use crate::laws::OWN;
use crate::laws::run_columns::{OPTIONAL, REQUIRED};
use crate::schema::Caution;

/// Place among the optional columns of the first one that holds text.
const LABELS: usize = 8;

/// Whether a column of this name in the file is read.
pub fn is_read(map: &ColumnMap, name: &str) -> bool {
    let own = map.own().iter().filter(|c| c.derived.is_none()).map(|c| c.name.as_str());
    REQUIRED.into_iter().chain(OPTIONAL).chain(own).any(|column| map.name(column) == name)
}

/// Where each known column stands.
pub struct ColumnPlaces {
    required: [usize; REQUIRED.len()],
    optional: [Option<usize>; OPTIONAL.len()],
    /// Columns of the user's own.
    own: Vec<Option<usize>>,
    /// Columns that are ignored, one sentence each.
    pub notes: Vec<String>,
    /// Ignored columns that look like a known one.
    pub cautions: Vec<Caution>,
    map: ColumnMap,
}

impl ColumnPlaces {
    /// The places of the columns in a file's header.
    ///
    /// # Errors
    /// [`Error`] for a column that is missing or comes twice.
    pub fn of(path: &Path, map: &ColumnMap, rows: &CsvRows<'_>) -> Result<Self, Error> {
        let ours = |name: &str| is_read(map, name);
        rows.refuse_duplicates(ours)?;
        let names = rows.header();
        let find = |name: &str| names.iter().position(|n| n == map.name(name));
        let mut required = [0; REQUIRED.len()];
        for (slot, name) in required.iter_mut().zip(REQUIRED) {
            *slot = find(name).ok_or_else(|| missing_column(rows, map, name, ours))?;
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
        let own = map.own().iter().map(|c| if c.derived.is_none() { find(&c.name) } else { None }).collect();
        Ok(Self { required, optional: OPTIONAL.map(find), own, notes, cautions, map: map.clone() })
    }

    /// Columns of numbers and their places.
    pub fn numbers(&self) -> Vec<(String, usize)> {
        let required = REQUIRED.into_iter().zip(self.required).skip(1);
        let optional = OPTIONAL.into_iter().zip(self.optional).take(LABELS).filter_map(|(name, at)| Some((name, at?)));
        let own = self.map.own().iter().zip(&self.own).filter_map(|(column, at)| Some((column.name.as_str(), (*at)?)));
        required.chain(optional).chain(own).map(|(name, at)| (name.to_owned(), at)).collect()
    }

    /// Labels and numbers of the present row.
    ///
    /// # Errors
    /// [`Error`] with line and column for a cell that is blank, no number or out of range.
    pub fn row(&self, line: usize, cells: &mut CsvRows<'_>) -> Result<(Labels, RawRow), Error> {
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
