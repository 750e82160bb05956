//! The file of a user's laws, TOML: read and checked, every refusal with its line.
//!
//! Main type: [`LawsFile`]; main function: [`LawsFile::read`]. `docs/laws-of-your-own.md` describes the file.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use sha2::{Digest, Sha256};
use toml::Spanned;

use super::drivers::{DRIVERS, Derived, OwnColumn, Rule};
use super::formula::Formula;
use super::own_law::{OwnFormula, OwnLaw, OwnParameter, Target};
use super::run_columns::run_columns;
use super::soundness::check_law;
use super::units::{Unit, check_ending, check_formula};
use crate::error::DiagnoseError;
use fingerpad::build::TableColumn;
use fingerpad::effects::{Column, LAWS, Law, OWN, VALUES, tables};

/// Most laws of a file.
const MOST_LAWS: usize = 16;
/// Longest time in which a column settles, s.
const MOST_SETTLE_S: f64 = 86_400.0;
/// Longest delay of a column, s.
const MOST_DELAY_S: f64 = 60.0;
/// Largest file, bytes.
const LARGEST: u64 = 1 << 20;

/// The laws of a file, checked.
#[derive(Clone, Debug, Default)]
pub struct LawsFile {
    /// The file.
    pub path: PathBuf,
    /// SHA-256 of it.
    pub sha256: String,
    /// Columns of the user's own.
    pub columns: Vec<OwnColumn>,
    /// The laws.
    pub laws: Vec<OwnLaw>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileText {
    #[serde(default)]
    column: Vec<Spanned<ColumnText>>,
    #[serde(default)]
    law: Vec<Spanned<LawText>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ColumnText {
    name: String,
    unit: Option<Spanned<String>>,
    range: [f64; 2],
    reference: Option<Spanned<f64>>,
    settle_s: Option<f64>,
    rate_of: Option<String>,
    delayed: Option<String>,
    delay_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LawText {
    name: String,
    acts_on: Spanned<String>,
    formula: Spanned<String>,
    family: Option<String>,
    #[serde(default)]
    confused_with: Vec<Spanned<String>>,
    #[serde(default)]
    source: String,
    parameter: Vec<Spanned<ParameterText>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterText {
    name: String,
    unit: String,
    range: [f64; 2],
    typical: f64,
}

/// Line of the text, and a refusal that names it.
struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Reader<'_> {
    fn refuse(&self, span: Range<usize>, problem: &str) -> DiagnoseError {
        let line = 1 + self.text.get(..span.start).map_or(0, |before| before.matches('\n').count());
        DiagnoseError::Unusable { path: self.path.to_path_buf(), problem: format!("line {line}: {problem}") }
    }
}

impl LawsFile {
    /// Reads and checks a file of laws.
    ///
    /// # Errors
    /// [`DiagnoseError::Unusable`] with the line, and for a formula its character.
    pub fn read(path: &Path) -> Result<Self, DiagnoseError> {
        let refuse = |problem: String| DiagnoseError::Unusable { path: path.to_path_buf(), problem };
        let length = std::fs::metadata(path).map_err(|e| refuse(e.to_string()))?.len();
        if length > LARGEST {
            return Err(refuse(format!("{length} bytes are no file of laws; at most {LARGEST} are read")));
        }
        let bytes = std::fs::read(path).map_err(|e| refuse(e.to_string()))?;
        let text = std::str::from_utf8(&bytes).map_err(|e| {
            let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
            refuse(format!("line {line}: this is no text in UTF-8"))
        })?;
        Self::parse(path, text)
    }

    /// The same of a text; `path` names it in errors.
    ///
    /// # Errors
    /// Those of [`LawsFile::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, DiagnoseError> {
        let reader = Reader { path, text };
        let parsed: FileText = toml::from_str(text)
            .map_err(|e| reader.refuse(e.span().unwrap_or(0..0), &e.message().replace('\n', ", ")))?;
        let mut ranges: Vec<(String, [f64; 2])> = Vec::new();
        let mut columns: Vec<OwnColumn> = Vec::new();
        for column in &parsed.column {
            reader.column(column, &mut ranges, &mut columns)?;
        }
        let mut laws: Vec<OwnLaw> = Vec::new();
        for law in &parsed.law {
            let own = reader.law(law, &columns, &ranges, laws.len())?;
            if laws.iter().any(|l| l.law.name == own.law.name) {
                return Err(reader.refuse(law.span(), &format!("there is a law `{}` already", own.law.name)));
            }
            laws.push(own);
        }
        if laws.is_empty() || laws.len() > MOST_LAWS {
            let problem = format!("{} laws ([[law]]); 1 to {MOST_LAWS} are read", laws.len());
            return Err(reader.refuse(0..0, &problem));
        }
        for name in parsed.law.iter().flat_map(|law| &law.get_ref().confused_with) {
            let is_known = |law: &&Law| law.name == name.get_ref().as_str();
            if !LAWS.iter().copied().chain(laws.iter().map(|l| l.law)).any(|law| is_known(&law)) {
                let problem = format!("confused_with: there is no law `{}`", name.get_ref());
                return Err(reader.refuse(name.span(), &problem));
            }
        }
        let sha256 = Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
        Ok(Self { path: path.to_path_buf(), sha256, columns, laws })
    }

    /// The columns of the user's own as laws know them.
    pub fn own_columns(&self) -> Vec<Column> {
        self.columns.iter().enumerate().map(|(place, column)| column.column(place)).collect()
    }

    /// The library and these laws, kept for the life of the program.
    pub fn with_library(&self) -> &'static [&'static Law] {
        LAWS.iter().copied().chain(self.laws.iter().map(|l| l.law)).collect::<Vec<_>>().leak()
    }

    /// What the law of a name says; `None` for one that is not in this file.
    pub fn formula_of(&self, name: &str) -> Option<OwnFormula> {
        let own = self.laws.iter().find(|own| own.law.name == name)?;
        Some(OwnFormula { acts_on: own.target.name().to_owned(), formula: own.text.clone() })
    }

    /// The law of this file with the number of a law.
    pub fn find(&self, law: &Law) -> Option<&OwnLaw> {
        self.laws.iter().find(|own| own.law == law)
    }
}

impl ColumnText {
    fn derives(&self) -> bool {
        self.rate_of.is_some() || self.delayed.is_some() || self.delay_s.is_some()
    }
}

/// How a column is computed, if it is.
///
/// * `unit`: its unit
/// * `columns`: those before it
fn derived(text: &ColumnText, unit: &Unit, columns: &[OwnColumn]) -> Result<Option<Derived>, String> {
    let (source, rule) = match (&text.rate_of, &text.delayed, text.delay_s) {
        (None, None, None) => return Ok(None),
        (Some(source), None, None) => (source, Rule::Rate),
        (None, Some(source), Some(delay_s)) if delay_s > 0.0 && delay_s <= MOST_DELAY_S => {
            (source, Rule::Delayed(delay_s))
        }
        (None, Some(_), Some(delay_s)) => {
            return Err(format!("delay_s {delay_s}: a time above 0 and up to {MOST_DELAY_S} s"));
        }
        _ => return Err("it takes either rate_of, or delayed and delay_s".into()),
    };
    if text.settle_s.is_some() {
        return Err("it is computed, and cannot be set: settle_s belongs to what it is computed from".into());
    }
    let of_driver = DRIVERS.iter().position(|d| d.name == source).map(|number| (number, DRIVERS[number].unit));
    let of_column = || {
        let place = columns.iter().position(|c| c.name == *source && c.derived.is_none())?;
        Some((tables::FIRST_OWN + place, columns[place].unit.as_str()))
    };
    let (source, of_source) = of_driver.or_else(of_column).ok_or_else(|| {
        format!("`{source}` is neither a driver nor a column of the runs that is declared before this one")
    })?;
    let expected = match rule {
        Rule::Rate => Unit::parse(&format!("{of_source}/s"))?,
        Rule::Delayed(_) => Unit::parse(of_source)?,
    };
    if *unit != expected {
        return Err(format!("contradictory units: it is {expected}, not {unit}"));
    }
    Ok(Some(Derived { source, rule }))
}

/// A name of lower-case letters, digits and underscores that begins with a letter.
fn is_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

fn is_range([low, high]: [f64; 2]) -> bool {
    low < high && low.abs() < 1e9 && high.abs() < 1e9
}

impl Reader<'_> {
    fn column(
        &self,
        column: &Spanned<ColumnText>,
        ranges: &mut Vec<(String, [f64; 2])>,
        columns: &mut Vec<OwnColumn>,
    ) -> Result<(), DiagnoseError> {
        let ColumnText { name, unit, range, reference, settle_s, .. } = column.get_ref();
        let refuse = |problem: String| self.refuse(column.span(), &format!("column `{name}`: {problem}"));
        if ranges.iter().any(|(known, _)| known == name) {
            return Err(refuse("it is declared twice".into()));
        }
        if !is_range(*range) {
            return Err(refuse(format!("range {range:?}: two numbers, the lesser first, within a milliard")));
        }
        let driver = DRIVERS.iter().find(|d| d.name == name);
        let said = unit.as_ref().map_or(driver.map_or("", |d| d.unit), |u| u.get_ref());
        let parsed = Unit::parse(said).and_then(|unit| check_ending(name, &unit).map(|()| unit)).map_err(&refuse)?;
        ranges.push((name.clone(), *range));
        if let Some(driver) = driver {
            if let Ok(ours) = Unit::parse(driver.unit)
                && ours != parsed
            {
                return Err(refuse(format!("contradictory units: it is {ours}, not {parsed}")));
            }
            if column.get_ref().derives() {
                return Err(refuse("it is a driver, which the program takes from the runs".into()));
            }
            if reference.is_some() || settle_s.is_some() {
                return Err(refuse(
                    "its reference and its price are part of the program; only its range can be given".into(),
                ));
            }
            return Ok(());
        }
        let [low, high] = *range;
        let reference = reference.as_ref().map_or(low.max(0.0).min(high), |r| *r.get_ref());
        if !(reference >= low && reference <= high) {
            return Err(refuse(format!("reference {reference} is outside its range {low} to {high}")));
        }
        if run_columns().iter().any(|known| known.name == name) {
            return Err(refuse(
                "it is one of the program's own columns, which formulas read by the drivers' names".into(),
            ));
        }
        if !is_name(&name.to_lowercase()) {
            return Err(refuse("a name has letters, digits and underscores".into()));
        }
        let settle_s = settle_s.unwrap_or(0.0);
        if !(0.0..=MOST_SETTLE_S).contains(&settle_s) {
            return Err(refuse(format!("settle_s {settle_s}: a time from 0 to {MOST_SETTLE_S} s")));
        }
        if columns.len() == OWN {
            return Err(refuse(format!("a model file has room for {OWN} columns of your own, and this is one more")));
        }
        let derived = derived(column.get_ref(), &parsed, columns).map_err(&refuse)?;
        let own = OwnColumn { name: name.clone(), unit: said.to_owned(), range: *range, reference, settle_s, derived };
        own.in_model_file().map_err(|_| {
            let (most, unit) = (TableColumn::NAME_BYTES, TableColumn::UNIT_BYTES);
            refuse(format!("a model file has {most} bytes for its name and {unit} for its unit `{said}`"))
        })?;
        columns.push(own);
        Ok(())
    }

