//! Tests of the code against analysis, another code and hidden truths.
//!
//! * [`cases`]: verification, one list. A [`Case`] returns [`Check`]s, numbers beside their reference and bound. The tests run
//!   the cases with [`Effort::Quick`], the binary `verify` with [`Effort::Full`].
//!   References are closed forms or quadratures of them ([`mod@reference`], [`half_space`]), never an earlier output of
//!   this code.
//! * [`calculix`]: the same problems in CalculiX (binary `calculix`).
//! * [`margin`]: the observer of the margin to slip on surfaces whose friction it does not know.
//! * [`problems`]: the bodies and runs that cases share.
//! * [`synthetic_truth`]: measured sets with a hidden effect, from a simulator of its own, and their score.
//! * Benches: the binaries `bench_*` and `benches/core.rs`; they time the very problems that the cases check.
//!
//! May use every crate of the repository; nothing uses this one.

#[cfg(unix)]
pub mod calculix;
pub mod cases;
pub mod check;
pub mod differences;
pub mod equilibrium;
pub mod fast_against_finite_elements;
pub mod half_space;
pub mod margin;
pub mod memory;
pub mod pads;
pub mod problems;
pub mod random;
pub mod reference;
pub mod synthetic_truth;

pub use cases::{CASES, Case, Effort, Failure};
pub use check::{Check, table};

/// Prints and records a measured number beside its bound.
///
/// # Panics
/// If the number is above the bound or NaN.
pub fn verify(case: &str, quantity: &str, value: f64, bound: f64) {
    println!("verify: {case} {quantity} = {value:.3e} (pass <= {bound:.1e})");
    check::RECORDED.with_borrow_mut(|list| list.push(Check::at_most(format!("{case}: {quantity}"), value, bound)));
    assert!(value <= bound, "{case}: {quantity} is {value:e}, above {bound:e}");
}
