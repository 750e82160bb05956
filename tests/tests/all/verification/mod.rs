//! The finite-element code against analysis: each case prints its number and the bound that it must keep.
//!
//! `cargo test --release -p fingerpad-tests --test all verification:: -- --nocapture` prints them all.

mod balance;
mod bodies;
mod branches;
mod compliance;
mod cook;
mod energy;
mod fingertip_meshes;
mod hanging_nodes;
mod hyperelastic;
mod long_runs;
mod patch;
mod poses;
mod readings;
mod rotation;
mod soft_regions;
mod stick;
mod stress;
mod symmetry;
mod tangents;
mod tie;
