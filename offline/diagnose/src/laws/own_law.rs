//! A law of the user's own: a formula with what is known of it, as the library's laws are known.
//!
//! Main types: [`OwnLaw`], [`Target`].

use fingerpad::effects::{Axis, Change, Column, Conditions, Law, Parameter, Place, Reported, VALUES, tables};

use super::drivers::{DRIVERS, OwnColumn, is_motion, is_within_stroke};
use super::formula::{Formula, Problem};
use super::units::Unit;

/// Number of the first law of a file of laws; the numbers of model files end below.
pub const FIRST_KIND: u32 = 1000;

/// What a formula gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target(pub tables::Target);

/// Names of targets in a file of laws.
const TARGETS: [(&str, tables::Target); 6] = [
    ("strength", tables::Target::Strength),
    ("stiffness", tables::Target::Stiffness),
    ("depth", tables::Target::Depth),
    ("reading_normal", tables::Target::ReadingNormal),
    ("reading_x", tables::Target::ReadingX),
    ("reading_y", tables::Target::ReadingY),
];

impl Target {
    /// The target of a name.
    pub fn of(name: &str) -> Option<Self> {
        TARGETS.iter().find(|(known, _)| *known == name).map(|(_, target)| Self(*target))
    }

    /// All names.
    pub fn names() -> String {
        TARGETS.map(|(name, _)| name).join(", ")
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        TARGETS.iter().find(|(_, target)| *target == self.0).map_or("", |(name, _)| name)
    }

    /// Unit of the formula's value.
    pub fn unit(self) -> Unit {
        let text = match self.0 {
            tables::Target::Strength | tables::Target::Stiffness => "",
            tables::Target::Depth => "mm",
            _ => "N",
        };
        Unit::parse(text).unwrap_or_default()
    }

    /// Where it enters the model.
    pub fn place(self) -> Place {
        match self.0 {
            tables::Target::Strength => Place::Strength,
            tables::Target::Stiffness => Place::Stiffness,
            tables::Target::Depth => Place::Depth,
            _ => Place::Reading,
        }
    }

    /// The change of the model by a formula, as the library's laws have it.
    fn changed_by(self, formula: &str) -> String {
        match self.name() {
            name @ ("strength" | "stiffness") => format!("{name} × (1 + {formula})"),
            "depth" => format!("depth += ({formula}) mm"),
            reading => format!("{} += ({formula}) N", reading.replace("reading_", "")),
        }
    }

    /// Lets a value act; one that is not finite, from a driver that is not known, leaves the law out.
    fn act(self, value: f64, change: &mut Change<f64>) {
        if !value.is_finite() {
            return;
        }
        let [normal, x, y] = &mut change.reading_n;
        let [least, most] = self.0.range().map(f64::from);
        let value = value.clamp(least, most);
        match self.0 {
            tables::Target::Strength => change.strengthen(1.0 + value),
            tables::Target::Stiffness => change.stiffen(1.0 + value),
            tables::Target::Depth => change.depth_mm += value,
            tables::Target::ReadingNormal => *normal += value,
            tables::Target::ReadingX => *x += value,
            tables::Target::ReadingY => *y += value,
        }
    }
}

/// What a law of a user's file says.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OwnFormula {
    /// What it acts on: `strength`, `stiffness`, `depth`, `reading_normal`, `reading_x` or `reading_y`.
    pub acts_on: String,
    /// The formula as it was written.
    pub formula: String,
}

/// A parameter of a law of the user's own.
#[derive(Clone, Debug)]
pub struct OwnParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: Unit,
    /// The unit as it was written.
    pub unit_text: String,
    /// Least value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Size to be expected.
    pub typical: f64,
}

/// A driver that a law reads.
#[derive(Clone, Debug)]
pub struct LawDriver {
    /// Name in the formula.
    pub name: String,
    /// Its number, see [`tables::driver`].
    pub number: usize,
    /// Its unit.
    pub unit: String,
    /// The column that it comes from.
    pub column: Column,
    /// Range in which the formula must hold.
    pub range: [f64; 2],
    /// Whether the range is the user's, not the program's guess.
    pub is_declared: bool,
    /// Whether it follows the motion of the plane: speed, direction, paths, and what is computed from what goes on within a stroke.
    pub moves: bool,
}

