//! Saving and restoring the state of a contact.
//!
//! Uses state, memory, model_file, error.

use bytemuck::Pod;

use crate::build::DataOf;
use crate::data::SPRINGS;
use crate::error::Field;
use crate::memory::Memory;
use crate::model_file::crc32;
use crate::step::TOUCH_MM;
use crate::{BRANCHES, Error, State, StateOf};

/// Version of the layout of a saved state.
const VERSION: u32 = 7;
/// Largest magnitude of a number of a state: a position after an endless slide, mm. There the rounding of a position exceeds the few mm by
/// which the origin moves at a time.
const REACH: f32 = 1e9;
/// Words beside the anchors: version, model, position, angle, three places of the way, two limits, depth,
/// strength factor, checksum.
const BESIDE: usize = 2 + 4 + 2 + 9 + 4 + 1;

/// Bytes of a saved state of the default model.
pub const STATE_BYTES: usize = state_bytes(SPRINGS, 1);

/// Bytes of a saved state with `springs` springs, `pairs` 2 with spin and 1 without.
pub const fn state_bytes(springs: usize, pairs: usize) -> usize {
    4 * (2 * springs * pairs + BESIDE)
}

/// Writes a saved state of `length` bytes into `out`, little-endian: version and checksum of its model, its words, and the CRC-32 of
/// all before. Returns the length.
pub(crate) fn write_words(
    head: [u32; 2],
    words: impl Iterator<Item = u32>,
    length: usize,
    out: &mut [u8],
) -> Result<usize, Error> {
    let short = Error::Buffer { needed: length as u32 };
    let out = out.get_mut(..length).ok_or(short)?;
    let (body, end) = out.split_last_chunk_mut::<4>().ok_or(short)?;
    for (slot, word) in body.as_chunks_mut::<4>().0.iter_mut().zip(head.into_iter().chain(words)) {
        *slot = word.to_le_bytes();
    }
    *end = crc32(body).to_le_bytes();
    Ok(length)
}

/// The words that [`write_words`] wrote with the same version and model.
pub(crate) fn read_words(
    [version, model]: [u32; 2],
    length: usize,
    bytes: &[u8],
) -> Result<impl Iterator<Item = u32>, Error> {
    if bytes.len() != length {
        return Err(Error::Length { expected: length as u32, found: bytes.len() as u32 });
    }
    let (body, end) = bytes.split_last_chunk::<4>().ok_or(Error::Checksum)?;
    if crc32(body) != u32::from_le_bytes(*end) {
        return Err(Error::Checksum);
    }
    let mut words = body.as_chunks::<4>().0.iter().map(|four| u32::from_le_bytes(*four));
    let (found_version, found) = (words.next().unwrap_or(0), words.next().unwrap_or(0));
    if found_version != version {
        return Err(Error::Version { found: found_version });
    }
    if found != model {
        return Err(Error::OtherModel { found, expected: model });
    }
    Ok(words)
}

/// The same for tissue that relaxes.
pub const fn relaxing_state_bytes(springs: usize, pairs: usize) -> usize {
    state_bytes(springs, pairs) + 4 * BRANCHES * (1 + 2 * springs * pairs + 2)
}

impl<const M: usize, const P: usize, R: Memory<M, P, f32> + Pod> StateOf<M, P, f32, R> {
    /// Length of a saved state, bytes: [`state_bytes`] or [`relaxing_state_bytes`].
    pub const SAVED_BYTES: usize = state_bytes(M, P) + size_of::<R>();

