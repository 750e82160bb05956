//! Units of columns and parameters, and what a formula makes of them.
//!
//! Main types: [`Unit`] (powers of symbols), `Dimension` (the unit of a part of a formula, or that of a bare number, which may
//! stand for any). Main function: `dimension`. Nothing is converted: mm and m contradict each other.

use std::collections::BTreeMap;

use super::formula::{Formula, Operation, Part, Problem};

/// Powers of symbols; none for a pure number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unit(BTreeMap<String, f64>);

impl Unit {
    /// From a text such as `mm`, `1/s`, `N s/mm` or `V^2`; a percent is a unit of its own.
    ///
    /// # Errors
    /// A sentence on what is not understood.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut out = Self::default();
        for (k, group) in text.split('/').enumerate() {
            for factor in group.split([' ', '*', '·']).filter(|f| !f.is_empty() && *f != "1") {
                let (symbol, power) = match factor.split_once('^') {
                    Some((symbol, power)) => (symbol, power.parse::<f64>().map_err(|_| unknown(text))?),
                    None => match factor.strip_suffix('²') {
                        Some(symbol) => (symbol, 2.0),
                        None => (factor, 1.0),
                    },
                };
                if symbol.is_empty() || !symbol.chars().all(|c| c.is_alphabetic() || "°.%µ".contains(c)) {
                    return Err(unknown(text));
                }
                out.multiply(symbol, if k == 0 { power } else { -power });
            }
        }
        Ok(out)
    }

    fn multiply(&mut self, symbol: &str, power: f64) {
        let sum = self.0.entry(symbol.to_owned()).or_default();
        *sum += power;
        if *sum == 0.0 {
            self.0.remove(symbol);
        }
    }

    fn times(&self, other: &Self, power: f64) -> Self {
        let mut out = self.clone();
        other.0.iter().for_each(|(symbol, p)| out.multiply(symbol, p * power));
        out
    }

    fn is_pure(&self) -> bool {
        self.0.is_empty()
    }
}

fn unknown(text: &str) -> String {
    format!("`{text}` is no unit; write it as mm, 1/s, N s/mm or V^2")
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.is_pure() {
            return f.write_str("a pure number");
        }
        let one = |(symbol, power): (&String, &f64)| match *power {
            1.0 => symbol.clone(),
            power => format!("{symbol}^{power}"),
        };
        f.write_str(&self.0.iter().map(one).collect::<Vec<_>>().join(" "))
    }
}

