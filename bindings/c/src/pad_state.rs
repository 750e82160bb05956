//! The memory of a contact of a pad: set up, strength, step, patches, save, restore. Uses `pad_steps` for each kind of memory.

use fingerpad::Error;
use fingerpad::pad::{Memory, PadOn, PadState, PatchState, RelaxingPadState};

use crate::codes::{FINGERPAD_BUFFER, FINGERPAD_NOT_SET_UP, FINGERPAD_RANGE, answer, code};
use crate::driven::fingerpad_drive;
use crate::pad::{FEW, FINGERPAD_PATCHES_MAX, LoadedPad, fingerpad_body, fingerpad_pad, loaded_pad};
use crate::pad_steps::{by_kind, init, step, step_driven, write_gradient, write_patches};
use crate::pointer::{check, exclusive, items, items_mut, shared, write};
use crate::requests::{fingerpad_gradient, fingerpad_grip};
use crate::types::{fingerpad_motion, fingerpad_response};

/// Most bytes of a saved state of a pad; `state_bytes` of `fingerpad_pad_info` is the number for one pad.
pub const FINGERPAD_PAD_STATE_BYTES: usize = 1852;
/// The same of a pad that relaxes.
pub const FINGERPAD_RELAXING_PAD_STATE_BYTES: usize = 4376;

/// All that a contact of a pad remembers: 1844 bytes, room for FINGERPAD_PATCHES_MAX patches, so that a program takes any pad
/// without a rebuild. A pad of up to 37 patches, the usual number, uses the first 1304 bytes and a step made for so many,
/// which needs less stack and time. Set it up with `fingerpad_pad_state_init` or `fingerpad_pad_state_init_over`. A state belongs to
/// one pad, one tuning and one body. Plain memory: copy it to go back to it in the same program (a step that is tried and
/// rejected); `fingerpad_pad_state_save` makes bytes that can be checked when they are read.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_pad_state {
    opaque: [u32; 461],
}

/// What the body does in one step, and the finger's pose at its end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_pad_motion {
    /// Depth at the end of the step, mm, positive into the finger, along the normal at the body's apex: from where a plane there
    /// would first touch the finger in its pose. 0 or less is no contact.
    pub depth_mm: f32,
    /// Slide of the body along x during the step, mm.
    pub slide_x_mm: f32,
    /// Slide of the body along y during the step, mm.
    pub slide_y_mm: f32,
    /// Turn of the body about the normal during the step, rad, counter-clockwise seen from the finger.
    pub spin_rad: f32,
    /// Pitch of the finger against the tangent plane at the body's apex at the end of the step, degrees.
    pub pitch_deg: f32,
    /// Its roll, degrees.
    pub roll_deg: f32,
    /// Length of the step, s.
    pub dt_s: f32,
}

/// Load of one patch of skin.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_patch {
    /// Its middle now along x, y and z of the tangent plane, from the point about which poses turn, mm.
    pub place_mm: [f32; 3],
    /// Mean pressure over its own area, MPa.
    pub pressure_mpa: f32,
    /// Mean traction along x and y over its own area, MPa.
    pub traction_mpa: [f32; 2],
    /// Area in contact, mm².
    pub contact_area_mm2: f32,
    /// Share of that area which sticks.
    pub stick_ratio: f32,
    /// Share of its strength that friction uses.
    pub used: f32,
}

const MANY: usize = FINGERPAD_PATCHES_MAX;

/// The same for tissue that relaxes: 4368 bytes. Set it up with `fingerpad_relaxing_pad_state_init` or
/// `fingerpad_relaxing_pad_state_init_over`, for any pad, and hand `&state` of it to every function. For a pad that does not relax it is a
/// `fingerpad_pad_state` with unused room.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_relaxing_pad_state {
    /// Its beginning, which stands for it.
    pub state: fingerpad_pad_state,
    more: [u32; 631],
}

/// What is inside of a `fingerpad_pad_state`: the mark of a state of that kind, and the state, of which any bits are one.
#[repr(C)]
struct Marked<S> {
    mark: u32,
    state: S,
}

/// The kinds of states: for few patches or many, of tissue that follows the motion at once or relaxes.
pub trait Kind: Copy {
    const MARK: u32;
}

