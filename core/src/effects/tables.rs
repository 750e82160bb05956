//! Effects as tables in a model file: a user-defined law runs without another compilation of the firmware.
//!
//! A slot of the number [`TABLE`] contains the target of its table and its place in the file's section of tables. A table has one or two
//! axes with evenly spaced nodes and a change at every node; between nodes it is linear. Beyond the end of an axis the value at the end
//! holds, and the step is flagged. A table whose driver is not finite is left out. Uses conditions, change, error.

use super::{Change, Conditions, VALUES};
use crate::Error;
use crate::build::EffectSlot;
use crate::error::Field;
use crate::math::Real;

/// Number of the slots that have a table; floats: its target (see [`Target`]), the index of its first number in the
/// section of tables, 0, 0, 0, 0.
pub const TABLE: u32 = 34;
/// Numbers before a table's nodes: driver, nodes, least value, nodes per unit of either axis.
pub const HEAD: usize = 8;
/// Most nodes of an axis.
pub const MOST_NODES: usize = 257;
/// Most nodes of a table.
pub const MOST_VALUES: usize = 289;
/// Drivers that an axis can have, see [`driver`].
pub const DRIVERS: usize = FIRST_OWN + super::OWN;
/// Number of the first user-defined column among the drivers.
pub const FIRST_OWN: usize = 13;

/// Quantity that a table changes; its number is the first float of the slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Target {
    /// Strength × (1 + value); values −0.9 to 4.
    Strength = 0,
    /// Stiffness × (1 + value); values −0.8 to 4.
    Stiffness = 1,
    /// Added to the depth, mm; −5 to 5.
    Depth = 2,
    /// Added to the sensor's normal force, N; −1000 to 1000.
    ReadingNormal = 3,
    /// Added to the sensor's force along x, N; the same.
    ReadingX = 4,
    /// Added to the sensor's force along y, N; the same.
    ReadingY = 5,
}

impl Target {
    /// The target of a number; `None` for another one.
    pub fn of(number: f32) -> Option<Self> {
        use Target::{Depth, ReadingNormal, ReadingX, ReadingY, Stiffness, Strength};
        [Strength, Stiffness, Depth, ReadingNormal, ReadingX, ReadingY].into_iter().find(|t| *t as u32 as f32 == number)
    }

    /// Least and largest value of a node.
    pub fn range(self) -> [f32; 2] {
        match self {
            Self::Strength => [-0.9, 4.0],
            Self::Stiffness => [-0.8, 4.0],
            Self::Depth => [-5.0, 5.0],
            Self::ReadingNormal | Self::ReadingX | Self::ReadingY => [-1e3, 1e3],
        }
    }

    /// Whether it changes the sensor's output alone.
    pub fn is_reading(self) -> bool {
        matches!(self, Self::ReadingNormal | Self::ReadingX | Self::ReadingY)
    }

    /// Applies a value of a table.
    fn act(self, value: f32, change: &mut Change<f32>) {
        let [normal, x, y] = &mut change.reading_n;
        match self {
            Self::Strength => change.strengthen(1.0 + value),
            Self::Stiffness => change.stiffen(1.0 + value),
            Self::Depth => change.depth_mm += value,
            Self::ReadingNormal => *normal += value,
            Self::ReadingX => *x += value,
            Self::ReadingY => *y += value,
        }
    }
}

/// The driver of a number: t_s, depth_mm, contact_time_s, speed_mm_s, x and y of the direction of motion, path and path since
/// the last turn, dwell_s, occlusion_s, hydration_au, temperature_c, width_mm, then the user-defined columns; `None` for
/// another number.
pub fn driver<T: Real>(number: usize, at: &Conditions<T>) -> Option<T> {
    let [x, y] = at.along;
    Some(match number {
        0 => at.t_s,
        1 => at.depth_mm,
        2 => at.contact_time_s,
        3 => at.speed_mm_s,
        4 => x,
        5 => y,
        6 => at.path_mm,
        7 => at.turn_mm,
        8 => at.dwell_s,
        9 => at.occlusion_s,
        10 => at.hydration_au,
        11 => at.temperature_c,
        12 => at.width_mm,
        own => return at.own.get(own - FIRST_OWN).copied(),
    })
}

