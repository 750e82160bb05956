//! Units that the columns of a file may have, and the row below a header that names them.
//!
//! Main types: [`Unit`], [`UnitCell`]; main functions: [`units_of`], [`find`], [`check_units_row`].

/// A unit: value in the program's unit = factor * value + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Name, as `--unit` takes it.
    pub name: &'static str,
    /// Quantity that it measures.
    of: Quantity,
    /// Factor.
    pub factor: f64,
    /// Offset, in the program's unit.
    pub offset: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Length,
    Area,
    Force,
    Time,
    Speed,
    Temperature,
    Angle,
    Moisture,
    Ratio,
}

const fn unit(name: &'static str, of: Quantity, factor: f64, offset: f64) -> Unit {
    Unit { name, of, factor, offset }
}

/// Full scale of a corneometer, a.u.
const MOISTURE_SCALE_AU: f64 = 130.0;

/// All units; the first of a quantity is the program's.
const UNITS: [Unit; 36] = [
    unit("mm", Quantity::Length, 1.0, 0.0),
    unit("m", Quantity::Length, 1e3, 0.0),
    unit("cm", Quantity::Length, 10.0, 0.0),
    unit("um", Quantity::Length, 1e-3, 0.0),
    unit("nm", Quantity::Length, 1e-6, 0.0),
    unit("in", Quantity::Length, 25.4, 0.0),
    unit("mm2", Quantity::Area, 1.0, 0.0),
    unit("um2", Quantity::Area, 1e-6, 0.0),
    unit("cm2", Quantity::Area, 100.0, 0.0),
    unit("m2", Quantity::Area, 1e6, 0.0),
    unit("in2", Quantity::Area, 645.16, 0.0),
    unit("N", Quantity::Force, 1.0, 0.0),
    unit("mN", Quantity::Force, 1e-3, 0.0),
    unit("kN", Quantity::Force, 1e3, 0.0),
    unit("gf", Quantity::Force, 9.806_65e-3, 0.0),
    unit("kgf", Quantity::Force, 9.806_65, 0.0),
    unit("lbf", Quantity::Force, 4.448_221_615, 0.0),
    unit("s", Quantity::Time, 1.0, 0.0),
    unit("ms", Quantity::Time, 1e-3, 0.0),
    unit("us", Quantity::Time, 1e-6, 0.0),
    unit("ns", Quantity::Time, 1e-9, 0.0),
    unit("min", Quantity::Time, 60.0, 0.0),
    unit("mm/s", Quantity::Speed, 1.0, 0.0),
    unit("m/s", Quantity::Speed, 1e3, 0.0),
    unit("cm/s", Quantity::Speed, 10.0, 0.0),
    unit("um/s", Quantity::Speed, 1e-3, 0.0),
    unit("C", Quantity::Temperature, 1.0, 0.0),
    unit("K", Quantity::Temperature, 1.0, -273.15),
    unit("F", Quantity::Temperature, 5.0 / 9.0, -160.0 / 9.0),
    unit("deg", Quantity::Angle, 1.0, 0.0),
    unit("rad", Quantity::Angle, 180.0 / std::f64::consts::PI, 0.0),
    unit("au", Quantity::Moisture, 1.0, 0.0),
    unit("fraction", Quantity::Moisture, MOISTURE_SCALE_AU, 0.0),
    unit("%", Quantity::Moisture, MOISTURE_SCALE_AU / 100.0, 0.0),
    unit("1", Quantity::Ratio, 1.0, 0.0),
    unit("%", Quantity::Ratio, 0.01, 0.0),
];

/// Other spellings of units.
const SPELLINGS: [(&str, &str); 18] = [
    ("µm", "um"),
    ("μm", "um"),
    ("µs", "us"),
    ("μs", "us"),
    ("µm/s", "um/s"),
    ("μm/s", "um/s"),
    ("mm²", "mm2"),
    ("mm^2", "mm2"),
    ("cm²", "cm2"),
    ("m²", "m2"),
    ("sec", "s"),
    ("°C", "C"),
    ("degC", "C"),
    ("°F", "F"),
    ("degF", "F"),
    ("°", "deg"),
    ("a.u.", "au"),
    ("a.u", "au"),
];

/// The quantity of a column by the ending of its name; a spread (`..._sd`) has that of its column.
fn quantity(column: &str) -> Option<Quantity> {
    let column = column.strip_suffix("_sd").unwrap_or(column);
    let endings = [
        ("_mm_s", Quantity::Speed),
        ("_mm2", Quantity::Area),
        ("_mm", Quantity::Length),
        ("_n", Quantity::Force),
        ("_s", Quantity::Time),
        ("_c", Quantity::Temperature),
        ("_deg", Quantity::Angle),
        ("_au", Quantity::Moisture),
        ("_coefficient", Quantity::Ratio),
    ];
    endings.iter().find(|(ending, _)| column.ends_with(ending)).map(|(_, quantity)| *quantity)
}

/// Units that a column may have, the program's first; none for a column without a unit.
pub fn units_of(column: &str) -> impl Iterator<Item = &'static Unit> {
    let quantity = quantity(column);
    UNITS.iter().filter(move |u| Some(u.of) == quantity)
}

