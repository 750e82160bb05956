//! Saving and restoring the state of a contact.
//!
//! Uses state, model_file, error.

use crate::data::SPRINGS;
use crate::error::Field;
use crate::model_file::crc32;
use crate::rolling::Rolled;
use crate::step::TOUCH_MM;
use crate::{DataOf, Error, State, StateOf};

/// Version of the layout of a saved state.
const VERSION: u32 = 6;
/// Words beside the anchors: version, model, position, angle, three places of the way, where the contact has rolled, two limits,
/// depth, strength factor, checksum.
const BESIDE: usize = 2 + 4 + 2 + 9 + 13 + 4 + 1;

/// Bytes of a saved state of the default model.
pub const STATE_BYTES: usize = state_bytes(SPRINGS, 1);

/// Bytes of a saved state with `springs` springs, `pairs` 2 with spin and 1 without.
pub const fn state_bytes(springs: usize, pairs: usize) -> usize {
    4 * (2 * springs * pairs + BESIDE)
}

impl<const M: usize, const P: usize> StateOf<M, P> {
    /// Numbers of a state: anchors, position, angle, turn, reached, turn before, rolled, limits there, depth, strength factor.
    fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        let anchors = self.anchor.as_flattened().as_flattened().iter();
        let places = self.position.as_flattened().iter().chain(&self.angle);
        let way = self.turn.iter().chain(&self.reached).chain(&self.turn_before);
        let Rolled { range, place, slide, angles, play, .. } = &self.rolled;
        let rolled = range.as_flattened().iter().chain(place).chain(slide).chain(angles).chain([play]);
        let stiffness = [self.rolled.stiffness, self.rolled.bearing];
        let numbers = [self.limit_reached, self.limit_before, self.depth, self.strength_factor];
        anchors.chain(places).chain(way).chain(rolled).copied().chain(stiffness).chain(numbers)
    }

    /// Writes the state into `out`, little-endian with version, checksum of the model's numbers ([`DataOf::checksum`]) and
    /// a checksum of its own at the end; returns the number of bytes, [`state_bytes`].
    pub fn write_bytes(&self, model: u32, out: &mut [u8]) -> Result<usize, Error> {
        let needed = state_bytes(M, P);
        let Some(out) = out.get_mut(..needed) else { return Err(Error::Buffer { needed: needed as u32 }) };
        let Some((body, end)) = out.split_last_chunk_mut::<4>() else {
            return Err(Error::Buffer { needed: needed as u32 });
        };
        let words = [VERSION, model].into_iter().chain(self.numbers().map(f32::to_bits));
        for (slot, word) in body.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *slot = word.to_le_bytes();
        }
        *end = crc32(body).to_le_bytes();
        Ok(needed)
    }

    /// A state from what [`StateOf::write_bytes`] wrote with the same model. Refuses damage, another version, another
    /// model's state and values that no step leaves behind.
    pub fn read_bytes(model: u32, bytes: &[u8]) -> Result<Self, Error> {
        let expected = state_bytes(M, P);
        if bytes.len() != expected {
            return Err(Error::Length { expected: expected as u32, found: bytes.len() as u32 });
        }
        let Some((body, end)) = bytes.split_last_chunk::<4>() else { return Err(Error::Checksum) };
        if crc32(body) != u32::from_le_bytes(*end) {
            return Err(Error::Checksum);
        }
        let mut words = body.chunks_exact(4).map(|c| match c.try_into() {
            Ok(four) => u32::from_le_bytes(four),
            Err(_) => 0,
        });
        let (version, found) = (words.next().unwrap_or(0), words.next().unwrap_or(0));
        if version != VERSION {
            return Err(Error::Version { found: version });
        }
        if found != model {
            return Err(Error::OtherModel { found, expected: model });
        }
        let mut next = || words.next().map_or(f32::NAN, f32::from_bits);
        let mut state = Self::default();
        let anchors = state.anchor.as_flattened_mut().as_flattened_mut().iter_mut();
        let places = state.position.as_flattened_mut().iter_mut().chain(&mut state.angle);
        let way = state.turn.iter_mut().chain(&mut state.reached).chain(&mut state.turn_before);
        let Rolled { range, place, slide, play, angles, stiffness, bearing } = &mut state.rolled;
        let rolled = range.as_flattened_mut().iter_mut().chain(place).chain(slide).chain(angles);
        let rolled = rolled.chain([play, stiffness, bearing]);
        for slot in anchors.chain(places).chain(way).chain(rolled) {
            *slot = next();
        }
        state.limit_reached = next();
        state.limit_before = next();
        state.depth = next();
        state.strength_factor = next();
        state.check()
    }

    /// The state itself if a step could have left it behind.
    pub(crate) fn check(self) -> Result<Self, Error> {
        let bad = |index: usize, value: f32| Error::Range { what: Field::State, index: index as u16, value };
        for (i, x) in self.numbers().enumerate() {
            // Positions lie within a slide of the origin, and forces within their range.
            if !(x.abs() <= 1e3) {
                return Err(bad(i, x));
            }
        }
        let last = 2 * M * P + BESIDE;
        let air = Self { strength_factor: self.strength_factor, ..Self::default() };
        if !(self.depth >= TOUCH_MM || self == air) {
            return Err(bad(last - 5, self.depth));
        }
        if let Some([least, _]) = self.rolled.range.iter().find(|[least, most]| !(least <= most)) {
            return Err(bad(last - 20, *least));
        }
        let Rolled { play, stiffness, bearing, .. } = self.rolled;
        if !(play >= 0.0) {
            return Err(bad(last - 10, play));
        }
        if !(bearing > 0.0 && bearing <= stiffness) {
            return Err(bad(last - 8, bearing));
        }
        if !(self.limit_reached >= 0.0) {
            return Err(bad(last - 7, self.limit_reached));
        }
        if !(self.limit_before >= 0.0) {
            return Err(bad(last - 6, self.limit_before));
        }
        if !(self.strength_factor >= 0.1 && self.strength_factor <= 5.0) {
            return Err(bad(last - 4, self.strength_factor));
        }
        Ok(self)
    }
}

