//! The reduced model as a WebAssembly module: a model file and motions in, responses out, all in the module's own memory.
//!
//! The page writes a file to [`incoming`] and calls [`load`], writes motions to [`motions`] and calls [`run`], and reads
//! responses from [`results`]. Nothing is imported, nothing is allocated, and no panic is linked. A module runs on one thread.
#![no_std]

mod skin;

use core::cell::UnsafeCell;

use fingerpad::{Contact, File, Model, Motion, NODES, Pose, Posed, SPRINGS, Surroundings};
use panic_never as _;

use skin::Slots;

/// Largest model file, bytes.
const FILE_BYTES: usize = 1 << 16;
/// Most steps of one call of [`run`].
const MOST_STEPS: usize = 512;
/// Numbers of a motion; see [`motions`].
const MOTION: usize = 10;
/// Words of a response; see [`results`].
const RESULT: usize = 18;
/// Contacts that the module holds: the page's own, and one to which it can be copied and from which it can be restored.
const CONTACTS: usize = 2;

/// Memory that the page shares with the module.
struct Shared<T>(UnsafeCell<T>);

// SAFETY: a WebAssembly module without threads runs one call at a time.
unsafe impl<T> Sync for Shared<T> {}

impl<T> Shared<T> {
    const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }
}

/// Bytes at an address divisible by 8, as model files ask for.
#[repr(C, align(8))]
struct Bytes([u8; FILE_BYTES]);

/// A model in use and what it is stepped with.
struct Finger {
    model: Model<'static>,
    /// The model in the pose of the last step.
    posed: Posed<'static>,
    pose: Pose,
    slots: Slots,
}

static INCOMING: Shared<Bytes> = Shared::new(Bytes([0; FILE_BYTES]));
static FILE: Shared<Bytes> = Shared::new(Bytes([0; FILE_BYTES]));
static FINGER: Shared<Option<Finger>> = Shared::new(None);
static CONTACT: Shared<Option<[Contact<SPRINGS, 2>; CONTACTS]>> = Shared::new(None);
static MOTIONS: Shared<[[f32; MOTION]; MOST_STEPS]> = Shared::new([[0.0; MOTION]; MOST_STEPS]);
static RESULTS: Shared<[[u32; RESULT]; MOST_STEPS]> = Shared::new([[0; RESULT]; MOST_STEPS]);
static REFUSAL: Shared<[u32; 5]> = Shared::new([0; 5]);

/// Where a model file is written before [`load`]; room for [`incoming_bytes`].
#[unsafe(no_mangle)]
pub extern "C" fn incoming() -> *mut u8 {
    INCOMING.0.get().cast()
}

/// Largest model file, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn incoming_bytes() -> usize {
    FILE_BYTES
}

/// Where the motions of a call of [`run`] are written, ten 32-bit floats each: depth at the end of the step, mm; slide along x
/// and y during it, mm; spin, rad; length of the step, s; pitch and roll, degrees; moisture, corneometer units; temperature of
/// the skin, °C; nominal speed, mm/s, 0 to count it from the motion.
#[unsafe(no_mangle)]
pub extern "C" fn motions() -> *mut f32 {
    MOTIONS.0.get().cast()
}

/// Where [`run`] writes responses, 18 words each: floats for normal force, friction x, y, N; stick ratio; friction limit, N;
/// slip margin; moment about the normal, N mm; centre of pressure x, y, mm; contact area, mm²; half-widths of the bands of
/// normal force and friction, N; centre of friction x, y, mm; mean stretch of the skin x, y, mm; then regime and status as
/// whole numbers.
#[unsafe(no_mangle)]
pub extern "C" fn results() -> *const u32 {
    RESULTS.0.get().cast_const().cast()
}

/// Most steps of one call of [`run`].
#[unsafe(no_mangle)]
pub extern "C" fn most_steps() -> usize {
    MOST_STEPS
}

/// Why the last [`load`] refused its file: the reason, 1 to 13 in the order of `fingerpad::Error`, and what it names.
#[unsafe(no_mangle)]
pub extern "C" fn refusal() -> *const u32 {
    REFUSAL.0.get().cast_const().cast()
}

