//! Many contacts of one model in one call.

use fingerpad::Motion;

use crate::codes::{FINGERPAD_BUFFER, answer};
use crate::model::{fingerpad_model, loaded};
use crate::pointer::{check, shared};
use crate::state::{Memory, fingerpad_spin_state, fingerpad_state, memory_to_read};
use crate::step::advance;
use crate::types::fingerpad_response;

/// Motions of many contacts, `count` numbers in each array; see `fingerpad_motion`.
#[repr(C)]
pub struct fingerpad_motions {
    /// Number of contacts.
    pub count: usize,
    /// Depths at the end of the step, mm.
    pub depth_mm: *const f32,
    /// Slides along x during the step, mm.
    pub slide_x_mm: *const f32,
    /// Slides along y during the step, mm.
    pub slide_y_mm: *const f32,
    /// Turns about the normal, rad; null for none.
    pub spin_rad: *const f32,
    /// Length of the step, s, the same for all.
    pub dt_s: f32,
}

/// Advances `count` contacts by one step each, with the same bits as steps one by one; `states` and `responses` are arrays of
/// `count`. To use several cores, divide the arrays.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is not that of the motions, FINGERPAD_NULL, FINGERPAD_ALIGNMENT, or
/// FINGERPAD_NOT_SET_UP for the model or any of the states; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_step_batch(
    model: *const fingerpad_model,
    states: *mut fingerpad_state,
    motions: *const fingerpad_motions,
    responses: *mut fingerpad_response,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_batch::<_, 1>(model, states, motions, responses, count) })
}

/// As `fingerpad_step_batch`, with spin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_step_batch(
    model: *const fingerpad_model,
    states: *mut fingerpad_spin_state,
    motions: *const fingerpad_motions,
    responses: *mut fingerpad_response,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_batch::<_, 2>(model, states, motions, responses, count) })
}

unsafe fn step_batch<C, const P: usize>(
    model: *const fingerpad_model,
    states: *mut C,
    motions: *const fingerpad_motions,
    responses: *mut fingerpad_response,
    count: usize,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let (model, motions) = unsafe { (loaded(model)?, shared(motions)?) };
    if motions.count != count {
        return Err(FINGERPAD_BUFFER);
    }
    check(responses)?;
    check(states)?;
    for array in [motions.depth_mm, motions.slide_x_mm, motions.slide_y_mm] {
        check(array)?;
    }
    let spins = !motions.spin_rad.is_null();
    if spins {
        check(motions.spin_rad)?;
    }
    for i in 0..count {
        // SAFETY: the caller's promise: there are `count` of them.
        unsafe { memory_to_read::<C, P, ()>(states.add(i)) }?;
    }
    for i in 0..count {
        // SAFETY: the caller's promise: each array has `count` numbers. They are read one by one, so that arrays may overlap.
        let (motion, state) = unsafe {
            let motion = Motion {
                depth_mm: *motions.depth_mm.add(i),
                slide_increment_mm: [*motions.slide_x_mm.add(i), *motions.slide_y_mm.add(i)],
                spin_increment_rad: if spins { *motions.spin_rad.add(i) } else { 0.0 },
                dt_s: motions.dt_s,
            };
            (motion, &mut *states.add(i).cast::<Memory<P>>())
        };
        let response = advance(model, state, motion.into());
        // SAFETY: the same.
        unsafe { responses.add(i).write(response) };
    }
    Ok(())
}
