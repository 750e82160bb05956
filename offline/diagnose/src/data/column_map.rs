//! Names and units of a user's columns.
//!
//! Main type: [`ColumnMap`].

use fingerpad_formats::unit::{Unit, find, units_of};

use crate::data::rotation::Rotation;
use crate::laws::run_columns::run_columns;
use crate::laws::{Column, OwnColumn};

/// What our columns are called in a file, and in which units they stand there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMap {
    entries: Vec<Entry>,
    own: Vec<OwnColumn>,
    rotation: Option<Rotation>,
}

#[derive(Clone, Debug, PartialEq)]
struct Entry {
    column: String,
    name: Option<String>,
    turned: bool,
    unit: Option<Unit>,
}

/// Files that pairs may be for.
const ROLES: [&str; 3] = ["calibration", "measured", "holdout"];

fn column_of(key: &str) -> Result<&'static str, String> {
    let key = key.trim();
    run_columns().iter().find(|known| known.name == key || known.short == key).map(|known| known.name).ok_or_else(
        || {
            format!(
                "`{key}` is not one of {}",
                run_columns()
                    .iter()
                    .map(|known| format!("{} ({})", known.short, known.name))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        },
    )
}

impl ColumnMap {
    /// From texts like `normal=-Fz,x=Fx,t=Timestamp` and `depth=um,normal=mN`; a minus sign turns a column round.
    ///
    /// # Errors
    /// A sentence that names the pair that cannot be used.
    pub fn parse(map: Option<&str>, units: Option<&str>) -> Result<Self, String> {
        Self::parse_with(Vec::new(), map, units, "")
    }

    /// The same for files that have columns of the user's own.
    ///
    /// * `role`: of the file; pairs like `measured:depth=um` hold for the files of one role alone
    ///
    /// # Errors
    /// Those of [`ColumnMap::parse`].
    pub fn parse_with(own: Vec<OwnColumn>, map: Option<&str>, units: Option<&str>, role: &str) -> Result<Self, String> {
        let mut out = Self { entries: Vec::new(), own, rotation: None };
        for (flag, text) in [("--map", map), ("--unit", units)] {
            for pair in text.unwrap_or("").split(',').filter(|p| !p.trim().is_empty()) {
                let (key, value) = pair.split_once('=').ok_or_else(|| format!("{flag}: `{pair}` is not KEY=VALUE"))?;
                let (only, key) = key.split_once(':').map_or((role, key), |(only, key)| (only.trim(), key));
                if only != role && !ROLES.contains(&only) {
                    return Err(format!("{flag}: `{only}:` is not one of {}:", ROLES.join(":, ")));
                }
                let column = out.column_of(key).map_err(|problem| format!("{flag}: {problem}"))?;
                if only != role {
                    continue;
                }
                let column = column.as_str();
                let entry = out.entry(column);
                let value = value.trim();
                let again = if flag == "--map" { entry.name.is_some() } else { entry.unit.is_some() };
                if again {
                    return Err(format!("{flag}: {column} is given twice"));
                }
                if flag == "--map" {
                    entry.turned = value.starts_with('-');
                    entry.name = Some(value.strip_prefix('-').unwrap_or(value).to_owned());
                } else {
                    entry.unit = Some(unit_of(column, value)?);
                }
            }
        }
        Ok(out)
    }

    /// The same for forces that were logged in the frame of a sensor; signs and units of the columns come first, then the rotation.
    pub fn turned_by(self, rotation: Option<Rotation>) -> Self {
        Self { rotation, ..self }
    }

    /// The rotation from the frame of the sensor.
    pub fn rotation(&self) -> Option<&Rotation> {
        self.rotation.as_ref()
    }

    /// Our name of a column, from that or its short name.
    fn column_of(&self, key: &str) -> Result<String, String> {
        let own = self.own.iter().find(|c| c.name == key.trim()).map(|c| c.name.clone());
        own.map_or_else(|| column_of(key).map(str::to_owned), Ok)
    }

    /// The columns of the user's own.
    pub fn own(&self) -> &[OwnColumn] {
        &self.own
    }

    /// The same as laws know them.
    pub fn own_columns(&self) -> Vec<Column> {
        self.own.iter().enumerate().map(|(place, column)| column.column(place)).collect()
    }

