//! The same of a contact that also spins: set up, strength, save, restore, step, driven step.

use crate::codes::answer;
use crate::driven::{fingerpad_drive, step_driven};
use crate::model::fingerpad_model;
use crate::state::{fingerpad_spin_state, init, restore, save, set_strength_factor};
use crate::step::step;
use crate::types::{fingerpad_motion, fingerpad_response};

/// A finger in the air whose contact will also spin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_init(state: *mut fingerpad_spin_state) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init::<_, 2, ()>(state) })
}

/// As `fingerpad_state_set_strength_factor`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_set_strength_factor(
    state: *mut fingerpad_spin_state,
    factor: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { set_strength_factor::<_, 2, ()>(state, factor) })
}

/// As `fingerpad_state_save`, FINGERPAD_SPIN_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_spin_state,
    bytes: *mut u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { save::<_, 2, ()>(model, state, bytes, length) })
}

/// As `fingerpad_state_restore`, FINGERPAD_SPIN_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_spin_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { restore::<_, 2, ()>(model, state, bytes, length) })
}

/// As `fingerpad_step`, with spin; takes about twice as long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_spin_state,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step::<_, 2, ()>(model, state, motion, response) })
}

/// As `fingerpad_step_driven`, with spin, which is prescribed as an angle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_step_driven(
    model: *const fingerpad_model,
    state: *mut fingerpad_spin_state,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_driven::<_, 2, ()>(model, state, drive, response, motion) })
}
