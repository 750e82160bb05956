//! Saving and restoring the state of a contact.
//!
//! Uses state, model_file, error.

use crate::Error;
use crate::data::ELEMENTS;
use crate::error::Field;
use crate::model_file::crc32;
use crate::step::TOUCH_MM;
use crate::{State, StateOf};

/// Bytes of a saved state of the default model.
pub const STATE_BYTES: usize = 4 * (2 * ELEMENTS + 14);

impl<const M: usize> StateOf<M> {
    /// Words of a state: elements, resultant, its path since the last reversal, the rim's lag, then depth, limit,
    /// stiffness, energy, stored energy, slide by pressing, strength factor.
    fn words(&self) -> impl Iterator<Item = f32> + '_ {
        let vectors =
            self.force.iter().chain([&self.resultant, &self.path_since_reversal, &self.rim_lag]).flatten().copied();
        let Self { depth, limit, stiffness, energy, stored_energy, press_slide, strength_factor, .. } = *self;
        vectors.chain([depth, limit, stiffness, energy, stored_energy, press_slide, strength_factor])
    }

    /// Writes the state into `out`, little-endian with a checksum at the end, and returns the number of bytes,
    /// `4 (2 M + 14)`.
    pub fn write_bytes(&self, out: &mut [u8]) -> Result<usize, Error> {
        let needed = 4 * (2 * M + 14);
        let out_length = out.len();
        let Some((body, rest)) = out.split_at_mut_checked(needed - 4) else {
            return Err(Error::Buffer { needed: needed as u32 });
        };
        let Some(end) = rest.get_mut(..4) else {
            return Err(Error::Buffer { needed: (needed.max(out_length)) as u32 });
        };
        for (slot, word) in body.chunks_exact_mut(4).zip(self.words()) {
            slot.copy_from_slice(&word.to_bits().to_le_bytes());
        }
        end.copy_from_slice(&crc32(body).to_le_bytes());
        Ok(needed)
    }

    /// A state from what [`StateOf::write_bytes`] wrote. Refuses damage and values that no step leaves behind.
    pub fn read_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let expected = 4 * (2 * M + 14);
        if bytes.len() != expected {
            return Err(Error::Length { expected: expected as u32, found: bytes.len() as u32 });
        }
        let Some((body, end)) = bytes.split_last_chunk::<4>() else { return Err(Error::Checksum) };
        if crc32(body) != u32::from_le_bytes(*end) {
            return Err(Error::Checksum);
        }
        let mut words = body.chunks_exact(4).map(|c| match c.try_into() {
            Ok(four) => f32::from_le_bytes(four),
            Err(_) => f32::NAN,
        });
        let mut next = || words.next().unwrap_or(f32::NAN);
        let mut state = Self::default();
        for pair in &mut state.force {
            *pair = [next(), next()];
        }
        state.resultant = [next(), next()];
        state.path_since_reversal = [next(), next()];
        state.rim_lag = [next(), next()];
        state.depth = next();
        state.limit = next();
        state.stiffness = next();
        state.energy = next();
        state.stored_energy = next();
        state.press_slide = next();
        state.strength_factor = next();
        state.check()
    }

    /// The state itself if a step could have left it behind.
    pub(crate) fn check(self) -> Result<Self, Error> {
        let bad = |index: usize, value: f32| Error::Range { what: Field::State, index: index as u16, value };
        for (j, [x, y]) in self.force.iter().chain([&self.resultant]).enumerate() {
            let square = x * x + y * y;
            // Tilted limits reach to 1.29; along y the root of the stiffness ratio may stretch them.
            if !(square <= 30.0) {
                return Err(bad(j, square));
            }
        }
        let [x, y] = self.path_since_reversal;
        // The path since a reversal may lead across the whole circle.
        if !(x * x + y * y <= 6.8) {
            return Err(bad(M, x * x + y * y));
        }
        let positive = |x: f32| x > 0.0 && x <= 1e12;
        let in_contact = self.depth >= TOUCH_MM;
        let plain = self.limit == 0.0 && self.stiffness == 0.0 && self.depth == 0.0 && self.press_slide == 0.0;
        let still = self
            .force
            .as_flattened()
            .iter()
            .chain(&self.resultant)
            .chain(&self.path_since_reversal)
            .chain(&self.rim_lag)
            .chain([&self.stored_energy, &self.energy])
            .all(|x| *x == 0.0);
        let air = plain && still;
        if !self.depth.is_finite() {
            return Err(bad(M, self.depth));
        }
        let pressed = positive(self.limit) && positive(self.stiffness);
        if !(if in_contact { pressed } else { air }) {
            return Err(bad(M + 1, self.limit));
        }
        if !(self.energy >= 0.0 && self.energy <= 1e9) {
            return Err(bad(M + 2, self.energy));
        }
        for lag in self.rim_lag {
            if !(lag.abs() <= 1e6) {
                return Err(bad(M + 6, lag));
            }
        }
        if !(self.stored_energy >= 0.0 && self.stored_energy <= 1e9) {
            return Err(bad(M + 5, self.stored_energy));
        }
        if !(self.press_slide.abs() <= 4096.0) {
            return Err(bad(M + 3, self.press_slide));
        }
        if !(self.strength_factor >= 0.2 && self.strength_factor <= 5.0) {
            return Err(bad(M + 4, self.strength_factor));
        }
        Ok(self)
    }
}