/// Endings of names that say a unit, longest first.
const ENDINGS: [(&str, &str); 22] = [
    ("_mm_s", "mm/s"),
    ("_m_s", "m/s"),
    ("_percent", "%"),
    ("_deg", "deg"),
    ("_kpa", "kPa"),
    ("_mpa", "MPa"),
    ("_min", "min"),
    ("_mm", "mm"),
    ("_um", "um"),
    ("_mn", "mN"),
    ("_ms", "ms"),
    ("_au", "a.u."),
    ("_kv", "kV"),
    ("_mv", "mV"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_n", "N"),
    ("_s", "s"),
    ("_h", "h"),
    ("_c", "°C"),
    ("_k", "K"),
    ("_v", "V"),
];

/// Refuses a unit that is another one than the ending of a name says; names like `slope_per_c` say nothing.
pub fn check_ending(name: &str, unit: &Unit) -> Result<(), String> {
    let ending = ENDINGS.iter().find(|(ending, _)| name.ends_with(ending) && !name.contains("_per_"));
    let Some((ending, said)) = ending else { return Ok(()) };
    match Unit::parse(said) {
        Ok(said) if said != *unit => Err(format!("`{name}` ends in {ending}, which says {said}; its unit is {unit}")),
        _ => Ok(()),
    }
}

/// The unit of a part of a formula.
#[derive(Clone, Debug, PartialEq)]
enum Dimension {
    /// A unit.
    Of(Unit),
    /// A bare number or what it was multiplied with: the 32 of `temperature_c - 32` is in °C, the 2 of `path_mm / 2` in mm.
    Any,
}

/// Refuses a formula whose units contradict each other or the unit of its result.
///
/// * `units`: those of its variables
pub fn check_formula(formula: &Formula, units: &[Unit], wanted: &Unit) -> Result<(), Problem> {
    match dimension(&formula.part, units)? {
        Dimension::Of(found) if found != *wanted => {
            let text = format!("contradictory units: the formula is {found} and must be {wanted}");
            Err(Problem { character: 1, text })
        }
        _ => Ok(()),
    }
}

fn dimension(part: &Part, units: &[Unit]) -> Result<Dimension, Problem> {
    match part {
        Part::Number(_) => Ok(Dimension::Any),
        Part::Variable(k) => Ok(Dimension::Of(units[*k].clone())),
        Part::Negative(x) => dimension(x, units),
        Part::One(function, at, x) => {
            let of = dimension(x, units)?;
            match (function.name(), of) {
                ("abs", of) => Ok(of),
                ("sqrt", Dimension::Of(unit)) => Ok(Dimension::Of(Unit::default().times(&unit, 0.5))),
                ("sqrt", Dimension::Any) => Ok(Dimension::Any),
                (name, Dimension::Of(unit)) if !unit.is_pure() => Err(Problem {
                    character: *at,
                    text: format!("contradictory units: {name} of {unit}; divide it by a size of the same unit"),
                }),
                _ => Ok(Dimension::Of(Unit::default())),
            }
        }
        Part::Two(operation, at, parts) => of_two(*operation, *at, parts, units),
    }
}

fn of_two(operation: Operation, at: usize, parts: &[Part; 2], units: &[Unit]) -> Result<Dimension, Problem> {
    let (a, b) = (dimension(&parts[0], units)?, dimension(&parts[1], units)?);
    match operation {
        Operation::Multiply | Operation::Divide => {
            let power = if operation == Operation::Multiply { 1.0 } else { -1.0 };
            Ok(match (a, b) {
                (Dimension::Of(a), Dimension::Of(b)) => Dimension::Of(a.times(&b, power)),
                _ => Dimension::Any,
            })
        }
        Operation::Power => {
            if let Dimension::Of(b) = &b
                && !b.is_pure()
            {
                return Err(Problem { character: at, text: format!("contradictory units: an exponent in {b}") });
            }
            Ok(match (a, &parts[1]) {
                (Dimension::Of(a), Part::Number(power)) => Dimension::Of(Unit::default().times(&a, *power)),
                (Dimension::Of(a), _) if a.is_pure() => Dimension::Of(a),
                _ => Dimension::Any,
            })
        }
        _ => match (a, b) {
            (Dimension::Of(a), Dimension::Of(b)) if a != b => {
                Err(Problem { character: at, text: format!("contradictory units: {a} and {b} meet here") })
            }
            (Dimension::Of(of), _) | (_, Dimension::Of(of)) => Ok(Dimension::Of(of)),
            _ => Ok(Dimension::Any),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<(), Problem> {
        let formula = Formula::parse(text).unwrap();
        let unit = |name: &str| match name {
            "path_mm" | "slip_mm" => "mm",
            "tau_s" => "s",
            "voltage_v" => "V",
            "temperature_c" => "°C",
            "slope" => "1/°C",
            _ => "",
        };
        let units: Vec<Unit> = formula.variables.iter().map(|(name, _)| Unit::parse(unit(name)).unwrap()).collect();
        check_formula(&formula, &units, &Unit::default())
    }

    #[test]
    fn units_that_contradict_each_other_are_found_and_bare_numbers_take_any() {
        for text in [
            "a * exp(-path_mm / slip_mm)",
            "slope * (temperature_c - 32)",
            "a * (voltage_v / 100)^2",
            "a * sqrt(path_mm / slip_mm + 1)",
            "a * max(path_mm, 0.1) / slip_mm",
        ] {
            assert_eq!(check(text), Ok(()), "{text}");
        }
        for (text, character) in [
            ("a * exp(-path_mm / tau_s)", 5),
            ("a + path_mm", 3),
            ("a * path_mm", 1),
            ("a * (path_mm - tau_s)", 14),
            ("a ^ path_mm", 3),
            ("a * ln(voltage_v)", 5),
            ("slope * temperature_c + tau_s", 23),
        ] {
            let problem = check(text).unwrap_err();
            assert!(problem.character == character && problem.text.contains("contradictory"), "{text}: {problem:?}");
        }
        assert!(Unit::parse("mm$").is_err() && Unit::parse("s^x").is_err());
        assert_eq!(Unit::parse("N s/mm").unwrap(), Unit::parse("s*N/mm").unwrap());
        assert!(check_ending("slip_mm", &Unit::parse("s").unwrap()).is_err());
        assert!(check_ending("slope_per_c", &Unit::parse("1/°C").unwrap()).is_ok());
    }
}
