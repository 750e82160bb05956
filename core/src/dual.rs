//! Exact derivatives: numbers that carry their derivatives over `D` variables through a step.
//!
//! Main type: [`Dual`]. Uses math.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::math::{Arithmetic, Scalar, of_one_number, sealed::Sealed};

/// A number and its derivatives over `D` variables (forward differentiation).
///
/// A model of it ([`crate::DataOf::cast`]) takes the same step as in `f64` and returns derivatives of forces and new
/// state over every quantity that was made a [`Dual::variable`]: motion, state ([`crate::StateOf::as_variables`]), strength factor. At a kink
/// (a spring on its limit, a node of the tables) the derivative is that of the side on which the step ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const D: usize> {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub rate: [f64; D],
}

impl<const D: usize> Dual<D> {
    /// A number that depends on none of the variables.
    pub fn constant(value: f64) -> Self {
        Self { value, rate: [0.0; D] }
    }

    /// The `index`-th variable at a value; one beyond `D` is a constant.
    pub fn variable(value: f64, index: usize) -> Self {
        Self { value, rate: core::array::from_fn(|k| if k == index { 1.0 } else { 0.0 }) }
    }

    /// A function's value here, with its slope.
    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, rate: self.rate.map(|r| slope * r) }
    }

    fn together(self, other: Self, value: f64, [a, b]: [f64; 2]) -> Self {
        Self { value, rate: core::array::from_fn(|k| a * self.rate[k] + b * other.rate[k]) }
    }
}

impl<const D: usize> Default for Dual<D> {
    fn default() -> Self {
        Self::constant(0.0)
    }
}

impl<const D: usize> PartialOrd for Dual<D> {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const D: usize> Add for Dual<D> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.together(other, self.value + other.value, [1.0, 1.0])
    }
}
impl<const D: usize> Sub for Dual<D> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.together(other, self.value - other.value, [1.0, -1.0])
    }
}
impl<const D: usize> Mul for Dual<D> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.together(other, self.value * other.value, [other.value, self.value])
    }
}
impl<const D: usize> Div for Dual<D> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.together(other, quotient, [1.0 / other.value, -quotient / other.value])
    }
}
impl<const D: usize> Neg for Dual<D> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}
impl<const D: usize> AddAssign for Dual<D> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<const D: usize> SubAssign for Dual<D> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl<const D: usize> MulAssign for Dual<D> {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const D: usize> Sealed for Dual<D> {}

impl<const D: usize> Arithmetic for Dual<D> {
    of_one_number!();
    fn of(constant: f32) -> Self {
        Self::constant(constant.into())
    }
    fn sqrt(self) -> Self {
        let root = libm::sqrt(self.value);
        // Where the root vanishes its slope has no bound; what depends on it there is a kink.
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    fn magnitude(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
    fn not_negative(self) -> Self {
        if self.value < 0.0 { Self::of(0.0) } else { self }
    }
}

impl<const D: usize> Scalar for Dual<D> {
    fn to_f32(self) -> f32 {
        self.value as f32
    }
    fn is_between(self, low: f32, high: f32) -> bool {
        self.value.is_between(low, high)
    }
    fn needs_rebase(self, other: Self) -> bool {
        self.value.needs_rebase(other.value)
    }
    fn index(self) -> usize {
        self.value.index()
    }
    fn power(self, exponent: Self) -> Self {
        let power = libm::pow(self.value, exponent.value);
        let by_exponent = if self.value > 0.0 { power * libm::log(self.value) } else { 0.0 };
        self.together(exponent, power, [exponent.value * libm::pow(self.value, exponent.value - 1.0), by_exponent])
    }
    fn select(condition: bool, yes: Self, no: Self) -> Self {
        if condition { yes } else { no }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::{Motion, Params, Response, StateOf, step};

    /// Along a path through stick, partial slip, full slip, turns and changes of depth, the derivatives of all forces over
    /// motion and state agree with central differences of the 64-bit twin, but for steps across a kink.
    #[test]
    fn derivatives_are_those_of_differences() {
        const D: usize = 30;
        let data = Params::example().try_build().unwrap();
        let (plain, dual) = (data.cast::<f64>(), data.cast::<Dual<D>>());
        let (plain, dual) = (plain.model().unwrap(), dual.model().unwrap());
        let numbers = |r: &Response<f64>| -> Vec<f64> {
            let [x, y] = r.friction_n;
            std::vec![r.normal_force_n, x, y, r.spin_moment_n_mm, r.stick_ratio, r.slip_margin, r.friction_limit_n]
        };
        let mut state = StateOf::<4, 2, f64>::default();
        let (mut compared, mut kinks) = (0, 0);
        for i in 0..600 {
            let way = 0.01 * f64::from(i);
            let motion = [
                0.9 + 0.5 * (0.7 * way).sin(),
                0.03 * (3.0 * way).cos(),
                0.02 * (1.7 * way).sin(),
                0.004 * (2.3 * way).cos(),
            ];
            let go = |state: &mut StateOf<4, 2, f64>, m: [f64; 4]| {
                let motion =
                    Motion { depth_mm: m[0], slide_increment_mm: [m[1], m[2]], spin_increment_rad: m[3], dt_s: 1e-3 };
                step(&plain, state, motion)
            };
            let mut carried = state.cast::<D>();
            let first = carried.as_variables(4);
            assert!(first <= D, "{first}");
            let variable = |k: usize| Dual::<D>::variable(motion[k], k);
            let moved = Motion {
                depth_mm: variable(0),
                slide_increment_mm: [variable(1), variable(2)],
                spin_increment_rad: variable(3),
                dt_s: Dual::constant(1e-3),
            };
            let r = step(&dual, &mut carried, moved);
            let exact: [Dual<D>; 7] = [
                r.normal_force_n,
                r.friction_n[0],
                r.friction_n[1],
                r.spin_moment_n_mm,
                r.stick_ratio,
                r.slip_margin,
                r.friction_limit_n,
            ];
            for k in 0..first {
                let h = 1e-6;
                let differ = |sign: f64| {
                    let (mut from, mut to) = (state, motion);
                    if k < 4 {
                        to[k] += sign * h
                    } else {
                        from.nudge(k - 4, sign * h)
                    }
                    numbers(&go(&mut from, to))
                };
                let (ahead, behind, here) = (differ(1.0), differ(-1.0), differ(0.0));
                for (n, value) in exact.iter().enumerate() {
                    let (up, down) = ((ahead[n] - here[n]) / h, (here[n] - behind[n]) / h);
                    // One-sided slopes that differ show a kink within the difference.
                    if (up - down).abs() > 1e-4 * (1.0 + up.abs()) {
                        kinks += 1;
                        continue;
                    }
                    let slope = 0.5 * (up + down);
                    assert!(
                        (value.rate[k] - slope).abs()
                            <= 1e-6 * (1.0 + slope.abs()) + 2e-5 * slope.abs().max(1e-1) * f64::from(u8::from(n >= 4)),
                        "step {i} number {n} over {k}: {} {slope}",
                        value.rate[k]
                    );
                    compared += 1;
                }
            }
            go(&mut state, motion);
        }
        assert!(compared > 60_000 && kinks < compared / 20, "{compared} compared, {kinks} kinks");
    }
}