    fn law(
        &self,
        law: &Spanned<LawText>,
        columns: &[OwnColumn],
        ranges: &[(String, [f64; 2])],
        place: usize,
    ) -> Result<OwnLaw, DiagnoseError> {
        let span = law.span();
        let law = law.get_ref();
        let refuse = |span: Range<usize>, problem: String| self.refuse(span, &format!("law `{}`: {problem}", law.name));
        if !is_name(&law.name) || LAWS.iter().any(|known| known.name == law.name) {
            let problem = "a name has lower-case letters, digits and underscores, and is none of the library's";
            return Err(refuse(span, problem.into()));
        }
        let target = Target::of(law.acts_on.get_ref()).ok_or_else(|| {
            refuse(law.acts_on.span(), format!("acts_on `{}` is none of {}", law.acts_on.get_ref(), Target::names()))
        })?;
        let parameters = self.parameters(law, columns)?;
        if parameters.is_empty() || parameters.len() > VALUES {
            return Err(refuse(span, format!("{} parameters; 1 to {VALUES} are fitted", parameters.len())));
        }
        let of_formula = |problem: super::formula::Problem| {
            let text = format!("formula, character {}: {}", problem.character, problem.text);
            refuse(law.formula.span(), text)
        };
        let formula = Formula::parse(law.formula.get_ref()).map_err(of_formula)?;
        let own =
            OwnLaw::new(law.name.as_str(), law.formula.get_ref(), formula, target, parameters, columns, ranges, place)
                .map_err(of_formula)?;
        check_formula(&own.formula, &own.units(), &target.unit()).map_err(of_formula)?;
        let linear = check_law(&own).map_err(of_formula)?;
        let confused_with = law.confused_with.iter().map(|name| name.get_ref().as_str());
        let family = law.family.as_deref().unwrap_or(&law.name);
        Ok(own.described(linear, family, confused_with, &law.source))
    }

