//! The one file that names a mathematics library.
//!
//! Every function gives the same bits on host and target.

/// Square root of a number that is not negative, correctly rounded.
///
/// `core` has no square root, and libm's is software on Arm (52 instructions). The C symbol becomes one VSQRT
/// where the argument is a sum of squares or an absolute value; without an FPU, Rust's own `compiler_builtins` provides it.
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

/// `x`, or 0 if it is negative.
#[inline(always)]
pub(crate) fn not_negative(x: f32) -> f32 {
    f32::from_bits((x.to_bits() as i32).max(0) as u32)
}

/// `base` >= 0 to the power `exponent`; only for set-up, never in a step (110 instructions). Relative error below
/// 2e-6 while the result is within 1e-3 to 1e3 (`tests::accuracy`). libm's `powf` is exact but drags in its software square root.
pub(crate) fn pow(base: f32, exponent: f32) -> f32 {
    libm::expf(exponent * libm::logf(base))
}

/// e to the power `x`; only where an effect is on.
pub(crate) fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// Natural logarithm; only where an effect is on.
pub(crate) fn ln(x: f32) -> f32 {
    libm::logf(x)
}

#[cfg(test)]
mod tests {
    #[test]
    fn accuracy() {
        for i in 1..400 {
            for j in -20..=20 {
                let (base, exponent) = (0.025 * i as f32, 0.1 * j as f32);
                let exact = f64::from(base).powf(f64::from(exponent));
                if (1e-3..=1e3).contains(&exact) {
                    let error = (f64::from(super::pow(base, exponent)) / exact - 1.0).abs();
                    assert!(error < 2e-6, "{base}^{exponent}: {error}");
                }
            }
        }
        assert_eq!(super::pow(0.0, 1.5), 0.0);
    }
}
