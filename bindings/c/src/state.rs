//! The memory of a contact that slides: set up, strength, save, restore.

use bytemuck::Pod;
use fingerpad::{BedMemory, SPRINGS, STATE_BYTES, SpinState, State, StateOf};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_RANGE, answer, code};
use crate::model::{Loaded, fingerpad_model, loaded, loaded_any};
use crate::pointer::{exclusive, items, items_mut, shared, write};

/// Bytes of a saved state.
pub const FINGERPAD_STATE_BYTES: usize = 120;
/// Bytes of a saved state of a contact that spins.
pub const FINGERPAD_SPIN_STATE_BYTES: usize = 152;

/// All that a contact remembers. Set it up with `fingerpad_state_init`. Plain memory: copy it to go back to it in the same
/// program (a step that is tried and rejected); `fingerpad_state_save` makes bytes that can be checked when they are read.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_state {
    opaque: [u32; 27],
}

/// The same of a contact that also spins. Set it up with `fingerpad_spin_state_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_spin_state {
    opaque: [u32; 35],
}

// A state is floats throughout: whatever lies there are numbers.
const _: () = {
    assert!(size_of::<State>() == size_of::<fingerpad_state>());
    assert!(align_of::<State>() == align_of::<fingerpad_state>());
    assert!(size_of::<SpinState>() == size_of::<fingerpad_spin_state>());
    assert!(align_of::<SpinState>() == align_of::<fingerpad_spin_state>());
    assert!(STATE_BYTES == FINGERPAD_STATE_BYTES);
    // Version, model and checksum come to the memory's own words in both.
    assert!(FINGERPAD_STATE_BYTES - size_of::<State>() == FINGERPAD_SPIN_STATE_BYTES - size_of::<SpinState>());
};

/// The memory of the model's springs, `P` 2 with spin and 1 without; `R` is that of the tissue.
pub type Memory<const P: usize, R = ()> = StateOf<SPRINGS, P, f32, R>;

/// Memory of the tissue, `()` for none, with the models of which it may be.
pub trait Tissue<const P: usize>: fingerpad::Memory<SPRINGS, P, f32> + Pod {
    /// A model for such states.
    unsafe fn model<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32>;
}

impl<const P: usize> Tissue<P> for () {
    #[inline(always)]
    unsafe fn model<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32> {
        // SAFETY: the caller's promise.
        unsafe { loaded(model) }
    }
}

impl<const P: usize> Tissue<P> for BedMemory<SPRINGS, P> {
    #[inline(always)]
    unsafe fn model<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32> {
        // SAFETY: the caller's promise.
        unsafe { loaded_any(model) }
    }
}

/// A state that was set up: its strength factor is one that can be set, which zeros and most other bits are not.
#[inline(always)]
pub fn set_up<const P: usize, R: Tissue<P>>(state: &mut Memory<P, R>) -> Result<&mut Memory<P, R>, i32> {
    if (0.1..=5.0).contains(&state.strength_factor()) { Ok(state) } else { Err(FINGERPAD_NOT_SET_UP) }
}

/// A state to change.
#[inline(always)]
pub unsafe fn memory<'a, C, const P: usize, R: Tissue<P>>(state: *mut C) -> Result<&'a mut Memory<P, R>, i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P, R>>()) };
    // SAFETY: the caller's promise; any bits are a state.
    set_up(unsafe { exclusive(state.cast()) }?)
}

/// A state to read.
pub unsafe fn memory_to_read<'a, C, const P: usize, R: Tissue<P>>(state: *const C) -> Result<&'a Memory<P, R>, i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P, R>>()) };
    // SAFETY: the caller's promise; any bits are a state.
    let state: &Memory<P, R> = unsafe { shared(state.cast()) }?;
    set_up(&mut { *state })?;
    Ok(state)
}

/// Writes a fresh state.
pub unsafe fn init<C, const P: usize, R: Tissue<P>>(state: *mut C) -> Result<(), i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P, R>>() && align_of::<C>() == align_of::<Memory<P, R>>()) };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(state.cast(), Memory::<P, R>::default()) }
}

/// Sets the strength factor; NaN and infinity are refused, so that a caller hears of them.
pub unsafe fn set_strength_factor<C, const P: usize, R: Tissue<P>>(state: *mut C, factor: f32) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let state = unsafe { memory::<C, P, R>(state) }?;
    if !(0.1..=5.0).contains(&factor) {
        return Err(FINGERPAD_RANGE);
    }
    state.set_strength_factor(factor);
    Ok(())
}

/// Writes a state as bytes.
pub unsafe fn save<C, const P: usize, R: Tissue<P>>(
    model: *const fingerpad_model,
    state: *const C,
    bytes: *mut u8,
    length: usize,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (R::model(model)?, memory_to_read::<C, P, R>(state)?) };
    // SAFETY: the caller's promise.
    state.write_bytes(model.checksum(), unsafe { items_mut(bytes, length) }?).map(|_| ()).map_err(code)
}

/// Reads a state from bytes.
pub unsafe fn restore<C, const P: usize, R: Tissue<P>>(
    model: *const fingerpad_model,
    state: *mut C,
    bytes: *const u8,
    length: usize,
) -> Result<(), i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P, R>>() && align_of::<C>() == align_of::<Memory<P, R>>()) };
    // SAFETY: the caller's promise.
    let (model, bytes) = unsafe { (R::model(model)?, items(bytes, length)?) };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(state.cast(), Memory::<P, R>::read_bytes(model.checksum(), bytes).map_err(code)?) }
}

/// A finger in the air, with a strength factor of 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_init(state: *mut fingerpad_state) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { init::<_, 1, ()>(state) })
}

/// Sets the factor on all strengths, 0.1 to 5, from the next step on: what moisture, speed, dwell or another finger make of
/// the friction. Returns FINGERPAD_OK, or FINGERPAD_RANGE; then the factor stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_set_strength_factor(state: *mut fingerpad_state, factor: f32) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { set_strength_factor::<_, 1, ()>(state, factor) })
}

/// Writes a state as FINGERPAD_STATE_BYTES bytes with version, checksum of the model and checksum of its own into a buffer of
/// `length` bytes. The model's checksum is computed each time, some 20 instructions a byte of the file.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `length` is too small; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_state,
    bytes: *mut u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { save::<_, 1, ()>(model, state, bytes, length) })
}

/// Reads a state that `fingerpad_state_save` wrote with the same model file; `state` need not be set up.
///
/// Returns FINGERPAD_OK, or: FINGERPAD_LENGTH if `length` is not FINGERPAD_STATE_BYTES, FINGERPAD_CHECKSUM if damaged,
/// FINGERPAD_VERSION_UNKNOWN, FINGERPAD_OTHER_MODEL, FINGERPAD_RANGE for a value that no step leaves behind; then the state
/// stays as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { restore::<_, 1, ()>(model, state, bytes, length) })
}