    fn parameters(&self, law: &LawText, columns: &[OwnColumn]) -> Result<Vec<OwnParameter>, DiagnoseError> {
        let mut out: Vec<OwnParameter> = Vec::new();
        for parameter in &law.parameter {
            let ParameterText { name, unit, range, typical } = parameter.get_ref();
            let refuse = |problem: String| {
                self.refuse(parameter.span(), &format!("law `{}`: parameter `{name}`: {problem}", law.name))
            };
            let is_driver = DRIVERS.iter().any(|d| d.name == name) || columns.iter().any(|c| c.name == *name);
            if is_driver || out.iter().any(|p| p.name == *name) {
                return Err(refuse("the name is taken".into()));
            }
            if !is_name(name) {
                return Err(refuse("a name has lower-case letters, digits and underscores".into()));
            }
            let [low, high] = *range;
            if !is_range(*range) || high.abs().max(low.abs()) > 1e6 {
                return Err(refuse(format!("range {range:?}: two numbers, the lesser first, within a million")));
            }
            if !(*typical >= low && *typical <= high && *typical != 0.0) {
                return Err(refuse(format!("typical {typical} is not in its range {low} to {high}, or is 0")));
            }
            let parsed = Unit::parse(unit).map_err(&refuse)?;
            check_ending(name, &parsed).map_err(|problem| refuse(format!("contradictory units: {problem}")))?;
            let [name, text] = [name, unit].map(String::clone);
            out.push(OwnParameter { name, unit: parsed, unit_text: text, low, high, typical: *typical });
        }
        Ok(out)
    }
}
