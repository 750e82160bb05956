//! Mathematical functions; the only file that uses a mathematics library.
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

/// The same in double precision. On x86-64 libm's is inline assembly of SSE, which delays the AVX instructions around it: a step
/// of ten springs took about 17 times as long.
#[allow(unsafe_code)]
#[inline(always)]
fn sqrt_of_double(x: f64) -> f64 {
    unsafe extern "C" {
        fn sqrt(x: f64) -> f64;
    }
    // SAFETY: as in `sqrt`.
    unsafe { sqrt(x) }
}

/// Adds an increment to a number in two parts; exact to the last bit of the second (Knuth's sum of two).
#[inline(always)]
pub(crate) fn add<T: Scalar>(sum: T, low: T, increment: T) -> (T, T) {
    let increment = increment + low;
    let to = sum + increment;
    let part = to - sum;
    (to, (sum - (to - part)) + (increment - part))
}

pub(crate) mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Scalar type of a step: `f32` on the target, `f64` as its twin. Sealed.
///
/// Both have the same source, so that the twin always computes the same as the target.
pub trait Scalar:
    sealed::Sealed + Copy + core::fmt::Debug + Default + PartialOrd + nalgebra::Scalar + nalgebra::Field
{
    /// A constant; exact.
    fn of(constant: f32) -> Self;
    /// Square root of a number that is not negative, correctly rounded.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn magnitude(self) -> Self;
    /// The number, or 0 if it is negative.
    fn not_negative(self) -> Self;
    /// The nearest number of single precision.
    fn to_f32(self) -> f32;
    /// The same in double precision; exact.
    fn to_f64(self) -> f64;
    /// The nearest number to one of another precision. Between numbers of single precision nothing is converted.
    fn near<R: Scalar>(x: R) -> Self;
    /// Whether it lies between two positive numbers, both included. In `f32` one comparison; NaN does not.
    fn is_between(self, low: f32, high: f32) -> bool;
    /// Whether one of two numbers has a magnitude of 2 or more or is not finite. In `f32` this tests one bit.
    fn needs_rebase(self, other: Self) -> bool;
    /// Its whole part as an index; 0 below 0, the largest index far above.
    fn index(self) -> usize;
    /// A number that is not negative to a power; for set-up.
    fn power(self, exponent: Self) -> Self;
    /// `yes` or `no`, without a branch where the machine can.
    fn choose(condition: bool, yes: Self, no: Self) -> Self;

    /// The smaller of two numbers.
    #[inline(always)]
    fn at_most(self, most: Self) -> Self {
        if self > most { most } else { self }
    }

    /// Whether it is a number.
    #[inline(always)]
    fn is_number(self) -> bool {
        self.magnitude().to_f32() <= f32::MAX
    }
}