/// The unit of a column under one of its spellings.
///
/// # Errors
/// The column's units; empty if it has none.
pub fn find(column: &str, name: &str) -> Result<Unit, Vec<&'static str>> {
    let name = SPELLINGS.iter().find(|(other, _)| *other == name).map_or(name, |(_, ours)| ours);
    units_of(column).find(|u| u.name == name).copied().ok_or_else(|| units_of(column).map(|u| u.name).collect())
}

/// A cell of a row that may name units.
pub struct UnitCell<'a> {
    /// The program's name of the column.
    pub column: &'a str,
    /// Its name in `--unit`; empty if the command has no such option.
    pub key: &'a str,
    /// Unit in which the column's values are read; empty if it has none.
    pub unit: &'a str,
    /// The cell.
    pub text: &'a str,
}

impl UnitCell<'_> {
    /// The unit that the cell names, without brackets; `None` without one.
    fn text(&self) -> Option<&str> {
        let bare = self.text.trim().trim_matches(['[', ']', '(', ')', '{', '}']).trim();
        (!matches!(bare, "" | "-" | "–" | "1" | "#" | "none" | "unit" | "units")).then_some(bare)
    }
}

/// Whether the first row below a header names units: none of its cells that ought to be numbers is one.
pub fn is_units_row(cells: &[UnitCell<'_>]) -> bool {
    let is_number = |c: &UnitCell<'_>| c.text.replace(',', ".").parse::<f64>().is_ok();
    cells.iter().any(|c| c.text().is_some()) && !cells.iter().any(is_number)
}

/// Compares a row of units with the units in which the columns are read.
///
/// # Errors
/// Place of the first cell that contradicts, and the defect as the end of a sentence, with the option that helps.
pub fn check_units_row(cells: &[UnitCell<'_>]) -> Result<(), (usize, String)> {
    let mut others: Vec<(usize, String)> = Vec::new();
    for (place, cell) in cells.iter().enumerate() {
        let Some(text) = cell.text() else { continue };
        let known = find(cell.column, text);
        if text == cell.unit || known.as_ref().is_ok_and(|u| u.name == cell.unit) {
            continue;
        }
        match known {
            Ok(unit) => others.push((place, format!("{}={}", cell.key, unit.name))),
            Err(_) if cell.unit.is_empty() => {}
            Err(units) => {
                let list = if units.is_empty() { cell.unit.to_owned() } else { units.join(", ") };
                return Err((place, format!("is neither a number nor a unit of this column ({list})")));
            }
        }
    }
    let Some((place, _)) = others.first() else { return Ok(()) };
    let read = cells[*place].unit;
    let way = if cells[*place].key.is_empty() {
        format!("convert the column to {read}")
    } else {
        let all: Vec<&str> = others.iter().map(|(_, pair)| pair.as_str()).collect();
        format!("add --unit {}", all.join(","))
    };
    Err((*place, format!("is the unit that the row below the header names, and the column is read in {read}: {way}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells<'a>(row: &[(&'a str, &'a str, &'a str, &'a str)]) -> Vec<UnitCell<'a>> {
        row.iter().map(|&(column, key, unit, text)| UnitCell { column, key, unit, text }).collect()
    }

    #[test]
    fn a_row_of_units_is_recognised_and_compared() {
        let ours =
            cells(&[("t_s", "t", "s", "[s]"), ("depth_mm", "depth", "mm", "mm"), ("hydration_au", "h", "au", "")]);
        assert!(is_units_row(&ours) && check_units_row(&ours).is_ok());
        assert!(!is_units_row(&cells(&[("t_s", "t", "s", "x"), ("depth_mm", "depth", "mm", "0,5")])));
        let other = cells(&[("t_s", "t", "s", "ms"), ("depth_mm", "depth", "mm", "µm")]);
        let (place, problem) = check_units_row(&other).unwrap_err();
        assert!(place == 0 && problem.ends_with("add --unit t=ms,depth=um"), "{problem}");
        let unknown = cells(&[("t_s", "t", "s", "fortnight")]);
        assert!(check_units_row(&unknown).unwrap_err().1.contains("s, ms, us, ns, min"));
        // A column of a user's own, whose unit the program cannot convert.
        let own = cells(&[("voltage_v", "voltage_v", "V", "mV")]);
        assert!(check_units_row(&own).unwrap_err().1.contains("(V)"));
    }

    #[test]
    fn a_unit_is_found_by_the_columns_ending_under_every_spelling() {
        let to_ours = |column: &str, name: &str, value: f64| find(column, name).map(|u| u.factor * value + u.offset);
        assert_eq!(to_ours("depth_mm", "µm", 900.0), Ok(900.0 * 1e-3));
        assert_eq!(to_ours("speed_mm_s", "cm/s", 2.0), Ok(20.0));
        assert_eq!(to_ours("hydration_au", "fraction", 0.5), Ok(65.0));
        assert!((to_ours("temperature_c", "°F", 95.0).unwrap() - 35.0).abs() < 1e-9);
        assert_eq!(to_ours("normal_force_n_sd", "mN", 5.0), Ok(5e-3));
        assert_eq!(find("run_id", "mm"), Err(Vec::new()));
    }
}