pub type Few = PadState<FEW>;
pub type Many = PadState<MANY>;
pub type RelaxingFew = RelaxingPadState<FEW>;
pub type RelaxingMany = RelaxingPadState<MANY>;

impl<const P: usize, M: Memory<P, f32>> Kind for PadState<P, f32, M> {
    const MARK: u32 = 0x4650_5300 + P as u32 + if size_of::<M>() == 0 { 0 } else { 128 };
}

const _: () = {
    assert!(size_of::<Marked<Few>>() < size_of::<Marked<Many>>());
    assert!(size_of::<Marked<Many>>() == size_of::<fingerpad_pad_state>());
    assert!(size_of::<Marked<RelaxingFew>>() < size_of::<Marked<RelaxingMany>>());
    assert!(size_of::<Marked<RelaxingMany>>() == size_of::<fingerpad_relaxing_pad_state>());
    assert!(align_of::<Marked<RelaxingMany>>() == align_of::<fingerpad_pad_state>());
    assert!(Many::SAVED_BYTES == FINGERPAD_PAD_STATE_BYTES);
    assert!(RelaxingMany::SAVED_BYTES == FINGERPAD_RELAXING_PAD_STATE_BYTES);
};

/// Does the same with a kind of state, `S`: whether the tissue relaxes, and whether it has few patches.
macro_rules! with_kind {
    ($kind:expr, $S:ident => $action:expr) => {
        match $kind {
            (false, true) => {
                type $S = $crate::pad_state::Few;
                $action
            }
            (false, false) => {
                type $S = $crate::pad_state::Many;
                $action
            }
            (true, true) => {
                type $S = $crate::pad_state::RelaxingFew;
                $action
            }
            (true, false) => {
                type $S = $crate::pad_state::RelaxingMany;
                $action
            }
        }
    };
}
#[cfg(not(target_os = "none"))]
pub(crate) use with_kind;

/// Bytes of a saved state of a pad.
pub fn state_bytes(pad: &LoadedPad) -> usize {
    with_kind!(pad.kind(), S => S::SAVED_BYTES)
}

/// A state of this kind to change. One of a pad of another size or tissue is none.
pub unsafe fn memory<'a, S: Kind>(state: *mut fingerpad_pad_state) -> Result<&'a mut S, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(state.cast::<u32>()) }? != S::MARK {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: the mark stands only where a state of that kind was written, or in a copy of that.
    Ok(&mut unsafe { exclusive(state.cast::<Marked<S>>()) }?.state)
}

/// The same to read.
pub unsafe fn memory_to_read<'a, S: Kind>(state: *const fingerpad_pad_state) -> Result<&'a S, i32> {
    // SAFETY: the caller's promise; nothing is changed.
    Ok(unsafe { memory(state.cast_mut()) }?)
}

/// Writes a fresh state of the kind that a pad's states have, where there is room for it.
pub unsafe fn write_fresh<S: Kind>(state: *mut fingerpad_pad_state, fresh: Result<S, Error>) -> Result<(), i32> {
    let fresh = Marked { mark: S::MARK, state: fresh.map_err(code)? };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(state.cast(), fresh) }
}

impl From<PatchState> for fingerpad_patch {
    fn from(patch: PatchState) -> Self {
        let PatchState { place_mm, pressure_mpa, traction_mpa, contact_area_mm2, stick_ratio, used } = patch;
        Self { place_mm, pressure_mpa, traction_mpa, contact_area_mm2, stick_ratio, used }
    }
}

/// A fresh state of any pad, where there is room.
unsafe fn init_any(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_relaxing_pad_state,
    over_deg: Option<[f32; 2]>,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    unsafe { loaded_pad(pad).and_then(|pad| by_kind!(init(pad, state.cast(), over_deg))) }
}

/// The same where there is no room for tissue that relaxes.
unsafe fn init_plain(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_pad_state,
    over_deg: Option<[f32; 2]>,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let pad = unsafe { loaded_pad(pad) }?;
    if pad.kind().0 {
        return Err(FINGERPAD_BUFFER);
    }
    // SAFETY: the caller's promise.
    unsafe { by_kind!(init(pad, state, over_deg)) }
}

/// A finger in the air over a plane, with a strength factor of 1. Poses turn about the point of first touch in the neutral pose.
///
/// Returns FINGERPAD_OK, FINGERPAD_BUFFER for a pad whose tissue relaxes (use `fingerpad_relaxing_pad_state_init`), or FINGERPAD_NULL,
/// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the pad; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_state_init(pad: *const fingerpad_pad, state: *mut fingerpad_pad_state) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init_plain(pad, state, None) })
}

