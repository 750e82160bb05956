//! Bodies and runs that several cases share: blocks of elements, a half-space's sphere, a dome, the fingertips.

pub mod blocks;
pub mod dome;
pub mod fingers;
pub mod sphere;
