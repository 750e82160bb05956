//! Contacts of one bed of springs.
//!
//! Main type: [`Springs`]. Uses the core's batch, driven step, gradient and saved states.

use bytemuck::Pod;
use fingerpad::host::{Forces, Motions};
use fingerpad::{Error, Memory, Motion, Regime, Response, SPRINGS, SpinState, StateOf, Status};

use crate::group::{
    DRIVEN, FORCES, Given, Group, REGIME, Refused, Row, Watches, drive_all, gradients, states, write_floats,
    write_response,
};
use crate::model::Bed;

/// Contacts that pass through the core's batch at once, so that its numbers stay in the nearest cache.
const CHUNK: usize = 256;

/// A memory of the tissue, `()` or [`fingerpad::BedMemory`].
pub trait Tissue<const P: usize>: Memory<SPRINGS, P, f32> + Pod + Send {}
impl<const P: usize, R: Memory<SPRINGS, P, f32> + Pod + Send> Tissue<P> for R {}

/// Contacts of a bed; `P` is 2 with spin, and `R` the memory of the tissue.
#[derive(Clone)]
pub struct Springs<const P: usize, R> {
    bed: Bed,
    states: Vec<StateOf<SPRINGS, P, f32, R>>,
    watches: Watches,
}

impl<const P: usize, R: Tissue<P>> Springs<P, R> {
    /// `count` contacts in the air; none where there is no memory for them.
    pub fn new(bed: Bed, count: usize) -> Option<Self> {
        Some(Self { bed, states: states(StateOf::default(), count)?, watches: Watches::default() })
    }

    /// Bytes of a saved state, and the checksum of its model.
    fn saved(&self) -> Result<(usize, u32), Error> {
        Ok((StateOf::<SPRINGS, P, f32, R>::SAVED_BYTES, self.bed.model()?.checksum()))
    }

    fn set_strength(&mut self, first: usize, row: &Row) {
        for (state, factor) in self.states[first..].iter_mut().zip(row.strength_factor) {
            state.set_strength_factor(*factor);
        }
    }
}

impl<const P: usize, R: Tissue<P>> Group for Springs<P, R> {
    fn steps_between_looks(&self) -> usize {
        1 << 16
    }

    fn step(&mut self, first: usize, row: &Row, out: &mut [u32]) -> Result<(), Error> {
        self.set_strength(first, row);
        let count = row.depth_mm.len();
        let words = out.len() / count.max(1);
        let states = &mut self.states[first..first + count];
        let model = self.bed.model()?;
        if words == FORCES {
            batch(|states, motions, forces| model.step_batch(states, motions, forces), states, row, out);
        } else {
            for (i, (state, out)) in states.iter_mut().zip(out.chunks_exact_mut(words)).enumerate() {
                write_response(&model.step(state, row.motion(i)), out);
            }
        }
        self.watches.look(first, out, words);
        Ok(())
    }

    fn state(&self) -> (Vec<f32>, Vec<f32>) {
        self.states.iter().map(|state| (state.depth_mm(), state.strength_factor())).unzip()
    }

    fn reset(&mut self, which: &[bool]) {
        for (state, _) in self.states.iter_mut().zip(which).filter(|(_, chosen)| **chosen) {
            *state = StateOf::default();
        }
    }

