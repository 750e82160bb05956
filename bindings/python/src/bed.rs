//! Contacts of one model, numbers of a kind side by side in memory that numpy owns.
//!
//! Main type: [`Bed`]. Uses the core's batch, driven step, gradient, watches and saved states.

use std::sync::Arc;

use fingerpad::events::{Event, Queue, Watch, WatchSettings};
use fingerpad::{
    DataOf, Drive, Error, Forces, Motion, Motions, NODES, Normal, Pose, Regime, Response, StateOf, Status, Tangential,
    Tuning, state_bytes,
};

use crate::model::with_model;

/// Words of the forces of one contact: six floats, regime and status.
pub const FORCES: usize = 8;
/// Words of all that a contact answers: limit, area, centre of pressure and bands as well.
pub const RESPONSE: usize = 14;
/// Words of a driven contact: depth, slides and spin as well.
pub const DRIVEN: usize = 18;
/// Place of the stick ratio and of the regime among a contact's words.
const STICK_RATIO: usize = 5;
const REGIME: usize = 6;
/// Contacts that pass through the core's batch at once, so that its numbers stay in the nearest cache.
const CHUNK: usize = 256;

/// One time step of all contacts; slices are as long as there are contacts, or empty where the caller left them out.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub depth_mm: &'a [f32],
    pub slide_x_mm: &'a [f32],
    pub slide_y_mm: &'a [f32],
    pub spin_rad: &'a [f32],
    pub strength_factor: &'a [f32],
    pub pitch_deg: &'a [f32],
    pub roll_deg: &'a [f32],
    pub dt_s: f32,
}

impl Row<'_> {
    fn pose(&self, i: usize) -> Option<Pose> {
        Some(Pose { pitch_deg: *self.pitch_deg.get(i)?, roll_deg: *self.roll_deg.get(i)? })
    }

    /// The end of the contacts from `start` on that are in the same pose.
    fn end_of_pose(&self, start: usize) -> usize {
        let first = self.pose(start);
        (start + 1..self.depth_mm.len()).find(|&i| self.pose(i) != first).unwrap_or(self.depth_mm.len())
    }
}

/// Whether a driven step is given forces (N) in place of depth and of slides (mm).
#[derive(Clone, Copy)]
pub struct Given {
    pub normal_force: bool,
    pub friction: bool,
}

/// Contacts of one model.
pub trait Bed: Send {
    /// Refuses the poses of a step before any contact moves.
    fn check_poses(&self, row: &Row) -> Result<(), Error>;
    /// Advances all contacts; `out` has [`FORCES`] words a contact, or [`RESPONSE`].
    fn step(&mut self, row: &Row, out: &mut [u32]) -> Result<(), Error>;
    /// Advances all contacts by displacements or forces; `out` has [`DRIVEN`] words a contact.
    fn step_driven(&mut self, row: &Row, given: Given, out: &mut [u32]) -> Result<(), Error>;
    /// Derivatives of normal force and friction (N) with depth and slides (mm), nine numbers a contact, for motions that go
    /// on in `direction`, three numbers a contact.
    fn gradient(&self, direction: &[f32], pose: Option<Pose>, out: &mut [f32]) -> Result<(), Error>;
    /// Depth of each contact, mm, and its strength factor.
    fn state(&self) -> (Vec<f32>, Vec<f32>);
    /// Lifts the contacts of `which` off and forgets all that they remember, the strength factor as well.
    fn reset(&mut self, which: &[bool]);
    /// Bytes of the saved state of one contact.
    fn state_bytes(&self) -> usize;
    /// All contacts as bytes.
    fn save(&self) -> Result<Vec<u8>, Error>;
    /// What [`Bed::save`] wrote; nothing changes if it is refused.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), Error>;
    /// Sees events from now on, with the ticks counted from here.
    fn watch(&mut self, settings: WatchSettings);
    /// Number of the contact and event, since they were last taken.
    fn take_events(&mut self) -> Vec<(u32, Event)>;
    /// The same contacts again.
    fn copy(&self) -> Box<dyn Bed>;
}

/// Contacts of a model with `M` springs; `P` is 2 with spin.
#[derive(Clone)]
pub struct BedOf<const M: usize, const P: usize> {
    data: Arc<DataOf<M, NODES>>,
    tuning: Option<Tuning>,
    states: Vec<StateOf<M, P>>,
    watches: Vec<Watch>,
    events: Vec<(u32, Event)>,
}

