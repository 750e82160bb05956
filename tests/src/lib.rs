//! Problems that tests, verification and benchmarks share.

pub mod blocks;
pub mod differences;
pub mod equilibrium;
pub mod random;
pub mod reference;

/// Prints a measured number beside its bound and panics if the number is above it or NaN.
pub fn verify(case: &str, quantity: &str, value: f64, bound: f64) {
    println!("verify: {case} {quantity} = {value:.3e} (pass <= {bound:.1e})");
    assert!(value <= bound, "{case}: {quantity} is {value:e}, above {bound:e}");
}