/// A finger in the air over a body whose apex lies under first touch in a pose, and about which the finger turns: for spheres,
/// cylinders and edges. A pose beyond those of the fit counts as the nearest of them; the first step flags it.
///
/// Returns as `fingerpad_pad_state_init`, or FINGERPAD_RANGE for a pitch or roll of NaN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_state_init_over(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_pad_state,
    pitch_deg: f32,
    roll_deg: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init_plain(pad, state, Some([pitch_deg, roll_deg])) })
}

/// As `fingerpad_pad_state_init`, of any pad. FINGERPAD_NOT_SET_UP also for a pad with the branches of its file that was loaded with
/// `fingerpad_pad_load`: use `fingerpad_relaxing_pad_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_pad_state_init(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_relaxing_pad_state,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init_any(pad, state, None) })
}

/// As `fingerpad_pad_state_init_over`, of any pad; see `fingerpad_relaxing_pad_state_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_pad_state_init_over(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_relaxing_pad_state,
    pitch_deg: f32,
    roll_deg: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init_any(pad, state, Some([pitch_deg, roll_deg])) })
}

/// Sets the factor on all strengths, 0.1 to 5, from the next step on: what moisture, speed or dwell make of the friction. Returns
/// FINGERPAD_OK, or FINGERPAD_RANGE; then the factor stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_state_set_strength_factor(state: *mut fingerpad_pad_state, factor: f32) -> i32 {
    let set = || {
        // SAFETY: the caller's promise; the mark is a number whatever lies there.
        let mark = *unsafe { shared(state.cast::<u32>()) }?;
        with_kind!((mark >= RelaxingFew::MARK, mark == Few::MARK || mark == RelaxingFew::MARK), S => {
            // SAFETY: the caller's promise.
            let state = unsafe { memory::<S>(state) }?;
            if !(0.1..=5.0).contains(&factor) {
                return Err(FINGERPAD_RANGE);
            }
            state.set_strength_factor(factor);
            Ok(())
        })
    };
    answer(set())
}

/// Advances a contact of a pad on a body by one step. Accepts a motion of any bits and reports errors in it in `status` of
/// the response: also a pose beyond the fit (FINGERPAD_STATUS_POSE_OUT_OF_RANGE) and a step without equilibrium
/// (FINGERPAD_STATUS_NOT_CONVERGED). Needs 13 kB of stack (21 kB for more than 37 patches; 1 kB more for tissue that relaxes) and ten to a hundred times the
/// time of `fingerpad_step`.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a body that cannot be, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or
/// FINGERPAD_NOT_SET_UP, also for the state of a pad of another size; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_step(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_pad_state,
    body: fingerpad_body,
    motion: fingerpad_pad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad).and_then(|pad| by_kind!(step(pad, state, body, motion, response))) })
}

/// Advances a contact of a pad by one step driven by displacement or force in each direction, as `fingerpad_spin_step_driven`: a held load does
/// not creep, a force out of reach gives the nearest state and FINGERPAD_STATUS_LOAD_NOT_REACHED. A finger that touches in this step is pressed
/// first, then loaded. Takes many steps, and the stack of one and several states more.
///
/// Returns as `fingerpad_pad_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_step_driven(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_pad_state,
    body: fingerpad_body,
    pitch_deg: f32,
    roll_deg: f32,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> i32 {
    let pose_deg = [pitch_deg, roll_deg];
    // SAFETY: the caller's promise.
    answer(unsafe {
        loaded_pad(pad).and_then(|pad| by_kind!(step_driven(pad, state, body, pose_deg, drive, response, motion)))
    })
}

/// Writes how the forces of a pad change with a further motion from the last step, as `fingerpad_spin_state_gradient`, in the pose of that step.
/// By differences of seven steps.
///
/// Returns as `fingerpad_pad_patches`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_gradient(
    pad: *const fingerpad_pad,
    state: *const fingerpad_pad_state,
    body: fingerpad_body,
    depth_mm: f32,
    slide_x_mm: f32,
    slide_y_mm: f32,
    gradient: *mut fingerpad_gradient,
) -> i32 {
    let motion_mm = [depth_mm, slide_x_mm, slide_y_mm];
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad).and_then(|pad| by_kind!(write_gradient(pad, state, body, motion_mm, gradient))) })
}

