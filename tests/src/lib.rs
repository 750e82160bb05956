//! Problems that tests, verification and benchmarks share, and the cases that hold the code against analysis.
//!
//! A [`Case`] is a function of [`Effort`] that returns [`Check`]s: numbers beside their reference and bound. The
//! tests run the cases with [`Effort::Quick`], the binary `verify` with [`Effort::Full`]. References are closed
//! forms or quadratures of them, never an earlier output of this code.

pub mod cases;
pub mod check;
pub mod dome;
pub mod fingers;
pub mod half_space;
pub mod sphere;

pub use cases::{CASES, Case, Effort, Failure};
pub use check::{Check, table};
