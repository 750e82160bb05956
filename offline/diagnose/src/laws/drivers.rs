//! What a formula may read besides its parameters: state of contact and skin, and columns of the user's own.
//!
//! Main types: [`Driver`] (one that every file has or may have), [`OwnColumn`] (one that a file of laws declares), [`Derived`] (how
//! the program computes one from another).

use fingerpad::build::TableColumn;
use fingerpad::effects::{Axis, Column, OWN, tables};

/// A driver of the program.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// Name in formulas.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// The column that it comes from.
    pub column: Column,
    /// Range in which a formula must hold, unless the file of laws says another one.
    pub range: [f64; 2],
    /// Axis of a protocol along which it varies, where it is one.
    pub axis: Option<Axis>,
}

const fn driver(name: &'static str, unit: &'static str, column: Column, range: [f64; 2], axis: Option<Axis>) -> Driver {
    Driver { name, unit, column, range, axis }
}

/// The drivers in the order of [`tables::driver`].
pub const DRIVERS: [Driver; tables::FIRST_OWN] = [
    driver("t_s", "s", Column::Time, [0.0, 7200.0], None),
    driver("depth_mm", "mm", Column::Depth, [0.01, 2.0], Some(Axis::Depth)),
    driver("contact_time_s", "s", Column::ContactTime, [0.0, 120.0], Some(Axis::Stroke)),
    driver("speed_mm_s", "mm/s", Column::Speed, [0.0, 50.0], Some(Axis::Speed)),
    driver("direction_x", "", Column::Direction, [-1.0, 1.0], Some(Axis::Direction)),
    driver("direction_y", "", Column::Direction, [-1.0, 1.0], Some(Axis::Direction)),
    driver("path_mm", "mm", Column::Slide, [0.0, 50.0], Some(Axis::Stroke)),
    driver("turn_mm", "mm", Column::Slide, [0.0, 50.0], Some(Axis::Stroke)),
    driver("dwell_s", "s", Column::Dwell, [0.0, 60.0], Some(Axis::Hold)),
    driver("occlusion_time_s", "s", Column::Occlusion, [0.0, 600.0], Some(Axis::Hold)),
    driver("hydration_au", "a.u.", Column::Hydration, [10.0, 100.0], None),
    driver("temperature_c", "°C", Column::Temperature, [20.0, 40.0], None),
    driver("finger_width_mm", "mm", Column::Width, [10.0, 25.0], None),
];

/// Drivers that go on within a stroke, of which a run has no one value.
pub fn is_within_stroke(number: usize) -> bool {
    (1..8).contains(&number)
}

/// Drivers of the motion in the plane: speed, direction, paths.
pub fn is_motion(number: usize) -> bool {
    (3..8).contains(&number)
}

/// Clocks of the contact, which run on while it is pressed.
pub fn is_contact_clock(number: usize) -> bool {
    matches!(number, 2 | 8 | 9)
}

/// How a column is computed from a driver or another column of the same run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derived {
    /// Number of what it is computed from, see [`tables::driver`].
    pub source: usize,
    /// What is computed.
    pub rule: Rule,
}

/// What is computed from a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// Its derivative over time, per s.
    Rate,
    /// Its value so many seconds earlier; before that, its first value.
    Delayed(f64),
}

/// A column of the user's own.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnColumn {
    /// Its name in the measured runs.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Its value where it is not recorded: that of the calibration.
    pub reference: f64,
    /// Time that it takes to settle at another value, s: what the next experiment pays for setting it.
    pub settle_s: f64,
    /// How it is computed; `None` for one that the runs have.
    pub derived: Option<Derived>,
}

impl OwnColumn {
    /// The column as a model file has it.
    ///
    /// # Errors
    /// Those of [`TableColumn::new`].
    pub fn in_model_file(&self) -> Result<TableColumn, fingerpad::Error> {
        TableColumn::new(&self.name, &self.unit, self.range.map(|v| v as f32), self.reference as f32)
    }

    /// The column as laws know it; `place` is its place in the file of laws. The name is kept for the life of the program.
    pub fn column(&self, place: usize) -> Column {
        Column::Own { place: place.min(OWN - 1) as u8, name: self.name.clone().leak() }
    }
}

impl From<&TableColumn> for OwnColumn {
    fn from(column: &TableColumn) -> Self {
        Self {
            name: column.name().to_owned(),
            unit: column.unit().to_owned(),
            range: [column.low, column.high].map(f64::from),
            reference: column.reference.into(),
            settle_s: 0.0,
            derived: None,
        }
    }
}
