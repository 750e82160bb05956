//! The one file that names a mathematics library.
//!
//! Every function of `f32` gives the same bits on host and target.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

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

/// A real number in one of two precisions, so that the formula of an effect is written once.
///
/// A trait and not a macro: formulas are checked where they stand, a file of an effect can lie in any crate, and a
/// program for a microcontroller holds the copies for `f32` alone. `f32` has the functions of libm, the same bits on host
/// and target; `f64` those of the standard library with feature `std`, else those of libm, which differ in the last bit.
pub trait Real:
    Copy
    + core::fmt::Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + MulAssign
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// A constant of a formula, rounded to the precision.
    fn of(constant: f64) -> Self;
    /// e to the power of it.
    fn exp(self) -> Self;
    /// e to the power of it, less 1; accurate near 0.
    fn exp_m1(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Natural logarithm of 1 and it; accurate near 0.
    fn ln_1p(self) -> Self;
    /// To the power of `exponent`, of a base that is not negative. For `f32` within 2e-6 while the result is within 1e-3 to
    /// 1e3.
    fn powf(self, exponent: Self) -> Self;

    /// It, or `least` if it is less or not a number.
    #[inline(always)]
    fn at_least(self, least: Self) -> Self {
        if self > least { self } else { least }
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline(always)]
    fn of(constant: f64) -> Self {
        constant as Self
    }
    fn exp(self) -> Self {
        libm::expf(self)
    }
    fn exp_m1(self) -> Self {
        libm::expm1f(self)
    }
    fn ln(self) -> Self {
        libm::logf(self)
    }
    fn ln_1p(self) -> Self {
        libm::log1pf(self)
    }
    fn powf(self, exponent: Self) -> Self {
        pow(self, exponent)
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn of(constant: f64) -> Self {
        constant
    }
    fn exp(self) -> Self {
        double::exp(self)
    }
    fn exp_m1(self) -> Self {
        double::expm1(self)
    }
    fn ln(self) -> Self {
        double::log(self)
    }
    fn ln_1p(self) -> Self {
        double::log1p(self)
    }
    fn powf(self, exponent: Self) -> Self {
        double::pow(self, exponent)
    }
}

#[cfg(not(feature = "std"))]
pub(crate) use libm as double;

/// Functions of the standard library under libm's names.
#[cfg(feature = "std")]
pub(crate) mod double {
    pub fn exp(x: f64) -> f64 {
        x.exp()
    }
    pub fn expm1(x: f64) -> f64 {
        x.exp_m1()
    }
    pub fn log(x: f64) -> f64 {
        x.ln()
    }
    pub fn log1p(x: f64) -> f64 {
        x.ln_1p()
    }
    pub fn pow(base: f64, exponent: f64) -> f64 {
        base.powf(exponent)
    }
    pub fn atan2(y: f64, x: f64) -> f64 {
        y.atan2(x)
    }
    pub fn hypot(x: f64, y: f64) -> f64 {
        x.hypot(y)
    }
    pub fn sincos(x: f64) -> (f64, f64) {
        x.sin_cos()
    }
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
