//! One step of a contact that slides.

use crate::codes::answer;
use crate::model::{Loaded, fingerpad_model};
use crate::pointer::{check, write};
use crate::state::{Memory, Tissue, fingerpad_state, memory};
use crate::types::{fingerpad_motion, fingerpad_response};

/// Advances a contact by one step.
#[inline(always)]
pub fn advance<const P: usize, R: Tissue<P>>(
    model: &Loaded,
    state: &mut Memory<P, R>,
    motion: fingerpad_motion,
) -> fingerpad_response {
    fingerpad::step(&model.model(), state, motion.into()).into()
}

/// Advances a contact by one step. A motion of any bits is accepted; `status` of the response reports its errors.
///
/// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_state,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    #[cfg(feature = "panics")]
    core::hint::black_box([0u8; 4][core::hint::black_box(motion.depth_mm as usize)]);
    // SAFETY: the caller's promise.
    answer(unsafe { step::<_, 1, ()>(model, state, motion, response) })
}

#[inline(always)]
pub unsafe fn step<C, const P: usize, R: Tissue<P>>(
    model: *const fingerpad_model,
    state: *mut C,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (R::model(model)?, memory::<C, P, R>(state)?) };
    check(response)?;
    // SAFETY: the caller's promise.
    unsafe { write(response, advance(model, state, motion)) }
}
