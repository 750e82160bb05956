//! The measured table as input of the diagnosis: cells with their errors, depths in rising order.

use fingerpad_fe::contact::RubberFriction;

use crate::table::slots;
use crate::table_csv::{Cell, PartialRow};
use crate::{IdentifyError, LawPoint, Point, Region, Table};

/// Quantities of a row, in the order of every triple of this room.
pub const QUANTITIES: [&str; 3] = ["normal_force_n", "contact_area_mm2", "friction_coefficient"];

/// Standard deviation of a cell whose table has none, as a share of its value: that of `identify`'s calibration.
pub const ASSUMED_SD: f64 = 0.05;
/// Standard deviation of a depth whose table has none, mm.
pub const ASSUMED_DEPTH_SD_MM: f64 = 0.05;

/// A table of at least three depths. Rows of one depth (repeats) share a slot.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredTable {
    /// Rows in the order of the file.
    pub rows: Vec<PartialRow>,
    /// Depths, mm, rising, each once.
    pub depths_mm: Vec<f64>,
    /// Standard deviation of each depth, mm.
    pub depth_sd_mm: Vec<f64>,
    /// Every measured number, row by row.
    pub numbers: Vec<Measured>,
}

/// One measured number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Row of the table, from 0.
    pub row: usize,
    /// Index of the row's depth.
    pub slot: usize,
    /// Index in [`QUANTITIES`].
    pub quantity: usize,
    /// Value.
    pub value: f64,
    /// Standard deviation as a share of the value.
    pub relative_sd: f64,
}

impl MeasuredTable {
    /// Refuses a table that has fewer depths or numbers than the constants of a finger and its friction.
    ///
    /// # Errors
    /// [`IdentifyError::Table`].
    pub fn new(rows: Vec<PartialRow>) -> Result<Self, IdentifyError> {
        let (depths_mm, slot) = slots(rows.iter().map(|r| r.depth_mm.value));
        if depths_mm.len() < 3 {
            return Err(IdentifyError::Table(format!(
                "{} row(s) at {} depth(s); stiffness, touch point and strength are three constants: at least three depths \
                 are needed",
                rows.len(),
                depths_mm.len()
            )));
        }
        let sd_of = |k: usize| {
            let known: Vec<f64> =
                (rows.iter().zip(&slot)).filter(|(_, s)| **s == k).filter_map(|(r, _)| r.depth_mm.sd).collect();
            if known.is_empty() { ASSUMED_DEPTH_SD_MM } else { known.iter().sum::<f64>() / known.len() as f64 }
        };
        let depth_sd_mm = (0..depths_mm.len()).map(sd_of).collect();
        let mut numbers = Vec::new();
        for (row, (read, &slot)) in rows.iter().zip(&slot).enumerate() {
            let cells =
                Self::cells(read).into_iter().enumerate().filter_map(|(quantity, cell)| Some((quantity, cell?)));
            numbers.extend(cells.map(|(quantity, Cell { value, sd })| Measured {
                row,
                slot,
                quantity,
                value,
                relative_sd: sd.map_or(ASSUMED_SD, |sd| sd / value),
            }));
        }
        if numbers.len() < 6 {
            return Err(IdentifyError::Table(format!(
                "{} measured numbers beside the depths; at least 6 are needed to distinguish an effect from three constants",
                numbers.len()
            )));
        }
        Ok(Self { rows, depths_mm, depth_sd_mm, numbers })
    }

    /// Normal force, contact area and friction coefficient of a row.
    pub fn cells(row: &PartialRow) -> [Option<Cell>; 3] {
        [row.normal_force_n, row.contact_area_mm2, row.friction_coefficient]
    }

    /// Whether every cell has its own spread.
    pub fn has_spread(&self) -> bool {
        self.rows.iter().flat_map(Self::cells).flatten().all(|cell| cell.sd.is_some())
    }

    /// Whether a quantity was measured.
    pub fn has(&self, quantity: usize) -> bool {
        self.numbers.iter().any(|m| m.quantity == quantity)
    }

    /// The power law through mean shear stress over mean pressure of the rows; none without areas.
    pub fn mean_field(&self) -> Option<LawPoint> {
        let point = |r: &PartialRow| {
            Some(Point {
                depth_mm: r.depth_mm.value,
                normal_force_n: r.normal_force_n?.value,
                friction_coefficient: r.friction_coefficient?.value,
                contact_area_mm2: Some(r.contact_area_mm2?.value),
            })
        };
        let table = Table::new("table", self.rows.iter().filter_map(point).collect()).ok()?;
        table.mean_field(&Region { beta: [-0.2, 0.9], tau_ref_kpa: [1e-3, 1e3] }, &RubberFriction::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_share_a_depth_and_too_little_is_refused() {
        let row = |depth: f64, sd| PartialRow {
            depth_mm: Cell { value: depth, sd },
            normal_force_n: Some(Cell { value: 0.2, sd: Some(0.004) }),
            contact_area_mm2: Some(Cell { value: 60.0, sd: None }),
            friction_coefficient: None,
        };
        let table =
            MeasuredTable::new(vec![row(1.0, None), row(0.5, Some(0.02)), row(1.5, None), row(1.0, None)]).unwrap();
        let slots: Vec<usize> = table.numbers.iter().step_by(2).map(|m| m.slot).collect();
        assert_eq!((&table.depths_mm[..], &slots[..]), (&[0.5, 1.0, 1.5][..], &[1, 0, 2, 1][..]));
        assert_eq!(table.depth_sd_mm, [0.02, ASSUMED_DEPTH_SD_MM, ASSUMED_DEPTH_SD_MM]);
        let numbers = &table.numbers;
        assert_eq!((numbers.len(), numbers[1].quantity), (8, 1));
        assert!((numbers[0].relative_sd - 0.02).abs() < 1e-12 && numbers[1].relative_sd == ASSUMED_SD);
        assert!(!table.has_spread() && table.has(1) && !table.has(2));
        let message = MeasuredTable::new(vec![row(1.0, None), row(0.5, None), row(1.0, None)]).unwrap_err().to_string();
        assert!(message.contains("3 row(s) at 2 depth(s)"), "{message}");
    }
}
