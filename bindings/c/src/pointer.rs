//! Pointers from C, checked before use.
//!
//! What cannot be checked is the caller's promise: that a pointer which is neither null nor misaligned points to that much
//! memory, and that nothing else changes it during the call.

use core::slice;

use crate::codes::{FINGERPAD_ALIGNMENT, FINGERPAD_NULL};

/// Null and alignment.
pub fn check<T>(pointer: *const T) -> Result<(), i32> {
    if pointer.is_null() {
        return Err(FINGERPAD_NULL);
    }
    if !pointer.is_aligned() {
        return Err(FINGERPAD_ALIGNMENT);
    }
    Ok(())
}

/// What a pointer shows, to read.
pub unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, i32> {
    check(pointer)?;
    // SAFETY: checked; the rest is the caller's promise.
    Ok(unsafe { &*pointer })
}

/// What a pointer shows, to change.
pub unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, i32> {
    check(pointer)?;
    // SAFETY: checked; the rest is the caller's promise.
    Ok(unsafe { &mut *pointer })
}

/// Writes a value to memory that need not hold one yet.
pub unsafe fn write<T>(pointer: *mut T, value: T) -> Result<(), i32> {
    check(pointer)?;
    // SAFETY: checked; the rest is the caller's promise.
    unsafe { pointer.write(value) };
    Ok(())
}

/// `length` items to read; null is no error where there are none.
pub unsafe fn items<'a, T>(pointer: *const T, length: usize) -> Result<&'a [T], i32> {
    if length == 0 {
        return Ok(&[]);
    }
    check(pointer)?;
    // SAFETY: checked; the rest is the caller's promise.
    Ok(unsafe { slice::from_raw_parts(pointer, length) })
}

/// `length` items to change; null is no error where there are none.
pub unsafe fn items_mut<'a, T>(pointer: *mut T, length: usize) -> Result<&'a mut [T], i32> {
    if length == 0 {
        return Ok(&mut []);
    }
    check(pointer)?;
    // SAFETY: checked; the rest is the caller's promise.
    Ok(unsafe { slice::from_raw_parts_mut(pointer, length) })
}
