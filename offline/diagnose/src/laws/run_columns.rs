//! The columns of measured runs: their one list, with what readers, laws, statistics, plans and pages know of each.
//!
//! A new column is a row here, a variant of [`Column`] with its value in the core's conditions, and its place in the reader's row.

use super::{Column, Row};

/// A column of measured runs.
#[derive(Clone, Copy, Debug)]
pub struct RunColumn {
    /// Its name.
    pub name: &'static str,
    /// The short name of `--map` and `--unit`.
    pub short: &'static str,
    /// Names under which loggers write it, in lower case without units.
    pub usual: &'static [&'static str],
    /// Whether it holds text.
    pub is_text: bool,
    /// What pages call it.
    pub words: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The column as laws read it, with its value in a row.
    pub law: Option<(Column, fn(&Row) -> f64)>,
    /// Sets a state that a run may record: it is read with an error, and is absent where a row lacks it.
    pub set: Option<fn(&mut Row, f64)>,
    /// Least standard deviation over runs with which a law that it drives can be tested.
    pub least_spread: f64,
    /// A condition that a laboratory sets: whether it is compared by its logarithm, and the least standard deviation over runs that
    /// is more than scatter of one setting.
    pub condition: Option<(bool, f64)>,
}

const fn number(name: &'static str, short: &'static str, usual: &'static [&'static str]) -> RunColumn {
    RunColumn {
        name,
        short,
        usual,
        is_text: false,
        words: short,
        unit: "",
        law: None,
        set: None,
        least_spread: 0.0,
        condition: None,
    }
}

const fn text(name: &'static str, short: &'static str, usual: &'static [&'static str]) -> RunColumn {
    RunColumn { is_text: true, ..number(name, short, usual) }
}

impl RunColumn {
    const fn law(self, column: Column, value: fn(&Row) -> f64, words: &'static str, unit: &'static str) -> Self {
        Self { law: Some((column, value)), words, unit, ..self }
    }

    const fn state(self, set: fn(&mut Row, f64), least_spread: f64) -> Self {
        Self { set: Some(set), least_spread, ..self }
    }

    const fn condition(self, by_logarithm: bool, scatter: f64) -> Self {
        Self { condition: Some((by_logarithm, scatter)), ..self }
    }
}

fn direction_deg(row: &Row) -> f64 {
    row.along[1].atan2(row.along[0]).to_degrees()
}

/// The columns of a file, the eight that must be there first; then the path of the plate, which laws read and no file has.
static COLUMNS: [RunColumn; 20] = [
    text("run_id", "run", &["run", "trial", "stroke", "test_no", "versuch", "lauf"]),
    number("t_s", "t", &["t", "time", "zeit", "timestamp", "x_value"]).law(Column::Time, |r| r.t_s, "clock", "s"),
    number("depth_mm", "depth", &["depth", "z", "indentation", "eindringtiefe", "tiefe"]).law(
        Column::Depth,
        |r| r.depth_mm,
        "depth",
        "mm",
    ),
    number("slide_x_mm", "slide_x", &["slide", "slide_x", "x", "pos", "position", "displacement", "weg"]),
    number("slide_y_mm", "slide_y", &["slide_y", "y"]),
    number("normal_force_n", "normal", &["fn", "fz", "normal", "normal_force", "normalkraft", "load", "last"]),
    number(
        "friction_x_n",
        "x",
        &["fx", "ft", "friction", "friction_force", "tangential_force", "reibkraft", "reibungskraft"],
    ),
    number("friction_y_n", "y", &["fy"]),
    number("contact_time_s", "contact_time", &[]).law(Column::ContactTime, |r| r.contact_time_s, "contact time", "s"),
    number("speed_mm_s", "speed", &[]).law(Column::Speed, |r| r.speed_mm_s, "speed", "mm/s").condition(true, 0.3),
    number("direction_deg", "direction", &[]).law(Column::Direction, direction_deg, "direction", "degree"),
    number("dwell_s", "dwell", &[])
        .law(Column::Dwell, |r| r.dwell_s, "hold", "s")
        .state(|r, v| r.dwell_s = v, 0.0)
        .condition(true, 0.3),
    number("occlusion_time_s", "occlusion_time", &[])
        .law(Column::Occlusion, |r| r.occlusion_s, "occlusion time", "s")
        .state(|r, v| r.occlusion_s = v, 0.2),
    number("hydration_au", "hydration", &["hydration", "moisture", "feuchte"])
        .law(Column::Hydration, |r| r.hydration_au, "hydration", "a.u.")
        .state(|r, v| r.hydration_au = v, 1.0)
        .condition(false, 5.0),
    number("temperature_c", "temperature", &["temperature", "temp", "temperatur"])
        .law(Column::Temperature, |r| r.temperature_c, "temperature", "°C")
        .state(|r, v| r.temperature_c = v, 0.1)
        .condition(false, 1.0),
    number("finger_width_mm", "finger_width", &[])
        .law(Column::Width, |r| r.width_mm, "finger width", "mm")
        .state(|r, v| r.width_mm = v, 0.1)
        .condition(false, 0.6),
    text("condition_id", "condition", &[]),
    text("block_id", "block", &[]),
    text("subject_id", "subject", &[]),
    number("slide", "slide", &[]).law(Column::Slide, |r| r.path_mm, "slide", "mm"),
];