/// What a variable of a formula is.
#[derive(Clone, Copy, Debug)]
enum Variable {
    Parameter(usize),
    Driver(usize),
}

/// A law of the user's own.
#[derive(Clone, Debug)]
pub struct OwnLaw {
    /// The law as the diagnosis uses it, kept for the life of the program.
    pub law: &'static Law,
    /// What the formula gives.
    pub target: Target,
    /// The formula.
    pub formula: Formula,
    /// The formula as it was written.
    pub text: String,
    /// Its parameters, those in which it is linear first.
    pub parameters: Vec<OwnParameter>,
    /// What it reads.
    pub drivers: Vec<LawDriver>,
    variables: Vec<Variable>,
}

impl OwnLaw {
    /// A law that is not yet described; `place` is its place in the file.
    ///
    /// # Errors
    /// A variable that is nothing known, with its place.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        name: &str,
        text: &str,
        formula: Formula,
        target: Target,
        parameters: Vec<OwnParameter>,
        columns: &[OwnColumn],
        ranges: &[(String, [f64; 2])],
        place: usize,
    ) -> Result<Self, Problem> {
        let mut drivers: Vec<LawDriver> = Vec::new();
        let mut variables = Vec::new();
        for (variable, character) in &formula.variables {
            if let Some(k) = parameters.iter().position(|p| p.name == *variable) {
                variables.push(Variable::Parameter(k));
                continue;
            }
            let driver = driver_of(variable, columns, ranges).ok_or_else(|| Problem {
                character: *character,
                text: format!(
                    "`{variable}` is no parameter of the law, no column that [[column]] declares, and none of {}",
                    DRIVERS.map(|d| d.name).join(", ")
                ),
            })?;
            variables.push(Variable::Driver(drivers.len()));
            drivers.push(driver);
        }
        if let Some(idle) = parameters.iter().find(|p| formula.variables.iter().all(|(name, _)| *name != p.name)) {
            return Err(Problem { character: 1, text: format!("the parameter `{}` is not in it", idle.name) });
        }
        let blank: &'static Law = Box::leak(Box::new(Law {
            name: name.to_owned().leak(),
            family: "",
            formula: "",
            kind: FIRST_KIND + place as u32,
            place: target.place(),
            parameters: &[],
            linear: 0,
            reported: Reported::AsFitted,
            drivers: &[],
            axes: &[],
            confused_with: &[],
            source: "",
            shapes: &[],
            act: &|_, _, _| (),
        }));
        Ok(Self { law: blank, target, formula, text: text.to_owned(), parameters, drivers, variables })
    }

    /// Units of the formula's variables.
    pub fn units(&self) -> Vec<Unit> {
        let unit = |variable: &Variable| match variable {
            Variable::Parameter(k) => self.parameters[*k].unit.clone(),
            Variable::Driver(k) => Unit::parse(&self.drivers[*k].unit).unwrap_or_default(),
        };
        self.variables.iter().map(unit).collect()
    }

    /// Values of the formula's variables.
    fn values(&self, parameters: &[f64], driver: impl Fn(usize) -> f64) -> Vec<f64> {
        let value = |variable: &Variable| match variable {
            Variable::Parameter(k) => parameters[*k],
            Variable::Driver(k) => driver(*k),
        };
        self.variables.iter().map(value).collect()
    }

    /// The formula's value where its drivers have these values, in the order of [`OwnLaw::drivers`].
    ///
    /// # Errors
    /// The first part that is not finite.
    pub fn checked_value(&self, parameters: &[f64], drivers: &[f64]) -> Result<f64, Problem> {
        self.formula.value(&self.values(parameters, |k| drivers[k]))
    }

    /// The same, whether finite or not.
    pub fn value(&self, parameters: &[f64], drivers: &[f64]) -> f64 {
        self.formula.plain_value(&self.values(parameters, |k| drivers[k]))
    }

    /// Lets the law act.
    fn act(&self, parameters: &[f64; VALUES], at: &Conditions<f64>, change: &mut Change<f64>) {
        let driver = |k: usize| tables::driver(self.drivers[k].number, at).unwrap_or(f64::NAN);
        self.target.act(self.formula.plain_value(&self.values(parameters, driver)), change);
    }

    /// The law with all the fields that the diagnosis needs.
    ///
    /// * `linear`: how many of the first parameters it is linear in
    pub fn described<'a>(
        mut self,
        linear: usize,
        family: &str,
        confused_with: impl Iterator<Item = &'a str>,
        source: &str,
    ) -> Self {
        let parameters: Vec<Parameter> = self
            .parameters
            .iter()
            .enumerate()
            .map(|(k, p)| Parameter {
                name: p.name.clone().leak(),
                unit: p.unit_text.clone().leak(),
                low: p.low,
                high: p.high,
                typical: p.typical,
                positive: k >= linear && p.low > 0.0,
            })
            .collect();
        let mut drivers: Vec<Column> = Vec::new();
        let mut axes: Vec<Axis> = Vec::new();
        for driver in &self.drivers {
            if !drivers.contains(&driver.column) {
                drivers.push(driver.column);
            }
            axes.extend(DRIVERS.get(driver.number).and_then(|d| d.axis).filter(|axis| !axes.contains(axis)));
        }
        let shapes: Vec<&'static [f64]> = shapes(&parameters[linear..]).into_iter().map(|s| &*s.leak()).collect();
        let confused_with: Vec<&'static str> = confused_with.map(|name| &*name.to_owned().leak()).collect();
        let acting = self.clone();
        self.law = Box::leak(Box::new(Law {
            name: self.law.name,
            family: family.to_owned().leak(),
            formula: self.target.changed_by(&self.text).leak(),
            kind: self.law.kind,
            place: self.target.place(),
            parameters: parameters.leak(),
            linear,
            reported: Reported::AsFitted,
            drivers: drivers.leak(),
            axes: axes.leak(),
            confused_with: confused_with.leak(),
            source: source.to_owned().leak(),
            shapes: shapes.leak(),
            act: Box::leak(Box::new(move |values: &[f64; VALUES], at: &Conditions<f64>, change: &mut Change<f64>| {
                acting.act(values, at, change);
            })),
        }));
        self
    }
}

