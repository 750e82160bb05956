//! The pad as a WebAssembly module: a model file and motions in, responses out, all in the module's own memory.
//!
//! The page writes a file to [`incoming`] and calls [`load`], chooses a rigid body with [`set_body`], writes motions to [`motions`] and
//! calls [`run`], and reads responses from [`results`] and what the patches bear from [`patch_states`]. Nothing is imported, nothing is
//! allocated, and no panic is linked. A module runs on one thread. `frames` has the same pad in one contact by poses of a body.
#![no_std]

mod frames;
mod skin;

use core::cell::UnsafeCell;

use fingerpad::pad::{Body, Cylinder, Edge, Pad, PadFile, PatchState, RelaxingPadState, Sphere, Surface};
use fingerpad::{Error, Motion, Relaxation, Response, Scalar, Status};
use panic_never as _;

/// Largest model file, bytes.
const FILE_BYTES: usize = 1 << 16;
/// Most patches of a pad.
const PATCHES: usize = 64;
/// Most steps of one call of [`run`].
const MOST_STEPS: usize = 512;
/// Numbers of a motion; see [`motions`].
const MOTION: usize = 10;
/// Words of a response; see [`results`].
const RESULT: usize = 15;
/// Numbers of a patch; see [`patch_states`].
const PATCH: usize = 9;
/// Least and largest radius of a body, mm.
const RADIUS_MM: core::ops::RangeInclusive<f32> = 0.1..=1e6;

/// Shorter motions are none, mm.
const LEAST_MM: f32 = 1e-6;

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

/// A pad in use, what it touches, and all that its contact remembers.
struct Finger {
    pad: Pad<'static>,
    body: Body,
    /// It remembers whether or not the tissue relaxes: the bits are the same where it does not.
    contact: RelaxingPadState<PATCHES>,
    /// Branches of the file.
    relaxation: Relaxation,
}

static INCOMING: Shared<Bytes> = Shared::new(Bytes([0; FILE_BYTES]));
static FILE: Shared<Bytes> = Shared::new(Bytes([0; FILE_BYTES]));
static FINGER: Shared<Option<Finger>> = Shared::new(None);
static MOTIONS: Shared<[[f32; MOTION]; MOST_STEPS]> = Shared::new([[0.0; MOTION]; MOST_STEPS]);
static RESULTS: Shared<[[u32; RESULT]; MOST_STEPS]> = Shared::new([[0; RESULT]; MOST_STEPS]);
static PATCH_STATES: Shared<[[f32; PATCH]; PATCHES]> = Shared::new([[0.0; PATCH]; PATCHES]);
static REFUSAL: Shared<[u32; 5]> = Shared::new([0; 5]);

/// The finger in use.
fn finger() -> Option<&'static mut Finger> {
    // SAFETY: one thread, and every function of this module takes it once.
    unsafe { &mut *FINGER.0.get() }.as_mut()
}

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

/// Where [`run`] writes responses, 15 words each: floats for normal force, friction x, y, N; stick ratio; friction limit, N;
/// slip margin; moment about the normal, N mm; centre of pressure x, y, mm; contact area, mm²; half-widths of the bands of
/// normal force and friction, N; the slip margin that is left when the tissue has relaxed; then regime and status as whole numbers.
#[unsafe(no_mangle)]
pub extern "C" fn results() -> *const u32 {
    RESULTS.0.get().cast_const().cast()
}

/// Where [`look`] writes what patches bear, nine floats each: place x, y, z, mm; pressure, MPa; traction x, y, MPa; area in
/// contact, mm²; stick ratio; used share of the strength.
#[unsafe(no_mangle)]
pub extern "C" fn patch_states() -> *const f32 {
    PATCH_STATES.0.get().cast_const().cast()
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

/// Checks the file of `length` bytes at [`incoming`] and uses it from now on, with a finger in the air over the body in use. Returns 0;
/// or the reason for which it was refused, and then everything stays as it was.
#[unsafe(no_mangle)]
pub extern "C" fn load(length: usize) -> u32 {
    // SAFETY: one thread; the page writes between calls only, and nothing else borrows these.
    let (incoming, refusal) = unsafe { (&*INCOMING.0.get(), &mut *REFUSAL.0.get()) };
    if let Err(error) = check(incoming, length) {
        *refusal = skin::words(error);
        return refusal[0];
    }
    let body = finger().map_or(Body::Plane, |finger| finger.body);
    // SAFETY: one thread; the finger, which borrows the file, ends before the file is overwritten.
    let file: &'static Bytes = unsafe {
        *FINGER.0.get() = None;
        frames::forget();
        (*FILE.0.get()).0.copy_from_slice(&incoming.0);
        &*FILE.0.get()
    };
    match check(file, length) {
        Ok((pad, contact)) => {
            // SAFETY: one thread, and nothing borrows it.
            unsafe { *FINGER.0.get() = Some(Finger { pad, body, contact, relaxation: *pad.relaxation() }) };
            0
        }
        Err(error) => skin::words(error)[0],
    }
}

