//! The laws by which moisture, temperature and speed change the skin's strength, and a refused file in numbers.
//!
//! Main type: [`Slots`]. All formulas are the core's.

use fingerpad::effects::hydration_bell::HydrationBell;
use fingerpad::effects::speed_log::SpeedLog;
use fingerpad::effects::temperature::Temperature;
use fingerpad::effects::{Effect, Law, VALUES};
use fingerpad::{EffectSlot, Effects, Error, Field};

/// Laws that the page's sliders drive. A file that lacks one gets it with the size that its source gives as typical; at the
/// sliders' rest it changes nothing.
const DRIVEN: [EffectSlot; 3] = [typical(&HydrationBell::LAW), typical(&SpeedLog::LAW), typical(&Temperature::LAW)];
/// Most laws in use at once.
const MOST: usize = 24;

/// A law with its typical parameters. Evaluated when compiling, so that the module holds no text of a law.
const fn typical(law: &Law) -> EffectSlot {
    let mut slot = EffectSlot { kind: law.kind, reserved: 0, values: [0.0; VALUES] };
    let mut k = 0;
    while k < law.parameters.len() {
        slot.values[k] = law.parameters[k].typical as f32;
        k += 1;
    }
    slot
}

/// Effects of the file, and behind them those that it lacks.
pub struct Slots {
    tables: &'static [f32],
    slots: [EffectSlot; MOST],
    of_file: usize,
    all: usize,
}

impl Slots {
    /// The laws in use with a file that holds `file`.
    pub fn of(file: &[EffectSlot], tables: &'static [f32]) -> Result<Self, Error> {
        let too_many = Error::Buffer { needed: size_of_val(file) as u32 };
        let mut slots = [EffectSlot::default(); MOST];
        let of_file = file.len();
        slots.get_mut(..of_file).ok_or(too_many)?.copy_from_slice(file);
        let mut all = of_file;
        for law in DRIVEN.iter().filter(|law| !file.iter().any(|slot| slot.kind == law.kind)) {
            *slots.get_mut(all).ok_or(too_many)? = *law;
            all += 1;
        }
        let slots = Self { tables, slots, of_file, all };
        slots.effects()?;
        Ok(slots)
    }

    /// The effects that they are, with the file's tables.
    pub fn effects(&self) -> Result<Effects<'_>, Error> {
        Effects::with_tables(self.all(), self.tables)
    }

    /// All of them.
    pub fn all(&self) -> &[EffectSlot] {
        self.slots.get(..self.all).unwrap_or(&[])
    }

    /// 2 for a law of the file, 1 for one of typical size, 0 for none.
    pub fn origin(&self, kind: u32) -> u32 {
        match self.all().iter().position(|slot| slot.kind == kind) {
            Some(at) if at < self.of_file => 2,
            Some(_) => 1,
            None => 0,
        }
    }

    /// A parameter of a law; 0 if there is none.
    pub fn value(&self, kind: u32, index: usize) -> f32 {
        let slot = self.all().iter().find(|slot| slot.kind == kind);
        slot.and_then(|slot| slot.values.get(index)).copied().unwrap_or(0.0)
    }
}

/// Why a file was refused, for the page to put into words: reason, then up to four numbers.
pub fn words(error: Error) -> [u32; 5] {
    let field = |what: Field| what as u32;
    match error {
        Error::Magic => [1, 0, 0, 0, 0],
        Error::Version { found } => [2, found, fingerpad::VERSION, 0, 0],
        Error::Length { expected, found } => [3, expected, found, 0, 0],
        Error::Checksum => [4, 0, 0, 0, 0],
        Error::Alignment => [5, 0, 0, 0, 0],
        Error::Shape { elements, nodes } => [6, elements, nodes, 0, 0],
        Error::Section { id } => [7, u32::from_le_bytes(id), 0, 0, 0],
        Error::Range { what, index, value } => [8, field(what), u32::from(index), value.to_bits(), 0],
        Error::NotMonotone { what, index } => [9, field(what), u32::from(index), 0, 0],
        Error::NotPassive { what, index, value, limit } => {
            [10, field(what), u32::from(index), value.to_bits(), limit.to_bits()]
        }
        Error::Buffer { needed } => [11, needed, 0, 0, 0],
        Error::OtherModel { found, expected } => [12, found, expected, 0, 0],
        // An error of a later version of the core.
        _ => [13, 0, 0, 0, 0],
    }
}