    fn entry(&mut self, column: &str) -> &mut Entry {
        let place = self.entries.iter().position(|e| e.column == column).unwrap_or_else(|| {
            self.entries.push(Entry { column: column.to_owned(), name: None, turned: false, unit: None });
            self.entries.len() - 1
        });
        &mut self.entries[place]
    }

    fn find(&self, column: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.column == column)
    }

    /// What one of our columns is called in the file.
    pub fn name<'a>(&'a self, column: &'a str) -> &'a str {
        self.find(column).and_then(|e| e.name.as_deref()).unwrap_or(column)
    }

    /// A value of the file in our unit and sign.
    pub fn value(&self, column: &str, value: f64) -> f64 {
        let Some(entry) = self.find(column) else { return value };
        let value = entry.unit.map_or(value, |u| u.factor * value + u.offset);
        if entry.turned { -value } else { value }
    }

    /// The unit in which a column is read; empty where it has none.
    pub fn unit<'a>(&'a self, column: &str) -> &'a str {
        let own = self.own.iter().find(|c| c.name == column).map(|c| c.unit.as_str());
        match (self.find(column).and_then(|e| e.unit), own) {
            (Some(unit), _) => unit.name,
            (None, Some(own)) => find(column, own).map_or(own, |unit| unit.name),
            (None, None) => units_of(column).next().map_or("", |unit| unit.name),
        }
    }

    /// The columns that are converted, with the factor of their unit.
    pub fn factors(&self) -> Vec<(String, f64)> {
        self.entries.iter().filter_map(|e| Some((e.column.clone(), e.unit?.factor))).collect()
    }

    /// What was understood, one line a column.
    pub fn used(&self) -> Vec<String> {
        let of = |e: &Entry| {
            let turned = if e.turned { ", turned round" } else { "" };
            let unit = e.unit.map_or_else(String::new, |u| format!(", in {}", u.name));
            format!("{} is column `{}`{unit}{turned}", e.column, e.name.as_deref().unwrap_or(&e.column))
        };
        self.entries.iter().map(of).collect()
    }
}

fn unit_of(column: &str, name: &str) -> Result<Unit, String> {
    find(column, name).map_err(|units| {
        if units.is_empty() {
            format!("--unit: {column} has no unit that could be another one")
        } else {
            format!("--unit: `{name}` is not a unit of {column}; known are {}", units.join(", "))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_signs_and_units_are_understood_and_contradictions_are_not() {
        let map = ColumnMap::parse(Some("normal=-Fz, depth=Z"), Some("depth=um,normal=mN,temperature=K")).unwrap();
        assert_eq!((map.name("normal_force_n"), map.name("depth_mm"), map.name("t_s")), ("Fz", "Z", "t_s"));
        assert!((map.value("normal_force_n", -1500.0) - 1.5).abs() < 1e-12);
        assert!((map.value("depth_mm", 900.0) - 0.9).abs() < 1e-12);
        assert!((map.value("temperature_c", 305.15) - 32.0).abs() < 1e-9);
        for (map, units, word) in [
            (Some("weight=W"), None, "weight"),
            (Some("normal"), None, "KEY=VALUE"),
            (None, Some("normal=mm"), "normal_force_n"),
            (None, Some("hydration=ppm"), "au, fraction, %"),
            (None, Some("depth=um,depth_mm=mm"), "twice"),
            (None, Some("run=mm"), "run_id"),
            (None, Some("mesured:depth=um"), "calibration:, measured:, holdout:"),
            (None, Some("measured:depht=um"), "depht"),
        ] {
            let message = ColumnMap::parse(map, units).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn pairs_may_be_for_the_files_of_one_role() {
        let unit = Some("t=ms,measured:normal=lbf,calibration:depth=um");
        let of = |role| ColumnMap::parse_with(Vec::new(), Some("measured:depth=Z"), unit, role).unwrap();
        let (calibration, measured) = (of("calibration"), of("measured"));
        assert_eq!((calibration.name("depth_mm"), measured.name("depth_mm")), ("depth_mm", "Z"));
        assert_eq!((calibration.value("normal_force_n", 1.0), measured.value("depth_mm", 1.0)), (1.0, 1.0));
        assert_eq!((measured.value("t_s", 1e3), calibration.value("t_s", 1e3)), (1.0, 1.0));
        assert!((measured.value("normal_force_n", 1.0) - 4.448).abs() < 1e-3);
    }
}