/// A pad and a finger in the air from the first `length` bytes.
fn check(bytes: &'static Bytes, length: usize) -> Result<(Pad<'static>, RelaxingPadState<PATCHES>), Error> {
    let too_long = Error::Length { expected: FILE_BYTES as u32, found: length as u32 };
    let pad = PadFile::from_bytes(bytes.0.get(..length).ok_or(too_long)?)?.pad;
    Ok((pad, RelaxingPadState::relaxing(&pad)?))
}

/// Patches of the pad in use; 0 without one.
#[unsafe(no_mangle)]
pub extern "C" fn patches() -> usize {
    finger().map_or(0, |finger| finger.pad.patches.len())
}

/// Area of a patch, mm²; 0 for none.
#[unsafe(no_mangle)]
pub extern "C" fn patch_area_mm2(patch: usize) -> f32 {
    finger().and_then(|finger| finger.pad.patches.get(patch)).map_or(0.0, |patch| patch.area_mm2)
}

/// What the pad was fitted for: largest depth, mm (0); least and largest pitch (1, 2), largest roll to either side (3) and neutral
/// pitch (4), degrees.
#[unsafe(no_mangle)]
pub extern "C" fn fitted(what: u32) -> f32 {
    finger().map_or(0.0, |finger| {
        let numbers = finger.pad.numbers;
        let [least, most] = numbers.pitch_range_deg;
        match what {
            0 => numbers.depth_max_mm,
            1 => least,
            2 => most,
            3 => numbers.roll_max_deg,
            _ => numbers.neutral_pitch_deg,
        }
    })
}

/// Puts another body under the finger: a plane (0), a sphere (1), a cylinder (2) or an edge (3). The finger must be lifted then. Returns 0;
/// or 1 for numbers of which no body can be made, and then everything stays as it was.
///
/// * `radius_mm`: of sphere and cylinder, or of the rounding of an edge
/// * `axis_deg`: direction of cylinder or edge from x
/// * `angle_deg`: between the faces of an edge
#[unsafe(no_mangle)]
pub extern "C" fn set_body(kind: u32, radius_mm: f32, axis_deg: f32, angle_deg: f32) -> u32 {
    let Some(finger) = finger() else { return 1 };
    let is_round = RADIUS_MM.contains(&radius_mm);
    let body = match kind {
        0 => Ok(Body::Plane),
        1 if is_round => Sphere::new(radius_mm).map(Body::Sphere),
        2 if is_round => Cylinder::new(radius_mm, axis_deg).map(Body::Cylinder),
        3 if is_round => Edge::new(radius_mm, axis_deg, angle_deg).map(Body::Edge),
        _ => return 1,
    };
    let Ok(body) = body else { return 1 };
    finger.body = body;
    0
}

/// Height of the body over a place of the tangent plane at its apex, mm.
#[unsafe(no_mangle)]
pub extern "C" fn height(x_mm: f32, y_mm: f32) -> f32 {
    finger().map_or(0.0, |finger| finger.body.height([x_mm, y_mm]))
}

/// Size of a law of the skin by its number; 0 beyond what there is.
#[unsafe(no_mangle)]
pub extern "C" fn law_value(kind: u32, index: usize) -> f32 {
    skin::value(kind, index)
}

/// Factor on the strength of moisture (corneometer units), temperature (°C) and speed (mm/s).
#[unsafe(no_mangle)]
pub extern "C" fn strength(hydration_au: f32, temperature_c: f32, speed_mm_s: f32) -> f32 {
    skin::strength(hydration_au, temperature_c, speed_mm_s)
}