/// Checks the file of `length` bytes at [`incoming`] and uses it from now on, with a finger in the air. Returns 0; or the reason
/// for which it was refused, and then everything stays as it was.
#[unsafe(no_mangle)]
pub extern "C" fn load(length: usize) -> u32 {
    // SAFETY: one thread; the page writes between calls only, and nothing else borrows these.
    let (incoming, refusal) = unsafe { (&*INCOMING.0.get(), &mut *REFUSAL.0.get()) };
    if let Err(error) = check(incoming, length) {
        *refusal = skin::words(error);
        return refusal[0];
    }
    // SAFETY: one thread; the finger, which borrows the file, ends before the file is overwritten.
    let file: &'static Bytes = unsafe {
        *FINGER.0.get() = None;
        (*FILE.0.get()).0.copy_from_slice(&incoming.0);
        &*FILE.0.get()
    };
    match check(file, length) {
        Ok(finger) => {
            // SAFETY: one thread, and nothing borrows these.
            unsafe {
                *FINGER.0.get() = Some(finger);
                *CONTACT.0.get() = Some([Contact::default(); CONTACTS]);
            }
            0
        }
        Err(error) => skin::words(error)[0],
    }
}

/// A finger from the first `length` bytes.
fn check(bytes: &'static Bytes, length: usize) -> Result<Finger, fingerpad::Error> {
    let too_long = fingerpad::Error::Length { expected: FILE_BYTES as u32, found: length as u32 };
    let file = File::from_bytes(bytes.0.get(..length).ok_or(too_long)?)?;
    let slots = Slots::of(file.effects, file.tables)?;
    let pose = Pose { pitch_deg: file.model.data().pose.pitch_deg, roll_deg: 0.0 };
    Ok(Finger { model: file.model, posed: file.model.posed(pose)?, pose, slots })
}

/// Largest depth of the model in the fitted pose, mm; 0 without a model.
#[unsafe(no_mangle)]
pub extern "C" fn depth_max_mm() -> f32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0.0, |finger| finger.model.depth_max_mm())
}

/// Pitch of the fitted pose, degrees.
#[unsafe(no_mangle)]
pub extern "C" fn fitted_pitch_deg() -> f32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0.0, |finger| finger.model.data().pose.pitch_deg)
}

/// Whether the model knows other poses than the fitted one: 1 or 0.
#[unsafe(no_mangle)]
pub extern "C" fn knows_poses() -> u32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0, |finger| u32::from(finger.model.data().pose.knows_poses()))
}

/// How the weight of friction times moment enters the limit surface f² + m² + c |f| |m| = 1.
#[unsafe(no_mangle)]
pub extern "C" fn spin_cross() -> f32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0.0, |finger| finger.model.data().spin_cross)
}

/// Whether the law of this number is the file's own (2), of typical size because the file has none (1), or not in use (0).
#[unsafe(no_mangle)]
pub extern "C" fn law_origin(kind: u32) -> u32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0, |finger| finger.slots.origin(kind))
}

/// A parameter of the law of this number, 0 beyond what there is.
#[unsafe(no_mangle)]
pub extern "C" fn law_value(kind: u32, index: usize) -> f32 {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { &*FINGER.0.get() }.as_ref().map_or(0.0, |finger| finger.slots.value(kind, index))
}

/// Lifts a contact off: it forgets everything.
#[unsafe(no_mangle)]
pub extern "C" fn lift(contact: usize) {
    // SAFETY: one thread, and nothing else borrows it.
    if let Some(contact) = unsafe { &mut *CONTACT.0.get() }.as_mut().and_then(|all| all.get_mut(contact)) {
        *contact = Contact::default();
    }
}

/// Copies all that one contact remembers to another: to save it, or to go back to it.
#[unsafe(no_mangle)]
pub extern "C" fn copy(from: usize, to: usize) {
    // SAFETY: one thread, and nothing else borrows it.
    let Some(all) = (unsafe { &mut *CONTACT.0.get() }) else { return };
    let Some(saved) = all.get(from).copied() else { return };
    if let Some(to) = all.get_mut(to) {
        *to = saved;
    }
}

