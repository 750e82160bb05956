//! Contacts of a bed whose tissue relaxes, with spin and without: set up, strength, step, save, restore.

use fingerpad::{BedMemory, RelaxingState, SPRINGS};

use crate::codes::answer;
use crate::driven::{fingerpad_drive, step_driven};
use crate::model::fingerpad_model;
use crate::requests::{fingerpad_gradient, write_gradient};
use crate::state::{init, restore, save, set_strength_factor};
use crate::step::step;
use crate::types::{fingerpad_motion, fingerpad_response};

/// Bytes of a saved state of a bed that relaxes.
pub const FINGERPAD_RELAXING_STATE_BYTES: usize = 252;
/// The same of a contact that spins.
pub const FINGERPAD_RELAXING_SPIN_STATE_BYTES: usize = 380;

/// All that a contact of a bed remembers whose tissue relaxes: 240 bytes. Set it up with `fingerpad_relaxing_state_init`. With a bed that does
/// not relax it is a `fingerpad_state` with unused room. Plain memory, as `fingerpad_state`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_relaxing_state {
    opaque: [u32; 60],
}

/// The same of a contact that also spins: 368 bytes. Set it up with `fingerpad_relaxing_spin_state_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_relaxing_spin_state {
    opaque: [u32; 92],
}

const _: () = {
    assert!(RelaxingState::<1>::SAVED_BYTES == FINGERPAD_RELAXING_STATE_BYTES);
    assert!(RelaxingState::<2>::SAVED_BYTES == FINGERPAD_RELAXING_SPIN_STATE_BYTES);
};

type Slide = BedMemory<SPRINGS>;
type Spin = BedMemory<SPRINGS, 2>;

/// A finger in the air, with a strength factor of 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_state_init(state: *mut fingerpad_relaxing_state) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init::<_, 1, Slide>(state) })
}

/// As `fingerpad_state_set_strength_factor`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_state_set_strength_factor(
    state: *mut fingerpad_relaxing_state,
    factor: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { set_strength_factor::<_, 1, Slide>(state, factor) })
}

/// As `fingerpad_state_save`, FINGERPAD_RELAXING_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_relaxing_state,
    bytes: *mut u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { save::<_, 1, Slide>(model, state, bytes, length) })
}

/// As `fingerpad_state_restore`, FINGERPAD_RELAXING_STATE_BYTES bytes of the same model file and branches.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { restore::<_, 1, Slide>(model, state, bytes, length) })
}

/// As `fingerpad_step`. A step of no valid length is flagged and freezes the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_state,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step::<_, 1, Slide>(model, state, motion, response) })
}

/// As `fingerpad_step_driven`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_step_driven(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_state,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_driven::<_, 1, Slide>(model, state, drive, response, motion) })
}

/// As `fingerpad_state_gradient`: for another motion in the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_state_gradient(
    model: *const fingerpad_model,
    state: *const fingerpad_relaxing_state,
    depth_mm: f32,
    slide_x_mm: f32,
    slide_y_mm: f32,
    gradient: *mut fingerpad_gradient,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write_gradient::<_, 1, Slide>(model, state, [depth_mm, slide_x_mm, slide_y_mm], gradient) })
}

/// The same whose contact will also spin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_state_init(state: *mut fingerpad_relaxing_spin_state) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init::<_, 2, Spin>(state) })
}

/// As `fingerpad_state_set_strength_factor`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_state_set_strength_factor(
    state: *mut fingerpad_relaxing_spin_state,
    factor: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { set_strength_factor::<_, 2, Spin>(state, factor) })
}

/// As `fingerpad_state_save`, FINGERPAD_RELAXING_SPIN_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_relaxing_spin_state,
    bytes: *mut u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { save::<_, 2, Spin>(model, state, bytes, length) })
}

/// As `fingerpad_state_restore`, FINGERPAD_RELAXING_SPIN_STATE_BYTES bytes of the same model file and branches.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_spin_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { restore::<_, 2, Spin>(model, state, bytes, length) })
}

/// As `fingerpad_spin_step`. A step of no valid length is flagged and freezes the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_spin_state,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step::<_, 2, Spin>(model, state, motion, response) })
}

/// As `fingerpad_spin_step_driven`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_step_driven(
    model: *const fingerpad_model,
    state: *mut fingerpad_relaxing_spin_state,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_driven::<_, 2, Spin>(model, state, drive, response, motion) })
}

/// As `fingerpad_spin_state_gradient`: for another motion in the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_spin_state_gradient(
    model: *const fingerpad_model,
    state: *const fingerpad_relaxing_spin_state,
    depth_mm: f32,
    slide_x_mm: f32,
    slide_y_mm: f32,
    gradient: *mut fingerpad_gradient,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write_gradient::<_, 2, Spin>(model, state, [depth_mm, slide_x_mm, slide_y_mm], gradient) })
}