    fn save(&self) -> Result<Vec<u8>, Refused> {
        let (one, model) = self.saved()?;
        let mut bytes = vec![0; one * self.states.len()];
        for (state, out) in self.states.iter().zip(bytes.chunks_exact_mut(one)) {
            state.write_bytes(model, out)?;
        }
        Ok(bytes)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Refused> {
        let (one, model) = self.saved()?;
        let expected = one * self.states.len();
        if bytes.len() != expected {
            return Err(Error::Length { expected: expected as u32, found: bytes.len() as u32 }.into());
        }
        self.states =
            bytes.chunks_exact(one).map(|saved| StateOf::read_bytes(model, saved)).collect::<Result<_, _>>()?;
        Ok(())
    }

    fn limit_surface(&self, motions: &[[f32; 3]], out: &mut [[f32; 3]]) -> Result<(), Refused> {
        let model = self.bed.model()?;
        for (state, out) in self.states.iter().zip(out.chunks_exact_mut(motions.len())) {
            let (depth_mm, factor) = (state.depth_mm(), state.strength_factor());
            for (motion, out) in motions.iter().zip(out) {
                *out = steady_slip(|state, motion| model.step(state, motion), depth_mm, factor, *motion);
            }
        }
        Ok(())
    }

    fn watches(&mut self) -> &mut Watches {
        &mut self.watches
    }

    fn copy(&self) -> Box<dyn Group> {
        Box::new(self.clone())
    }

    fn step_driven(&mut self, row: &Row, given: Given, out: &mut [u32]) -> Result<(), Refused> {
        let model = self.bed.model()?;
        drive_all(self.states.iter_mut().map(|state| (model, state)), row, given, out);
        self.watches.look(0, out, DRIVEN);
        Ok(())
    }

    fn gradient(&self, direction: &[f32], out: &mut [f32]) -> Result<(), Refused> {
        let model = self.bed.model()?;
        gradients(self.states.iter().map(|state| (model, state)), direction, out);
        Ok(())
    }
}

/// Lengths of the steps of a slide to the limit: from and to, mm, the factor from one length to the next, and steps of each length.
/// Long steps settle a spring near the pole of a turn, which hardly moves, short ones the direction of its friction.
const TO_THE_LIMIT: (f32, f32, f32, usize) = (64.0, 0.002, 0.8, 20);
/// Distance from the centre of a turn at which its length counts, mm: about the middle of a spring's arm.
const ARM_MM: f32 = 3.0;

/// Friction and moment of a contact that slides far in one direction, N and N mm; 0 without a motion.
///
/// Differs from the springs' closed form of steady slip by at most 1 % of the largest over all directions (`tests/test_limits.py`).
fn steady_slip(
    step: impl Fn(&mut SpinState, Motion) -> Response,
    depth_mm: f32,
    strength_factor: f32,
    [x, y, turn]: [f32; 3],
) -> [f32; 3] {
    let way = x.hypot(y).hypot(ARM_MM * turn);
    if way == 0.0 {
        return [0.0; 3];
    }
    let mut state = SpinState::default();
    state.set_strength_factor(strength_factor);
    let mut last = Response::default();
    let (mut length_mm, least_mm, factor, steps) = TO_THE_LIMIT;
    while length_mm > least_mm {
        let scale = length_mm / way;
        let motion = Motion {
            depth_mm,
            slide_increment_mm: [x * scale, y * scale],
            spin_increment_rad: turn * scale,
            dt_s: 1e-3,
        };
        for _ in 0..steps {
            last = step(&mut state, motion);
        }
        length_mm *= factor;
    }
    [last.friction_n[0], last.friction_n[1], last.spin_moment_n_mm]
}

/// Advances contacts by the core's batch, which computes forces alone.
fn batch<const P: usize, R: Tissue<P>>(
    step: impl Fn(&mut [StateOf<SPRINGS, P, f32, R>], Motions, &mut Forces) -> Result<(), fingerpad::host::BatchLength>,
    states: &mut [StateOf<SPRINGS, P, f32, R>],
    row: &Row,
    out: &mut [u32],
) {
    let count = states.len();
    let (mut numbers, mut regimes, mut statuses) = ([[0.0; CHUNK]; 6], [Regime::NoContact; CHUNK], [Status::OK; CHUNK]);
    for start in (0..count).step_by(CHUNK) {
        let end = (start + CHUNK).min(count);
        let Row { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s, .. } = row.part(start, end);
        let part = Motions { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s };
        let mut forces = Forces::of(
            numbers.each_mut().map(|of_kind| &mut of_kind[..end - start]),
            &mut regimes[..end - start],
            &mut statuses[..end - start],
        );
        step(&mut states[start..end], part, &mut forces).expect("all slices are of one length");
        for (i, out) in out[FORCES * start..FORCES * end].chunks_exact_mut(FORCES).enumerate() {
            write_floats(numbers.each_ref().map(|of_kind| of_kind[i]), out);
            out[REGIME] = regimes[i] as u32;
            out[REGIME + 1] = statuses[i].0;
        }
    }
}
