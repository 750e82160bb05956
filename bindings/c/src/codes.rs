//! What a function answers.

use core::ffi::c_char;

use fingerpad::Error;

/// All is well.
pub const FINGERPAD_OK: i32 = 0;
/// The bytes do not start like a model file.
pub const FINGERPAD_NOT_A_MODEL: i32 = 1;
/// Another version of the file's or the saved state's layout than this library reads.
pub const FINGERPAD_VERSION_UNKNOWN: i32 = 2;
/// Shorter or longer than it says itself: cut off, or not all of it was handed over.
pub const FINGERPAD_LENGTH: i32 = 3;
/// The checksum does not agree: damaged.
pub const FINGERPAD_CHECKSUM: i32 = 4;
/// A pointer is not aligned as its type requires; a model file must lie at an address divisible by 4.
pub const FINGERPAD_ALIGNMENT: i32 = 5;
/// Another number of springs, table nodes or modes than this library was built for, or more than FINGERPAD_PATCHES_MAX patches.
pub const FINGERPAD_SHAPE: i32 = 6;
/// A section of the file is missing, or an effect in it is unknown. From `fingerpad_model_load`: the file is not that of a bed;
/// a pad's file goes to `fingerpad_pad_load`. From `fingerpad_pad_load`: the file is not that of a pad; a bed's file goes to
/// `fingerpad_model_load`, or of tissue that relaxes to `fingerpad_relaxing_model_load`. Also for branches beside the effect
/// `normal_relaxation`.
pub const FINGERPAD_SECTION: i32 = 7;
/// A value is not a number or out of its range.
pub const FINGERPAD_RANGE: i32 = 8;
/// A table of the file falls where it must not.
pub const FINGERPAD_NOT_MONOTONE: i32 = 9;
/// The file's numbers would let a closed path create energy.
pub const FINGERPAD_NOT_PASSIVE: i32 = 10;
/// A buffer is too small, or arrays of a batch are of different length.
pub const FINGERPAD_BUFFER: i32 = 11;
/// The state was saved with another model.
pub const FINGERPAD_OTHER_MODEL: i32 = 12;
/// An error that this version has no code of its own for.
pub const FINGERPAD_UNKNOWN: i32 = 13;
/// A pointer is null.
pub const FINGERPAD_NULL: i32 = 14;
/// A model, pad, state, contact or watch that was not set up: never initialised, zeroed or unloaded.
pub const FINGERPAD_NOT_SET_UP: i32 = 15;

/// The code of an error of the core.
pub fn code(error: Error) -> i32 {
    match error {
        Error::Magic => FINGERPAD_NOT_A_MODEL,
        Error::Version { .. } => FINGERPAD_VERSION_UNKNOWN,
        Error::Length { .. } => FINGERPAD_LENGTH,
        Error::Checksum => FINGERPAD_CHECKSUM,
        Error::Alignment => FINGERPAD_ALIGNMENT,
        Error::Shape { .. } => FINGERPAD_SHAPE,
        Error::Section { .. } | Error::RelaxesTwice => FINGERPAD_SECTION,
        Error::Range { .. } => FINGERPAD_RANGE,
        Error::NotMonotone { .. } => FINGERPAD_NOT_MONOTONE,
        Error::NotPassive { .. } => FINGERPAD_NOT_PASSIVE,
        Error::Buffer { .. } => FINGERPAD_BUFFER,
        Error::OtherModel { .. } => FINGERPAD_OTHER_MODEL,
        _ => FINGERPAD_UNKNOWN,
    }
}

/// The code of an outcome.
pub fn answer(outcome: Result<(), i32>) -> i32 {
    match outcome {
        Ok(()) => FINGERPAD_OK,
        Err(code) => code,
    }
}

/// What a code means, in English; never null, never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn fingerpad_error_text(code: i32) -> *const c_char {
    let text = match code {
        FINGERPAD_OK => c"ok",
        FINGERPAD_NOT_A_MODEL => c"not a model file: it does not start with FPM1",
        FINGERPAD_VERSION_UNKNOWN => c"another version of the layout than this library reads",
        FINGERPAD_LENGTH => c"shorter or longer than it says itself: cut off?",
        FINGERPAD_CHECKSUM => c"the checksum does not agree: damaged",
        FINGERPAD_ALIGNMENT => c"a pointer is not aligned (a model file must lie at an address divisible by 4)",
        FINGERPAD_SHAPE => c"made for another number of springs, table nodes, modes or patches",
        FINGERPAD_SECTION => c"the file has another content (load a pad with fingerpad_pad_load, a bed with fingerpad_model_load), an unknown effect, or tissue that relaxes (section RELX)",
        FINGERPAD_RANGE => c"a value is not a number or out of its range",
        FINGERPAD_NOT_MONOTONE => c"a table of the file falls where it must not",
        FINGERPAD_NOT_PASSIVE => c"the file's numbers would let a closed path create energy",
        FINGERPAD_BUFFER => c"a buffer is too small, or arrays of a batch are of different length",
        FINGERPAD_OTHER_MODEL => c"the state was saved with another model",
        FINGERPAD_NULL => c"a pointer is null",
        FINGERPAD_NOT_SET_UP => c"a model, pad, state, contact or watch that was not set up",
        _ => c"unknown error",
    };
    text.as_ptr()
}