/// One axis of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Number of its driver.
    pub driver: usize,
    /// Nodes; 1 for an axis that is not there.
    pub nodes: usize,
    /// Value of the driver at the first node.
    pub low: f32,
    /// Cells per unit of the driver.
    pub per_unit: f32,
}

impl Axis {
    /// An axis that is not there.
    pub const NONE: Self = Self { driver: 0, nodes: 1, low: 0.0, per_unit: 1.0 };

    fn of(numbers: [f32; 4]) -> Self {
        let [driver, nodes, low, per_unit] = numbers;
        Self { driver: driver as u32 as usize, nodes: nodes as u32 as usize, low, per_unit }
    }

    /// Its four numbers in a file.
    pub fn numbers(&self) -> [f32; 4] {
        [self.driver as f32, self.nodes as f32, self.low, self.per_unit]
    }

    /// The cell, the place in it from 0 to 1, and whether the driver lies beyond the axis; `None` where it is not a number.
    fn place(&self, at: &Conditions<f32>) -> Option<(usize, f32, bool)> {
        if self.nodes < 2 {
            return Some((0, 0.0, false));
        }
        let cells = (self.nodes - 1) as f32;
        let x = (driver(self.driver, at)? - self.low) * self.per_unit;
        if x >= 0.0 && x <= cells {
            let cell = (x as u32 as usize).min(self.nodes - 2);
            return Some((cell, x - cell as f32, false));
        }
        // A thousandth of a cell is rounding.
        let is_beyond = !(x > -1e-3 && x < cells + 1e-3);
        if x < 0.0 {
            Some((0, 0.0, is_beyond))
        } else if x > cells {
            Some((self.nodes - 2, 1.0, is_beyond))
        } else {
            None
        }
    }
}

/// A table in a file's section of tables.
#[derive(Clone, Copy, Debug)]
struct Table<'a> {
    axes: [Axis; 2],
    /// Changes at the nodes, the second axis running fastest.
    values: &'a [f32],
}

impl<'a> Table<'a> {
    /// The table that begins at a number of the section; `None` where the section ends before it does.
    fn at(section: &'a [f32], start: f32) -> Option<Self> {
        let numbers = section.get(start as u32 as usize..)?;
        let &[a, b, c, d, e, f, g, h, ref values @ ..] = numbers else { return None };
        let axes = [Axis::of([a, b, c, d]), Axis::of([e, f, g, h])];
        let [one, two] = axes.map(|axis| axis.nodes);
        Some(Self { axes, values: values.get(..one.checked_mul(two)?)? })
    }

    /// The change under conditions, and whether a driver lies beyond its axis; `None` where one is not a number.
    fn value(&self, at: &Conditions<f32>) -> Option<(f32, bool)> {
        let [one, two] = &self.axes;
        let ((i, s, is_beyond), (k, t, is_beyond_too)) = (one.place(at)?, two.place(at)?);
        let node = |i: usize, k: usize| self.values.get(i * two.nodes + k).copied();
        let along = |i: usize| {
            let left = node(i, k)?;
            if t > 0.0 { Some(left + t * (node(i, k + 1)? - left)) } else { Some(left) }
        };
        let left = along(i)?;
        let value = if s > 0.0 { left + s * (along(i + 1)? - left) } else { left };
        Some((value, is_beyond | is_beyond_too))
    }
}

/// Refuses a table that is not whole: the driver or the number of nodes of an axis, a node's value.
///
/// * `index`: number of the slot
pub(super) fn check(slot: &EffectSlot, index: usize, section: &[f32]) -> Result<(), Error> {
    let range =
        |k: usize, value: f32| Error::Range { what: Field::EffectValue, index: (VALUES * index + k) as u16, value };
    let [target, start, ..] = slot.values;
    let limits = Target::of(target).ok_or(range(0, target))?.range();
    if !(start >= 0.0 && start as u32 as f32 == start) {
        return Err(range(1, start));
    }
    let table = Table::at(section, start).ok_or(Error::Section { id: *b"TABL" })?;
    for (axis, least) in table.axes.iter().zip([2, 1]) {
        let fits = axis.nodes >= least && axis.nodes <= MOST_NODES && axis.driver < DRIVERS;
        if !(fits && axis.low.abs() <= 1e9 && axis.per_unit > 0.0 && axis.per_unit <= 1e9) {
            return Err(Error::Section { id: *b"TABL" });
        }
    }
    for (k, &value) in table.values.iter().enumerate() {
        let [least, most] = limits;
        if !(value >= least && value <= most) || k >= MOST_VALUES {
            return Err(Error::Range { what: Field::TableValue, index: k as u16, value });
        }
    }
    Ok(())
}

