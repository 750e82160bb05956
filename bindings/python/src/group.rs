//! Contacts that step together, numbers of a kind side by side in memory that numpy owns.
//!
//! Main types: [`Group`], [`Row`], [`Watches`]. Uses the core's responses and events.

use fingerpad::events::{Event, Queue, Watch, WatchSettings};
use fingerpad::{Drivable, Drive, Error, Motion, Normal, Regime, Response, Tangential};
use pyo3::PyErr;

use crate::error;
use crate::frames::Pose;

/// Words of the forces of one contact: six floats, regime and status.
pub const FORCES: usize = 8;
/// Words of the whole response of a contact: limit, area, centre of pressure, bands, friction alone, moments and the margin that is left when
/// the tissue has relaxed as well.
pub const RESPONSE: usize = 19;
/// Place of the stick ratio and of the regime among a contact's words.
const STICK_RATIO: usize = 5;
pub const REGIME: usize = 6;

/// One time step of contacts; slices are as long as there are contacts, or empty where the caller left them out.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub depth_mm: &'a [f32],
    pub slide_x_mm: &'a [f32],
    pub slide_y_mm: &'a [f32],
    pub spin_rad: &'a [f32],
    pub strength_factor: &'a [f32],
    pub pitch_deg: &'a [f32],
    pub roll_deg: &'a [f32],
    /// Of contacts in frames alone.
    pub poses: &'a [Pose],
    pub dt_s: f32,
}

impl<'a> Row<'a> {
    /// No contacts.
    pub const REST: Self = Self {
        depth_mm: &[],
        slide_x_mm: &[],
        slide_y_mm: &[],
        spin_rad: &[],
        strength_factor: &[],
        pitch_deg: &[],
        roll_deg: &[],
        poses: &[],
        dt_s: 1e-3,
    };

    /// The contacts from `start` to `end`.
    pub fn part(&self, start: usize, end: usize) -> Self {
        let of = |slice: &'a [f32]| slice.get(start..end).unwrap_or(&[]);
        Self {
            depth_mm: of(self.depth_mm),
            slide_x_mm: of(self.slide_x_mm),
            slide_y_mm: of(self.slide_y_mm),
            spin_rad: of(self.spin_rad),
            strength_factor: of(self.strength_factor),
            pitch_deg: of(self.pitch_deg),
            roll_deg: of(self.roll_deg),
            poses: self.poses.get(start..end).unwrap_or(&[]),
            dt_s: self.dt_s,
        }
    }

    /// The motion of one contact.
    pub fn motion(&self, i: usize) -> Motion {
        Motion {
            depth_mm: self.depth_mm[i],
            slide_increment_mm: [self.slide_x_mm[i], self.slide_y_mm[i]],
            spin_increment_rad: self.spin_rad.get(i).copied().unwrap_or(0.0),
            dt_s: self.dt_s,
        }
    }
}

/// Why a saved state or a request is refused.
pub enum Refused {
    /// The core refuses it.
    Core(Error),
    /// It belongs to other contacts, or these have none.
    Text(String),
}

impl From<Refused> for PyErr {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Core(error) => error::model(error),
            Refused::Text(text) => error::model_text(text),
        }
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self::Core(error)
    }
}

fn cannot(function: &str) -> Refused {
    Refused::Text(format!("{function}: contacts in frames have none"))
}

/// Contacts of one model. Those in frames have neither bytes nor a limit surface.
pub trait Group: Send {
    /// Steps of single contacts between two looks for Ctrl-C: some milliseconds.
    fn steps_between_looks(&self) -> usize;
    /// Advances the contacts from `first` on, as many as the row has; `out` has [`FORCES`] words a contact, or [`RESPONSE`].
    fn step(&mut self, first: usize, row: &Row, out: &mut [u32]) -> Result<(), Error>;
    /// Depth of each contact, mm, and its strength factor.
    fn state(&self) -> (Vec<f32>, Vec<f32>);
    /// Lifts the contacts of `which` off and forgets all that they remember, the strength factor as well.
    fn reset(&mut self, which: &[bool]);
    /// All contacts as bytes.
    fn save(&self) -> Result<Vec<u8>, Refused> {
        Err(cannot("save"))
    }
    /// Takes up the bytes that [`Group::save`] wrote; nothing changes if it is refused.
    fn restore(&mut self, _bytes: &[u8]) -> Result<(), Refused> {
        Err(cannot("restore"))
    }
    /// The watches over events of the contacts.
    fn watches(&mut self) -> &mut Watches;
    /// The same contacts again.
    fn copy(&self) -> Box<dyn Group>;
    /// Advances all contacts by displacements or forces; `out` has [`DRIVEN`] words a contact.
    fn step_driven(&mut self, _row: &Row, _given: Given, _out: &mut [u32]) -> Result<(), Refused> {
        Err(cannot("step_driven"))
    }
    /// Derivatives of normal force and friction (N) with depth and slides (mm), nine numbers a contact, for motions that go
    /// on in `direction`, three numbers a contact.
    fn gradient(&self, _direction: &[f32], _out: &mut [f32]) -> Result<(), Refused> {
        Err(cannot("gradient"))
    }
    /// Friction along x and y (N) and moment about the normal (N mm) of each contact in full slip under each motion (slides along x
    /// and y, turn; of any length), three floats for each motion, one contact after the other.
    fn limit_surface(&self, _motions: &[[f32; 3]], _out: &mut [[f32; 3]]) -> Result<(), Refused> {
        Err(cannot("limit_surface"))
    }
    /// State of the patches of a pad: [`PATCH`] floats a patch, in frames [`FRAME_PATCH`], one contact after the other. Empty for a bed.
    fn patches(&self, _out: &mut [f32]) {}
    /// Floats of a patch.
    fn patch_floats(&self) -> usize {
        PATCH
    }
}

