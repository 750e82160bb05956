//! Columns under other names and in other units than the format's own.
//!
//! Main type: [`ColumnNames`], made from a user's arguments: `normal_force_n=-Fz` and `normal_force_n=mN`.

use std::collections::BTreeMap;

use crate::unit::{self, Unit};

/// Column names of a file, and the factors that convert its numbers to the format's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnNames {
    /// The file's name of a column, and -1 if its sign changes.
    given: BTreeMap<String, (String, f64)>,
    /// Unit of a column's values.
    units: BTreeMap<String, Unit>,
}

impl ColumnNames {
    /// Reads a user's arguments.
    ///
    /// * `map`: pairs `column=name in the file`, separated by commas; a minus sign before the name changes the sign of
    ///   the values
    /// * `unit`: pairs `column=unit`; the unit of a column is that of its spread (`..._sd`) too, unless that has its
    ///   own
    /// * `known`: columns of the format
    ///
    /// # Errors
    /// The flag with the pair that cannot be used.
    pub fn parse(map: Option<&str>, unit: Option<&str>, known: &[&str]) -> Result<Self, String> {
        let mut names = Self::default();
        for (column, name) in pairs("--map", map, known)? {
            let (name, sign) = name.strip_prefix('-').map_or((name, 1.0), |turned| (turned, -1.0));
            if let Some((other, _)) = names.given.iter().find(|(_, (given, _))| given == name) {
                return Err(format!("--map {column}={name}: {other} has this column already"));
            }
            if names.given.insert(column.to_owned(), (name.to_owned(), sign)).is_some() {
                return Err(format!("--map {column}={name}: {column} is given twice"));
            }
        }
        for (column, unit) in pairs("--unit", unit, known)? {
            let found = unit::find(column, unit).map_err(|units| {
                if units.is_empty() {
                    format!("--unit {column}={unit}: this column has no other unit")
                } else {
                    format!("--unit {column}={unit}: units are {}", units.join(", "))
                }
            })?;
            if names.units.insert(column.to_owned(), found).is_some() {
                return Err(format!("--unit {column}={unit}: {column} is given twice"));
            }
        }
        Ok(names)
    }

    /// Whether columns have names of the file's own; other columns of the file are then ignored.
    pub fn renames(&self) -> bool {
        !self.given.is_empty()
    }

    /// The format's name of a column of the file.
    pub fn of_file<'a>(&'a self, name: &'a str) -> Option<&'a str> {
        match self.given.iter().find(|(_, (given, _))| given == name) {
            Some((column, _)) => Some(column),
            // A column that another one replaces is not meant.
            None => (!self.given.contains_key(name)).then_some(name),
        }
    }

    /// Names of the file that replace columns of the format.
    pub fn given(&self) -> impl Iterator<Item = (&str, &str)> {
        self.given.iter().map(|(column, (name, _))| (column.as_str(), name.as_str()))
    }

    /// Factor of the values of a column of the format.
    pub fn factor(&self, column: &str) -> f64 {
        let sign = self.given.get(column).map_or(1.0, |(_, sign)| *sign);
        sign * self.unit(column).map_or(1.0, |unit| unit.factor)
    }

    /// Unit that the user gave a column.
    pub(crate) fn unit(&self, column: &str) -> Option<&Unit> {
        self.units.get(column).or_else(|| self.units.get(column.strip_suffix("_sd")?))
    }
}

/// Pairs of a flag's text.
fn pairs<'a>(flag: &str, text: Option<&'a str>, known: &[&str]) -> Result<Vec<(&'a str, &'a str)>, String> {
    let mut out = Vec::new();
    for pair in text.unwrap_or("").split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let (column, value) = pair.split_once('=').ok_or_else(|| format!("{flag} {pair}: is not COLUMN=..."))?;
        let (column, value) = (column.trim(), value.trim());
        if !known.contains(&column) {
            return Err(format!("{flag} {pair}: `{column}` is not one of {}", known.join(", ")));
        }
        if value.is_empty() || value == "-" {
            return Err(format!("{flag} {pair}: nothing follows `=`"));
        }
        out.push((column, value));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [&str; 4] = ["depth_mm", "normal_force_n", "normal_force_n_sd", "friction_coefficient"];

    #[test]
    fn names_and_units_are_applied_and_mistakes_reported() {
        let names = ColumnNames::parse(Some("normal_force_n=-Fz"), Some("normal_force_n=mN,depth_mm=um"), &KNOWN);
        let names = names.unwrap();
        assert_eq!((names.of_file("Fz"), names.of_file("depth_mm")), (Some("normal_force_n"), Some("depth_mm")));
        assert_eq!(names.of_file("normal_force_n"), None);
        assert_eq!((names.factor("normal_force_n"), names.factor("normal_force_n_sd")), (-1e-3, 1e-3));
        assert_eq!((names.factor("depth_mm"), names.factor("friction_coefficient")), (1e-3, 1.0));
        for (map, unit, expected) in [
            ("load=Fz", "", "--map load=Fz: `load` is not one of"),
            ("depth_mm", "", "--map depth_mm: is not COLUMN="),
            ("depth_mm=-", "", "nothing follows"),
            ("depth_mm=a,normal_force_n=a", "", "depth_mm has this column already"),
            ("", "normal_force_n=stone", "units are N, mN"),
            ("", "normal_force_n=N,normal_force_n=mN", "twice"),
        ] {
            let message = ColumnNames::parse(Some(map), Some(unit), &KNOWN).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