/// Lets the table of a slot act; whether a driver was beyond its axis or no number.
pub(super) fn apply(
    slot: &EffectSlot,
    section: &[f32],
    of_sensor: bool,
    at: &Conditions<f32>,
    change: &mut Change<f32>,
) -> bool {
    let [target, start, ..] = slot.values;
    let Some(target) = Target::of(target).filter(|t| t.is_reading() == of_sensor) else { return false };
    match Table::at(section, start).and_then(|table| table.value(at)) {
        Some((value, is_held)) => {
            target.act(value, change);
            is_held
        }
        None => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two axes, own column 0 from 0 to 4 in five nodes and temperature from 30 to 32 in three; the change 0.1 x + 0.2 (T − 30).
    fn section() -> std::vec::Vec<f32> {
        let one = Axis { driver: 13, nodes: 5, low: 0.0, per_unit: 1.0 };
        let two = Axis { driver: 11, nodes: 3, low: 30.0, per_unit: 1.0 };
        let mut out: std::vec::Vec<f32> = one.numbers().into_iter().chain(two.numbers()).collect();
        (0..5).for_each(|i| (0..3).for_each(|k| out.push(0.1 * i as f32 + 0.2 * k as f32)));
        out
    }

    fn strength(own: f32, temperature_c: f32) -> (f32, bool) {
        let slot = EffectSlot { kind: TABLE, reserved: 0, values: [0.0; 6] };
        let at = Conditions { own: [own, 0.0, 0.0, 0.0], temperature_c, ..Conditions::default() };
        let mut change = Change::default();
        let is_held = apply(&slot, &section(), false, &at, &mut change);
        (change.strength, is_held)
    }

    #[test]
    fn a_bilinear_table_is_exact_inside_held_and_flagged_outside_and_left_out_without_a_driver() {
        for (x, t) in [(0.0, 30.0), (1.25, 31.5), (3.999, 30.01), (4.0, 32.0)] {
            let (found, is_held) = strength(x, t);
            assert!((found - (1.0 + 0.1 * x + 0.2 * (t - 30.0))).abs() < 1e-6 && !is_held, "{x} {t}: {found}");
        }
        let (found, is_held) = strength(9.0, 29.0);
        assert!((found - 1.4).abs() < 1e-6 && is_held, "{found}");
        assert_eq!(strength(f32::NAN, 31.0), (1.0, true));
    }

    #[test]
    fn tables_that_are_not_whole_are_refused() {
        let slot = |values: [f32; 2]| EffectSlot {
            kind: TABLE,
            reserved: 0,
            values: [values[0], values[1], 0.0, 0.0, 0.0, 0.0],
        };
        assert_eq!(check(&slot([0.0, 0.0]), 0, &section()), Ok(()));
        for (values, broken) in [
            ([9.0, 0.0], None),
            ([0.0, -1.0], None),
            ([0.0, f32::NAN], None),
            ([0.0, 20.0], None),
            ([0.0, 0.0], Some((0, 99.0))),
            ([0.0, 0.0], Some((1, 40.0))),
            ([0.0, 0.0], Some((3, 0.0))),
            ([0.0, 0.0], Some((6, f32::NAN))),
            ([0.0, 0.0], Some((12, f32::NAN))),
            ([0.0, 0.0], Some((12, -0.95))),
        ] {
            let mut section = section();
            if let Some((k, value)) = broken {
                section[k] = value;
            }
            assert!(check(&slot(values), 0, &section).is_err(), "{values:?} {broken:?}");
        }
    }
}
