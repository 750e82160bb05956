//! Problems that tests, verification and benchmarks share.