impl State {
    /// The state as bytes; see [`StateOf::write_bytes`].
    pub fn to_bytes(&self) -> [u8; STATE_BYTES] {
        let mut bytes = [0; STATE_BYTES];
        // The buffer has the right length.
        let _ = self.write_bytes(&mut bytes);
        bytes
    }

    /// A state from [`State::to_bytes`].
    pub fn from_bytes(bytes: &[u8; STATE_BYTES]) -> Result<Self, Error> {
        Self::read_bytes(bytes)
    }
}

#[cfg(feature = "serde")]
mod with_serde {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::StateOf;

    #[derive(Serialize, Deserialize)]
    struct Plain<const M: usize> {
        #[serde(with = "crate::array")]
        force: [[f32; 2]; M],
        resultant: [f32; 2],
        path_since_reversal: [f32; 2],
        depth_mm: f32,
        limit_n: f32,
        stiffness_n_mm: f32,
        energy_mj: f32,
        stored_energy_mj: f32,
        rim_lag_mm: [f32; 2],
        press_slide_half_cells: f32,
        strength_factor: f32,
    }

    impl<const M: usize> Serialize for StateOf<M> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let plain = Plain {
                force: self.force,
                resultant: self.resultant,
                path_since_reversal: self.path_since_reversal,
                depth_mm: self.depth,
                limit_n: self.limit,
                stiffness_n_mm: self.stiffness,
                energy_mj: self.energy,
                stored_energy_mj: self.stored_energy,
                rim_lag_mm: self.rim_lag,
                press_slide_half_cells: self.press_slide,
                strength_factor: self.strength_factor,
            };
            plain.serialize(serializer)
        }
    }

    impl<'de, const M: usize> Deserialize<'de> for StateOf<M> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let plain = Plain::deserialize(deserializer)?;
            let state = Self {
                force: plain.force,
                resultant: plain.resultant,
                path_since_reversal: plain.path_since_reversal,
                depth: plain.depth_mm,
                limit: plain.limit_n,
                stiffness: plain.stiffness_n_mm,
                energy: plain.energy_mj,
                stored_energy: plain.stored_energy_mj,
                rim_lag: plain.rim_lag_mm,
                press_slide: plain.press_slide_half_cells,
                strength_factor: plain.strength_factor,
            };
            state.check().map_err(serde::de::Error::custom)
        }
    }
}
