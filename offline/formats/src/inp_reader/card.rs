//! Keyword lines, data lines and their numbers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Error;

/// The highest number of a node or an element, so that sums of numbers are numbers.
const MOST_LABEL: u64 = 1_000_000_000_000_000;

/// Position in the file.
#[derive(Clone, Debug, Default)]
pub(super) struct Place {
    pub(super) path: PathBuf,
    pub(super) line: usize,
}

impl Place {
    pub(super) fn fail(&self, field: &str, value: impl Into<String>, problem: impl Into<String>) -> Error {
        Error::Field {
            path: self.path.clone(),
            line: self.line,
            field: field.into(),
            value: value.into(),
            problem: problem.into(),
        }
    }
}

/// A keyword with its parameters, and its data lines joined.
pub(super) struct Card {
    pub(super) keyword: String,
    pub(super) parameters: BTreeMap<String, String>,
    pub(super) place: Place,
}

impl Card {
    pub(super) fn parse(text: &str, place: Place) -> Self {
        let mut parts = text.trim_start_matches('*').split(',').map(str::trim);
        let keyword = parts.next().unwrap_or("").to_uppercase();
        let pair = |part: &str| {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            (key.trim().to_uppercase(), value.trim().trim_matches('"').to_owned())
        };
        Self { keyword, parameters: parts.filter(|p| !p.is_empty()).map(pair).collect(), place }
    }

    pub(super) fn get(&self, key: &str) -> Option<&str> {
        self.parameters.get(key).map(String::as_str)
    }

    pub(super) fn need(&self, key: &str) -> Result<&str, Error> {
        let found = self.get(key).filter(|v| !v.is_empty());
        found.ok_or_else(|| self.place.fail(&format!("*{}", self.keyword), key, "is missing"))
    }

    /// A file that the card names, beside its own.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        self.place.path.parent().unwrap_or(Path::new("")).join(name)
    }

    /// Data lines in the file that `INPUT=` names.
    pub(super) fn data_of_input(&self) -> Result<Vec<(String, Place)>, Error> {
        let path = self.beside(self.need("INPUT")?);
        let bytes = std::fs::read(&path).map_err(|source| Error::File { path: path.clone(), source })?;
        let text = String::from_utf8_lossy(&bytes);
        let mut data = Vec::new();
        for (index, line) in text.strip_prefix('\u{feff}').unwrap_or(&text).lines().enumerate() {
            let place = Place { path: path.clone(), line: index + 1 };
            let line = line.trim();
            if line.is_empty() || line.starts_with("**") {
                continue;
            }
            if line.starts_with('*') {
                let problem = "is a keyword in a file of data lines: read such a file with *INCLUDE";
                return Err(place.fail(&format!("*{}", self.keyword), line, problem));
            }
            data.push((line.to_owned(), place));
        }
        Ok(data)
    }
}

/// The cells of a data line, without quotes.
pub(super) fn cells(line: &str) -> Vec<String> {
    line.split(',').map(|c| c.trim().replace('"', "")).collect()
}

/// A number of a node or an element.
pub(super) fn whole(cells: &[String], at: usize, keyword: &str, place: &Place) -> Result<u64, Error> {
    let cell = cells.get(at).map_or("", String::as_str);
    let number = cell.parse::<u64>().ok().filter(|n| (1..=MOST_LABEL).contains(n));
    number.ok_or_else(|| place.fail(keyword, cell, format!("is not a number from 1 (column {})", at + 1)))
}

/// A finite number; the exponent may be written with a D.
pub(super) fn real(cells: &[String], at: usize, keyword: &str, place: &Place) -> Result<f64, Error> {
    let cell = cells.get(at).map_or("", String::as_str);
    let number = cell.replace(['d', 'D'], "e").parse::<f64>().ok().filter(|v| v.is_finite());
    number.ok_or_else(|| place.fail(keyword, cell, format!("is not a finite number (column {})", at + 1)))
}
