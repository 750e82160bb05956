//! The one file that names a mathematics library.
//!
//! Every function gives the same bits on host and target.

/// Square root of a number that is not negative, correctly rounded.
///
/// `core` has no square root, and libm's is software on Arm (52 instructions). The C symbol becomes one VSQRT
/// where the argument is a sum of squares; without an FPU, Rust's own `compiler_builtins` provides it.
#[allow(unsafe_code)]
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    unsafe extern "C" {
        fn sqrtf(x: f32) -> f32;
    }
    // SAFETY: `sqrtf` takes and returns a number, touches no memory but `errno` of a hosted C library, and is
    // provided on every target, by `compiler_builtins` or by the C library.
    unsafe { sqrtf(x) }
}

/// `base` >= 0 to the power `exponent`; only for set-up, never in a step (110 instructions). Relative error below
/// 1e-6 while the result is within 1e-3 to 1e3. libm's `powf` is exact but drags in its software square root.
pub(crate) fn pow(base: f32, exponent: f32) -> f32 {
    libm::expf(exponent * libm::logf(base))
}
