//! The memory of a contact that slides: set up, strength, save, restore.

use fingerpad::{STATE_BYTES, SpinState, State, StateOf};

use crate::codes::{FINGERPAD_NOT_SET_UP, answer, code};
use crate::model::{Loaded, fingerpad_model, loaded};
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

/// The memory of the model's springs, `P` 2 with spin and 1 without.
pub type Memory<const P: usize> = StateOf<{ fingerpad::SPRINGS }, P>;

/// A state that was set up: its strength factor is one that can be set, which zeros and most other bits are not.
#[inline(always)]
pub fn set_up<const P: usize>(state: &mut Memory<P>) -> Result<&mut Memory<P>, i32> {
    if (0.1..=5.0).contains(&state.strength_factor()) { Ok(state) } else { Err(FINGERPAD_NOT_SET_UP) }
}

/// A state to change.
#[inline(always)]
pub unsafe fn memory<'a, C, const P: usize>(state: *mut C) -> Result<&'a mut Memory<P>, i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P>>()) };
    // SAFETY: the caller's promise; any bits are a state.
    set_up(unsafe { exclusive(state.cast()) }?)
}

/// A state to read.
pub unsafe fn memory_to_read<'a, C, const P: usize>(state: *const C) -> Result<&'a Memory<P>, i32> {
    const { assert!(size_of::<C>() == size_of::<Memory<P>>()) };
    // SAFETY: the caller's promise; any bits are a state.
    let state: &Memory<P> = unsafe { shared(state.cast()) }?;
    set_up(&mut { *state })?;
    Ok(state)
}

/// Sets the strength factor; NaN and infinity are refused, so that a caller hears of them.
pub fn set_strength_factor<const P: usize>(state: &mut Memory<P>, factor: f32) -> Result<(), i32> {
    if !(0.1..=5.0).contains(&factor) {
        return Err(crate::codes::FINGERPAD_RANGE);
    }
    state.set_strength_factor(factor);
    Ok(())
}

/// Writes a state as bytes.
pub fn save<const P: usize>(model: &Loaded, state: &Memory<P>, bytes: &mut [u8]) -> Result<(), i32> {
    state.write_bytes(model.checksum(), bytes).map(|_| ()).map_err(code)
}

/// Reads a state from bytes.
pub fn restore<const P: usize>(model: &Loaded, bytes: &[u8]) -> Result<Memory<P>, i32> {
    StateOf::read_bytes(model.checksum(), bytes).map_err(code)
}

/// A finger in the air, with a strength factor of 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_init(state: *mut fingerpad_state) -> i32 {
    // SAFETY: the caller's promise; size and alignment were checked above.
    answer(unsafe { write(state.cast(), State::default()) })
}

/// Sets the factor on all strengths, 0.1 to 5, from the next step on: what moisture, speed, dwell or another finger make of
/// the friction. Returns FINGERPAD_OK, or FINGERPAD_RANGE; then the factor stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_set_strength_factor(state: *mut fingerpad_state, factor: f32) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { memory::<_, 1>(state) }.and_then(|state| set_strength_factor(state, factor)))
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
    let saved = || {
        // SAFETY: the caller's promise.
        let (model, state) = unsafe { (loaded(model)?, memory_to_read::<_, 1>(state)?) };
        // SAFETY: the caller's promise.
        save(model, state, unsafe { items_mut(bytes, length) }?)
    };
    answer(saved())
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
    let restored = || {
        // SAFETY: the caller's promise.
        let (model, bytes) = unsafe { (loaded(model)?, items(bytes, length)?) };
        // SAFETY: the caller's promise; size and alignment were checked above.
        unsafe { write(state.cast(), restore::<1>(model, bytes)?) }
    };
    answer(restored())
}