/// Gives the finger tissue that relaxes: the times of a human finger with assumed shares (1), or the branches of the file, of which it has
/// usually none (0). The finger must be lifted then.
#[unsafe(no_mangle)]
pub extern "C" fn relax(is_assumed: u32) {
    let Some(Finger { pad, relaxation, .. }) = finger() else { return };
    *pad = pad.with_relaxation(if is_assumed == 0 { *relaxation } else { Relaxation::HUMAN_ASSUMED });
}

/// Lifts the finger off: it forgets everything. The body's apex then lies under first touch of the pose.
#[unsafe(no_mangle)]
pub extern "C" fn lift(pitch_deg: f32, roll_deg: f32) {
    let Some(Finger { pad, body, contact, .. }) = finger() else { return };
    let pose_deg = [pitch_deg, roll_deg];
    let is_plane = *body == Body::Plane;
    let state = if is_plane { RelaxingPadState::relaxing(pad) } else { RelaxingPadState::relaxing_over(pad, pose_deg) };
    if let Ok(state) = state {
        *contact = state;
    }
}

/// Advances the finger by the first `count` motions; returns how many steps were made. Cannot fail, whatever the motions.
#[unsafe(no_mangle)]
pub extern "C" fn run(count: usize) -> usize {
    let Some(Finger { pad, body, contact, .. }) = finger() else { return 0 };
    // SAFETY: one thread, and nothing else borrows these.
    let (motions, results) = unsafe { (&*MOTIONS.0.get(), &mut *RESULTS.0.get()) };
    let count = count.min(MOST_STEPS);
    for (motion, result) in motions.iter().zip(results).take(count) {
        #[cfg(feature = "panics")]
        core::hint::black_box([0u8; 4][core::hint::black_box(motion[0] as usize)]);
        *result = step(pad, body, contact, motion);
    }
    count
}

/// One step; see [`motions`] and [`results`].
fn step(
    pad: &Pad<'_>,
    body: &Body,
    contact: &mut RelaxingPadState<PATCHES>,
    &[depth_mm, x, y, spin_increment_rad, dt_s, pitch_deg, roll_deg, hydration_au, temperature_c, speed]: &[f32;
         MOTION],
) -> [u32; RESULT] {
    let strength = skin::strength(hydration_au, temperature_c, speed_of([x, y], depth_mm, dt_s, speed));
    let is_held = contact.set_strength_factor(strength) != strength;
    let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s };
    let r = pad.step(contact, body, motion, [pitch_deg, roll_deg]);
    words(&r, if is_held { r.status.with(Status::EFFECT_HELD) } else { r.status })
}

/// A response as [`results`] has it.
fn words(r: &Response, status: Status) -> [u32; RESULT] {
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
        r.slip_margin_relaxed,
    ];
    let mut words = [0; RESULT];
    for (word, number) in words.iter_mut().zip(numbers) {
        *word = number.to_bits();
    }
    words[RESULT - 2] = r.regime as u32;
    words[RESULT - 1] = status.0;
    words
}

/// Speed of a slide, mm/s: the nominal one where it is given; 0 in the air and for what is no motion, as the core's effects count it.
fn speed_of([x, y]: [f32; 2], depth_mm: f32, dt_s: f32, nominal: f32) -> f32 {
    let moved = root(x * x + y * y);
    if !(depth_mm > 0.0 && moved > LEAST_MM && moved < 1e3) {
        return 0.0;
    }
    match nominal > 0.0 {
        true => nominal,
        false if dt_s > 0.0 && dt_s < 1e3 => moved / dt_s,
        false => 0.0,
    }
}

/// The core's square root, by way of a bound since `core` has none.
fn root<T: Scalar>(x: T) -> T {
    x.magnitude().sqrt()
}

/// Writes what the patches bear after the last step to [`patch_states`]; returns how many there are.
#[unsafe(no_mangle)]
pub extern "C" fn look() -> usize {
    let Some(Finger { pad, body, contact, .. }) = finger() else { return 0 };
    // SAFETY: one thread, and nothing else borrows it.
    let out = unsafe { &mut *PATCH_STATES.0.get() };
    for (patch, out) in pad.patch_states(contact, body).iter().zip(out) {
        let PatchState { place_mm: [x, y, z], pressure_mpa, traction_mpa: [tx, ty], contact_area_mm2, .. } = *patch;
        *out = [x, y, z, pressure_mpa, tx, ty, contact_area_mm2, patch.stick_ratio, patch.used];
    }
    pad.patches.len()
}