fn driver_of(name: &str, columns: &[OwnColumn], ranges: &[(String, [f64; 2])]) -> Option<LawDriver> {
    let declared = ranges.iter().find(|(known, _)| known == name).map(|(_, range)| *range);
    if let Some((number, driver)) = DRIVERS.iter().enumerate().find(|(_, d)| d.name == name) {
        return Some(LawDriver {
            name: name.to_owned(),
            number,
            unit: driver.unit.to_owned(),
            column: driver.column,
            range: declared.unwrap_or(driver.range),
            is_declared: declared.is_some(),
            moves: is_motion(number),
        });
    }
    let (place, column) = columns.iter().enumerate().find(|(_, c)| c.name == name)?;
    Some(LawDriver {
        name: name.to_owned(),
        number: tables::FIRST_OWN + place,
        unit: column.unit.clone(),
        column: column.column(place),
        range: column.range,
        is_declared: true,
        moves: column.derived.is_some_and(|derived| is_within_stroke(derived.source)),
    })
}

/// Starting values of the shape parameters: the middle of each range and places on either side, by ratio where the range is
/// positive; fewer of each the more there are.
fn shapes(parameters: &[Parameter]) -> Vec<Vec<f64>> {
    let each = match parameters.len() {
        0 => 0,
        1 => 7,
        2 => 4,
        3 => 3,
        _ => 2,
    };
    let mut out = vec![Vec::new()];
    for p in parameters {
        let at = |k: usize| {
            let share = (k as f64 + 0.5) / each as f64;
            if p.positive { p.low * (p.high / p.low).powf(share) } else { p.low + share * (p.high - p.low) }
        };
        out = (0..each)
            .flat_map(|k| {
                out.iter().map(move |shape: &Vec<f64>| {
                    let mut shape = shape.clone();
                    shape.push(at(k));
                    shape
                })
            })
            .collect();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_its_unit() {
        for (name, unit) in
            [("strength", ""), ("stiffness", ""), ("depth", "mm"), ("reading_normal", "N"), ("reading_y", "N")]
        {
            assert_eq!(Some(Target::of(name).unwrap().unit()), Unit::parse(unit).ok(), "{name}");
        }
    }
}
