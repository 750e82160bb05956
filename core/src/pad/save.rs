//! Saving and restoring the state of a contact of a pad.
//!
//! Uses state and save.

use crate::error::Field;
use crate::model_file::crc32;
use crate::save::{read_words, write_words};
use crate::{BRANCHES, Error};

use super::memory::{Memory, PadMemory};
use super::state::FLAGS;
use super::vector::Rounded;
use super::{Numbers, Pad, PadState, Patch};

/// Version of the layout of a saved state.
const VERSION: u32 = 5;
/// Largest magnitude of a number of a state.
const LARGEST: f32 = 1e9;

/// Bytes of a saved state for a pad of up to `patches` patches.
pub const fn pad_state_bytes(patches: usize) -> usize {
    size_of::<PadState<0>>() + 5 * 4 * patches + 12
}

/// The same for tissue that relaxes.
pub const fn relaxing_pad_state_bytes(patches: usize) -> usize {
    pad_state_bytes(patches) + size_of::<PadMemory<0>>() + BRANCHES * 3 * 4 * patches
}

impl Pad<'_> {
    /// Checksum of the pad's numbers. A saved state contains it and is refused with another pad. Costs about 20 instructions a byte.
    pub fn checksum(&self) -> u32 {
        let numbers: &[u8] = bytemuck::bytes_of::<Numbers>(self.numbers);
        let patches: &[u8] = bytemuck::cast_slice::<Patch, u8>(self.patches);
        let checksum = crc32(numbers) ^ crc32(patches).rotate_left(1);
        if !self.relaxation.is_some() {
            return checksum;
        }
        checksum ^ crc32(bytemuck::bytes_of(&self.relaxation)).rotate_left(2)
    }
}

impl<const P: usize, M: Memory<P, f32> + bytemuck::Pod> PadState<P, f32, M> {
    /// Length of a saved state, bytes: [`pad_state_bytes`] or [`relaxing_pad_state_bytes`].
    pub const SAVED_BYTES: usize = size_of::<Self>() + 12;

    /// Writes the state into `out`, little-endian, after version and checksum of the pad's numbers ([`Pad::checksum`]), with a checksum of
    /// all bytes at the end. Returns the number of bytes, [`Self::SAVED_BYTES`].
    ///
    /// # Errors
    /// [`Error::Buffer`] if `out` is too short.
    pub fn write_bytes(&self, pad: u32, out: &mut [u8]) -> Result<usize, Error> {
        let words: &[u32] = bytemuck::cast_slice(core::slice::from_ref(self));
        write_words([VERSION, pad], words.iter().copied(), Self::SAVED_BYTES, out)
    }

    /// The state that [`PadState::write_bytes`] wrote with the same pad.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Checksum`] for damage, [`Error::Version`], [`Error::OtherModel`], and [`Error::Range`] for a value that
    /// no step produces.
    pub fn read_bytes(pad: u32, bytes: &[u8]) -> Result<Self, Error> {
        let found = read_words([VERSION, pad], Self::SAVED_BYTES, bytes)?;
        let mut state = Self::without_contact(0);
        let words: &mut [u32] = bytemuck::cast_slice_mut(core::slice::from_mut(&mut state));
        for (slot, word) in words.iter_mut().zip(found) {
            *slot = word;
        }
        state.check()
    }

    /// The state itself if a step can produce it.
    fn check(self) -> Result<Self, Error> {
        let words: &[u32] = bytemuck::cast_slice(core::slice::from_ref(&self));
        let (flags, numbers) = words.split_last().ok_or(Error::Checksum)?;
        let bad = |index: usize, value: f32| Error::Range { what: Field::State, index: index as u16, value };
        let factor = core::mem::offset_of!(Self, factor) / 4;
        let factor = factor..factor + size_of::<Rounded>() / 4;
        if !self.factor.is_within(LARGEST) {
            return Err(bad(factor.start, f32::NAN));
        }
        for (index, bits) in numbers.iter().enumerate() {
            let value = f32::from_bits(*bits);
            if !(value.abs() <= LARGEST) && !factor.contains(&index) {
                return Err(bad(index, value));
            }
        }
        if !self.is_consistent(self.patches as usize) {
            return Err(bad(numbers.len(), self.strength_factor));
        }
        if *flags > FLAGS {
            return Err(bad(numbers.len(), *flags as f32));
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Motion;
    use crate::pad::{EXAMPLE_PATCHES, ExamplePad, Plane};

    const BYTES: usize = pad_state_bytes(EXAMPLE_PATCHES);

    fn in_contact() -> (ExamplePad, PadState<EXAMPLE_PATCHES>) {
        let example = ExamplePad::new();
        let mut state = PadState::new(&example.pad()).unwrap();
        for _ in 0..10 {
            let motion = Motion { depth_mm: 1.0, slide_increment_mm: [0.05, 0.02], dt_s: 1e-3, ..Motion::default() };
            example.pad().step(&mut state, &Plane, motion, [30.0, 5.0]);
        }
        (example, state)
    }

    #[test]
    fn a_saved_state_goes_on_bit_for_bit() {
        let (example, mut state) = in_contact();
        let pad = example.pad();
        let mut bytes = [0; BYTES];
        assert_eq!(state.write_bytes(pad.checksum(), &mut bytes), Ok(BYTES));
        let mut again = PadState::<EXAMPLE_PATCHES>::read_bytes(pad.checksum(), &bytes).unwrap();
        assert_eq!(again, state);
        let motion = Motion { depth_mm: 0.9, slide_increment_mm: [-0.05, 0.02], dt_s: 1e-3, ..Motion::default() };
        let [a, b] = [&mut state, &mut again].map(|state| pad.step(state, &Plane, motion, [31.0, 5.0]));
        assert_eq!((a, state), (b, again));
    }

    #[test]
    fn damage_is_refused() {
        let (example, state) = in_contact();
        let pad = example.pad().checksum();
        let mut bytes = [0; BYTES];
        state.write_bytes(pad, &mut bytes).unwrap();
        type State = PadState<EXAMPLE_PATCHES>;
        assert_eq!(State::read_bytes(pad ^ 1, &bytes), Err(Error::OtherModel { found: pad, expected: pad ^ 1 }));
        assert!(matches!(State::read_bytes(pad, &bytes[1..]), Err(Error::Length { .. })));
        for at in 0..BYTES {
            bytes[at] ^= 0x10;
            assert!(State::read_bytes(pad, &bytes).is_err(), "{at}");
            bytes[at] ^= 0x10;
        }
        for bits in [f32::NAN.to_bits(), f32::INFINITY.to_bits(), 1e20f32.to_bits()] {
            let mut bad = state;
            bytemuck::cast_slice_mut::<_, u32>(core::slice::from_mut(&mut bad))[20] = bits;
            bad.write_bytes(pad, &mut bytes).unwrap();
            assert!(matches!(State::read_bytes(pad, &bytes), Err(Error::Range { what: Field::State, index: 20, .. })));
        }
        // A word of the factor holds two 16-bit numbers.
        for bits in [0x7fc0, 0x7fc0_0000u32] {
            let mut bad = state;
            bytemuck::cast_slice_mut::<_, u32>(core::slice::from_mut(&mut bad))[50] = bits;
            bad.write_bytes(pad, &mut bytes).unwrap();
            assert!(matches!(State::read_bytes(pad, &bytes), Err(Error::Range { what: Field::State, .. })));
        }
        assert!(matches!(state.write_bytes(pad, &mut [0; 20]), Err(Error::Buffer { .. })));
    }
}