impl<const M: usize, const P: usize> BedOf<M, P> {
    /// `count` contacts in the air.
    pub fn new(data: Arc<DataOf<M, NODES>>, tuning: Option<Tuning>, count: usize) -> Self {
        Self { data, tuning, states: vec![StateOf::default(); count], watches: Vec::new(), events: Vec::new() }
    }

    fn set_strength(&mut self, row: &Row) {
        for (state, factor) in self.states.iter_mut().zip(row.strength_factor) {
            state.set_strength_factor(*factor);
        }
    }

    /// Shows every watch what its contact did.
    fn look(&mut self, out: &[u32], words: usize) {
        for ((i, watch), contact) in self.watches.iter_mut().enumerate().zip(out.chunks_exact(words)) {
            let mut response = Response::default();
            response.stick_ratio = f32::from_bits(contact[STICK_RATIO]);
            response.regime = [Regime::NoContact, Regime::Stick, Regime::PartialSlip, Regime::Slip]
                .into_iter()
                .find(|regime| *regime as u32 == contact[REGIME])
                .unwrap_or_default();
            let mut queue: Queue<4> = Queue::new();
            let (mut producer, mut consumer) = queue.split();
            watch.look(&response, &mut producer);
            self.events.extend(std::iter::from_fn(|| consumer.dequeue()).map(|event| (i as u32, event)));
        }
    }
}

impl<const M: usize, const P: usize> Bed for BedOf<M, P> {
    fn check_poses(&self, row: &Row) -> Result<(), Error> {
        let mut start = 0;
        while !row.pitch_deg.is_empty() && start < self.states.len() {
            with_model!(self.data, self.tuning, row.pose(start), |_model| ());
            start = row.end_of_pose(start);
        }
        Ok(())
    }

    fn step(&mut self, row: &Row, out: &mut [u32]) -> Result<(), Error> {
        self.set_strength(row);
        let count = self.states.len();
        let words = out.len() / count.max(1);
        let data = self.data.clone();
        let mut start = 0;
        while start < count {
            let end = row.end_of_pose(start);
            let (states, out) = (&mut self.states[start..end], &mut out[words * start..words * end]);
            with_model!(data, self.tuning, row.pose(start), |model| step_alike(
                |states, motions, forces| model.step_batch(states, motions, forces),
                |state, motion| model.step(state, motion),
                states,
                motions(row, start, end),
                out
            ));
            start = end;
        }
        self.look(out, words);
        Ok(())
    }

    fn step_driven(&mut self, row: &Row, given: Given, out: &mut [u32]) -> Result<(), Error> {
        self.set_strength(row);
        let data = self.data.clone();
        let contacts = self.states.iter_mut().zip(out.chunks_exact_mut(DRIVEN));
        for (i, (state, out)) in contacts.enumerate() {
            let (normal, tangential) = (row.depth_mm[i], [row.slide_x_mm[i], row.slide_y_mm[i]]);
            let drive = Drive {
                normal: if given.normal_force { Normal::ForceN(normal) } else { Normal::DepthMm(normal) },
                tangential: match given.friction {
                    true => Tangential::FrictionN(tangential),
                    false => Tangential::SlideIncrementMm(tangential),
                },
                spin_increment_rad: row.spin_rad.get(i).copied().unwrap_or(0.0),
                dt_s: row.dt_s,
            };
            let driven = with_model!(data, self.tuning, row.pose(i), |model| model.step_driven(state, drive));
            write_response(&driven.response, &mut out[..RESPONSE]);
            let Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, .. } = driven.motion;
            write_floats([depth_mm, x, y, spin_increment_rad], &mut out[RESPONSE..]);
        }
        self.look(out, DRIVEN);
        Ok(())
    }

    fn gradient(&self, direction: &[f32], pose: Option<Pose>, out: &mut [f32]) -> Result<(), Error> {
        let (directions, outs) = (direction.as_chunks::<3>().0, out.as_chunks_mut::<9>().0);
        with_model!(self.data, self.tuning, pose, |model| {
            for ((state, direction), out) in self.states.iter().zip(directions).zip(outs) {
                let gradient = model.gradient(state, *direction);
                let [x, y] = gradient.friction_n_mm;
                out.as_chunks_mut::<3>().0.copy_from_slice(&[gradient.normal_n_mm, x, y]);
            }
        });
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

    fn state_bytes(&self) -> usize {
        state_bytes(M, P)
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        let (one, model) = (self.state_bytes(), self.data.checksum());
        let mut bytes = vec![0; one * self.states.len()];
        for (state, out) in self.states.iter().zip(bytes.chunks_exact_mut(one)) {
            state.write_bytes(model, out)?;
        }
        Ok(bytes)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let (one, model) = (self.state_bytes(), self.data.checksum());
        let expected = one * self.states.len();
        if bytes.len() != expected {
            return Err(Error::Length { expected: expected as u32, found: bytes.len() as u32 });
        }
        self.states =
            bytes.chunks_exact(one).map(|saved| StateOf::read_bytes(model, saved)).collect::<Result<_, _>>()?;
        Ok(())
    }

    fn watch(&mut self, settings: WatchSettings) {
        // The number of a contact is kept beside its events, since it may not fit into the watch's own.
        self.watches = vec![Watch::with_settings(0, settings); self.states.len()];
        self.events.clear();
    }

    fn take_events(&mut self) -> Vec<(u32, Event)> {
        std::mem::take(&mut self.events)
    }

    fn copy(&self) -> Box<dyn Bed> {
        Box::new(self.clone())
    }
}

