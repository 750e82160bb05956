//! Sections of a model file: slots of effects, the tables and columns that they read, branches of the tissue.
//!
//! Main types: [`EffectSlot`], [`TableColumn`], [`Sections`]. Uses error and relaxation.

use bytemuck::{Pod, Zeroable};

use crate::error::Field;
use crate::{Error, Relaxation};

/// Section of the columns.
pub(crate) const COLUMNS: [u8; 4] = *b"COLS";
/// Section of the branches of the tissue; only in files of tissue that relaxes.
pub(crate) const RELAXATION: [u8; 4] = *b"RELX";

/// A slot for an effect beyond the plain model: which law, and its parameters.
///
/// The plain step does not read the slots; [`crate::Effects`] does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct EffectSlot {
    /// Number of the law.
    pub kind: u32,
    /// 0; for later use.
    pub reserved: u32,
    /// Parameters of the law, in its own order.
    pub values: [f32; 6],
}

/// Values of effect slots lie within; no law's parameters are near it.
const LARGEST_VALUE: f32 = 1e6;

impl EffectSlot {
    /// Refuses a value that is not a number or beyond 1e6. `index` is the slot's number in its file.
    pub(crate) fn check(&self, index: usize) -> Result<(), Error> {
        for (k, &value) in self.values.iter().enumerate() {
            if !(value.abs() <= LARGEST_VALUE) {
                let index = (self.values.len() * index + k) as u16;
                return Err(Error::Range { what: Field::EffectValue, index, value });
            }
        }
        Ok(())
    }
}

/// A user-defined column (a voltage, a humidity) that tables of a model file read from
/// [`crate::Surroundings::own`], in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TableColumn {
    name: [u8; 32],
    unit: [u8; 16],
    /// Least value for which the tables' formulas hold.
    pub low: f32,
    /// Largest value for which they hold.
    pub high: f32,
    /// The value under which the model was calibrated.
    pub reference: f32,
}

impl TableColumn {
    /// Longest name, bytes.
    pub const NAME_BYTES: usize = 31;
    /// Longest unit, bytes.
    pub const UNIT_BYTES: usize = 15;

    /// A column.
    ///
    /// * `range`: least and largest value, finite, the lesser first; `reference` lies within
    ///
    /// # Errors
    /// [`Error::Section`] for a name of no or more than 31 bytes, a unit of more than 15, a zero byte in either, and for
    /// numbers outside these rules.
    pub fn new(name: &str, unit: &str, range: [f32; 2], reference: f32) -> Result<Self, Error> {
        let [low, high] = range;
        let out = Self { name: padded(name)?, unit: padded(unit)?, low, high, reference };
        out.check()?;
        Ok(out)
    }

    /// Its name.
    pub fn name(&self) -> &str {
        text(&self.name)
    }

    /// Its unit; empty for a pure number.
    pub fn unit(&self) -> &str {
        text(&self.unit)
    }

    /// Name and unit in the form of the file: UTF-8, padded with at least one zero byte.
    pub fn bytes(&self) -> (&[u8; 32], &[u8; 16]) {
        (&self.name, &self.unit)
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let whole = |bytes: &[u8]| {
            let text = text(bytes);
            text.len() < bytes.len() && bytes.iter().skip(text.len()).all(|b| *b == 0)
        };
        let is_range = self.low < self.high && self.low.abs() <= 1e9 && self.high.abs() <= 1e9;
        let is_sound = whole(&self.name) && whole(&self.unit) && !self.name().is_empty() && is_range;
        if is_sound && self.reference >= self.low && self.reference <= self.high {
            return Ok(());
        }
        Err(Error::Section { id: COLUMNS })
    }
}

/// A text with zeros behind it, at least one.
fn padded<const N: usize>(text: &str) -> Result<[u8; N], Error> {
    let mut out = [0; N];
    match out.get_mut(..text.len()) {
        Some(head) if text.len() < N => head.copy_from_slice(text.as_bytes()),
        _ => return Err(Error::Section { id: COLUMNS }),
    }
    Ok(out)
}

/// The text before the first zero; none where it is not UTF-8.
fn text(bytes: &[u8]) -> &str {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    bytes.get(..end).and_then(|head| core::str::from_utf8(head).ok()).unwrap_or("")
}

/// The optional sections of a model file; [`Default`] has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sections<'a> {
    /// Numbers of the tables that effects read, see [`crate::effects::tables`].
    pub tables: &'a [f32],
    /// User-defined columns that they read, at most [`crate::effects::OWN`].
    pub columns: &'a [TableColumn],
    /// Branches of the tissue.
    pub relaxation: Option<&'a Relaxation>,
}