/// Elementary functions of one number for the step of a pad. Sealed.
pub trait Elementary: Scalar {
    /// Natural logarithm of a positive number.
    fn ln(self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Sine and cosine of an angle within ±4 rad. In `f32` within 1e-7.
    fn sin_cos(self) -> (Self, Self);
    /// Angle of the point (x, self) from the x axis, within ±pi; 0 for the origin. In `f32` within 3e-7.
    fn atan2(self, x: Self) -> Self;
    /// Pi, rounded to the precision of the type.
    fn half_turn() -> Self;
}

impl Elementary for f32 {
    /// Error below 1.2e-7, absolute up to a result of 1 and relative beyond. Polynomial of Cephes, without the division of libm's.
    #[inline(always)]
    fn ln(self) -> Self {
        if !(f32::MIN_POSITIVE..=f32::MAX).contains(&self) {
            return if self > 0.0 { self } else { f32::NAN };
        }
        // m 2^e with m from the root of 1/2 to that of 2.
        let bits = self.to_bits();
        let e = bits.wrapping_sub(0x3f35_04f3) as i32 >> 23;
        let f = f32::from_bits(bits.wrapping_sub((e << 23) as u32)) - 1.0;
        let e = e as f32;
        let mut p = 7.037_683_6e-2;
        for c in [
            -1.151_461e-1,
            1.167_699_9e-1,
            -1.242_014_1e-1,
            1.424_932_3e-1,
            -1.666_805_8e-1,
            2.000_071_5e-1,
            -2.499_999_4e-1,
            0.333_333_3,
        ] {
            p = p * f + c;
        }
        let z = f * f;
        f + (p * f * z - 2.121_944_4e-4 * e - 0.5 * z) + 0.693_359_4 * e
    }
    /// Relative error below 3e-7. Polynomial of Cephes; arguments are limited to -87 and 88.
    #[inline(always)]
    fn exp(self) -> Self {
        let x = if self < -87.0 { -87.0 } else { self.at_most(88.0) };
        let scaled = x * core::f32::consts::LOG2_E;
        let n = if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 } as i32;
        let whole = n as f32;
        let r = (x - 0.693_359_4 * whole) + 2.121_944_4e-4 * whole;
        let mut p = 1.987_569_1e-4;
        for c in [1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5] {
            p = p * r + c;
        }
        (p * r * r + r + 1.0) * f32::from_bits(((n + 127) as u32) << 23)
    }
    fn half_turn() -> Self {
        core::f32::consts::PI
    }
    /// libm's are in double precision, which is software on most microcontrollers.
    fn sin_cos(self) -> (Self, Self) {
        // By quarters of a turn, pi/2 in two parts; polynomials of Cephes on ±pi/4.
        let quarters = self * core::f32::consts::FRAC_2_PI;
        let quarter = if quarters < 0.0 { quarters - 0.5 } else { quarters + 0.5 } as i32;
        let turns = quarter as f32;
        let x = (self - turns * 1.570_312_5) - turns * 4.838_268e-4;
        let z = x * x;
        let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * (z * x) + x;
        let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * (z * z) - 0.5 * z + 1.0;
        let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, -sin) };
        if quarter & 2 == 0 { (sin, cos) } else { (-sin, -cos) }
    }
    /// Polynomial of Cephes on the tangent of up to 22.5 degrees.
    fn atan2(self, x: Self) -> Self {
        use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
        let (up, along) = (self.magnitude(), x.magnitude());
        let (less, more) = if up > along { (along, up) } else { (up, along) };
        let (tangent, start) = if less > 0.414_213_57 * more {
            ((less - more) / (less + more), FRAC_PI_4)
        } else {
            (less / (more + Self::MIN_POSITIVE), 0.0)
        };
        let z = tangent * tangent;
        let p = ((8.053_744_5e-2 * z - 1.387_768_6e-1) * z + 1.997_771e-1) * z - 3.333_295e-1;
        let angle = start + (p * z * tangent + tangent);
        let angle = if up > along { FRAC_PI_2 - angle } else { angle };
        let angle = if x < 0.0 { PI - angle } else { angle };
        if self < 0.0 { -angle } else { angle }
    }
}

impl Elementary for f64 {
    fn ln(self) -> Self {
        double::log(self)
    }
    fn exp(self) -> Self {
        double::exp(self)
    }
    fn sin_cos(self) -> (Self, Self) {
        double::sincos(self)
    }
    fn atan2(self, x: Self) -> Self {
        double::atan2(self, x)
    }
    fn half_turn() -> Self {
        core::f64::consts::PI
    }
}