/// The least depth and normal force at which a pad on a body in a pose holds a load, as `fingerpad_least_grip`; after a press and a slide to the
/// load. Tissue that relaxes has relaxed then: the grip holds the load for good. Takes many steps at each of 13 depths.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a body that cannot be, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_least_grip(
    pad: *const fingerpad_pad,
    body: fingerpad_body,
    pitch_deg: f32,
    roll_deg: f32,
    load_x_n: f32,
    load_y_n: f32,
    margin: f32,
    strength_factor: f32,
    grip: *mut fingerpad_grip,
) -> i32 {
    let found = || {
        // SAFETY: the caller's promise.
        let pad = unsafe { loaded_pad(pad) }?;
        check(grip)?;
        let body = body.checked()?;
        let finger = PadOn { pad: pad.pad, body: &body, pose_deg: [pitch_deg, roll_deg] };
        let load_n = [load_x_n, load_y_n];
        let found = if pad.kind().1 {
            finger.least_grip::<FEW>(load_n, margin, strength_factor)
        } else {
            finger.least_grip::<MANY>(load_n, margin, strength_factor)
        };
        // SAFETY: the caller's promise.
        unsafe { write(grip, found.into()) }
    };
    answer(found())
}

/// Writes the load of each patch after the last step, on the body of that step, to an array of `count` patches. The first
/// `patches` of `fingerpad_pad_info` are written. Costs as much as a round of a step, and
/// 2 to 4 kB more stack than one.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is less than that number, FINGERPAD_RANGE for a body that cannot be,
/// FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_patches(
    pad: *const fingerpad_pad,
    state: *const fingerpad_pad_state,
    body: fingerpad_body,
    patches: *mut fingerpad_patch,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad).and_then(|pad| by_kind!(write_patches(pad, state, body, patches, count))) })
}

/// Writes a state as `state_bytes` (`fingerpad_pad_info`) bytes with version, checksum of the pad and checksum of its own into a buffer of
/// `length` bytes. The pad's checksum is computed each time, some 20 instructions a byte of the file.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `length` is too small; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_state_save(
    pad: *const fingerpad_pad,
    state: *const fingerpad_pad_state,
    bytes: *mut u8,
    length: usize,
) -> i32 {
    let saved = || {
        // SAFETY: the caller's promise.
        let pad = unsafe { loaded_pad(pad) }?;
        with_kind!(pad.kind(), S => {
            // SAFETY: the caller's promise.
            let (state, bytes) = unsafe { (memory_to_read::<S>(state)?, items_mut(bytes, length)?) };
            state.write_bytes(pad.checksum(), bytes).map(|_| ()).map_err(code)
        })
    };
    answer(saved())
}

/// Reads a state that `fingerpad_pad_state_save` wrote with the same pad's file and branches; `state` need not be set up, but of a pad
/// that relaxes it must have been.
///
/// Returns FINGERPAD_OK, or: FINGERPAD_NOT_SET_UP for the pad or such a state, FINGERPAD_LENGTH if `length` is not `state_bytes`, FINGERPAD_CHECKSUM if damaged,
/// FINGERPAD_VERSION_UNKNOWN, FINGERPAD_OTHER_MODEL, FINGERPAD_RANGE for a value that no step leaves behind; then the state
/// stays as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_state_restore(
    pad: *const fingerpad_pad,
    state: *mut fingerpad_pad_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    let restored = || {
        // SAFETY: the caller's promise.
        let (pad, bytes) = unsafe { (loaded_pad(pad)?, items(bytes, length)?) };
        if pad.kind().0 {
            // Only the mark of a relaxing state shows that there is room for one.
            // SAFETY: the caller's promise; the mark is a number whatever lies there.
            let mark = *unsafe { shared(state.cast::<u32>()) }?;
            if ![RelaxingFew::MARK, RelaxingMany::MARK].contains(&mark) {
                return Err(FINGERPAD_NOT_SET_UP);
            }
        }
        // SAFETY: the caller's promise.
        with_kind!(pad.kind(), S => unsafe { write_fresh(state, S::read_bytes(pad.checksum(), bytes)) })
    };
    answer(restored())
}
