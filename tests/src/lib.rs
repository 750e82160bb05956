//! Problems that tests, verification and benchmarks share, and the cases that hold the code against analysis.
//!
//! A [`Case`] is a function of [`Effort`] that returns [`Check`]s: numbers beside their reference and bound. The
//! tests run the cases with [`Effort::Quick`], the binary `verify` with [`Effort::Full`]. References are closed
//! forms or quadratures of them, never an earlier output of this code.

pub mod blocks;
pub mod cases;
pub mod check;
pub mod differences;
pub mod dome;
pub mod equilibrium;
pub mod fingers;
pub mod half_space;
pub mod hidden;
pub mod memory;
#[cfg(unix)]
pub mod peer_cases;
pub mod random;
pub mod reference;
pub mod sphere;

pub use cases::{CASES, Case, Effort, Failure};
pub use check::{Check, table};

/// Prints a measured number beside its bound and panics if the number is above it or NaN.
pub fn verify(case: &str, quantity: &str, value: f64, bound: f64) {
    println!("verify: {case} {quantity} = {value:.3e} (pass <= {bound:.1e})");
    assert!(value <= bound, "{case}: {quantity} is {value:e}, above {bound:e}");
}
