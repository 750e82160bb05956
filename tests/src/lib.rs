//! Problems that tests, verification and benchmarks share.

#[cfg(unix)]
pub mod peer_cases;
