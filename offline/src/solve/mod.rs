//! Equilibrium: Newton with a frozen bulk factor, contact solved on its dense compliance, load steps.
pub mod linear;