/// The motions of the contacts from `start` to `end`.
fn motions<'a>(row: &Row<'a>, start: usize, end: usize) -> Motions<'a> {
    Motions {
        depth_mm: &row.depth_mm[start..end],
        slide_x_mm: &row.slide_x_mm[start..end],
        slide_y_mm: &row.slide_y_mm[start..end],
        spin_rad: row.spin_rad.get(start..end).unwrap_or(&[]),
        dt_s: row.dt_s,
    }
}

/// Advances contacts in one pose: by the core's batch where only forces are wanted, else one by one.
fn step_alike<const M: usize, const P: usize>(
    batch: impl Fn(&mut [StateOf<M, P>], Motions, &mut Forces) -> Result<(), fingerpad::BatchLength>,
    one: impl Fn(&mut StateOf<M, P>, Motion) -> Response,
    states: &mut [StateOf<M, P>],
    motions: Motions,
    out: &mut [u32],
) {
    let count = states.len();
    if out.len() != FORCES * count {
        for (i, (state, out)) in states.iter_mut().zip(out.chunks_exact_mut(RESPONSE)).enumerate() {
            let motion = Motion {
                depth_mm: motions.depth_mm[i],
                slide_increment_mm: [motions.slide_x_mm[i], motions.slide_y_mm[i]],
                spin_increment_rad: motions.spin_rad.get(i).copied().unwrap_or(0.0),
                dt_s: motions.dt_s,
            };
            write_response(&one(state, motion), out);
        }
        return;
    }
    let (mut numbers, mut regimes, mut statuses) = ([[0.0; CHUNK]; 6], [Regime::NoContact; CHUNK], [Status::OK; CHUNK]);
    for start in (0..count).step_by(CHUNK) {
        let end = (start + CHUNK).min(count);
        let part = Motions {
            depth_mm: &motions.depth_mm[start..end],
            slide_x_mm: &motions.slide_x_mm[start..end],
            slide_y_mm: &motions.slide_y_mm[start..end],
            spin_rad: motions.spin_rad.get(start..end).unwrap_or(&[]),
            dt_s: motions.dt_s,
        };
        let mut forces = Forces::of(
            numbers.each_mut().map(|of_kind| &mut of_kind[..end - start]),
            &mut regimes[..end - start],
            &mut statuses[..end - start],
        );
        batch(&mut states[start..end], part, &mut forces).expect("all slices are of one length");
        for (i, out) in out[FORCES * start..FORCES * end].chunks_exact_mut(FORCES).enumerate() {
            write_floats(numbers.each_ref().map(|of_kind| of_kind[i]), out);
            out[REGIME] = regimes[i] as u32;
            out[REGIME + 1] = u32::from(statuses[i].0);
        }
    }
}

fn write_floats<const N: usize>(numbers: [f32; N], out: &mut [u32]) {
    for (word, number) in out.iter_mut().zip(numbers) {
        *word = number.to_bits();
    }
}

/// Writes all that a contact answers, the forces first.
fn write_response(r: &Response, out: &mut [u32]) {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    write_floats([r.normal_force_n, x, y, r.spin_moment_n_mm, r.slip_margin, r.stick_ratio], out);
    out[REGIME] = r.regime as u32;
    out[REGIME + 1] = u32::from(r.status.0);
    let rest = [r.friction_limit_n, r.contact_area_mm2, centre_x, centre_y, r.band_normal_n, r.band_friction_n];
    write_floats(rest, &mut out[FORCES..]);
}