/// Advances a contact by the first `count` motions; returns how many steps were made. Cannot fail, whatever the motions. A pose
/// out of range leaves the last one.
#[unsafe(no_mangle)]
pub extern "C" fn run(contact: usize, count: usize) -> usize {
    // SAFETY: one thread, and nothing else borrows these.
    let (finger, contacts) = unsafe { (&mut *FINGER.0.get(), &mut *CONTACT.0.get()) };
    // SAFETY: as above.
    let (motions, results) = unsafe { (&*MOTIONS.0.get(), &mut *RESULTS.0.get()) };
    let (Some(finger), Some(contacts)) = (finger, contacts) else { return 0 };
    let Some(contact) = contacts.get_mut(contact) else { return 0 };
    let count = count.min(MOST_STEPS);
    for (motion, result) in motions.iter().zip(results).take(count) {
        #[cfg(feature = "panics")]
        core::hint::black_box([0u8; 4][core::hint::black_box(motion[0] as usize)]);
        *result = finger.step(contact, motion);
    }
    count
}

impl Finger {
    /// One step; see [`motions`] and [`results`].
    fn step(&mut self, contact: &mut Contact<SPRINGS, 2>, motion: &[f32; MOTION]) -> [u32; RESULT] {
        let &[depth_mm, x, y, spin_increment_rad, dt_s, pitch_deg, roll_deg, hydration_au, temperature_c, speed] =
            motion;
        self.turn_to(Pose { pitch_deg, roll_deg });
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s };
        let speed_mm_s = (speed > 0.0).then_some(speed);
        let around = Surroundings { hydration_au, temperature_c, speed_mm_s, ..Surroundings::default() };
        let r = match self.slots.effects() {
            Ok(effects) => effects.step(&self.posed, contact, around, motion),
            // They were accepted when the file was loaded.
            Err(_) => fingerpad::Response::IN_THE_AIR,
        };
        let depth = contact.state.depth_mm();
        let [centre_x, centre_y] = self.posed.friction_centre_mm(depth);
        let [stretch_x, stretch_y] = self.stretch(depth, r.friction_n);
        let numbers = [
            r.normal_force_n,
            r.friction_n[0],
            r.friction_n[1],
            r.stick_ratio,
            r.friction_limit_n,
            r.slip_margin,
            r.spin_moment_n_mm,
            r.pressure_centre_mm[0],
            r.pressure_centre_mm[1],
            r.contact_area_mm2,
            r.band_normal_n,
            r.band_friction_n,
            centre_x,
            centre_y,
            stretch_x,
            stretch_y,
        ];
        let mut words = [0; RESULT];
        for (word, number) in words.iter_mut().zip(numbers) {
            *word = number.to_bits();
        }
        words[RESULT - 2] = r.regime as u32;
        words[RESULT - 1] = u32::from(r.status.0);
        words
    }

    /// Brings the model into a pose, where it is another one that the model knows.
    fn turn_to(&mut self, pose: Pose) {
        if pose != self.pose
            && let Ok(posed) = self.model.posed(pose)
        {
            (self.posed, self.pose) = (posed, pose);
        }
    }

    /// How far friction stretches skin and tissue, mm, for the drawing: over the stiffness in the fitted pose.
    fn stretch(&self, depth_mm: f32, [x, y]: [f32; 2]) -> [f32; 2] {
        let data = self.model.data();
        let at = depth_mm * data.cells_per_mm;
        let index = (at as usize).min(NODES - 1);
        let t = (at - index as f32).min(1.0);
        let Some(row) = data.rows.get(index) else { return [0.0; 2] };
        let stiffness = |k: &fingerpad::Parabola| (k.value + t * (k.slope + t * k.bend)).max(1e-3);
        [x / stiffness(&row.stiffness_x), y / stiffness(&row.stiffness_y)]
    }
}