/// The columns of a file; the first eight must be there.
pub fn run_columns() -> &'static [RunColumn] {
    &COLUMNS[..COLUMNS.len() - 1]
}

/// The columns that laws read, in the order of the list, the path last.
pub fn law_columns() -> impl Iterator<Item = (Column, &'static RunColumn)> {
    COLUMNS.iter().filter_map(|known| Some((known.law?.0, known)))
}

/// What is known of a column that laws read; nothing of one of the user's own.
pub fn of(column: Column) -> Option<&'static RunColumn> {
    law_columns().find(|(c, _)| *c == column).map(|(_, known)| known)
}

/// State columns that a run may record.
pub fn states() -> impl Iterator<Item = (Column, fn(&mut Row, f64))> {
    law_columns().filter_map(|(column, known)| Some((column, known.set?)))
}

/// Columns of which a run has one value, whether set or met: the clock, the conditions, the states.
pub fn of_runs() -> impl Iterator<Item = Column> {
    law_columns()
        .filter(|(column, known)| *column == Column::Time || known.condition.is_some() || known.set.is_some())
        .map(|(column, _)| column)
}

/// Value of a column in a row.
pub fn value(column: Column, row: &Row) -> f64 {
    match column {
        Column::Own { place, .. } => row.own.get(usize::from(place)).copied().unwrap_or(f64::NAN),
        _ => of(column).and_then(|known| known.law).map_or(f64::NAN, |(_, value)| value(row)),
    }
}

/// Columns that must be there.
pub const REQUIRED: [&str; 8] = names(0);
/// Columns that may be there.
pub const OPTIONAL: [&str; COLUMNS.len() - 1 - REQUIRED.len()] = names(REQUIRED.len());

const fn names<const N: usize>(from: usize) -> [&'static str; N] {
    let mut out = [""; N];
    let mut k = 0;
    while k < N {
        out[k] = COLUMNS[from + k].name;
        k += 1;
    }
    out
}

/// Two rows of a run with all columns.
const EXAMPLE: &str = "\
stroke1,0.00,-0.20,0,0,0.001,-0.002,0.000,-0.20,2,0,1.0,0,35.2,32.1,16.0,reference,block1,subject1
stroke1,0.35,0.30,0,0,0.062,0.001,0.000,0.15,2,0,1.0,0.15,35.2,32.1,16.0,reference,block1,subject1
";

/// A file with all columns and the first two rows of a run.
pub fn template() -> String {
    [&REQUIRED[..], &OPTIONAL].concat().join(",") + "\n" + EXAMPLE
}