impl State {
    /// The state as bytes; see [`StateOf::write_bytes`].
    pub fn to_bytes<const N: usize>(&self, model: &DataOf<SPRINGS, N>) -> [u8; STATE_BYTES] {
        let mut bytes = [0; STATE_BYTES];
        // The buffer has the right length.
        let _ = self.write_bytes(model.checksum(), &mut bytes);
        bytes
    }

    /// A state from [`State::to_bytes`] with the same model.
    pub fn from_bytes<const N: usize>(model: &DataOf<SPRINGS, N>, bytes: &[u8; STATE_BYTES]) -> Result<Self, Error> {
        Self::read_bytes(model.checksum(), bytes)
    }
}

#[cfg(feature = "serde")]
mod with_serde {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Rolled, StateOf};

    #[derive(Serialize, Deserialize)]
    struct Plain<const M: usize, const P: usize> {
        #[serde(with = "crate::array")]
        anchor_mm: [Pair<P>; M],
        position_mm: [[f32; 2]; 2],
        angle_rad: [f32; 2],
        turn: [f32; 3],
        reached: [f32; 3],
        limit_reached_n: f32,
        turn_before: [f32; 3],
        limit_before_n: f32,
        rolled: Rolled<f32>,
        depth_mm: f32,
        strength_factor: f32,
    }

    #[derive(Clone, Copy, Serialize, Deserialize)]
    #[serde(transparent)]
    struct Pair<const P: usize>(#[serde(with = "crate::array")] [[f32; 2]; P]);

    impl<const P: usize> Default for Pair<P> {
        fn default() -> Self {
            Self([[0.0; 2]; P])
        }
    }

    impl<const M: usize, const P: usize> Serialize for StateOf<M, P> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let plain = Plain {
                anchor_mm: self.anchor.map(Pair),
                position_mm: self.position,
                angle_rad: self.angle,
                turn: self.turn,
                reached: self.reached,
                limit_reached_n: self.limit_reached,
                turn_before: self.turn_before,
                limit_before_n: self.limit_before,
                rolled: self.rolled,
                depth_mm: self.depth,
                strength_factor: self.strength_factor,
            };
            plain.serialize(serializer)
        }
    }

    impl<'de, const M: usize, const P: usize> Deserialize<'de> for StateOf<M, P> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let plain = Plain::<M, P>::deserialize(deserializer)?;
            let state = Self {
                anchor: plain.anchor_mm.map(|pair| pair.0),
                position: plain.position_mm,
                angle: plain.angle_rad,
                turn: plain.turn,
                reached: plain.reached,
                limit_reached: plain.limit_reached_n,
                turn_before: plain.turn_before,
                limit_before: plain.limit_before_n,
                rolled: plain.rolled,
                depth: plain.depth_mm,
                strength_factor: plain.strength_factor,
            };
            state.check().map_err(serde::de::Error::custom)
        }
    }
}