/// Floats of a patch: place x, y, z, pressure, traction x and y, area in contact, stick ratio, used share of the strength.
pub const PATCH: usize = 9;
/// Floats of a patch in frames: place, force and moment of three each, pressure, shear x and y, area, area in contact, stick ratio, used share
/// of the strength.
pub const FRAME_PATCH: usize = 16;

/// Whether a driven step is given forces (N) in place of depth and of slides (mm).
#[derive(Clone, Copy)]
pub struct Given {
    pub normal_force: bool,
    pub friction: bool,
}

/// Words of a driven contact: those of its response, then depth, slides and spin.
pub const DRIVEN: usize = RESPONSE + 4;

/// Drives contacts of fingers, one a state; see [`Group::step_driven`].
pub fn drive_all<'a, S: Clone + 'a, F: Drivable<S>>(
    contacts: impl Iterator<Item = (F, &'a mut S)>,
    row: &Row,
    given: Given,
    out: &mut [u32],
) {
    for (i, ((finger, state), out)) in contacts.zip(out.chunks_exact_mut(DRIVEN)).enumerate() {
        if let Some(factor) = row.strength_factor.get(i) {
            finger.set_strength_factor(state, *factor);
        }
        let Motion { depth_mm, slide_increment_mm, spin_increment_rad, dt_s } = row.motion(i);
        let drive = Drive {
            normal: if given.normal_force { Normal::ForceN(depth_mm) } else { Normal::DepthMm(depth_mm) },
            tangential: match given.friction {
                true => Tangential::FrictionN(slide_increment_mm),
                false => Tangential::SlideIncrementMm(slide_increment_mm),
            },
            spin_increment_rad,
            dt_s,
        };
        let driven = finger.step_driven(state, drive);
        write_response(&driven.response, &mut out[..RESPONSE]);
        let Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, .. } = driven.motion;
        write_floats([depth_mm, x, y, spin_increment_rad], &mut out[RESPONSE..]);
    }
}

/// Derivatives of contacts; see [`Group::gradient`].
pub fn gradients<'a, S: Clone + 'a, F: Drivable<S>>(
    contacts: impl Iterator<Item = (F, &'a S)>,
    direction: &[f32],
    out: &mut [f32],
) {
    let rows = direction.as_chunks::<3>().0.iter().zip(out.as_chunks_mut::<9>().0);
    for ((finger, state), (direction, out)) in contacts.zip(rows) {
        let gradient = finger.gradient(state, *direction);
        let [x, y] = gradient.friction_n_mm;
        out.as_chunks_mut::<3>().0.copy_from_slice(&[gradient.normal_n_mm, x, y]);
    }
}

/// Events of contacts: one watch a contact, none before [`Watches::start`].
#[derive(Clone, Default)]
pub struct Watches {
    watches: Vec<Watch>,
    events: Vec<(u32, Event)>,
}

impl Watches {
    /// Sees the events of `count` contacts from now on, with the ticks counted from here.
    pub fn start(&mut self, settings: WatchSettings, count: usize) {
        // The number of a contact is kept beside its events, since it may not fit into the watch's own.
        self.watches = vec![Watch::with_settings(0, settings); count];
        self.events.clear();
    }

    /// Number of the contact and event, since they were last taken.
    pub fn take(&mut self) -> Vec<(u32, Event)> {
        std::mem::take(&mut self.events)
    }

    /// Shows the watches from `first` the responses of their contacts, `words` a contact.
    pub fn look(&mut self, first: usize, out: &[u32], words: usize) {
        let watches = self.watches.get_mut(first..).unwrap_or(&mut []);
        for ((i, watch), contact) in watches.iter_mut().enumerate().zip(out.chunks_exact(words)) {
            let mut response = Response::default();
            response.stick_ratio = f32::from_bits(contact[STICK_RATIO]);
            response.regime = Regime::numbered(contact[REGIME]).unwrap_or_default();
            let mut queue: Queue<4> = Queue::new();
            let (mut producer, mut consumer) = queue.split();
            watch.look(&response, &mut producer);
            let events = std::iter::from_fn(|| consumer.dequeue());
            self.events.extend(events.map(|event| ((first + i) as u32, event)));
        }
    }
}

pub fn write_floats<const N: usize>(numbers: [f32; N], out: &mut [u32]) {
    for (word, number) in out.iter_mut().zip(numbers) {
        *word = number.to_bits();
    }
}

/// Writes the forces of a response, and behind them the rest where `out` has room for it.
pub fn write_response(r: &Response, out: &mut [u32]) {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    write_floats([r.normal_force_n, x, y, r.spin_moment_n_mm, r.slip_margin, r.stick_ratio], out);
    out[REGIME] = r.regime as u32;
    out[REGIME + 1] = r.status.0;
    let rest = [r.friction_limit_n, r.contact_area_mm2, centre_x, centre_y, r.band_normal_n, r.band_friction_n];
    let ([tangential_x, tangential_y], [about_x, about_y]) = (r.tangential_friction_n, r.tilt_moment_n_mm);
    let more = [tangential_x, tangential_y, about_x, about_y, r.slip_margin_relaxed];
    write_floats(rest, &mut out[FORCES..]);
    write_floats(more, out.get_mut(FORCES + rest.len()..).unwrap_or_default());
}

/// Room for `count` states, or none where there is not that much memory.
pub fn states<T: Clone>(state: T, count: usize) -> Option<Vec<T>> {
    let mut states = Vec::new();
    states.try_reserve_exact(count).ok()?;
    states.resize(count, state);
    Some(states)
}