    /// Numbers of a state: anchors, position, angle, turn, reached, turn before, limits there, depth, strength factor, memory of the tissue.
    fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        let Self { forces, history } = self;
        let anchors = forces.anchor.as_flattened().as_flattened().iter();
        let places = forces.position.as_flattened().iter().chain(&forces.angle);
        let way = history.turn.iter().chain(&history.reached).chain(&history.turn_before);
        let numbers = [history.limit_reached, history.limit_before, forces.depth, forces.strength_factor];
        let memory: &[f32] = bytemuck::try_cast_slice(bytemuck::bytes_of(&forces.memory)).unwrap_or(&[]);
        anchors.chain(places).chain(way).copied().chain(numbers).chain(memory.iter().copied())
    }

    /// Writes the state into `out`, little-endian with version, checksum of the model's numbers ([`DataOf::checksum`]) and
    /// a checksum of its own at the end; returns the number of bytes, [`Self::SAVED_BYTES`].
    pub fn write_bytes(&self, model: u32, out: &mut [u8]) -> Result<usize, Error> {
        write_words([VERSION, model], self.numbers().map(f32::to_bits), Self::SAVED_BYTES, out)
    }

    /// The same numbers to be overwritten, in the same order.
    fn numbers_mut(&mut self) -> impl Iterator<Item = &mut f32> {
        let Self { forces, history } = self;
        let anchors = forces.anchor.as_flattened_mut().as_flattened_mut().iter_mut();
        let places = forces.position.as_flattened_mut().iter_mut().chain(&mut forces.angle);
        let way = history.turn.iter_mut().chain(&mut history.reached).chain(&mut history.turn_before);
        let limits = [&mut history.limit_reached, &mut history.limit_before];
        let last = limits.into_iter().chain([&mut forces.depth, &mut forces.strength_factor]);
        let memory: &mut [f32] =
            bytemuck::try_cast_slice_mut(bytemuck::bytes_of_mut(&mut forces.memory)).unwrap_or(&mut []);
        anchors.chain(places).chain(way).chain(last).chain(memory)
    }

    /// The state that [`StateOf::write_bytes`] wrote with the same model. Refuses damage, another version, another model's state and values
    /// that no step produces.
    pub fn read_bytes(model: u32, bytes: &[u8]) -> Result<Self, Error> {
        let mut words = read_words([VERSION, model], Self::SAVED_BYTES, bytes)?;
        let mut state = Self::default();
        for slot in state.numbers_mut() {
            *slot = words.next().map_or(f32::NAN, f32::from_bits);
        }
        state.check()
    }

    /// The state itself if a step can produce it.
    pub(crate) fn check(mut self) -> Result<Self, Error> {
        let bad = |index: usize, value: f32| Error::Range { what: Field::State, index: index as u16, value };
        for (i, x) in self.numbers().enumerate() {
            if !(x.abs() <= REACH) {
                return Err(bad(i, x));
            }
        }
        let last = 2 * M * P + BESIDE;
        if self.forces.memory.get().is_some_and(|memory| !memory.is_consistent()) {
            return Err(bad(last, f32::NAN));
        }
        let Self { forces, history } = &self;
        let mut air = Self::default();
        (air.forces.strength_factor, air.forces.memory) = (forces.strength_factor, forces.memory);
        if !(forces.depth >= TOUCH_MM || self == air) {
            return Err(bad(last - 5, forces.depth));
        }
        if !(history.limit_reached >= 0.0) {
            return Err(bad(last - 7, history.limit_reached));
        }
        if !(history.limit_before >= 0.0) {
            return Err(bad(last - 6, history.limit_before));
        }
        if !forces.is_consistent() {
            return Err(bad(last - 4, forces.strength_factor));
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

    use super::StateOf;
    use crate::ForceStateOf;
    use crate::stick_ratio::SlipHistory;

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
            let Self { forces, history } = self;
            let plain = Plain {
                anchor_mm: forces.anchor.map(Pair),
                position_mm: forces.position,
                angle_rad: forces.angle,
                turn: history.turn,
                reached: history.reached,
                limit_reached_n: history.limit_reached,
                turn_before: history.turn_before,
                limit_before_n: history.limit_before,
                depth_mm: forces.depth,
                strength_factor: forces.strength_factor,
            };
            plain.serialize(serializer)
        }
    }

    impl<'de, const M: usize, const P: usize> Deserialize<'de> for StateOf<M, P> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let plain = Plain::<M, P>::deserialize(deserializer)?;
            let forces = ForceStateOf {
                anchor: plain.anchor_mm.map(|pair| pair.0),
                position: plain.position_mm,
                angle: plain.angle_rad,
                depth: plain.depth_mm,
                strength_factor: plain.strength_factor,
                memory: (),
            };
            let history = SlipHistory {
                turn: plain.turn,
                reached: plain.reached,
                limit_reached: plain.limit_reached_n,
                turn_before: plain.turn_before,
                limit_before: plain.limit_before_n,
            };
            Self { forces, history }.check().map_err(serde::de::Error::custom)
        }
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::build::Data;
    use crate::host::ModelFile;
    use crate::{Motion, Response, Status, step};

    /// Uniform in −1 to 1, the same every time.
    struct Noise(u64);

    impl Noise {
        fn bits(&mut self) -> u32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 32) as u32
        }

        fn next(&mut self) -> f32 {
            (self.bits() >> 8) as f32 / (1 << 23) as f32 - 1.0
        }

        fn below(&mut self, count: usize) -> usize {
            self.bits() as usize % count
        }
    }

    fn shipped() -> Data {
        *ModelFile::new(include_bytes!("../tests/data/fingertip.fpm")).unwrap().file().model.data()
    }

    /// Saves a state and restores it.
    fn restored<const P: usize>(state: &StateOf<SPRINGS, P>) -> Result<StateOf<SPRINGS, P>, Error> {
        let mut bytes = [0; state_bytes(SPRINGS, 2)];
        let length = state.write_bytes(7, &mut bytes).unwrap();
        StateOf::read_bytes(7, &bytes[..length])
    }

    fn moved(depth_mm: f32, x: f32, y: f32, spin_increment_rad: f32) -> Motion {
        Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s: 1e-3 }
    }

    /// Random paths of depth, slide and spin, small and large, with reversals and lift-offs: every state is restored.
    fn random_paths_are_restored<const P: usize>() {
        let data = shipped();
        let model = data.model().unwrap();
        let mut noise = Noise(3);
        for _ in 0..3000 {
            let mut state = StateOf::<SPRINGS, P>::default();
            let slide = [1e-3, 0.1, 4.0][noise.below(3)];
            for _ in 0..60 {
                let depth_mm = if noise.below(40) == 0 { 0.0 } else { 1.0 + 0.9 * noise.next() };
                let spin = if P == 1 { 0.0 } else { 0.3 * noise.next() };
                let motion = moved(depth_mm, slide * noise.next(), slide * noise.next(), spin);
                let before = state;
                step(&model, &mut state, motion);
                assert_eq!(restored(&state), Ok(state), "{motion:?} {before:?}");
            }
        }
    }

    #[test]
    fn every_state_that_a_step_leaves_is_restored() {
        random_paths_are_restored::<1>();
        random_paths_are_restored::<2>();
    }

    /// A slide and a spin of any length.
    #[test]
    fn a_state_after_a_long_slide_is_restored() {
        let data = shipped();
        let model = data.model().unwrap();
        let (mut slid, mut spun) = (State::default(), StateOf::<SPRINGS, 2>::default());
        for i in 0..20_000 {
            step(&model, &mut slid, moved(1.0, 0.2, 0.1, 0.0));
            step(&model, &mut spun, moved(1.0, 0.2, 0.1, 0.2));
            assert_eq!(restored(&slid), Ok(slid), "{i}");
            assert_eq!(restored(&spun), Ok(spun), "{i}");
        }
    }

    /// A number that memory may hold after it was overwritten.
    fn overwritten(noise: &mut Noise) -> f32 {
        match noise.below(6) {
            0 => f32::from_bits(noise.bits()),
            1 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN][noise.below(4)],
            2 => [1e-45, -1e-45, 0.0, -0.0, 1e-20][noise.below(5)],
            3 => [f32::MAX, f32::MIN, 1e19, -1e19, 1e25][noise.below(5)],
            4 => 10.0 * noise.next(),
            _ => 1e3 * noise.next(),
        }
    }

    fn is_sound<const P: usize>(state: &StateOf<SPRINGS, P>, r: &Response) -> bool {
        let [x, y] = r.friction_n;
        let others = [r.spin_moment_n_mm, r.pressure_centre_mm[0], r.pressure_centre_mm[1], r.normal_force_n];
        let positive = [r.normal_force_n, r.friction_limit_n, r.contact_area_mm2, r.band_normal_n, r.band_friction_n];
        x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6)
            && (0.0..=1.0).contains(&r.slip_margin)
            && (0.0..=1.0).contains(&r.stick_ratio)
            && others.iter().all(|number| number.is_finite())
            && positive.iter().all(|number| *number >= 0.0 && *number < 1e3)
            && (0.1..=5.0).contains(&state.strength_factor())
    }

    /// A state of which some numbers are overwritten at random, in contact or in the air, plain and with spin: the next
    /// steps reset and flag it, or give sound answers.
    fn overwritten_memory_is_answered<const P: usize>() {
        let data = shipped();
        let model = data.model().unwrap();
        let mut noise = Noise(11);
        let (mut lost, mut kept) = (0, 0);
        for _ in 0..100_000 {
            let mut state = StateOf::<SPRINGS, P>::default();
            let spin = if P == 1 { 0.0 } else { 0.1 };
            for _ in 0..4 {
                step(&model, &mut state, moved(0.9, 0.2 * noise.next(), 0.1, spin * noise.next()));
            }
            let count = state.numbers_mut().count();
            for _ in 0..=noise.below(3) {
                let (place, number) = (noise.below(count), overwritten(&mut noise));
                *state.numbers_mut().nth(place).unwrap() = number;
            }
            let before = state;
            for k in 0..4 {
                let depth = [1.0 + 0.3 * noise.next(), 0.0, f32::NAN][[0, 0, 0, 0, 0, 0, 1, 2][noise.below(8)]];
                let motion = moved(depth, 0.3 * noise.next(), 0.3 * noise.next(), spin * noise.next());
                let r = step(&model, &mut state, motion);
                let flagged = r.status.contains(Status::MEMORY_LOST);
                (lost, kept) = (lost + u32::from(flagged), kept + u32::from(!flagged));
                assert!(is_sound(&state, &r), "{k}: {r:?} of {before:?} now {state:?}");
                assert!(!flagged || r.regime == crate::Regime::NoContact, "{r:?}");
            }
        }
        assert!(lost > 1000 && kept > 1000, "{lost} {kept}");
    }

    #[test]
    fn overwritten_memory_is_reset_or_sound() {
        overwritten_memory_is_answered::<1>();
        overwritten_memory_is_answered::<2>();
    }

    /// A strength factor outside its range is refused.
    #[test]
    fn an_inconsistent_state_is_refused() {
        let data = shipped();
        let mut state = State::default();
        step(&data.model().unwrap(), &mut state, moved(1.0, 0.3, 0.0, 0.0));
        assert!(restored(&state).is_ok());
        for factor in [-1.2, 0.0, 0.09, 5.1, f32::NAN] {
            let mut bad = state;
            bad.forces.strength_factor = factor;
            assert!(restored(&bad).is_err(), "{factor}");
        }
    }
}