impl Scalar for f32 {
    #[inline(always)]
    fn of(constant: f32) -> Self {
        constant
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        sqrt(self)
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn not_negative(self) -> Self {
        f32::from_bits((self.to_bits() as i32).max(0) as u32)
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn near<R: Scalar>(x: R) -> Self {
        x.to_f32()
    }
    #[inline(always)]
    fn is_between(self, low: f32, high: f32) -> bool {
        self.to_bits().wrapping_sub(low.to_bits()) <= high.to_bits() - low.to_bits()
    }
    #[inline(always)]
    fn needs_rebase(self, other: Self) -> bool {
        (self.to_bits() | other.to_bits()) & 0x4000_0000 != 0
    }
    #[inline(always)]
    fn index(self) -> usize {
        self as u32 as usize
    }
    fn power(self, exponent: Self) -> Self {
        pow(self, exponent)
    }
    #[inline(always)]
    fn choose(condition: bool, yes: Self, no: Self) -> Self {
        core::hint::select_unpredictable(condition, yes, no)
    }
}

impl Scalar for f64 {
    fn of(constant: f32) -> Self {
        constant.into()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        sqrt_of_double(self)
    }
    fn magnitude(self) -> Self {
        if self < 0.0 { -self } else { self }
    }
    fn not_negative(self) -> Self {
        if self < 0.0 { 0.0 } else { self }
    }
    fn to_f32(self) -> f32 {
        self as f32
    }
    fn to_f64(self) -> f64 {
        self
    }
    fn near<R: Scalar>(x: R) -> Self {
        x.to_f64()
    }
    fn is_between(self, low: f32, high: f32) -> bool {
        self >= low.into() && self <= high.into()
    }
    fn needs_rebase(self, other: Self) -> bool {
        !(self.abs() < 2.0 && other.abs() < 2.0)
    }
    fn index(self) -> usize {
        self as u32 as usize
    }
    fn power(self, exponent: Self) -> Self {
        libm::pow(self, exponent)
    }
    fn choose(condition: bool, yes: Self, no: Self) -> Self {
        if condition { yes } else { no }
    }
}

/// `base` >= 0 to the power `exponent`; only for set-up, never in a step (110 instructions). Relative error below
/// 2e-6 while the result is within 1e-3 to 1e3 (`tests::accuracy`). libm's `powf` is exact but drags in its software square root.
pub(crate) fn pow(base: f32, exponent: f32) -> f32 {
    libm::expf(exponent * libm::logf(base))
}

/// A real number in one of two precisions, so that the formula of an effect is written once.
///
/// This is a trait and not a macro, so that formulas are type-checked in place, the file of an effect can be in any crate, and a program
/// for a microcontroller contains only the copies for `f32`. `f32` has the functions of libm, the same bits on host
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

    /// The number, or `least` if it is less or NaN.
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

    #[test]
    fn logarithm_and_exponential() {
        use super::Elementary;
        for k in 0..40_000 {
            let x = f32::from_bits(0x0080_0000 + 53_000 * k);
            let exact = f64::from(x).ln();
            let error = (f64::from(Elementary::ln(x)) - exact).abs() / exact.abs().max(1.0);
            assert!(error < 1.2e-7, "ln {x}: {error}");
        }
        for k in -8700..=8800 {
            let x = 0.01 * k as f32 + 1e-4;
            let error = (f64::from(Elementary::exp(x)) / f64::from(x.min(88.0)).exp() - 1.0).abs();
            assert!(error < 3e-7, "exp {x}: {error}");
        }
        assert_eq!(Elementary::exp(f32::NEG_INFINITY), Elementary::exp(-87.0f32));
        assert!(
            Elementary::exp(f32::NAN).is_nan() && Elementary::ln(f32::NAN).is_nan() && Elementary::ln(-1.0f32).is_nan()
        );
        assert_eq!(Elementary::ln(f32::INFINITY), f32::INFINITY);
    }

    #[test]
    fn sine_and_cosine() {
        for k in -4000..=4000 {
            let x = 1e-3 * k as f32;
            let (sin, cos) = super::Elementary::sin_cos(x);
            let (s, c) = f64::from(x).sin_cos();
            let error = (f64::from(sin) - s).abs().max((f64::from(cos) - c).abs());
            assert!(error < 1.2e-7, "{x}: {error}");
        }
    }

    #[test]
    fn angle_of_a_point() {
        use super::Elementary;
        for k in -3141..=3141 {
            for size in [1e-20, 1e-3, 1.0, 1e15] {
                let (sin, cos) = (1e-3 * f64::from(k)).sin_cos();
                let (y, x) = ((size * sin) as f32, (size * cos) as f32);
                let error = (f64::from(Elementary::atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs();
                assert!(error < 3e-7, "{y} {x}: {error}");
            }
        }
        assert_eq!(Elementary::atan2(0.0f32, 0.0), 0.0);
        assert!(Elementary::atan2(f32::NAN, 1.0).is_nan());
    }
}
